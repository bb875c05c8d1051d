"""Why no design keeps all limits: which are in conflict, how much each would have to give, what to free.

One program answers all such questions. Every number that a designer could free is a variable of it, every
limit has a slack relative to its size, and the torque error is one more limit. A question is which numbers
may move and which slacks may open; the rest is held by the bounds of the variables. What is made small is the
sum of the slacks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, InfeasibleError
from ...foundation.quantity import parse_unit, with_unit
from ...foundation.work_sharing import parallel_map
from .defaults import BREAKS
from .design_search import Search, carried_over, row_of
from .limits import Bound, MaximumTorqueError
from .problem import contour_names
from .program import PROVED_INFEASIBLE, DesignVariable, Program, Solution, scaled
from .shape import starts

FEASIBLE = 1e-6
"""Relative give below which a limit counts as kept."""
_MOST = 1e3
_MOST_RAISED = 10.0
"""Beyond this factor a give is no advice but another design."""
_RANGE = 4.0
"""By what factor a size that is freed may leave its present value, either way."""


def _outwards(value: float, upper: bool) -> float:
    """Return a number rounded to four digits on the side where the limit is wider."""
    if value == 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 3)
    # The margin covers what the solver leaves open.
    return step * (math.ceil(value / step * (1 + 1e-5)) if upper else math.floor(value / step * (1 - 1e-5)))


@dataclass(frozen=True)
class Give:
    """How far one limit would have to move for all others to be kept."""

    bound: Bound
    amount: float

    @property
    def moved(self) -> float:
        """Where the limit would have to be, in SI."""
        return self.bound.value + (self.amount if self.bound.upper else -self.amount)

    @property
    def sensible(self) -> bool:
        """Whether a designer could consider it: within ten times, and within what rubber can stretch."""
        if self.bound.value == 0.0 or (self.bound.unit == "1" and self.moved > BREAKS):
            return False
        ratio = self.moved / self.bound.value
        return ratio <= _MOST_RAISED if self.bound.upper else ratio >= 1.0 / _MOST_RAISED

    def __str__(self) -> str:
        amount, end = self.bound.shown(self.amount), self.bound.shown(_outwards(self.moved, self.bound.upper))
        return f"{self.bound} would have to give by {amount} (to {end})"


@dataclass(frozen=True)
class Freed:
    """Numbers that are held now, and where they go when they are freed.

    Parameters
    ----------
    names
        Full names.
    values
        In SI.
    units
        In which each is shown.
    error
        Rms torque error in N·m that is then left; ``None`` where it was not asked.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    units: tuple[str, ...]
    error: float | None = None

    def __str__(self) -> str:
        shown = [
            f"{name} (to {with_unit(f'{value / parse_unit(unit).factor:.4g}', unit)})"
            for name, value, unit in zip(self.names, self.values, self.units, strict=True)
        ]
        return "free " + " and ".join(shown)


