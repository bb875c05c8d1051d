"""From the solution of a search to a finished design, measured on the changed assembly."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import NlsError
from ...foundation.quantity import MM, Quantity, significant
from ...model import FlatModel, flatten
from ...model.origin import derived
from ..curves.target import Target
from ..statics.contour import Contour
from ..statics.declared_cam import CamFit, DesignedCam, cam_from_profile, contour_of_cam
from ..statics.equilibrium import cam_function, torque_function, with_smooth_cables
from ..tolerance.monte_carlo import tolerance_analysis
from ..tolerance.tolerance_result import ToleranceResult
from .coil_limits import side_forces
from .defaults import safe_limits
from .design_search import Search, carried_over, same_design, spans_of
from .limits import Bound, limits_in_words
from .problem import DesignProblem
from .program import Solution
from .remedies import Remedies, find_remedies
from .result import CamDesign, DesignCurves, LimitState, Miss, StartOutcome, TorqueCheck
from .shape import INTERVALS
from .size_ranges import size_ranges

_ACTIVE = 1e-3
_STIFFER = 0.1
"""Share by which clamped ends may stiffen a piece of rubber unsaid; the published element has 0.08."""
_AT_END = 1e-6
_CONTROL_VALUES = 64
_DEARER = 1.2
"""Factor on the cost up to which a narrower rounding counts as the same design."""
_NARROWED = 2
"""How often the rounding of knots is narrowed at most."""
_SHARE_OF_CAM = 0.25
"""Part of what is allowed that the declared cam may add to the error of its contour without a word."""
_PROMISED = 2e-4
"""Difference between the error that the optimiser saw and that of the finished assembly, relative to the
largest torque, from which the rounding of knots is narrowed."""


@dataclass(frozen=True, eq=False)
class SolvedSearch:
    """A search with its outcomes, the one that was taken, and the assembly that follows from it."""

    actuator: Assembly
    search: Search  # that was solved
    free: tuple[str, ...]  # what may change in it
    outcomes: Sequence[Solution]
    taken: int  # number of the best of them
    best: Solution  # that one, or what followed from it with knots rounded less

    def start_outcome(self, outcome: Solution) -> StartOutcome:
        """Return where a start came to, beside the one that was taken."""
        problem = self.search.problem
        same = same_design(problem, self.outcomes[self.taken], outcome)
        error = problem.rms(outcome.point)
        return StartOutcome(outcome.solved, outcome.status, outcome.iterations, outcome.cost, error, same)

    @cached_property
    def predicted_rms(self) -> float:
        """Torque error in N·m that the optimiser saw."""
        return self.search.problem.rms(self.best.point)

    @cached_property
    def contour_fit(self) -> tuple[Contour, CamFit | None]:
        """Contour, and the declared cam made for it; none where the contour was given."""
        cam = self.search.question.cam
        problem = self.search.problem
        if problem.contour is None:
            return contour_of_cam(cam), None
        contour = problem.contour.made(problem.design, lambda each: problem.evaluate(each, self.best.point))
        given = None if problem.design.cam.anchor_distance is None else contour.anchor_distance
        fit = cam_from_profile(
            contour.angles, contour.lever_arms, like=cam, count=_CONTROL_VALUES, anchor_distance=given
        )
        return contour, fit

    @cached_property
    def changes(self) -> dict[str, Quantity]:
        """Designed numbers by full name."""
        problem = self.search.problem
        target, values = problem.design.target, problem.named(self.best.point)
        known, pretension = self.actuator.quantities(), problem.law.cam.pretension
        source = f"designed for {type(target).__name__}, {target.largest:.6g} N·m"
        if pretension in values:
            most = min(b.value for b in _upper(self.search, pretension))
            values[pretension] = min(values[pretension] + self.lost_travel, max(values[pretension], most))
        changes = {}
        for name in (name for name in values if name in known):
            (rounded,), unit = significant([values[name]]), known[name].unit
            # In millimetres where only metres were stated.
            shown = {"m": "mm", "m^2": "mm^2"}.get(unit, unit)
            changes[name] = replace(known[name].with_value(rounded, source), unit=shown)
        return changes | self.cam_changes

    @cached_property
    def cam_changes(self) -> dict[str, Quantity]:
        """Those of the cam by full name; none where its contour was given."""
        name, fit = self.search.problem.law.cam.name, self.contour_fit[1]
        return {} if fit is None else {f"{name}.{field}": each for field, each in fit.changes().items()}

    @cached_property
    def lost_travel(self) -> float:
        """Cable in m that the declared cam takes up less than the contour that it was fitted to.

        One that begins with a lever arm sets in over an angle, and stays behind by that from there on. A
        pretension that is free makes up for it.
        """
        contour, cam = self.contour_fit[0], self.search.question.cam
        designed = self.cam_changes or isinstance(cam, DesignedCam)
        if not designed or contour.lever_arms[0] <= 0.0:
            return 0.0
        model = flatten(with_smooth_cables(self.actuator.with_values(self.cam_changes)))
        law = cam_function(model, self.search.problem.law.cam.drive)
        taken = float(law(contour.angles[-1], model.start(model.parameters))[1])
        return max(0.0, float(contour.taken_lengths[-1]) - taken)

    @cached_property
    def changed(self) -> Assembly:
        """Copy of the assembly with those numbers."""
        return self.actuator.with_values(self.changes)

    @cached_property
    def model(self) -> FlatModel:
        """That copy, flattened."""
        return flatten(self.changed)

    @cached_property
    def check(self) -> TorqueCheck:
        """Its torque against the target."""
        cam = self.search.problem.law.cam
        spring = next(s.name for s in self.model.springs for each in s.cams if each.name == cam.name)
        # A spring that is turned on its shaft engages at the angle at which its cam is at zero.
        rest = self.model.evaluate([0.0] * len(self.model.states), [0.0] * len(self.model.inputs))
        engaged = -rest[cam.angle]
        return torque_check(
            self.model, target=self.search.problem.design.target, spring=spring, engaged=engaged
        )


def narrowed(solved: SolvedSearch) -> SolvedSearch:
    """Return the design on a law whose knots are rounded less, where the rounding shows in the torque."""
    for _ in range(_NARROWED):
        target, rounding = solved.search.problem.design.target, solved.search.rounding
        finer = solved.search.question.finer(rounding)
        if finer is None or abs(solved.check.rms - solved.predicted_rms) <= _PROMISED * target.largest:
            break
        search = solved.search.question.search(solved.free, finer)
        outcome = search.program.solve(carried_over(solved.search, solved.best.point, search))
        # A sharper law is no reason to end in another, dearer place.
        if not outcome.solved or outcome.cost > _DEARER * solved.best.cost:
            break
        better = replace(solved, search=search, best=outcome)
        if better.check.rms >= solved.check.rms:
            break
        solved = better
    return solved


def finished(solved: SolvedSearch) -> CamDesign:
    """Return the finished design."""
    search, problem, best = solved.search, solved.search.problem, solved.best
    contour, fit = solved.contour_fit
    settings, design = search.question.settings, problem.design
    limits = tuple(limit_state(problem, bound, best.point) for bound in search.bounds)
    held = [limit_state(problem, bound, best.point) for bound in search.structural]
    limits += tuple(state for state in held if state.active)
    tolerance, remarks = _tolerance(solved)
    cam, kinds = search.problem.law.cam, {bound.limit for bound in search.bounds}
    sentences = []
    if cam.rolling is None and "MaximumCableTension" not in kinds:
        sentences.append(
            f"{cam.name} declares no cable, and none of its tension is limited (MaximumCableTension)"
        )
    if cam.specimens and not {"MaximumStress", "MaximumStrain"} & kinds:
        sentences.append(
            "no strength of the rubber is declared, no largest stress or strain of it is asked for "
            "(MaximumStress, MaximumStrain)"
        )
    if cam.coils and "GoodmanSafety" not in kinds:
        sentences.append("wire and strength of the coil are not declared: nothing limits what the wire bears")
    sentences += _unlimited_pair(solved, kinds)
    sentences += side_forces(design, lambda each: problem.evaluate(each, best.point))
    sentences += [f"{at}.{text}" for at, part in solved.changed.walk() for text in part.remarks()]
    return CamDesign(
        target=design.target,
        changes=tuple(solved.changes.items()),
        actuator=derived(solved.changed, solved.actuator, "designed"),
        check=solved.check,
        predicted_rms=solved.predicted_rms,
        contour=contour,
        fit_error=0.0 if fit is None else fit.error,
        limits=limits,
        tolerance=tolerance,
        curves=_curves(problem, best.point),
        rubber_volume=float(problem.evaluate(design.rubber_volume, best.point)[0]),
        starts=tuple(solved.start_outcome(outcome) for outcome in solved.outcomes),
        taken=solved.taken,
        cam=cam,
        size_ranges=size_ranges(search, best.point, solved.predicted_rms)
        if settings.look_for_size_ranges
        else (),
        miss=_miss(solved, limits),
        remarks=(*sentences, *_ends(solved), *_beyond_defaults(solved), *_blocks(solved), *remarks),
    )


def _tolerance(solved: SolvedSearch) -> tuple[ToleranceResult | None, tuple[str, ...]]:
    """Return the tolerance analysis, or why there is none."""
    settings = solved.search.question.settings
    if not settings.draws:
        return None, ()
    try:
        analysis = tolerance_analysis(
            solved.changed,
            target=solved.search.problem.design.target,
            name=solved.search.problem.law.cam.drive,
            draws=settings.draws,
            seed=settings.seed,
        )
    except NlsError as error:
        # The design stands without it; the reason is among its remarks.
        return None, (f"no tolerance: {error}",)
    return analysis, ()


def _miss(solved: SolvedSearch, limits: Sequence[LimitState]) -> Miss | None:
    settings, target, check = (
        solved.search.question.settings,
        solved.search.problem.design.target,
        solved.check,
    )
    allowed = settings.largest_error * target.largest
    if check.rms <= allowed:
        return None
    binding = [i for i, state in enumerate(limits[: len(solved.search.bounds)]) if state.active]
    remedies: Remedies | None = None
    advice: tuple[str, ...] = ()
    if solved.predicted_rms <= allowed:
        advice = (_made_otherwise(solved),)
    elif settings.look_for_remedies:
        remedies = find_remedies(
            solved.search, solved.free, solved.best.point, allowed=allowed, error=check.rms, binding=binding
        )
        advice = tuple(remedies.sentences(target.largest, allowed))
        if check.rms - solved.predicted_rms > _SHARE_OF_CAM * allowed:
            advice += (_made_otherwise(solved),)
    worst = int(np.argmax(np.abs(check.errors)))
    return Miss(
        error=check.rms / target.largest,
        allowed=settings.largest_error,
        worst_angle=float(check.angles[worst]),
        worst_error=float(check.errors[worst]),
        binding=limits_in_words((state.limit, state.of) for state in limits if state.active),
        remedies=remedies,
        advice=advice,
    )


def _made_otherwise(solved: SolvedSearch) -> str:
    """Say that the contour would do and the declared cam does not hold it: over its onset, or its knots."""
    cam, largest = solved.search.problem.law.cam.name, solved.search.problem.design.target.largest
    widths = [name for name in (f"{cam}.onset", f"{cam}.changeover") if name in solved.actuator.quantities()]
    share, pretension = 100.0 * solved.predicted_rms / largest, solved.search.problem.law.cam.pretension
    if solved.search.problem.law.cam.rolling is not None:
        step = math.degrees(solved.search.problem.design.target.last_angle) / INTERVALS
        return (
            f"at its {INTERVALS} nodes the way of what rolls on it leaves {share:.2g} %; between them the "
            f"curve bends more than it can: spread its jumps over {step:.2g}° or more"
        )
    freed = "" if pretension in solved.free or solved.lost_travel <= 0.0 else f", free {pretension}"
    return (
        f"the contour itself leaves {share:.2g} %; the rest is the cam, which sets in over an angle: "
        f"make {' or '.join(widths)} smaller{freed}, or round the knots of the rubber's law"
    )


def _ends(solved: SolvedSearch) -> Iterator[str]:
    """Yield the numbers that sit at the end of the range of their part, which no limit names."""
    problem, point = solved.search.problem, solved.best.point
    for i, variable in enumerate(problem.scalars):
        if variable.name in solved.search.question.model.values and (
            point[i] - variable.lower < _AT_END or variable.upper - point[i] < _AT_END
        ):
            value = solved.changes[variable.name]
            if problem.named(point)[variable.name] > 0.0:
                yield f"{variable.name} = {value} is the end of its range, no limit of yours: bound it"


_PAIR_SIZE = 2.0
"""Radius of a cam that rolls on its mirror image, over the length of the element between the pivots without
load, from which its size is remarked. Assumed; the joints of Wu and Mintchev 2024 have 1.04 to 1.10."""


def _unlimited_pair(solved: SolvedSearch, kinds: Container[str]) -> Iterator[str]:
    """Yield how large a rolling pair came out where no limit keeps its smooth profile from growing."""
    cam, values = solved.search.problem.law.cam, solved.model.values
    if cam.rolling is None or cam.rolling.radius is not None or "MaximumCamRadius" in kinds:
        return
    enough = _PAIR_SIZE * max(values[name] for name in cam.lengths)
    if solved.contour_fit[0].radii.max() > enough:
        yield (
            "nothing limits the size of this pair: its pivots are "
            f"{MM * values[cam.rolling.base]:.3g} mm apart at angle zero -> limit the cam radius, "
            f'MaximumCamRadius = {{radius = "{MM * enough:.3g} mm"}} for '
            "instance, twice the length of its element"
        )


def _beyond_defaults(solved: SolvedSearch) -> Iterator[str]:
    """Yield the limits of the declared cable and rubber that were replaced and that the design breaks."""
    problem, question = solved.search.problem, solved.search.question
    for limit in safe_limits(question.model, question.drive):
        for bound in limit.bounds(problem.design):
            state = limit_state(problem, bound, solved.best.point)
            excess = (state.value - state.bound) * (1.0 if state.upper else -1.0)
            if excess > _ACTIVE * (bound.scale if bound.offset is None else abs(state.bound)):
                yield f"beyond what the declared cable and rubber allow: {state}"


def _blocks(solved: SolvedSearch) -> Iterator[str]:
    """Yield the pieces of rubber that are too short for their section to be strips.

    A law of stress over strain is that of a slender strip. Clamped ends hold a piece sideways: with the shape
    factor S, section over free surface, its stiffness is about 1 + 2·S² times that. A section whose form is
    not known is taken as a square.

    Source: Gent 2012.
    """
    values = solved.search.question.model.values
    for piece in solved.search.problem.law.cam.specimens:
        sides = [
            solved.changes[name].number if name in solved.changes else values[name]
            for name in (*piece.section, piece.rest_length)
        ]
        *section, length = sides
        width, thickness = section if len(section) == 2 else [math.sqrt(section[0])] * 2
        stiffer = 2.0 * (width * thickness / (2.0 * (width + thickness) * length)) ** 2
        if stiffer > _STIFFER:
            yield (
                f"{piece.name}: {1e3 * length:.3g} mm long with {1e6 * width * thickness:.4g} mm² of section "
                f"is a block, no strip: clamped ends make it about {1.0 + stiffer:.2g} times as stiff as its "
                f"law says -> ask for a longer one (limit RestLengthRange), more elements or thinner strips, "
                "or measure it"
            )


def _curves(problem: DesignProblem, point: Array) -> DesignCurves:
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


def _upper(search: Search, name: str) -> Iterator[Bound]:
    """Yield what bounds a number from above: its part, and the limits."""
    variable = search.question.model.variable(name)
    yield Bound("", name, ca.SX(0), variable.maximum, True, variable.unit, 1.0)
    yield from (each for each in search.bounds if each.upper and each.of in (name, "pretension"))


def limit_state(problem: DesignProblem, bound: Bound, point: Array) -> LimitState:
    """Return how a design stands to a limit."""
    values = problem.evaluate(bound.expression, point)
    value = float(values.max() if bound.upper else values.min())
    active = abs(value - bound.value) <= _ACTIVE * bound.scale
    if abs(value - bound.value) <= _AT_END * bound.scale:
        value = bound.value
    read, end = bound.read(value), bound.read(bound.value)
    angles = problem.evaluate(problem.design.angles, point)
    where = ""
    if active and len(values) == len(angles):
        where = spans_of(angles, np.abs(values - bound.value) <= _ACTIVE * bound.scale)
    return LimitState(bound.limit, bound.of, read, end, bound.at_most, bound.unit, active, where)


_ANGLES = 801


def torque_check(
    model: FlatModel, *, target: Target, spring: str | None = None, engaged: float = 0.0
) -> TorqueCheck:
    """Return the equilibrium torque of a model against a target.

    ``spring``: path of the spring; decided from the structure if it is left out. ``engaged``: angle in rad at
    which its target begins.
    """
    angles = np.linspace(0.0, target.last_angle, _ANGLES)
    at = (engaged + angles).reshape(1, -1)
    torque = torque_function(model, spring)(at, model.start(model.parameters))
    values = np.array(torque, dtype=float).ravel()
    return TorqueCheck(angles, values, target.torque(angles), target.weight(angles))
