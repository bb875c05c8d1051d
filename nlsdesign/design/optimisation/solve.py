"""Joint design of contour, pretension and rubber: deterministic starts, checked on the model itself.

A cam with a contour of its own on each side: both are designed, on one element.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import ConvergenceError, InfeasibleError, NlsError
from ...foundation.work_sharing import parallel_map
from ...model import flatten
from ...model.origin import derived
from ...model.roles import series_cam
from ..curves.target import Target
from ..statics.declared_cam import both_sides, one_side, with_contour
from ..statics.equilibrium import elastic_law, with_smooth_cables
from .coil_limits import MaximumTravel
from .defaults import DesignSettings, no_progress, safe_limits, with_defaults
from .design_search import FIRST_STARTS, Question, SeveralStarts
from .finish import SolvedSearch, finished, narrowed
from .goals import Goal, LeastRubber, SmoothContour, TorqueError
from .limits import Limit
from .remedies import feasible_point
from .result import Alternative, CamDesign
from .stock import StockChoice, combinations, require_once

GOALS: tuple[Goal, ...] = (TorqueError(), SmoothContour(), LeastRubber())
"""Torque error; the other two only choose between designs of equal torque."""
_SAMPLES = 201
"""Extensions at which the force of a coil is summed up."""
USUAL = DesignSettings()
"""Eight starts, 1 % of the largest torque as the largest error, limits of the declared cable and rubber."""


def design_cam(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str | StockChoice] | None = None,
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
        alone by default. A :class:`Stock`, :class:`RubberStock` or :class:`CoilStock` among them is chosen
        from: every combination is designed, and all are listed in ``alternatives``.
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
        If a free number cannot be changed by a design, or changes neither a goal nor a limit.
    UnknownNameError
        If a free name does not exist.
    ArrangementError
        If the structure does not say which spring is meant, or its cam has no contour.
    """
    choices = [each for each in free or () if isinstance(each, StockChoice)]
    names = None if free is None else tuple(each for each in free if isinstance(each, str))
    require_once(names or (), choices)
    wanted = Wanted(target, names, tuple(keep), spring, tuple(goals))
    if not choices:
        return wanted.designed(actuator, settings)
    design = wanted.chosen(combinations(actuator, choices), settings)
    known, now = actuator.quantities(), design.actuator.quantities()
    stock = [(each.chosen, now[each.chosen]) for each in choices if each.chosen in known]
    # Not from the combination that was tried, but from what was given.
    made = derived(design.actuator, actuator, "designed")
    return replace(design, changes=(*stock, *design.changes), actuator=made)


