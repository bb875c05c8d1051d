"""Joint design of contour, pretension and rubber: deterministic starts, checked on the model itself."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...components.assembly.named_parts import Assembly
from ...errors import ConvergenceError
from ...model import FlatModel, flatten
from ...model.roles import series_cam, series_spring
from ...quantity import Quantity, significant
from ..curves.target import Target
from ..statics.contour import Contour, contour_from_curvature
from ..statics.declared_cam import CamFit, cam_from_profile, contour_of_cam
from ..statics.equilibrium import torque_function
from ..statics.rounding import has_corners
from .conflict import feasible_point, row_of
from .design_point import anchor_of
from .goals import Goal, LeastRubber, SmoothContour, TorqueError
from .limits import Bound, Limit
from .problem import DesignProblem, contour_names, design_problem
from .program import Program, Solution
from .result import CamDesign, LimitState, Sensitivity, TorqueCheck

Floats = NDArray[np.float64]

GOALS: tuple[Goal, ...] = (TorqueError(), SmoothContour(), LeastRubber())
"""Torque error; the other two only choose between designs of equal torque."""

_ANGLES = 801
_ACTIVE = 1e-3
_MOST_MODULI = 10
_ROUNDING = 0.003
"""Width over which the knots of a rubber's law are rounded where needed, relative to its stretch."""
_ITERATION_LIMIT = "Maximum_Iterations_Exceeded"
"""IPOPT's status where Newton's method does not settle, as at the knots of a law."""
_CONTROL_VALUES = 64


def _quiet() -> None:
    """Report no progress."""


def design_cam(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str] | None = None,
    keep: Sequence[Limit],
    spring: str | None = None,
    goals: Sequence[Goal] = GOALS,
    progress: Callable[[], None] = _quiet,
) -> CamDesign:
    """Design the cam of a spring, and with it whatever else is free, for a target torque curve.

    The static law is that of the flat model with all relaxation at rest. The result is converted to the
    numbers of the declared cam, put into a copy of the assembly, flattened anew, and its torque error is
    measured there.

    Parameters
    ----------
    actuator
        Assembly with a cam spring; its present numbers are the fixed ones and the starting point.
    target
        Torque curve.
    free
        Full names of what may change: the contour ``<cam>.contour`` (or ``<cam>.lever_arm``, which is the
        same), pretension, area and rest length of the rubber, distance of the anchor, or any other single
        number behind the cam, for instance ``spring.cam.contour`` and ``spring.rubber.area``. The contour
        alone by default.
    keep
        Limits.
    spring
        Path of the cam spring; decided from the structure if it is left out.
    goals
        What is made small, as a sum.
    progress
        Called after each starting point.

    Returns
    -------
    CamDesign
        The best of the starting points.

    Raises
    ------
    InfeasibleError
        If the limits contradict each other, with their names and how much each would have to give.
    ConvergenceError
        If the solver stops without a solution.
    UnknownNameError
        If a free name does not exist.
    ArrangementError
        If the structure does not say which spring is meant, or it has no two-sided cam.
    """
    model = flatten(actuator)
    names = series_cam(model, spring)
    cam, chosen = actuator[names.name], contour_names(names)[:1] if free is None else free

    def program_of(rounding: float) -> _DesignProgram:
        problem = design_problem(
            model, cam, target=target, free=chosen, spring=names.drive, rounding=rounding
        )
        return _DesignProgram(problem, keep, goals, progress)

    solved, outcomes = _solved(program_of)
    return _finished(actuator, solved.problem, solved.bounds, _best(outcomes))


def _solved(program_of: Callable[[float], _DesignProgram]) -> tuple[_DesignProgram, list[Solution]]:
    """Return the program that was solved and the solution from each start."""
    plain = program_of(0.0)
    first, *others = plain.problem.starts
    outcomes = plain.solve(first)
    if outcomes[0].solved:
        return plain, outcomes + plain.solve(*others)
    # Whether there is any cam at all is found out with softened limits.
    feasible = feasible_point(plain.problem, plain.bounds, plain.progress)
    if outcomes[0].status == _ITERATION_LIMIT and has_corners(plain.problem.law.function):
        smooth = program_of(_ROUNDING)
        outcomes = smooth.solve(*smooth.problem.starts)
        if any(outcome.solved for outcome in outcomes):
            return smooth, outcomes
    return plain, plain.solve(feasible, *others)


class _DesignProgram:
    """A problem with its limits and goals as a program."""

    def __init__(
        self,
        problem: DesignProblem,
        keep: Sequence[Limit],
        goals: Sequence[Goal],
        progress: Callable[[], None],
    ) -> None:
        self.problem, self.progress = problem, progress
        self.bounds = [bound for limit in keep for bound in limit.bounds(problem.design)]
        self.program = Program(
            problem.vector,
            np.array([v.lower for v in problem.variables]),
            np.array([v.upper for v in problem.variables]),
            sum((goal.cost(problem.design) for goal in goals), start=ca.SX(0)),
            (*problem.structure, *(row_of(bound) for bound in self.bounds)),
        )

    def solve(self, *starts: Floats) -> list[Solution]:
        """Solve from each starting point."""
        return self.program.solve(*starts, progress=self.progress)


def _best(outcomes: Sequence[Solution]) -> Solution:
    solved = [outcome for outcome in outcomes if outcome.solved]
    if not solved:
        raise ConvergenceError(
            "design", f"IPOPT stopped with '{outcomes[0].status}' after {outcomes[0].iterations} iterations",
            next_step="widen the narrowest limit, free one number more, or smooth the rubber's law",
        )  # fmt: skip
    return min(solved, key=lambda outcome: outcome.cost)