class Loosened:
    """The program of all that could give.

    Parameters
    ----------
    search
        The search that failed or missed.
    free
        What was free in it.
    largest_error
        Rms torque error in N·m that is asked for; ``None`` if the error does not matter.
    best
        Where the search came to.
    """

    def __init__(
        self, search: Search, free: Sequence[str], *, largest_error: float | None, best: Array | None
    ) -> None:
        # The names that a designer could free besides: sizes, not the material.
        cam = search.problem.law.cam
        sizes = [cam.pretension]
        for piece in cam.specimens:
            sizes += [*piece.section, piece.rest_length]
        if cam.anchor_distance is not None and any(name in free for name in contour_names(cam)):
            sizes.append(cam.anchor_distance)
        self.free = tuple(free)
        self.candidates = tuple(dict.fromkeys(name for name in sizes if name not in free))
        self.open = search.question.search([*free, *self.candidates], search.rounding)
        bounds = self.open.bounds
        if largest_error is not None:
            bounds += tuple(MaximumTorqueError(largest_error).bounds(self.open.problem.design))
        self.bounds, self.error = bounds, None if largest_error is None else len(bounds) - 1
        self.count = len(self.open.problem.variables)
        pretension = [self.open.problem.at(start) for start in starts(2, 0, [])]
        self.starts = pretension if best is None else [carried_over(search, best, self.open)]

    @cached_property
    def program(self) -> Program:
        """The program; its unknowns are those of the open search, then the slacks."""
        problem, slacks = self.open.problem, ca.SX.sym("slack", len(self.bounds))
        rows = [row_of(bound, slacks[i]) for i, bound in enumerate(self.bounds)]
        program = Program(
            problem.vector,
            np.array([u.lower for u in problem.variables]),
            np.array([u.upper for u in problem.variables]),
            ca.sum1(slacks),
            (*problem.structure, *rows),
        )
        return program.with_unknowns(slacks, 0.0, _MOST)

    def least(self, names: Sequence[str], slacks: Sequence[int], start: Array | None = None) -> Solution:
        """Return where the sum of some slacks is least; the solution says whether it is one.

        ``names``: candidates that may move; the others stay as declared.
        """
        lower, upper = self._box(names)
        allowed = np.isin(np.arange(len(self.bounds)), slacks)
        upper[self.count :] = np.where(allowed, _MOST, 0.0)
        outcomes: list[Solution] = []
        for point in self.starts if start is None else [start, *self.starts]:
            begin = np.append(np.clip(point, lower[: self.count], upper[: self.count]), allowed.astype(float))
            outcomes.append(self.program.solve(begin, lower=lower, upper=upper))
            if outcomes[-1].solved and outcomes[-1].cost <= FEASIBLE:
                break
        return min(outcomes, key=lambda outcome: (not outcome.solved, outcome.cost))

    def several(
        self, questions: Sequence[tuple[Sequence[str], Sequence[int]]], start: Array | None = None
    ) -> list[Solution]:
        """Return the answers to several questions, side by side on the cores."""
        self.program.prepare()
        return list(parallel_map(lambda k: self.least(*questions[k], start), len(questions)))

    def designed(self, names: Sequence[str], outcome: Solution) -> Freed:
        """Return freed numbers at the best design with them, found from a solution of :meth:`least`.

        ``outcome``: with them freed; where no better design is found from there, its own values count.
        """
        lower, upper = self._box(names)
        point = outcome.point[: self.count]
        better = self.open.program.solve(point, lower=lower[: self.count], upper=upper[: self.count])
        freed = self.freed(names, better if better.solved else outcome)
        return freed if better.solved and freed.error is not None else self.freed(names, outcome)

    def freed(self, names: Sequence[str], outcome: Solution) -> Freed:
        """Return freed numbers with their values at a solution."""
        values = self.open.problem.named(outcome.point[: self.count])
        shown = tuple(self.open.problem.design.shown_units[name] for name in names)
        error = None
        if self.error is not None:
            mean_square = self.open.problem.design.mean_square_error
            error = float(np.sqrt(self.open.problem.evaluate(mean_square, outcome.point[: self.count])[0]))
        return Freed(tuple(names), tuple(values[name] for name in names), shown, error)

    def give(self, index: int, outcome: Solution) -> Give:
        """Return how far a limit gives at a solution."""
        return Give(self.bounds[index], float(outcome.point[self.count + index]) * self.bounds[index].scale)

    def _box(self, names: Sequence[str]) -> tuple[Array, Array]:
        """Return the bounds of all unknowns with these candidates freed and the others held."""
        lower, upper = self.program.lower.copy(), self.program.upper.copy()
        for i, variable in enumerate(self.open.problem.variables):
            if variable.name in self.candidates:
                lower[i], upper[i] = (
                    self._range(variable) if variable.name in names else (variable.start, variable.start)
                )
        return lower, upper

    def _range(self, variable: DesignVariable) -> tuple[float, float]:
        """Return the scaled range of a freed number, within a factor of its present value."""
        model, cam = self.open.question.model, self.open.problem.law.cam
        now = model.variable(variable.name).start
        if variable.name == cam.pretension:
            lengths = [model.values[piece.rest_length] for piece in cam.specimens]
            return scaled(variable, 0.0), scaled(variable, max([now, *lengths]))
        return scaled(variable, now / _RANGE), scaled(variable, now * _RANGE)


_ENOUGH = 1.0 + 1e-3


@dataclass(frozen=True)
class Remedies:
    """What was tried against a miss; each entry was solved for, not estimated.

    Parameters
    ----------
    enough
        Smallest sets of names that, freed, bring the error within what is allowed.
    better
        Single names that, freed, lower the error, best first.
    gives
        Limits that would have to move, each with what has to be freed as well (nothing, for the first kind).
    everything
        Error with all sizes free at once.
    """

    enough: tuple[Freed, ...]
    better: tuple[Freed, ...]
    gives: tuple[tuple[Give, Freed | None], ...]
    everything: Freed | None

    def sentences(self, largest: float) -> list[str]:
        """Return the advice as sentences."""
        sentences = [f"{freed}: {_percent(freed.error, largest)}" for freed in self.enough]
        for give, also in self.gives:
            sentences.append(f"{give}" + ("" if also is None else f", and {also}"))
        if sentences:
            return sentences
        if self.everything is not None and self.everything.error is not None:
            sentences.append(
                f"no size and no single limit is enough; with all sizes free "
                f"({', '.join(self.everything.names)}) {_percent(self.everything.error, largest)} is left: "
                "ask for another target, more elements or another rubber"
            )
        else:
            sentences.append(
                "no size is left to free: ask for another target, more elements or another rubber"
            )
        return sentences


def _percent(error: float | None, largest: float) -> str:
    return "" if error is None else f"{100.0 * error / largest:.2g} % of the largest torque"


