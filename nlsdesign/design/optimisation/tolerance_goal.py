"""A goal over the spreads: the quantile of the torque error of made springs, trimmed or not, in symbols.

To first order the error of a made spring over the angle is e + Σ sⱼ·xⱼ with independent xⱼ of variance 1, the
error e of the design and the sensitivities sⱼ of :mod:`..tolerance.made_cam`. A trim takes the part along its
tangent t off all sⱼ, but not off e: a design must not lean on it. The mean square of what is left is

    Q = e·e + 2 bᵀx + xᵀGx,    bⱼ = e·sⱼ,    Gⱼₖ = sⱼ·sₖ,

with the mean over the angle as product, so mean and variance of Q follow from b and G; the distribution in
between is taken as that of a multiple of χ² with the same two, whose quantile has a closed form. All
derivatives are exact. What time takes (:mod:`..tolerance.lasting`) is a share between nothing and the whole:
half of it is added to e, also without its part along the trims.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
import scipy

from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.spread import Spread
from ...foundation.symbolic import Expression
from ..curves.numbers import in_si, plain
from ..tolerance.causes import (
    AnchorCause,
    Cause,
    NumberCause,
    ProfileCause,
    SinceMade,
    SpreadRules,
    WaveCause,
    spring_causes,
)
from ..tolerance.lasting import SMALLEST, relaxed_until_measured
from .design_point import DesignPoint
from .goals import Goal
from .limits import Bound, Limit

_LEAST = 1e-12
"""Addend of sizes that may vanish, relative to the square of the largest torque."""


@dataclass(frozen=True)
class ToleranceQuantile(Goal):
    """Mean square torque error that a share of the made springs stays below, over the spreads of the numbers.

    It holds the error of the design itself, so it stands in the place of :class:`TorqueError`. The friction
    of guides is left out, and a trim counts as one of unlimited range; the design that comes out should be
    looked at with :func:`~nlsdesign.design.tolerance_analysis`, which knows neither simplification.
    Source: Satterthwaite 1946 (multiple of χ² with the same mean and variance); Wilson and Hilferty 1931
    (its quantile).

    Parameters
    ----------
    share
        Share of the made springs that stay below, between 0 and 1.
    trims
        Full names of what is set after assembly, together; ``None`` for the pretension, empty for nothing.
    rules
        How declared spreads become deviations.

    Raises
    ------
    ValueRangeError
        If the share is not between 0.5 and 1.
    """

    share: float = 0.95
    trims: tuple[str, ...] | None = None
    rules: SpreadRules = field(default_factory=SpreadRules)

    def __post_init__(self) -> None:
        if not 0.5 <= self.share < 1.0:
            raise ValueRangeError(
                f"share = {self.share:g}", "must be at least 0.5 and below 1",
                next_step="take 0.95, the error that 95 % of the springs stay below",
            )  # fmt: skip

    def cost(self, design: DesignPoint) -> Expression:
        """Return (quantile of the rms error / 0.1 % of the largest torque)²."""
        scale = 1e-3 * design.target.largest
        return self.mean_square(design) / scale**2

    def mean_square(self, design: DesignPoint) -> Expression:
        """Return the quantile of the mean square error in (N·m)².

        Parameters
        ----------
        design
            The design in symbols.

        Raises
        ------
        ArrangementError
            If a trim does not exist.
        UnknownNameError
            If a spread is given for a name that does not exist.
        """
        sensitivities = _Sensitivities(design)
        rows = _rows(design, sensitivities, self.rules)
        trims = (design.cam.pretension,) if self.trims is None else self.trims
        tangents = [sensitivities.tangent(name) for name in trims]
        least = _LEAST * design.target.largest**2
        weights, errors = _weights(design), design.torque_errors
        if not rows:
            return ca.dot(weights, errors**2)
        # The last column is the mean of what time takes.
        half = [0.5 * row / _SINCE.slope(0.0) for spread, row in rows if spread is _SINCE]
        left = ca.horzcat(*[row for _, row in rows], sum(half, start=ca.SX.zeros(errors.shape)))
        result: list[Expression] = []
        for column in tangents:
            for other in result:
                column = column - other * ca.dot(weights, other * column) / ca.dot(weights, other**2)
            result.append(column)
        for tangent in result:
            along = (weights * tangent).T @ left / (ca.dot(weights, tangent**2) + least)
            left = left - tangent @ along
        left, errors = left[:, :-1], errors + left[:, -1]
        weighed = ca.diag(weights) @ left
        cross, gram = errors.T @ weighed, left.T @ weighed
        mean = ca.dot(weights, errors**2) + ca.trace(gram)
        peaked = ca.DM([spread.fourth_moment - 3.0 for spread, _ in rows])
        variance = 4.0 * ca.sumsqr(cross) + 2.0 * ca.sumsqr(gram) + ca.dot(peaked, ca.diag(gram) ** 2)
        # The quantile of a multiple of χ² of which mean and variance are known.
        ratio = (variance + least**2) / (9.0 * mean**2)
        return mean * (1.0 - ratio + float(scipy.special.ndtri(self.share)) * ca.sqrt(ratio)) ** 3


@dataclass(frozen=True)
class TrimRoom(Limit):
    """Room for the trim: the number as set on most springs stays between two ends.

    What is set after assembly differs from spring to spring with a standard deviation that follows to first
    order from the spreads; ``deviations`` of them are kept free on both sides. Source: definition.

    Parameters
    ----------
    name
        Full name of the number that is trimmed.
    lowest, highest
        Least and largest number that can be set, in its unit.
    deviations
        Standard deviations of the trim that are kept free. Soft springs need more than the first order says,
        so that 2 leave room for about 93 % of them.
    rules
        How declared spreads become deviations.

    Raises
    ------
    ValueRangeError
        If the ends are in the wrong order, or the deviations are negative.
    """

    name: str
    lowest: Quantity | float
    highest: Quantity | float
    deviations: float = 3.0
    rules: SpreadRules = field(default_factory=SpreadRules)

    def __post_init__(self) -> None:
        in_si("deviations", self.deviations, "1", maximum=10.0)
        if not plain(self.lowest) < plain(self.highest):
            raise ValueRangeError(
                f"TrimRoom for '{self.name}' from {self.lowest} to {self.highest}", "has no room",
                next_step="give a lowest below the highest",
            )  # fmt: skip

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides.

        Raises
        ------
        ArrangementError
            If the number cannot be trimmed.
        UnitError
            If an end is given in a unit of something else.
        """
        sensitivities, weights = _Sensitivities(design), _weights(design)
        tangent = sensitivities.tangent(self.name)
        rows = _rows(design, sensitivities, self.rules)
        along = ca.vertcat(ca.SX(0), *[ca.dot(weights, tangent * row) for _, row in rows])
        least = _LEAST * design.target.largest**2
        away = self.deviations * ca.sqrt(ca.sumsqr(along) + least**2) / (ca.dot(weights, tangent**2) + least)
        number, unit = design.parameters[self.name], design.model.variable(self.name).unit
        shown = design.shown_units[self.name]
        for end, upper in ((self.lowest, False), (self.highest, True)):
            value = in_si(f"TrimRoom of {self.name}", end, unit)
            expression = number + away if upper else number - away
            words = f"{self.name} as trimmed"
            yield Bound("TrimRoom", words, expression, value, upper, shown, max(abs(value), 1e-3))


