"""The way of a roller on a cam as numbers that a solver chooses."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.interpolate import PPoly

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ..curves.target import Target
from ..statics.contour import Contour
from ..statics.roller_contour import RollerContour, roller_contour
from .design_point import DesignPoint
from .edges import RollerEdge
from .limits import Bound
from .program import DesignVariable, Rows
from .shape import INTERVALS, FreeContour, Shape, Start, StartSizes, held

_STEEPEST = 200.0
"""Largest slope of the lever arm, relative to the size of the lever arm."""
_REFINE = 8
"""Points of the contour in each interval."""


@dataclass(frozen=True, eq=False)
class RollerVariables(FreeContour):
    """The slope of the lever arm at each node, straight between them, in units of a typical lever arm."""

    slopes: tuple[DesignVariable, ...]
    profile: Array  # slope of the wanted torque over the angle there, relative to its largest
    radius: float  # of the roller in m

    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""
        return list(self.slopes)

    def at(self, start: Start, sizes: StartSizes) -> dict[str, float]:
        """Return a lever arm that rises and falls as the torque does."""
        size = start.contour_size * 2.0 * start.slope_share
        return {v.name: size * each for v, each in zip(self.slopes, self.profile.tolist(), strict=True)}

    def held(self, design: DesignPoint, arm: float, *, curved: bool) -> list[Bound]:
        """Return that the element presses the roller on the cam."""
        return [held("PressedRoller", "extension of the element", design.extensions, arm)]

    def made(self, design: DesignPoint, value: Callable[[Expression], Array]) -> Contour:
        """Return the contour at a solution: a slope that is straight between nodes, integrated exactly."""
        nodes, slopes = value(design.angles), value(design.lever_arm_slopes)
        share = np.arange(_REFINE) / _REFINE
        bearings = np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * share).ravel(), nodes[-1])
        law = PPoly(np.array([np.diff(slopes) / np.diff(nodes), slopes[:-1]]), nodes)
        arms, way = law.antiderivative(), law.antiderivative(2)
        rho = design.parameters[design.cam.roller.base_radius]  # type: ignore[union-attr]
        return roller_contour(
            bearings,
            (way(bearings), arms(bearings), law(bearings)),
            base_radius=float(value(rho)[0]),
            roller_radius=self.radius,
        )


def rolled(
    target: Target, end: Expression, *, arm: float, base: Expression, radius: float
) -> tuple[RollerVariables, Shape]:
    """Return the way of a roller whose lever arm is zero at angle zero.

    ``base``, ``radius``: base radius, and radius of the roller in m; ``arm``: a typical lever arm.
    """
    names = [f"lever_arm_slope[{i}]" for i in range(INTERVALS + 1)]
    symbols = [ca.SX.sym(name) for name in names]
    variables = tuple(
        DesignVariable(name, symbol, arm * symbol, -_STEEPEST, _STEEPEST, 0.0)
        for name, symbol in zip(names, symbols, strict=True)
    )
    slopes = [v.value for v in variables]
    step, ways = end / INTERVALS, ca.SX.sym("way", 2, INTERVALS)
    begin = (ca.SX(0), ca.SX(0))
    states = [begin, *[(arm * ways[0, i], arm * ways[1, i]) for i in range(INTERVALS)]]
    explicit, rows = [begin], []
    for i, (left, right) in enumerate(itertools.pairwise(slopes)):
        explicit.append(_next(explicit[-1], left, right, step))
        there = _next(states[i], left, right, step)
        rows += [(a - b) / arm for a, b in zip(there, states[i + 1], strict=True)]
    arms, taken = (ca.vertcat(*column) for column in zip(*states, strict=True))
    lifted = tuple(
        DesignVariable(f"{name}[{i + 1}]", ways[k, i], arm * ways[k, i], -np.inf, np.inf, 0.0)
        for i in range(INTERVALS)
        for k, name in enumerate(("lever_arm", "way"))
    )
    values = ca.vertcat(*[each for state in explicit[1:] for each in state]) / arm
    angles = step * ca.SX(np.arange(INTERVALS + 1))
    edge = RollerEdge(angles, base + taken, arms, ca.vertcat(*slopes), radius)
    at = np.linspace(0.0, target.last_angle, INTERVALS + 1)
    profile = np.gradient(target.torque(at), at) / target.largest
    clear = Rows((edge.centre_radii - 1.01 * radius) / arm, 0.0, ca.inf)
    shape = _shape(edge, taken, (Rows(ca.vertcat(*rows), 0.0, 0.0), clear), (lifted, values))
    return RollerVariables((), variables, profile, radius), shape


def given_roller(contour: RollerContour) -> Shape:
    """Return the shape of a declared cam with a roller that stays as it is."""
    arms, slopes = ca.SX(contour.lever_arms), ca.SX(contour.slopes)
    centre = ca.SX(contour.centre_radii)
    edge = RollerEdge(ca.SX(contour.bearings), centre, arms, slopes, contour.roller_radius)
    return _shape(edge, ca.SX(contour.taken_lengths), (), ((), ca.SX(0, 1)))


def _shape(
    edge: RollerEdge,
    taken: Expression,
    rows: tuple[Rows, ...],
    states: tuple[tuple[DesignVariable, ...], Expression],
) -> Shape:
    return Shape(
        edge.bearings, edge.bearings, edge.lever_arms, edge.radii, edge.radii_of_curvature, taken,
        edge.lever_arm_slopes, rows, True, *states, edge,
    )  # fmt: skip


def _next(
    state: tuple[Expression, Expression], left: Expression, right: Expression, step: Expression
) -> tuple[Expression, Expression]:
    """Return h and x one interval further."""
    arm, taken = state
    return arm + step * (left + right) / 2, taken + step * arm + step**2 * (2 * left + right) / 6
