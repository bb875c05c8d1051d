"""Joint design of contour, pretension and rubber: deterministic starts, checked on the model itself."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError
from ..model import Assembly, FlatModel, flatten
from ..quantity import Quantity
from .conflict import feasible_point, row_of
from .contour import CamFit, cam_from_profile, contour_of_cam
from .equilibrium import torque_function
from .geometry import Contour, contour_from_curvature
from .goals import Goal, LeastRubber, SmoothContour, TorqueError
from .limits import Bound, Limit
from .problem import Problem, design_problem
from .program import Outcome, Program
from .result import CamDesign, LimitState, Sensitivity, TorqueCheck
from .rounding import has_corners
from .target import Target

Floats = NDArray[np.float64]

GOALS: tuple[Goal, ...] = (TorqueError(), SmoothContour(), LeastRubber())
"""Torque error; the other two only choose between designs of equal torque."""

_ANGLES = 801
_ACTIVE = 1e-3
_MOST_CORNERS = 10
_ROUNDING = 0.003
"""Width over which the knots of a rubber's law are rounded where needed, relative to its stretch."""
_CIRCLES = "Maximum_Iterations_Exceeded"
"""What IPOPT says where the knots of a law send Newton's method round in circles."""
_CONTROL_VALUES = 64


def _quiet() -> None:
    """Report no progress."""


