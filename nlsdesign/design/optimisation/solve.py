"""Joint design of contour, pretension and rubber: deterministic starts, checked on the model itself."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...components.assembly.named_parts import Assembly
from ...components.core.element import Element
from ...errors import ConvergenceError
from ...model import FlatModel, flatten
from ...model.roles import series_cam, series_spring
from ...quantity import Quantity, significant
from ..curves.target import Target
from ..statics.contour import Contour, contour_from_curvature
from ..statics.declared_cam import CamFit, cam_from_profile, contour_of_cam
from ..statics.equilibrium import torque_function
from .conflict import feasible_point
from .defaults import safe_limits, with_defaults
from .goals import Goal, LeastRubber, SmoothContour, TorqueError
from .limits import Bound, Limit
from .problem import DesignProblem, contour_names
from .program import Solution
from .remedies import find_remedies
from .result import (
    CamDesign,
    DesignCurves,
    LimitState,
    Miss,
    Sensitivity,
    StartOutcome,
    TorqueCheck,
)
from .search import Question, Search, carried_over
from .settings import DesignSettings
from .valleys import valleys

Floats = NDArray[np.float64]

GOALS: tuple[Goal, ...] = (TorqueError(), SmoothContour(), LeastRubber())
"""Torque error; the other two only choose between designs of equal torque."""

USUAL = DesignSettings()
"""Four starts, 1 % of the largest torque as the largest error, limits of the declared cable and rubber."""

_ANGLES = 801
_ACTIVE = 1e-3
_MOST_MODULI = 10
_CONTROL_VALUES = 64
_NARROWED = 2
"""How often the rounding of knots is narrowed at most."""
_PROMISED = 2e-4
"""Difference between the error that the optimiser saw and that of the finished assembly, relative to the
largest torque, from which the rounding of knots is narrowed."""


def design_cam(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str] | None = None,
    keep: Sequence[Limit] = (),
    spring: str | None = None,
    goals: Sequence[Goal] = GOALS,
    settings: DesignSettings = USUAL,
) -> CamDesign:
    """Design the cam of a spring, and with it whatever else is free, for a target torque curve.

    The static law is that of the flat model with all relaxation at rest. The result is converted to the
    numbers of the declared cam, put into a copy of the assembly, flattened anew, and its torque error is
    measured there. A design whose rms error exceeds what the settings allow comes back too, with ``met``
    false and ``miss`` saying why and what to free.

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
        Limits, besides those of the settings.
    spring
        Path of the cam spring; decided from the structure if it is left out.
    goals
        What is made small, as a sum.
    settings
        Starts, seed, what counts as a miss, limits that hold by default, whom to tell of progress.

    Returns
    -------
    CamDesign
        The best of the starting points.

    Raises
    ------
    InfeasibleError
        If the limits contradict each other, with their names, how much each would have to give, and which
        number to free.
    ConvergenceError
        If the solver stops without a solution.
    ValueRangeError
        If a free number changes neither a goal nor a limit.
    UnknownNameError
        If a free name does not exist.
    ArrangementError
        If the structure does not say which spring is meant, or its cam has no contour.
    """
    question, chosen = asked(
        actuator, target=target, free=free, keep=keep, spring=spring, goals=goals, settings=settings
    )
    search = question.search(chosen)
    search.require_influence()
    outcomes = search.outcomes()
    if not any(outcome.solved for outcome in outcomes):
        # Whether there is any cam at all is found out with softened limits.
        outcomes.append(search.program.solve(feasible_point(search, chosen)))
    taken = _best(outcomes)
    return finished_design(_narrowed(FoundDesign(actuator, search, chosen, outcomes, taken, outcomes[taken])))


def asked(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str] | None,
    keep: Sequence[Limit],
    spring: str | None,
    goals: Sequence[Goal],
    settings: DesignSettings,
) -> tuple[Question, tuple[str, ...]]:
    """Return the question of a design and the names of what is free.

    Parameters
    ----------
    actuator, target, free, keep, spring, goals, settings
        As :func:`design_cam`.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant, or its cam has no contour.
    """
    model = flatten(_with_smooth_cables(actuator))
    names = series_cam(model, spring)
    defaults = safe_limits(model, names.drive) if settings.defaults is None else settings.defaults
    question = Question(
        model=model,
        cam=actuator[names.name],
        drive=names.drive,
        target=target,
        keep=with_defaults(keep, defaults),
        goals=tuple(goals),
        settings=settings,
    )
    return question, tuple(contour_names(names)[:1] if free is None else free)


def _with_smooth_cables(actuator: Assembly) -> Assembly:
    """Return the assembly with every cable that goes slack in its smooth form, which an optimiser can follow.

    Within the range of a design the cable is taut, where the two forms agree; the finished design is measured
    on the assembly as it is declared.
    """
    for path, part in actuator.walk():
        if "unilateral contact" in part.phenomena and isinstance(part, Element) and not part.is_smooth:
            actuator = actuator.with_part(path, part.smooth())
    return actuator


@dataclass(frozen=True, eq=False)
class FoundDesign:
    """A search with its outcomes, the one that was taken, and the assembly that follows from it.

    Parameters
    ----------
    actuator
        As declared.
    search
        In which the best was found.
    free
        What may change.
    outcomes, taken
        Of all starts, and the number of the one that was taken.
    best
        What came of it in the end.
    """

    actuator: Assembly
    search: Search
    free: tuple[str, ...]
    outcomes: Sequence[Solution]
    taken: int
    best: Solution

    @cached_property
    def predicted_rms(self) -> float:
        """Rms torque error in N·m as the optimiser sees it."""
        return self.rms(self.best)

    def rms(self, outcome: Solution) -> float:
        """Return the rms torque error of an outcome in N·m.

        Parameters
        ----------
        outcome
            Of the search.
        """
        problem = self.search.problem
        square = problem.evaluate(problem.design.mean_square_error, outcome.point)[0]
        return float(np.sqrt(max(square, 0.0)))

    @cached_property
    def contour_fit(self) -> tuple[Contour, CamFit | None]:
        """Contour, and how well the declared cam holds it."""
        return _contour(self.actuator, self.search.problem, self.best)

    @cached_property
    def changes(self) -> dict[str, Quantity]:
        """Numbers of the assembly that change, by full name."""
        problem = self.search.problem
        target, values = problem.design.target, problem.named(self.best.point)
        known = self.actuator.quantities()
        source = f"designed for {type(target).__name__}, {target.largest:.6g} N·m"
        changes = {n: _designed(known[n], value, source) for n, value in values.items() if n in known}
        fit = self.contour_fit[1]
        if fit is not None:
            changes |= {f"{problem.law.cam.name}.{field}": given for field, given in fit.changes().items()}
        return changes

    @cached_property
    def changed(self) -> Assembly:
        """The assembly with them."""
        return self.actuator.with_values(self.changes)

    @cached_property
    def model(self) -> FlatModel:
        """Its flat model."""
        return flatten(self.changed)

    @cached_property
    def check(self) -> TorqueCheck:
        """Its torque against the target."""
        spring = _spring_of(self.model, self.search.problem.law.cam.name)
        return torque_check(self.model, target=self.search.problem.design.target, spring=spring)


def _narrowed(found: FoundDesign) -> FoundDesign:
    """Return the design on a law whose knots are rounded less, where the rounding shows in the torque."""
    for _ in range(_NARROWED):
        target, rounding = found.search.problem.design.target, found.search.rounding
        finer = found.search.question.finer(rounding)
        if finer is None or abs(found.check.rms - found.predicted_rms) <= _PROMISED * target.largest:
            break
        search = found.search.question.search(found.free, finer)
        outcome = search.program.solve(carried_over(found.search, found.best.point, search))
        if not outcome.solved:
            break
        better = replace(found, search=search, best=outcome)
        if better.check.rms >= found.check.rms:
            break
        found = better
    return found


def _best(outcomes: Sequence[Solution]) -> int:
    solved = [i for i, outcome in enumerate(outcomes) if outcome.solved]
    if not solved:
        raise ConvergenceError(
            "design", f"IPOPT stopped with '{outcomes[0].status}' after {outcomes[0].iterations} iterations",
            next_step="widen the narrowest limit, free one number more, or smooth the rubber's law",
        )  # fmt: skip
    return min(solved, key=lambda i: outcomes[i].cost)


def finished_design(found: FoundDesign) -> CamDesign:
    """Return what was found as a design, with all that is said of it.

    Parameters
    ----------
    found
        By a search.
    """
    search, problem, best = found.search, found.search.problem, found.best
    contour, fit = found.contour_fit
    settings, design = search.question.settings, problem.design
    limits = tuple(limit_state(problem, bound, best.point) for bound in search.bounds)
    return CamDesign(
        target=design.target,
        changes=tuple(found.changes.items()),
        actuator=found.changed,
        check=found.check,
        predicted_rms=found.predicted_rms,
        contour=contour,
        fit_error=0.0 if fit is None else fit.error,
        limits=limits,
        sensitivity=torque_sensitivity(
            found.model, target=design.target, spring=_spring_of(found.model, problem.law.cam.name)
        ),
        curves=_curves(problem, best.point),
        rubber_volume=float(problem.evaluate(design.rubber_volume, best.point)[0]),
        starts=tuple(
            StartOutcome(o.solved, o.status, o.iterations, o.cost, found.rms(o)) for o in found.outcomes
        ),
        taken=found.taken,
        valleys=valleys(search, best.point, found.predicted_rms) if settings.look_for_valleys else (),
        miss=_miss(found, limits),
        remarks=_remarks(search),
    )


def _miss(found: FoundDesign, limits: Sequence[LimitState]) -> Miss | None:
    settings, target, check = found.search.question.settings, found.search.problem.design.target, found.check
    allowed = settings.largest_error * target.largest
    if check.rms <= allowed:
        return None
    remedies = find_remedies(
        found.search, found.free, found.best.point, allowed=allowed, error=check.rms,
        binding=[i for i, state in enumerate(limits) if state.active],
    )  # fmt: skip
    worst = int(np.argmax(np.abs(check.errors)))
    return Miss(
        error=check.rms / target.largest,
        allowed=settings.largest_error,
        worst_angle=float(check.angles[worst]),
        worst_error=float(check.errors[worst]),
        binding=tuple(dict.fromkeys(state.limit for state in limits if state.active)),
        remedies=remedies,
        advice=tuple(remedies.sentences(target.largest)),
    )


def _remarks(search: Search) -> tuple[str, ...]:
    cam, kinds = search.problem.law.cam, {bound.limit for bound in search.bounds}
    said = []
    if "MaximumCableTension" not in kinds:
        said.append(
            f"{cam.name} declares no cable and no MaximumCableTension is asked for: nothing limits it"
        )
    if cam.specimens and not {"MaximumStress", "MaximumStrain"} & kinds:
        said.append("no strength of the rubber is declared, no MaximumStress or MaximumStrain is asked for")
    return tuple(said)


def _curves(problem: DesignProblem, point: Floats) -> DesignCurves:
    design = problem.design
    columns = [
        design.angles, design.lever_arms, design.radii_of_curvature, design.radii, design.torques,
        design.tangent_stiffness, design.extensions, design.forces,
        *design.strains.values(), *design.stresses.values(),
    ]  # fmt: skip
    table = problem.evaluate(ca.vertcat(*columns), point).reshape(len(columns), -1)
    pieces = len(design.strains)
    angles, arms, rho, radii, torques, stiffnesses, extensions, forces = table[:8]
    return DesignCurves(
        angles=angles,
        lever_arms=arms,
        radii_of_curvature=rho,
        radii=radii,
        torques=torques,
        stiffnesses=stiffnesses,
        extensions=extensions,
        forces=forces,
        strains=dict(zip(design.strains, table[8 : 8 + pieces], strict=True)),
        stresses=dict(zip(design.stresses, table[8 + pieces :], strict=True)),
    )


def _spring_of(model: FlatModel, cam: str) -> str:
    return next(each.name for each in model.springs for inside in each.cams if inside.name == cam)


def _designed(old: Quantity, value: float, source: str) -> Quantity:
    """Return a designed number, shown in millimetres where only metres were stated."""
    (rounded,) = significant([value])
    return replace(old.with_value(rounded, source), unit={"m": "mm", "m^2": "mm^2"}.get(old.unit, old.unit))


def _contour(actuator: Assembly, problem: DesignProblem, best: Solution) -> tuple[Contour, CamFit | None]:
    design, cam = problem.design, actuator[problem.law.cam.name]
    if problem.contour is None:
        return contour_of_cam(cam), None
    anchor = design.cam.anchor_distance
    contour = contour_from_curvature(
        problem.evaluate(design.directions, best.point),
        problem.evaluate(design.radii_of_curvature, best.point),
        first_slope=float(problem.evaluate(problem.contour.first_slope.value, best.point)[0]),
        first_lever_arm=float(problem.evaluate(design.lever_arms[0], best.point)[0]),
        anchor_distance=(
            np.inf if anchor is None else float(problem.evaluate(design.parameters[anchor], best.point)[0])
        ),
    )
    return contour, cam_from_profile(contour.angles, contour.lever_arms, like=cam, count=_CONTROL_VALUES)


def limit_state(problem: DesignProblem, bound: Bound, point: Floats) -> LimitState:
    """Return how a design stands to a limit.

    Parameters
    ----------
    problem
        Its problem.
    bound
        One side of the limit.
    point
        Shape (variables,), scaled.
    """
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
