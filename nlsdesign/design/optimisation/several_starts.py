"""Starts until the best design has been found twice, each led from well rounded knots to sharper ones.

Knots of a rubber's law make a local optimum wherever one of them meets a node of the contour. With knots
rounded ten times as wide there are few, so each start is solved there first. What it comes to is followed
while the knots become sharper, by searches that keep to the last solution, and once by one that does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...foundation.arrays import Array
from ...foundation.work_sharing import parallel_map
from .design_search import Search
from .problem import DesignProblem
from .program import Program, Solution
from .shape import Start, starts

_BATCH = 6
"""Starts before it is asked whether the best was found twice."""
_ENOUGH = 2
_WIDER = (10.0, 7.5, 5.6, 4.2, 3.2, 2.4, 1.8, 1.35)
"""Roundings of the knots before that of the search, relative to it; with wide steps a knot skips a node."""
SAME_COST = 5e-4
"""Relative difference of the costs of two solutions that count as one design."""
_SAME_SHAPE = 0.03
"""Difference of their free numbers, each scaled to about 1."""


def same_design(problem: DesignProblem, one: Solution, other: Solution) -> bool:
    """Tell whether two solutions are one design, by cost and by sizes and shape."""
    if not (one.solved and other.solved):
        return False
    a, b = (np.array(list(problem.chosen(each.point).values())) for each in (one, other))
    near = abs(one.cost - other.cost) <= SAME_COST * max(abs(one.cost), abs(other.cost))
    return near and bool(np.max(np.abs(a - b)) <= _SAME_SHAPE * max(1.0, float(np.max(np.abs(a)))))


def times_found(problem: DesignProblem, outcomes: Sequence[Solution]) -> int:
    """Return from how many starts the best design was found."""
    solved = [outcome for outcome in outcomes if outcome.solved]
    if not solved:
        return 0
    best = min(solved, key=lambda outcome: outcome.cost)
    return sum(same_design(problem, best, outcome) for outcome in solved)


@dataclass(frozen=True, eq=False)
class SeveralStarts:
    """A search from several starts."""

    search: Search  # that is to be solved

    @cached_property
    def rounded(self) -> Program | None:
        """Its program with the width of rounded knots as a parameter; ``None`` for a law without knots."""
        return self.search.of_any_rounding if self.search.rounding > 0.0 else None

    def outcomes(self) -> list[Solution]:
        """Return where each start came to; the search ends with the starts that found the best again."""
        settings, problem = self.search.question.settings, self.search.problem
        for each in (self.search.program, self.rounded):
            if each is not None:
                each.prepare()
                each.prepare_beside()
        first: list[Solution] = []
        ends: dict[int, Solution] = {}
        outcomes: list[Solution] = []
        while len(outcomes) < len(self._starts):
            batch = range(len(first), min(len(first) + _BATCH, len(self._starts)))
            for solution in self._mapped(self.first, batch):
                first.append(solution)
                settings.progress()
            # What is one design with knots rounded much is led on once.
            same = [
                next((n for n in range(k) if same_design(problem, first[n], first[k])), k)
                for k in range(len(first))
            ]
            new = [number for number in dict.fromkeys(same) if number not in ends]
            led = self._mapped(lambda number: self.end(number, first[number]), new)
            ends |= dict(zip(new, led, strict=True))
            outcomes = [ends[number] for number in same]
            if times_found(problem, outcomes) >= _ENOUGH or not any(o.solved for o in outcomes):
                break
        return outcomes

    @cached_property
    def _starts(self) -> list[Start]:
        settings, problem = self.search.question.settings, self.search.problem
        sizes = [v.name for v in problem.scalars if v.name != problem.law.cam.pretension]
        return list(starts(settings.starts, settings.seed, sizes))

    def _mapped(self, work: Callable[[int], Solution], numbers: Sequence[int]) -> Iterator[Solution]:
        return parallel_map(lambda place: work(numbers[place]), len(numbers))

    def first(self, number: int) -> Solution:
        """Solve with the widest rounding; from each second start the contour first, sizes held."""
        problem, program = self.search.problem, self.search.program
        width: Array | None = None
        if self.rounded is not None:
            program, width = self.rounded, np.array([_WIDER[0] * self.search.rounding])
        point, held = problem.at(self._starts[number]), len(problem.scalars)
        if number % 2 and held and problem.contour is not None:
            lower, upper = program.lower.copy(), program.upper.copy()
            lower[:held] = upper[:held] = np.clip(point[:held], lower[:held], upper[:held])
            outcome = program.solve(point, lower=lower, upper=upper, parameters=width)
            point = outcome.point if outcome.solved else point
        return program.solve(point, parameters=width)

    def end(self, number: int, first: Solution) -> Solution:
        """Lead a first solution to the search's own rounding; the better of two ways."""
        search = self.search
        if self.rounded is None:
            return first
        if not first.solved:
            return search.program.solve(search.problem.at(self._starts[number]))
        last = first
        for wide in _WIDER:
            width = np.array([wide * search.rounding])
            last = self.rounded.solve(last.point, parameters=width, beside=last.multipliers)
        ways = [
            search.program.solve(search.problem.completed(search.problem.chosen(first.point))),
            search.program.solve(last.point, beside=last.multipliers),
        ]
        return min(ways, key=lambda outcome: (not outcome.solved, outcome.cost))