def design_cam(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str],
    keep: Sequence[Limit],
    spring: str = "spring",
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
        Full names of what may change: ``spring.cam.contour`` (or ``spring.cam.lever_arm``, which is the
        same), ``spring.pretension``, ``spring.rubber.area``, ``spring.rubber.rest_length``,
        ``spring.cam.anchor_distance``, or any other single number behind the cam.
    keep
        Limits.
    spring
        Path of the cam spring.
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
    """
    model, cam = flatten(actuator), actuator[f"{spring}.cam"]

    def stated(rounding: float) -> _Stated:
        problem = design_problem(model, cam, target=target, free=free, spring=spring, rounding=rounding)
        return _Stated(problem, keep, goals, progress)

    chosen, outcomes = _answered(stated)
    return _finished(actuator, chosen.problem, chosen.bounds, _best(outcomes))


def _answered(stated: Callable[[float], _Stated]) -> tuple[_Stated, list[Outcome]]:
    """Return the problem that was solved and what came of each start."""
    plain = stated(0.0)
    first, *others = plain.problem.starts
    outcomes = plain.solve(first)
    if outcomes[0].solved:
        return plain, outcomes + plain.solve(*others)
    # Whether there is any cam at all is found out with softened limits.
    feasible = feasible_point(plain.problem, plain.bounds, plain.progress)
    if outcomes[0].status == _CIRCLES and has_corners(plain.problem.law.function):
        smooth = stated(_ROUNDING)
        outcomes = smooth.solve(*smooth.problem.starts)
        if any(outcome.solved for outcome in outcomes):
            return smooth, outcomes
    return plain, plain.solve(feasible, *others)


class _Stated:
    """A problem with its limits and goals as a program."""

    def __init__(
        self, problem: Problem, keep: Sequence[Limit], goals: Sequence[Goal], progress: Callable[[], None]
    ) -> None:
        self.problem, self.progress = problem, progress
        self.bounds = [bound for limit in keep for bound in limit.bounds(problem.candidate)]
        self.program = Program(
            problem.vector,
            np.array([u.lower for u in problem.unknowns]),
            np.array([u.upper for u in problem.unknowns]),
            sum((goal.cost(problem.candidate) for goal in goals), start=ca.SX(0)),
            (*problem.structure, *(row_of(bound) for bound in self.bounds)),
        )

    def solve(self, *starts: Floats) -> list[Outcome]:
        """Solve from each starting point."""
        return self.program.solve(*starts, progress=self.progress)


def _best(outcomes: Sequence[Outcome]) -> Outcome:
    solved = [outcome for outcome in outcomes if outcome.solved]
    if not solved:
        raise ConvergenceError(
            "design", f"IPOPT stopped with '{outcomes[0].status}' after {outcomes[0].iterations} iterations",
            next_step="widen the narrowest limit, free one number more, or smooth the rubber's law",
        )  # fmt: skip
    return min(solved, key=lambda outcome: outcome.cost)


def _finished(actuator: Assembly, problem: Problem, bounds: Sequence[Bound], best: Outcome) -> CamDesign:
    target, spring = problem.candidate.target, problem.law.spring
    found = problem.named(best.point)
    contour, fit = _contour(actuator, problem, best, found)
    known, source = actuator.quantities(), f"designed for {type(target).__name__}, {target.largest:.6g} N*m"
    changes = {name: _designed(known[name], value, source) for name, value in found.items() if name in known}
    if fit is not None:
        changes[f"{spring}.cam.lever_arm"] = fit.cam.lever_arm
        changes[f"{spring}.cam.last_angle"] = fit.cam.last_angle
    changed = actuator.with_values(changes)
    model = flatten(changed)
    mean_square = problem.evaluate(problem.candidate.mean_square_error, best.point)[0]
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
    """Return a found number, shown in millimetres where only metres were stated."""
    return replace(old.with_value(value, source), unit={"m": "mm", "m^2": "mm^2"}.get(old.unit, old.unit))


def _contour(
    actuator: Assembly, problem: Problem, best: Outcome, found: dict[str, float]
) -> tuple[Contour, CamFit | None]:
    cam = actuator[f"{problem.law.spring}.cam"]
    if not problem.contour_is_free:
        return contour_of_cam(cam), None
    candidate = problem.candidate
    anchor = candidate.parameters[f"{problem.law.spring}.cam.anchor_distance"]
    contour = contour_from_curvature(
        problem.evaluate(candidate.directions, best.point),
        problem.evaluate(candidate.radii_of_curvature, best.point),
        first_slope=found["first_slope"],
        anchor_distance=float(problem.evaluate(anchor, best.point)[0]),
    )
    return contour, cam_from_profile(contour.angles, contour.lever_arms, like=cam, count=_CONTROL_VALUES)


def _state(problem: Problem, bound: Bound, point: Floats) -> LimitState:
    values = problem.evaluate(bound.expression, point)
    value = float(values.max() if bound.upper else values.min())
    active = abs(value - bound.value) <= _ACTIVE * bound.scale
    return LimitState(bound.limit, bound.of, value, bound.value, bound.upper, bound.unit, active)


def torque_check(model: FlatModel, *, target: Target, spring: str = "spring") -> TorqueCheck:
    """Return the equilibrium torque of a model against a target.

    Parameters
    ----------
    model
        Flat model of the actuator.
    target
        Torque curve.
    spring
        Path of the spring.
    """
    angles = np.linspace(0.0, target.last_angle, _ANGLES)
    torque = torque_function(model, spring)(angles.reshape(1, -1), model.start(model.parameters))
    return TorqueCheck(angles, np.array(torque, dtype=float).ravel(), target.torque(angles))


def torque_sensitivity(model: FlatModel, *, target: Target, spring: str = "spring") -> Sensitivity:
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
        Path of the spring.
    """
    angles = np.linspace(0.0, target.last_angle, 201)
    wanted, numbers = target.torque(angles), model.start(model.parameters)
    law = torque_function(model, spring)

    def torque(deviations: dict[int, float]) -> Floats:
        changed = numbers.copy()
        for index, deviation in deviations.items():
            changed[index] *= 1.0 + deviation
        return np.array(law(angles.reshape(1, -1), changed), dtype=float).ravel()

    nominal = torque({})
    moduli = [
        (i, v)
        for i, v in enumerate(model.parameters)
        if v.name.startswith(f"{spring}.") and v.unit == "Pa" and v.spread > 0.0
        if np.max(np.abs(torque({i: v.spread}) - nominal)) > 1e-9 * target.largest
    ]
    if not moduli:
        return Sensitivity(TorqueCheck(angles, nominal, wanted).rms, ())
    few = len(moduli) <= _MOST_CORNERS
    signs = (
        itertools.product((-1.0, 1.0), repeat=len(moduli))
        if few
        else [(s,) * len(moduli) for s in (-1.0, 1.0)]
    )
    corners = [{i: sign * v.spread for sign, (i, v) in zip(corner, moduli, strict=True)} for corner in signs]
    errors = [TorqueCheck(angles, torque(corner), wanted).rms for corner in corners]
    worst = int(np.argmax(errors))
    return Sensitivity(errors[worst], tuple((v.name, corners[worst][i]) for i, v in moduli))