_SINCE = SinceMade()


def _rows(
    design: DesignPoint, sensitivities: _Sensitivities, rules: SpreadRules
) -> list[tuple[Spread, Expression]]:
    """Return the spreads that change the torque at rest, each with its change per standard deviation."""
    if design.cam.rolling is not None:
        raise ArrangementError(
            f"cam '{design.cam.name}'",
            f"has {design.cam.rolling.what}, which goals over the spreads do not know",
            next_step="leave them out; tolerance_analysis looks at the design that comes out",
        )  # fmt: skip
    causes = spring_causes(design.model, design.cam.drive, rules)
    rows = [(cause.spread, sensitivities.row(cause)) for cause in causes]
    rows += [(_SINCE, -_SINCE.slope(0.0) * lost) for lost in (*lost_by_set(design), *lost_by_creep(design))]
    return [(spread, row) for spread, row in rows if not row.is_zero()]


def lost_by_set(design: DesignPoint) -> Iterator[Expression]:
    """Yield the torque that each piece which states a set loses by it, over the nodes."""
    for piece in design.cam.specimens:
        if piece.tension_set is None:
            continue
        stays = design.parameters[piece.tension_set] * ca.fmax(design.strains[piece.name][0], 0)
        shorter = ca.fmax(design.extensions - stays * design.parameters[piece.rest_length], 0)
        forces = ca.vertcat(*[design.element(each).force for each in ca.vertsplit(shorter)])
        yield design.elements * design.lever_arms * (design.forces - forces)


def lost_by_creep(design: DesignPoint) -> Iterator[Expression]:
    """Yield the torque that relaxation takes after it was measured, with its times as declared."""
    if not design.cam.states:
        return
    try:
        relaxing = design.relaxing.function
    except ArrangementError:
        return
    model, stretched = design.model, design.model.values[design.cam.pretension]
    left, grown = relaxed_until_measured(relaxing, stretched, model.start(model.parameters))
    if np.max(np.abs(left)) < SMALLEST:
        return
    numbers, forces = ca.vertcat(*[design.parameters[v.name] for v in model.parameters]), []
    for extension in ca.vertsplit(design.extensions):
        rates = relaxing.call([extension, ca.SX(0), ca.SX.zeros(len(left)), numbers])[1]
        forces.append(relaxing.call([extension, ca.SX(0), ca.mtimes(ca.DM(grown), rates), numbers])[0])
    yield design.elements * design.lever_arms * ca.vertcat(*forces)


def _weights(design: DesignPoint) -> Expression:
    """Return the share of each node in the mean over the angle, by trapezoids, as the target weighs it."""
    steps = design.angles[1:] - design.angles[:-1]
    importance = [design.target.weight_law(design.angles[i]) for i in range(design.angles.shape[0])]
    sizes = ca.vertcat(*importance) * (ca.vertcat(steps, 0.0) + ca.vertcat(0.0, steps))
    return sizes / ca.sum1(sizes)


