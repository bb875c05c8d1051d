"""The program of all that could give: it answers what a miss and a conflict of limits ask.

Every number that a designer could free is a variable of it, every limit has a slack relative to its size, and
the torque error is one more limit. A question is which numbers may move and which slacks may open; the rest
is held by the bounds of the variables. What is made small is the sum of the slacks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.work_sharing import parallel_map
from ..curves.numbers import in_unit
from .defaults import BREAKS
from .design_search import Search, carried_over, row_of
from .limits import Bound, MaximumTorqueError
from .program import DesignVariable, Program, Solution, scaled
from .shape import starts

FEASIBLE = 1e-6
"""Relative give below which a limit counts as kept."""
_MOST = 1e3
_MOST_RAISED = 10.0
"""Beyond this factor a give is no advice but another design."""
_RANGE = 4.0
"""By what factor a size that is freed may leave its present value, either way."""
_SHOWS = 1e-3
"""Excess of the torque error, relative to what is allowed, from which it counts."""


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
        if self.bound.value == 0.0 or (self.bound.unit in ("1", "%") and self.moved > BREAKS):
            return False
        ratio = self.moved / self.bound.value
        return ratio <= _MOST_RAISED if self.bound.upper else ratio >= 1.0 / _MOST_RAISED

    @property
    def named(self) -> str:
        """How far, with the name of the limit: for who was not told it yet."""
        return f"{self} ({self.bound.limit})"

    def __str__(self) -> str:
        bound = self.bound
        moved = bound.read(self.moved)
        amount = in_unit(abs(moved - bound.read(bound.value)), bound.unit)
        end = in_unit(_outwards(moved, bound.at_most), bound.unit)
        return f"{bound} would have to give by {amount} (to {end})"


@dataclass(frozen=True)
class Freed:
    """Numbers that are held now, and where they go when they are freed."""

    names: tuple[str, ...]  # full names
    values: tuple[float, ...]  # in SI
    units: tuple[str, ...]  # in which each is shown
    error: float  # rms torque error in N·m that is then left

    def __str__(self) -> str:
        shown = [
            f"{name} (to {in_unit(value, unit)})"
            for name, value, unit in zip(self.names, self.values, self.units, strict=True)
        ]
        return "free " + " and ".join(shown)


@dataclass(frozen=True)
class SizesTried:
    """What freeing sizes came to."""

    enough: tuple[Freed, ...]  # single names that are enough alone, or else the smallest set that was found
    # better: single names with the error that is then left, where the solver came to a solution
    better: tuple[Freed, ...]
    # everything: all sizes freed at once; None where one alone is enough, or none is left to free
    everything: Solution | None


class Loosened:
    """The program of all that could give.

    ``search``: the search that failed or missed. ``largest_error``: rms torque error in N·m that is asked
    for; ``None`` if the error does not matter.
    """

    def __init__(
        self, search: Search, free: Sequence[str], *, largest_error: float | None, best: Array | None
    ) -> None:
        # The names that a designer could free besides: sizes, not the material.
        cam = search.problem.law.cam
        held = cam.anchor_distance if search.problem.contour is None else None
        self.free = tuple(free)
        self.candidates = tuple(name for name in cam.sizes if name not in (*free, held))
        self.open = search.question.search([*free, *self.candidates], search.rounding)
        pretension = [self.open.problem.at(start) for start in starts(2, 0, [])]
        self.starts = pretension if best is None else [carried_over(search, best, self.open)]
        bounds = self.open.bounds
        if largest_error is not None:
            bounds += tuple(MaximumTorqueError(largest_error).bounds(self.open.problem.design))
        self.bounds, self.error = bounds, None if largest_error is None else len(bounds) - 1
        self.count = len(self.open.problem.variables)
        self.every = tuple(range(len(bounds))) if self.error is None else (self.error,)

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
        return program.with_unknowns(slacks, _MOST)

    def least(self, names: Sequence[str], slacks: Sequence[int], start: Array | None = None) -> Solution:
        """Return where the sum of some slacks is least; the solution says whether it is one.

        ``names``: candidates that may move; the others stay as declared.
        """
        lower, upper = self.box(names)
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

    def kept(self, outcome: Solution) -> bool:
        """Tell whether nothing has to give at a solution: no limit, or no more of the error than shows."""
        enough = FEASIBLE * len(self.bounds) if self.error is None else _SHOWS
        return outcome.solved and outcome.cost <= enough

    def sizes_tried(self, start: Array | None = None) -> SizesTried:
        """Free each size alone; where none is enough, all of them, and then as few as are enough."""
        outcomes = self.several([([name], self.every) for name in self.candidates], start)
        solved = {n: o for n, o in zip(self.candidates, outcomes, strict=True) if o.solved}
        better = tuple(self.freed([name], outcome) for name, outcome in solved.items())
        alone = tuple(
            self.designed([name], outcome) for name, outcome in solved.items() if self.kept(outcome)
        )
        if alone or not self.candidates:
            return SizesTried(alone, better, None)
        everything = self.least(self.candidates, self.every, start)
        if not self.kept(everything):
            return SizesTried((), better, everything)
        ranked = sorted(self.candidates, key=lambda name: solved[name].cost if name in solved else math.inf)
        return SizesTried((self.smallest(ranked, everything, start),), better, everything)

    def smallest(self, ranked: Sequence[str], everything: Solution, start: Array | None) -> Freed:
        """Return the first of the best two, best three, ... names that are enough, without idle ones."""
        names, outcome = list(ranked), everything
        for count in range(2, len(ranked)):
            tried = self.least(ranked[:count], self.every, start)
            if self.kept(tried):
                names, outcome = list(ranked[:count]), tried
                break
        for name in tuple(names) if len(names) > 2 else ():
            without = [each for each in names if each != name]
            tried = self.least(without, self.every, start)
            if self.kept(tried):
                names, outcome = without, tried
        return self.designed(names, outcome)

    def designed(self, names: Sequence[str], outcome: Solution) -> Freed:
        """Return freed numbers at the best design with them, found from a solution of :meth:`least`.

        ``outcome``: with them freed; where no better design is found from there, its own values count.
        """
        lower, upper = self.box(names)
        point = outcome.point[: self.count]
        better = self.open.program.solve(point, lower=lower[: self.count], upper=upper[: self.count])
        return self.freed(names, better if better.solved else outcome)

    def freed(self, names: Sequence[str], outcome: Solution) -> Freed:
        """Return freed numbers with their values at a solution."""
        point = outcome.point[: self.count]
        values = self.open.problem.named(point)
        shown = tuple(self.open.problem.design.shown_units[name] for name in names)
        return Freed(tuple(names), tuple(values[name] for name in names), shown, self.open.problem.rms(point))

    def give(self, index: int, outcome: Solution) -> Give:
        """Return how far a limit gives at a solution."""
        return Give(self.bounds[index], float(outcome.point[self.count + index]) * self.bounds[index].scale)

    def box(self, names: Sequence[str]) -> tuple[Array, Array]:
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
            lengths = [model.values[name] for name in cam.lengths]
            return scaled(variable, 0.0), scaled(variable, max([now, *lengths]))
        return scaled(variable, now / _RANGE), scaled(variable, now * _RANGE)