def _finished(
    actuator: Assembly, problem: DesignProblem, bounds: Sequence[Bound], best: Solution
) -> CamDesign:
    target, cam = problem.design.target, problem.law.cam
    values = problem.named(best.point)
    contour, fit = _contour(actuator, problem, best)
    known, source = actuator.quantities(), f"designed for {type(target).__name__}, {target.largest:.6g} N·m"
    changes = {name: _designed(known[name], value, source) for name, value in values.items() if name in known}
    if fit is not None:
        changes |= {f"{cam.name}.{field}": given for field, given in fit.changes().items()}
    changed = actuator.with_values(changes)
    model = flatten(changed)
    spring = next(each.name for each in model.springs for inside in each.cams if inside.name == cam.name)
    mean_square = problem.evaluate(problem.design.mean_square_error, best.point)[0]
    return CamDesign(
        target=target,
        changes=tuple(changes.items()),
        actuator=changed,
        check=torque_check(model, target=target, spring=spring),
        predicted_rms=float(np.sqrt(mean_square)),
        contour=contour,
        fit_error=0.0 if fit is None else fit.error,
        limits=tuple(_state(problem, bound, best.point) for bound in bounds),
        sensitivity=torque_sensitivity(model, target=target, spring=spring),
        iterations=best.iterations,
    )


def _designed(old: Quantity, value: float, source: str) -> Quantity:
    """Return a designed number, shown in millimetres where only metres were stated."""
    (rounded,) = significant([value])
    return replace(old.with_value(rounded, source), unit={"m": "mm", "m^2": "mm^2"}.get(old.unit, old.unit))


def _contour(actuator: Assembly, problem: DesignProblem, best: Solution) -> tuple[Contour, CamFit | None]:
    design, cam = problem.design, actuator[problem.law.cam.name]
    if problem.contour is None:
        return contour_of_cam(cam), None
    anchor = design.parameters[anchor_of(design.cam)]
    contour = contour_from_curvature(
        problem.evaluate(design.directions, best.point),
        problem.evaluate(design.radii_of_curvature, best.point),
        first_slope=float(problem.evaluate(problem.contour.first_slope.value, best.point)[0]),
        anchor_distance=float(problem.evaluate(anchor, best.point)[0]),
    )
    return contour, cam_from_profile(contour.angles, contour.lever_arms, like=cam, count=_CONTROL_VALUES)


def _state(problem: DesignProblem, bound: Bound, point: Floats) -> LimitState:
    values = problem.evaluate(bound.expression, point)
    value = float(values.max() if bound.upper else values.min())
    active = abs(value - bound.value) <= _ACTIVE * bound.scale
    return LimitState(bound.limit, bound.of, value, bound.value, bound.upper, bound.unit, active)


def torque_check(model: FlatModel, *, target: Target, spring: str | None = None) -> TorqueCheck:
    """Return the equilibrium torque of a model against a target.

    Parameters
    ----------
    model
        Flat model of the actuator.
    target
        Torque curve.
    spring
        Path of the spring; decided from the structure if it is left out.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant.
    """
    angles = np.linspace(0.0, target.last_angle, _ANGLES)
    torque = torque_function(model, spring)(angles.reshape(1, -1), model.start(model.parameters))
    return TorqueCheck(angles, np.array(torque, dtype=float).ravel(), target.torque(angles))


def torque_sensitivity(model: FlatModel, *, target: Target, spring: str | None = None) -> Sensitivity:
    """Return the worst rms torque error over the corners of the moduli's stated spread.

    The torque is linear in the moduli for the laws of this project, so the rms error is convex in them and
    its largest value lies at a corner. With more than ten moduli only the two common corners are looked at.

    Parameters
    ----------
    model
        Flat model of the actuator.
    target
        Torque curve.
    spring
        Path of the spring; decided from the structure if it is left out.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant.
    """
    angles = np.linspace(0.0, target.last_angle, 201)
    wanted, numbers = target.torque(angles), model.start(model.parameters)
    law, inside = torque_function(model, spring), set(series_spring(model, spring).parameters)

    def torque(deviations: dict[int, float]) -> Floats:
        changed = numbers.copy()
        for index, deviation in deviations.items():
            changed[index] *= 1.0 + deviation
        return np.array(law(angles.reshape(1, -1), changed), dtype=float).ravel()

    nominal = torque({})
    moduli = [
        (i, v)
        for i, v in enumerate(model.parameters)
        if v.name in inside and v.unit == "Pa" and v.spread > 0.0
        if np.max(np.abs(torque({i: v.spread}) - nominal)) > 1e-9 * target.largest
    ]
    if not moduli:
        return Sensitivity(TorqueCheck(angles, nominal, wanted).rms, ())
    signs = (
        itertools.product((-1.0, 1.0), repeat=len(moduli))
        if len(moduli) <= _MOST_MODULI
        else [(s,) * len(moduli) for s in (-1.0, 1.0)]
    )
    corners = [{i: sign * v.spread for sign, (i, v) in zip(corner, moduli, strict=True)} for corner in signs]
    errors = [TorqueCheck(angles, torque(corner), wanted).rms for corner in corners]
    worst = int(np.argmax(errors))
    return Sensitivity(errors[worst], tuple((v.name, corners[worst][i]) for i, v in moduli))