class _Sensitivities:
    """Change of the torque at the nodes of a design per standard deviation, columns of shape (n,)."""

    def __init__(self, design: DesignPoint) -> None:
        self.design = design
        anchor = design.cam.anchor_distance
        self.anchor = ca.SX(np.inf) if anchor is None else design.parameters[anchor]
        self.parallel = anchor is None
        root = ca.sqrt(self.anchor**2 - design.lever_arms**2)
        # dφ/dθ = 1 + h'/√(D² − p²) = √(D² − p²)/f, and p' = h'/(dφ/dθ).
        self.root = root
        self.turning = ca.SX(1.0) if self.parallel else 1.0 + design.lever_arm_slopes / root
        self.slopes = design.lever_arm_slopes / self.turning
        self.force_change = _ForceChange(design)

    def row(self, cause: Cause) -> Expression:
        """Return the change for a cause; zero for one that does not change the torque at rest."""
        design = self.design
        if isinstance(cause, NumberCause):
            return self._by_numbers({n: self._amount(cause, n, size) for n, size in cause.numbers})
        if isinstance(cause, AnchorCause):
            return self._by_anchor(self._amount(cause, cause.name, cause.deviation))
        if isinstance(cause, WaveCause):
            turned, rate = design.directions, cause.order * np.pi / design.directions[-1]
            if cause.order == 0:
                return cause.deviation * self._by_contour(ca.SX.ones(turned.shape), turned)
            return cause.deviation * self._by_contour(ca.cos(rate * turned), ca.sin(rate * turned) / rate)
        if isinstance(cause, ProfileCause) and {n for n, _ in cause.numbers} & set(design.cam.control_values):
            # A larger cam: Δ = a·p, whose integral is δ − √(D² − p²) + D.
            arms = design.lever_arms
            shortened = 0.0 if self.parallel else arms**2 / (self.anchor + self.root)
            taken = design.extensions - design.parameters[design.cam.pretension] + shortened
            return cause.deviation * self._by_contour(arms, taken)
        return ca.SX.zeros(design.angles.shape)

    def tangent(self, name: str) -> Expression:
        """Return the change per metre (or unit) of a number that is set after assembly."""
        cam = self.design.cam
        if name == cam.anchor_distance:
            return self._by_anchor(ca.SX(1.0))
        if name not in cam.numbers:
            raise ArrangementError(
                f"trim '{name}'", "is not a single number behind the cam",
                next_step=f"trim '{cam.pretension}'",
            )  # fmt: skip
        return self._by_numbers({name: ca.SX(1.0)})

    def _amount(self, cause: Cause, name: str, size: float) -> Expression:
        declared = self.design.model.values[name]
        now = self.design.parameters[name]
        return size * now / declared if cause.relative and declared != 0.0 else ca.SX(size)

    def _by_numbers(self, amounts: dict[str, Expression]) -> Expression:
        design = self.design
        cam, elements = design.cam, design.elements
        inside = {n: a for n, a in amounts.items() if n not in (cam.pretension, cam.elements)}
        change = self.force_change(inside) + design.stiffnesses * amounts.get(cam.pretension, ca.SX(0))
        more = design.forces * amounts.get(cam.elements, ca.SX(0))
        return design.lever_arms * (elements * change + more)

    def _by_contour(self, error: Expression, integral: Expression) -> Expression:
        return self._by_geometry(error * self.turning, integral)

    def _by_anchor(self, amount: Expression) -> Expression:
        arms, away = self.design.lever_arms, self.anchor * self.root
        change = -arms * self.slopes * self.turning / away
        return amount * self._by_geometry(change, -(arms**2) / (self.anchor * (self.anchor + self.root)))

    def _by_geometry(self, arms: Expression, longer: Expression) -> Expression:
        design = self.design
        return design.elements * (arms * design.forces + design.lever_arms * design.stiffnesses * longer)


class _ForceChange:
    """Change of the force of one element with its numbers, as a column over the nodes."""

    def __init__(self, design: DesignPoint) -> None:
        law = design.law
        self.design, self.names = design, [v.name for v in law.parameters]
        extension, numbers = ca.SX.sym("extension"), ca.SX.sym("numbers", len(self.names))
        direction = ca.SX.sym("direction", len(self.names))
        force = law.function.call([extension, numbers])[0]
        change = ca.jtimes(force, numbers, direction)
        self.function = ca.Function("change", [extension, numbers, direction], [change])
        self.numbers = ca.vertcat(*[design.parameters[name] for name in self.names])

    def __call__(self, amounts: dict[str, Expression]) -> Expression:
        extensions = self.design.extensions
        if not amounts:
            return ca.SX.zeros(extensions.shape)
        direction = ca.vertcat(*[amounts.get(name, ca.SX(0)) for name in self.names])
        columns = [
            self.function.call([extensions[i], self.numbers, direction])[0]
            for i in range(extensions.shape[0])
        ]
        return ca.vertcat(*columns)