def require_designable(
    actuator: Assembly,
    *,
    target: Target,
    free: Sequence[str] | None,
    keep: Sequence[Limit],
    goals: Sequence[Goal],
    spring: str | None,
    settings: DesignSettings,
) -> None:
    """Refuse, without a search, a design whose names do not fit the assembly."""
    names = None if free is None else tuple(free)
    require_once(names or (), [])
    question, movable = Wanted(target, names, tuple(keep), spring, tuple(goals)).question(actuator, settings)
    question.search(movable).require_influence()


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is asked for, whatever the assembly."""

    target: Target
    free: tuple[str, ...] | None
    keep: tuple[Limit, ...]
    spring: str | None
    goals: tuple[Goal, ...]

    def question(self, actuator: Assembly, settings: DesignSettings) -> tuple[Question, tuple[str, ...]]:
        """Return the question for one assembly, and the names of what is free."""
        # The finished design is measured on the assembly as it is declared.
        model = flatten(with_smooth_cables(actuator))
        names = series_cam(model, self.spring)
        defaults = safe_limits(model, names.drive) if settings.defaults is None else settings.defaults
        question = Question(
            machine=actuator,
            model=model,
            cam=with_contour(actuator[names.name], settings.contour),
            drive=names.drive,
            target=self.target,
            keep=with_defaults(self.keep, defaults),
            goals=self.goals,
            settings=settings,
        )
        return question, (names.contour,) if self.free is None else self.free

    def designed(self, actuator: Assembly, settings: DesignSettings) -> CamDesign:
        """Return the design of one assembly."""
        question, free = self.question(actuator, settings)
        search = question.search(free)
        search.require_influence()
        outcomes = SeveralStarts(search).outcomes()
        if not any(outcome.solved for outcome in outcomes):
            # Whether there is any cam at all is found out with softened limits.
            outcomes.append(search.program.solve(feasible_point(search, free)))
        if settings.starts < FIRST_STARTS and not any(outcome.solved for outcome in outcomes):
            # The limits agree, so few starts were unlucky.
            outcomes = SeveralStarts(search, FIRST_STARTS).outcomes()
        solved = [i for i, outcome in enumerate(outcomes) if outcome.solved]
        if not solved:
            raise ConvergenceError(
                "design",
                f"IPOPT stopped with '{outcomes[0].status}' after {outcomes[0].iterations} iterations",
                next_step="widen the narrowest limit, free one number more, or smooth the rubber's law",
            )
        taken = min(solved, key=lambda i: outcomes[i].cost)
        return finished(narrowed(SolvedSearch(actuator, search, free, outcomes, taken, outcomes[taken])))

    def chosen(self, options: Sequence[tuple[str, Assembly]], settings: DesignSettings) -> CamDesign:
        """Return the best design over all combinations of a stock, with what became of the others."""
        hasty = replace(settings, look_for_size_ranges=False, look_for_remedies=False, draws=0)
        hasty = replace(hasty, progress=no_progress)

        # The work in J that a spring must do up to the last angle, or miss by more than the error: that is
        # rms, relative to the largest torque, and takes at most its product with the angle.
        end = self.target.last_angle
        work = float(self.target.energy(end)) - settings.largest_error * self.target.largest * end
        held = settings.defaults is None and not any(isinstance(each, MaximumTravel) for each in self.keep)

        def one(number: int) -> tuple[Alternative, NlsError | None]:
            label, assembly = options[number]
            stored = _stored_at_most(assembly, self.spring, self.free or ()) if held else math.inf
            try:
                if stored < work:
                    raise InfeasibleError(
                        f"coil that stores {stored:.3g} J over its whole travel",
                        f"the torque needs {work:.3g} J",
                        next_step="take one that stores more, or more elements",
                    )
                design = self.designed(assembly, hasty)
            except (InfeasibleError, ConvergenceError) as error:
                # One thickness that does not do is a line of the table; only if none does is it an error.
                return Alternative(label, None, None, False, str(error)), error
            cost = design.starts[design.taken].cost
            reason = "" if design.met else str(design.miss)
            return Alternative(label, cost, design.rms, design.met, reason, design.rubber_volume), None

        table: list[Alternative] = []
        errors: list[NlsError] = []
        for alternative, error in parallel_map(one, len(options)):
            table.append(alternative)
            errors += [] if error is None else [error]
            settings.progress()
        costs = {i: each.cost for i, each in enumerate(table) if each.cost is not None}
        if not costs:
            place = f"none of {len(options)} combinations of the stock does; the first, {table[0].choice}"
            raise errors[0].at(place)
        best = min(costs, key=lambda i: (not table[i].met, costs[i]))
        return replace(self.designed(options[best][1], settings), alternatives=tuple(table))


def _stored_at_most(actuator: Assembly, spring: str | None, free: Sequence[str]) -> float:
    """Return the work in J that coils behind a cam store over their whole travel.

    ``free``: infinite where it holds a number of the coil or the number of elements, and without a coil.
    """
    model = flatten(with_smooth_cables(actuator))
    law = elastic_law(model, spring)
    coil = next((coil for coil in law.cam.coils if coil.name == law.cam.element), None)
    if coil is None or {*law.cam.numbers} & {*free} - {law.cam.pretension}:
        return math.inf
    travel = np.linspace(0.0, model.variable(coil.extension).maximum, _SAMPLES)
    forces = np.array(law.function(travel.reshape(1, -1), law.numbers)[0]).ravel()
    return model.values[law.cam.elements] * float(np.trapezoid(forces, travel))


@dataclass(frozen=True, eq=False)
class SidesDesign:
    """A cam whose two sides were designed, and the assembly that holds it.

    Parameters
    ----------
    actuator
        Copy of the assembly with both contours and the sizes that they share.
    front, back
        The design of either side, as of a cam with two such sides; the angles and torques of the back are
        those of negative angles with both signs turned.
    chosen_by
        The side that chose what both share, ``"front"`` or ``"back"``.
    """

    actuator: Assembly
    front: CamDesign
    back: CamDesign
    chosen_by: str

    @property
    def met(self) -> bool:
        """Whether both sides meet their target."""
        return self.front.met and self.back.met

    def __str__(self) -> str:
        return f"front: {self.front}\nback: {self.back}\nwhat both share was chosen by the {self.chosen_by}"


def design_sides(
    actuator: Assembly,
    *,
    targets: tuple[Target, Target],
    free: Sequence[str | StockChoice] | None = None,
    keep: Sequence[Limit] = (),
    spring: str | None = None,
    goals: Sequence[Goal] = GOALS,
    settings: DesignSettings = USUAL,
) -> SidesDesign:
    """Design both contours of a cam whose sides differ, and what they share, each side by :func:`design_cam`.

    The side that stores more energy chooses what both share (pretension, rubber or coil, anchor), the other
    its contour alone; where one of them then misses, the other way round is tried too. So what they share is
    the best for one side and good enough for the other, not the best for both.

    Parameters
    ----------
    actuator
        Assembly whose cam spring has a :class:`~nlsdesign.components.LopsidedCam`.
    targets
        Torque curve for positive angles, and for negative ones with both signs turned.
    free, keep, spring, goals, settings
        As for :func:`design_cam`; both contours are free as ``<cam>.contour``, and limits hold on both.

    Raises
    ------
    ArrangementError
        If the cam has no two contours.
    InfeasibleError
        If the limits of a side contradict each other, whichever chooses; with the side.
    """
    names = series_cam(flatten(with_smooth_cables(actuator)), spring)
    cam = actuator[names.name]
    work = [float(target.energy(target.last_angle)) for target in targets]
    designs: list[SidesDesign] = []
    errors: list[NlsError] = []
    for first in sorted((0, 1), key=lambda side: -work[side]):
        sides: dict[int, CamDesign] = {}
        machine, released = actuator.with_part(names.name, one_side(cam, back=bool(first))), free
        try:
            for side in (first, 1 - first):
                sides[side] = design_cam(
                    machine, target=targets[side], free=released, keep=keep, spring=spring, goals=goals,
                    settings=settings,
                )  # fmt: skip
                # The other side, on what this one chose.
                machine, released = sides[side].actuator, [names.contour]
                other = one_side(cam, back=side == 0, like=machine[names.name])
                machine = machine.with_part(names.name, other)
        except InfeasibleError as error:
            errors.append(error.at(_NAMES[1 - first if sides else first]))
            continue
        both = sides[0], sides[1]
        made = both_sides(cam, *(side.actuator[names.name] for side in both))
        parts = sides[first].actuator.with_part(names.name, made).parts
        joined = derived(replace(actuator, parts=parts), actuator, "designed")
        designs.append(SidesDesign(joined, *both, _NAMES[first]))
        if designs[-1].met:
            return designs[-1]
    if not designs:
        raise errors[0]
    return min(designs, key=lambda each: max(s.rms / s.target.largest for s in (each.front, each.back)))


_NAMES = ("front", "back")