def find_remedies(
    search: Search, free: Sequence[str], best: Array, *, allowed: float, error: float, binding: Sequence[int]
) -> Remedies:
    """Return what would bring a design within its target."""
    loose = Loosened(search, free, largest_error=allowed, best=best)
    assert loose.error is not None
    outcomes = loose.several([([name], [loose.error]) for name in loose.candidates])
    singles = [
        loose.freed([name], outcome)
        for name, outcome in zip(loose.candidates, outcomes, strict=True)
        if outcome.solved
    ]
    better = sorted((one for one in singles if _error(one) < 0.98 * error), key=_error)
    enough = [
        loose.designed([name], outcome)
        for name, outcome in zip(loose.candidates, outcomes, strict=True)
        if outcome.solved and _error(loose.freed([name], outcome)) <= _ENOUGH * allowed
    ]
    everything = None
    if loose.candidates and not enough:
        everything = _freed(loose, loose.candidates)
        if everything is not None and _error(everything) <= _ENOUGH * allowed:
            enough = [_smallest(loose, [one.names[0] for one in better], allowed) or everything]
    gives = () if enough else _gives(loose, binding)
    # A limit that need not give shows that freeing all sizes is enough after all.
    enough += [also for give, also in gives if also is not None and _nothing(give)][:1]
    gives = tuple((give, also) for give, also in gives if not _nothing(give))
    return Remedies(tuple(enough), tuple(better), gives, everything)


def _nothing(give: Give) -> bool:
    return give.amount <= 1e-4 * give.bound.scale


def _error(freed: Freed) -> float:
    return float("inf") if freed.error is None else freed.error


def _freed(loose: Loosened, names: Sequence[str]) -> Freed | None:
    assert loose.error is not None
    outcome = loose.least(names, [loose.error])
    return None if not outcome.solved else loose.freed(names, outcome)


def _smallest(loose: Loosened, ranked: Sequence[str], allowed: float) -> Freed | None:
    """Return the first of the best two, best three, ... names that is enough."""
    for count in range(2, len(ranked) + 1):
        kept = _freed(loose, ranked[:count])
        if kept is not None and _error(kept) <= _ENOUGH * allowed:
            return kept
    return None


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
    every = range(len(loose.bounds))
    best = loose.least((), every)
    if not best.solved:
        raise ConvergenceError(
            "design: search for a cam within the limits", "IPOPT found neither a cam nor a proof against it",
            next_step="leave out limits one by one, or start from a deck that is closer to the target",
        )  # fmt: skip
    if best.cost <= FEASIBLE * len(loose.bounds):
        return search.problem.completed(loose.open.problem.chosen(best.point))
    prices = best.prices[len(loose.open.problem.structure) :]
    involved = [i for i, price in enumerate(prices) if price > _INVOLVED]
    start = best.point[: loose.count]
    alone = loose.several([((), [i]) for i in involved], start)
    names = loose.several([([name], every) for name in loose.candidates], start)
    gives = [loose.give(i, outcome) for i, outcome in zip(involved, alone, strict=True) if outcome.solved]
    failed = {loose.bounds[i].limit: outcome for i, outcome in zip(involved, alone, strict=True)}
    failed = {limit: outcome for limit, outcome in failed.items() if not outcome.solved}
    undecided = [limit for limit, outcome in failed.items() if outcome.status != PROVED_INFEASIBLE]
    hopeless = [limit for limit in failed if limit not in undecided]
    cures = [
        loose.freed([name], outcome)
        for name, outcome in zip(loose.candidates, names, strict=True)
        if outcome.solved and outcome.cost <= FEASIBLE * len(loose.bounds)
    ]
    together = [give for give in (loose.give(i, best) for i in involved) if give.amount > 0.0]
    sensible = [give for give in gives if give.sensible]
    no_use = [*hopeless, *names_of(give.bound for give in gives if not give.sensible)]
    sentences = []
    if sensible:
        sentences.append("one of these is enough: " + "; or ".join(str(give) for give in sensible))
    elif together and all(give.sensible for give in together):
        needed = [give for give in together if give.amount > FEASIBLE * give.bound.scale]
        sentences.append("no single one is enough; together: " + "; and ".join(str(give) for give in needed))
    if cures:
        sentences.append("enough without any give: " + "; or ".join(str(cure) for cure in cures))
    if no_use and sentences:
        sentences.append("no give of " + " or ".join(no_use) + " alone is enough, or none that makes sense")
    if undecided:
        listed = " or ".join(undecided)
        sentences.append(f"whether a give of {listed} alone is enough the solver could not decide")
    if not (sensible or cures):
        sentences.append("ask for a smaller torque or angle, more elements or another rubber")
    raise InfeasibleError(
        "limits " + ", ".join(names_of(loose.bounds[i] for i in involved)),
        "contradict each other" if len(involved) > 1 else "cannot be kept with what is free",
        next_step="; ".join(sentences),
    )


def names_of(bounds: Iterable[Bound]) -> list[str]:
    """Return the names of the limits of some bounds, each once."""
    return list(dict.fromkeys(bound.limit for bound in bounds))
