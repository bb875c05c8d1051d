"""What would bring a design within its target: sizes to free, limits to move, other kinds of spring.

What is tried where neither sizes nor limits help: another kind of cam, more elements, a hollow contour.

Why no design keeps all limits: which are in conflict, how much each would have to give, what to free.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, InfeasibleError, NlsError
from ..statics.declared_cam import as_pair, declared_cam, one_sided, with_roller
from .design_search import Search, row_of, spans_of
from .limits import MaximumCableTension, MinimumRadiusOfCurvature, limits_in_words
from .loosening import FEASIBLE, Freed, Give, Loosened
from .program import PROVED_INFEASIBLE, Program, Rows, Solution
from .shape import starts

_STARTS = 4
_MOST = 1e3
_HOLLOW = 1e-6
"""Radius of curvature below zero, relative to the size of the contour, from which it counts as hollow."""
_SURE = 0.7
"""Share of the allowed error that another spring is asked for: the finished cam adds some between nodes."""
_SHOWS = 0.01
"""Part of the deepest hollow from which a place is named."""


@dataclass(frozen=True)
class OtherSpring:
    """Another spring that was tried with the same free numbers and limits."""

    words: str  # what it is
    machine: Assembly  # the actuator with it, not designed yet
    error: float  # rms torque error in N·m that is then left
    freed: Freed | None = None  # what has to be freed besides
    gives: tuple[Give, ...] = ()  # limits that would have to move besides

    def __str__(self) -> str:
        besides = [] if self.freed is None else [str(self.freed)]
        return ", ".join([f"take {self.words}", *besides, *(give.named for give in self.gives)])


def percent(error: float, largest: float) -> str:
    """Return an rms error relative to the largest torque, as text."""
    return f"{100.0 * error / largest:.2g} % of the largest torque"


def other_springs(
    search: Search, free: Sequence[str], allowed: float | None = None
) -> tuple[OtherSpring, ...]:
    """Return the other springs for which a cam was found within the limits.

    Where none leaves less than the ``allowed`` error, the first that does with sizes freed besides stands
    before them, or else the one that does with limits moved least.
    """
    springs: list[OtherSpring] = []
    designs: list[tuple[Search, list[str], Array]] = []
    for words, machine in _others(search):
        try:
            question = search.question.of(machine)
            kept = [name for name in free if name in question.names]
            other = question.search(kept)
            begin = [other.problem.at(start) for start in starts(_STARTS, 0, [])]
            outcomes = [outcome for outcome in other.program.solve_all(begin) if outcome.solved]
        except NlsError:
            # A limit or a free number of this spring that the other does not have: it is no other way.
            continue
        if outcomes:
            best = min(outcomes, key=lambda outcome: outcome.cost)
            springs.append(OtherSpring(words, machine, other.problem.rms(best.point)))
            designs.append((other, kept, best.point))
    if allowed is None or any(one.error <= allowed for one in springs):
        return tuple(springs)
    sure = _SURE * allowed
    loosened = [Loosened(other, kept, largest_error=sure, best=at) for other, kept, at in designs]
    for spring, loose in zip(springs, loosened, strict=True):
        for freed in loose.sizes_tried().enough[:1]:
            return (replace(spring, error=freed.error, freed=freed), *springs)
    ways = [way for way in map(_with_limits, springs, loosened) if way is not None]
    least = sorted(ways, key=lambda way: sum(give.amount / give.bound.scale for give in way.gives))
    return (*least[:1], *springs)


def _with_limits(spring: OtherSpring, loose: Loosened) -> OtherSpring | None:
    """Return another spring with all sizes freed and limits moved as little as is enough, or ``None``."""
    limits = [i for i in range(len(loose.bounds)) if i != loose.error]
    outcome = loose.least(loose.candidates, limits)
    gives = [loose.give(i, outcome) for i in limits if not _nothing(loose.give(i, outcome))]
    if not outcome.solved or not all(give.sensible for give in gives):
        return None
    freed = loose.freed(loose.candidates, outcome)
    return replace(spring, error=freed.error, freed=freed if freed.names else None, gives=tuple(gives))


def _others(search: Search) -> Iterator[tuple[str, Assembly]]:
    """Yield the other springs in words, with their machines."""
    machine, cam = search.question.machine, search.problem.law.cam
    part = machine[cam.name]
    if search.problem.contour is not None and declared_cam(part).through_centre:
        other = one_sided(part, search.question.target.last_angle)
        words = "a one-sided cam (OneSidedCam), which pulls to one side only"
        yield words, machine.with_part(cam.name, other)
    if search.problem.contour is not None and cam.rolling is None:
        words = "a cam with a roller follower (RollerCam), whose edge may be hollow"
        sizes = search.problem.sizes.arm, search.question.target.last_angle
        yield words, machine.with_part(cam.name, with_roller(part, *sizes))
        words = "two cams that roll on one another (RollingPair), the element between their pivots"
        yield words, machine.with_part(cam.name, as_pair(part, *sizes))
    # Elements share the torque as areas do, but only they share the force of the cable.
    if any(bound.limit == MaximumCableTension.__name__ for bound in search.bounds):
        count = 2 * round(search.question.model.values[cam.elements])
        if count <= 100:
            yield f"{cam.elements} = {count}", machine.with_values({cam.elements: float(count)})


@dataclass(frozen=True)
class Hollow:
    """Where a contour would have to be hollow for all limits to be kept."""

    spans: str  # in words, over the angle
    deepest: float  # least radius of curvature in m, below zero
    freed: Freed | None  # what has to be freed besides; None for nothing
    what: str  # what a hollow contour would do

    def __str__(self) -> str:
        besides = "" if self.freed is None else f" ({self.freed} besides)"
        return (
            f"the contour would have to be hollow {self.spans} (ConvexContour), with radii of curvature "
            f"down to {1e3 * self.deepest:.3g} mm{besides}; {self.what}"
        )


def hollow_contour(loose: Loosened) -> Hollow | None:
    """Return where the contour would have to be hollow, as little as will do; ``None`` where none does.

    All limits are kept but those on its curvature, with what is free, or else with all sizes freed.
    """
    problem = loose.open.problem
    if problem.contour is None or not problem.contour.radii_of_curvature:
        return None
    names = [v.name for v in problem.variables]
    radii = [names.index(v.name) for v in problem.contour.radii_of_curvature]
    hollow = ca.SX.sym("hollow", len(radii))
    kept = [row_of(each) for each in loose.bounds if each.limit != MinimumRadiusOfCurvature.__name__]
    convex = Rows(ca.vertcat(*[problem.variables[i].symbol for i in radii]) + hollow, 0.0, ca.inf)
    for freed in dict.fromkeys(((), loose.candidates)):
        lower, upper = (ends[: loose.count] for ends in loose.box(freed))
        lower[radii] = -upper[radii]
        rows = (*problem.structure, *kept, convex)
        program = Program(problem.vector, lower, upper, ca.sumsqr(hollow), rows)
        program = program.with_unknowns(hollow, _MOST)
        begin = np.append(np.clip(loose.starts[0], lower, upper), np.ones(len(radii)))
        outcome = program.solve(begin)
        rho = problem.evaluate(problem.design.radii_of_curvature, outcome.point[: loose.count])
        where = rho < _SHOWS * min(rho)
        if outcome.solved and min(rho) < -_HOLLOW * problem.sizes.arm:
            angles = problem.evaluate(problem.design.angles, outcome.point[: loose.count])
            also = loose.freed(freed, outcome) if freed else None
            return Hollow(spans_of(angles, where), float(rho.min()), also, problem.contour.hollow)
    return None


def tried_otherwise(loose: Loosened, search: Search, free: Sequence[str]) -> list[str]:
    """Return in words what else keeps limits that contradict each other."""
    largest = search.question.target.largest
    ways = [
        f"{one}: it keeps all limits and leaves {percent(one.error, largest)}"
        for one in other_springs(search, free)
    ]
    hollow = hollow_contour(loose)
    ways = [*([] if hollow is None else [str(hollow)]), *ways]
    sizes = f"all sizes free ({', '.join(loose.candidates)})" if loose.candidates else "no size left to free"
    return ways or [f"nothing that was tried keeps them: {sizes}, another kind of cam, a hollow contour"]


_LESS = 0.98
"""Share of the error that a name leaves from which freeing it counts as of no use."""


@dataclass(frozen=True)
class Remedies:
    """What was tried against a miss; each entry was solved for, not estimated."""

    enough: tuple[Freed, ...]  # smallest sets of names that, freed, bring the error within what is allowed
    better: tuple[Freed, ...]  # single names that, freed, lower the error, best first
    # gives: limits that would have to move, each with what has to be freed as well (nothing, for the first
    # kind)
    gives: tuple[tuple[Give, Freed | None], ...]
    everything: Freed | None  # error with all sizes free at once
    # others: other springs that were tried, where neither sizes nor one limit are enough
    others: tuple[OtherSpring, ...] = ()
    # hollow: where the contour would have to be hollow; None where that is not enough either, or was not
    # asked
    hollow: Hollow | None = None

    def sentences(self, largest: float, allowed: float) -> list[str]:
        """Return the advice as sentences; ``allowed``: the largest rms error in N·m."""
        sentences = [f"{freed}: {percent(freed.error, largest)}" for freed in self.enough]
        for give, also in self.gives:
            sentences.append(give.named + ("" if also is None else f", and {also}"))
        others = [f"{one}: {percent(one.error, largest)}" for one in self.others if one.error <= allowed]
        if others and self.hollow is not None:
            sentences.append(str(self.hollow))
        sentences += others
        if sentences:
            return sentences
        tried = []
        if self.everything is not None:
            names, left = ", ".join(self.everything.names), percent(self.everything.error, largest)
            tried.append(f"with all sizes free ({names}) {left} is left")
        tried += [f"with {one.words} {percent(one.error, largest)} is left" for one in self.others]
        tried += [] if self.hollow is not None else ["no hollow contour was found that is enough"]
        none = (
            "no size is left to free" if self.everything is None else "no size and no single limit is enough"
        )
        return ["; ".join([none, *tried]), *([] if self.hollow is None else [str(self.hollow)])]


def find_remedies(
    search: Search, free: Sequence[str], best: Array, *, allowed: float, error: float, binding: Sequence[int]
) -> Remedies:
    """Return what would bring a design within its target.

    ``binding``: numbers of the limits that the design sits on, among those of the search.
    """
    loose = Loosened(search, free, largest_error=allowed, best=best)
    tried = loose.sizes_tried()
    better = sorted((one for one in tried.better if one.error < _LESS * error), key=lambda one: one.error)
    all_free = tried.everything
    everything = None
    if all_free is not None and all_free.solved:
        everything = loose.freed(loose.candidates, all_free)
    gives = () if tried.enough else _gives(loose, binding)
    # A limit that need not give shows that freeing all sizes is enough after all.
    enough = tried.enough + tuple(also for give, also in gives if also is not None and _nothing(give))[:1]
    gives = tuple((give, also) for give, also in gives if not _nothing(give))
    if enough or gives:
        return Remedies(enough, tuple(better), gives, everything)
    others = other_springs(search, free, allowed)
    return Remedies((), tuple(better), (), everything, others, hollow_contour(loose))


def _nothing(give: Give) -> bool:
    return give.amount <= 1e-4 * give.bound.scale


def _gives(loose: Loosened, binding: Sequence[int]) -> tuple[tuple[Give, Freed | None], ...]:
    """Return limits that are enough alone, or else together with all sizes freed."""
    for names in ((), loose.candidates):
        answers = loose.several([(names, [i]) for i in binding])
        kept = [
            (loose.give(i, outcome), loose.freed(names, outcome) if names else None)
            for i, outcome in zip(binding, answers, strict=True)
            if outcome.solved and loose.give(i, outcome).sensible
        ]
        if kept:
            return tuple(kept)
    return ()


_INVOLVED = 1e-3
"""Price, in give of the whole per give of this limit, from which a limit counts as part of the conflict."""


def feasible_point(search: Search, free: Sequence[str]) -> Array:
    """Return unknowns that keep all limits, or say why there are none.

    Every limit gets a slack, and the sum of the slacks, each relative to the size of its limit, is made as
    small as possible. Where it does not vanish, each limit that has a price is relaxed alone, and each number
    that is held is freed alone.
    """
    loose = Loosened(search, free, largest_error=None, best=None)
    best = loose.least((), loose.every)
    if not best.solved:
        raise ConvergenceError(
            "design: search for a cam within the limits", "IPOPT found neither a cam nor a proof against it",
            next_step="leave out limits one by one, or start from a deck that is closer to the target",
        )  # fmt: skip
    if loose.kept(best):
        return search.problem.completed(loose.open.problem.chosen(best.point))
    prices = best.prices[len(loose.open.problem.structure) :]
    bounds, involved = loose.bounds, [i for i, price in enumerate(prices) if price > _INVOLVED]
    raise InfeasibleError(
        "limits of " + ", ".join(limits_in_words((bounds[i].limit, bounds[i].of) for i in involved)),
        "contradict each other" if len(involved) > 1 else "cannot be kept with what is free",
        next_step="; ".join(what_would_help(loose, best, involved, search, free)),
    )


def what_would_help(
    loose: Loosened, best: Solution, involved: Sequence[int], search: Search, free: Sequence[str]
) -> list[str]:
    """Return in words how much limits would have to give, which sizes to free, and what else was tried."""
    start = best.point[: loose.count]
    alone = loose.several([((), [i]) for i in involved], start)
    gives = [loose.give(i, outcome) for i, outcome in zip(involved, alone, strict=True) if outcome.solved]
    failed = {loose.bounds[i].of: o for i, o in zip(involved, alone, strict=True) if not o.solved}
    undecided = [limit for limit, outcome in failed.items() if outcome.status != PROVED_INFEASIBLE]
    hopeless = [limit for limit in failed if limit not in undecided]
    tried = loose.sizes_tried(start)
    largest = search.question.target.largest
    together = [give for give in (loose.give(i, best) for i in involved) if give.amount > 0.0]
    sensible = [give for give in gives if give.sensible]
    no_use = dict.fromkeys([*hopeless, *(give.bound.of for give in gives if not give.sensible)])
    sentences = []
    if sensible:
        sentences.append("one of these is enough: " + "; or ".join(str(give) for give in sensible))
    elif together and all(give.sensible for give in together):
        needed = [give for give in together if give.amount > FEASIBLE * give.bound.scale]
        sentences.append("no single one is enough; together: " + "; and ".join(str(give) for give in needed))
    if tried.enough:
        cures = [f"{cure}, which leaves {percent(cure.error, largest)}" for cure in tried.enough]
        sentences.append("enough without any give: " + "; or ".join(cures))
    if no_use and sentences:
        sentences.append("no give of " + " or ".join(no_use) + " alone is enough, or none that makes sense")
    if undecided:
        listed = " or ".join(undecided)
        sentences.append(f"whether a give of {listed} alone is enough the solver could not decide")
    return sentences if sensible or tried.enough else [*sentences, *tried_otherwise(loose, search, free)]
