"""One design problem with its limits and goals, solved from several starts.

Starts until the best design has been found twice, each led from well rounded knots to sharper ones.

Knots of a rubber's law make a local optimum wherever one of them meets a node of the contour. With knots
rounded ten times as wide there are few, so each start is solved there first. What it comes to is followed
while the knots become sharper, by searches that keep to the last solution, and once by one that does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array, Mask
from ...foundation.errors import ValueRangeError
from ...foundation.symbolic import Expression
from ...foundation.work_sharing import parallel_map
from ...model import FlatModel, flatten
from ...model.roles import series_cam
from ..curves.target import Target
from ..statics.equilibrium import elastic_law, has_corners, with_smooth_cables
from .defaults import DesignSettings, safe_limits, with_defaults
from .goals import Goal
from .limits import Bound, Limit, MinimumRadiusOfCurvature
from .problem import DesignProblem, contour_names, design_problem, movable_numbers
from .program import Program, Rows, Solution
from .shape import Start, starts

_ROUNDING = 0.003
"""Width over which the knots of a rubber's law are rounded at first, relative to its stretch."""
_FINER = 0.1
"""By what the rounding is narrowed where the sharp law does not keep what the rounded one promised."""
_NO_INFLUENCE = 1e-12
"""Change of any goal or limit, each relative to its scale, per change of a number by its own size."""
ANCHOR = "AnchorClearance"
"""Name of what the rows with words hold: the cam stays clear of the anchor of its cable."""


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked for, apart from what is free."""

    machine: Assembly  # the actuator as it is declared
    model: FlatModel  # it, flattened with smooth cables
    cam: object  # its declared cam
    drive: str  # path of the part that holds the cam
    target: Target  # torque curve
    keep: tuple[Limit, ...]  # all limits, defaults included
    goals: tuple[Goal, ...]  # what is made small, as a sum
    settings: DesignSettings  # how the search is carried out

    def search(self, free: Sequence[str], rounding: float | None = None) -> Search:
        """Return the search in which these numbers may change.

        ``rounding``: width of rounded knots relative to the stretch; by itself if it is left out.
        """
        if rounding is None:
            rounding = _ROUNDING if self._has_knots else 0.0
        problem = design_problem(
            self.model, self.cam, target=self.target, free=free, spring=self.drive, rounding=rounding
        )
        return Search(self, problem, rounding)

    def of(self, machine: Assembly) -> Question:
        """Return the same question for another machine; the contour of its cam is not known."""
        model = flatten(with_smooth_cables(machine))
        names = series_cam(model, self.drive)
        defaults = self.settings.defaults
        others = safe_limits(model, names.drive) if defaults is None else defaults
        keep = with_defaults(self.keep, others)
        return replace(self, machine=machine, model=model, cam=machine[names.name], keep=keep)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All names that may be free."""
        cam = series_cam(self.model, self.drive)
        return (*contour_names(cam), *movable_numbers(self.model, cam))

    @cached_property
    def _has_knots(self) -> bool:
        return has_corners(elastic_law(self.model, self.drive).function)

    def finer(self, rounding: float) -> float | None:
        """Return a narrower rounding to go on with, or None where knots are not rounded."""
        return _FINER * rounding if rounding > 0.0 else None


@dataclass(frozen=True, eq=False)
class Search:
    """A design problem as a program."""

    question: Question
    problem: DesignProblem
    rounding: float

    @cached_property
    def bounds(self) -> tuple[Bound, ...]:
        """All limits."""
        return tuple(bound for limit in self.question.keep for bound in limit.bounds(self.problem.design))

    @cached_property
    def structural(self) -> tuple[Bound, ...]:
        """What holds a designed contour besides the limits: a taut cable lies on it and pulls.

        Where a least radius of curvature above zero is kept, convexity is no limit of its own.
        """
        problem = self.problem
        if problem.contour is None:
            return ()
        curved = any(b.limit == MinimumRadiusOfCurvature.__name__ and b.value > 0.0 for b in self.bounds)
        bounds = problem.contour.held(problem.design, problem.sizes.arm, curved=curved)
        for each in problem.structure:
            if each.words:
                upper = bool(np.isfinite(each.upper))
                end = each.upper if upper else each.lower
                bounds.append(Bound(ANCHOR, each.words, each.expression, end, upper, "1", 1.0))
        return tuple(bounds)

    @cached_property
    def cost(self) -> Expression:
        """Sum of the goals."""
        return sum((goal.cost(self.problem.design) for goal in self.question.goals), start=ca.SX(0))

    @cached_property
    def program(self) -> Program:
        """The nonlinear program."""
        problem = self.problem
        return Program(
            problem.vector,
            np.array([v.lower for v in problem.variables]),
            np.array([v.upper for v in problem.variables]),
            self.cost,
            (*problem.structure, *(row_of(bound) for bound in self.bounds)),
        )

    @cached_property
    def of_any_rounding(self) -> Program:
        """The program with the width of rounded knots as a parameter."""
        question, names = self.question, [v.name for v in self.problem.scalars]
        shape = (self.problem.law.cam.contour,) if self.problem.contour is not None else ()
        width = ca.SX.sym("rounding")
        problem = design_problem(
            question.model, question.cam, target=question.target, free=[*shape, *names],
            spring=question.drive, rounding=(self.rounding, width),
        )  # fmt: skip
        return replace(Search(question, problem, self.rounding).program, parameters=width)

    def require_influence(self) -> None:
        """Refuse numbers that change neither a goal nor a limit."""
        problem = self.problem
        if not problem.scalars:
            return
        rows = [*problem.structure, *(row_of(bound) for bound in self.bounds)]
        effects = ca.vertcat(self.cost, *[row.expression for row in rows])
        symbols = ca.vertcat(*[v.symbol for v in problem.scalars])
        slopes = ca.Function("slopes", [problem.vector], [ca.jacobian(effects, symbols)])
        largest = np.zeros(len(problem.scalars))
        for start in starts(3, 0, []):
            sizes = np.abs(np.array(slopes(problem.at(start)), dtype=float))
            largest = np.maximum(largest, np.nan_to_num(sizes, nan=1.0, posinf=1.0).max(axis=0))
        idle = [v.name for v, size in zip(problem.scalars, largest, strict=True) if size < _NO_INFLUENCE]
        if idle:
            movable = movable_numbers(self.question.model, problem.law.cam)
            behind = f"{problem.law.cam.drive}."
            others = [name for name in movable if name not in idle and name.startswith(behind)]
            raise ValueRangeError(
                "free: " + ", ".join(f"'{name}'" for name in idle),
                "changes neither a goal nor a limit of this design, so any value of it would do",
                next_step="leave it out, or ask for a goal or limit that depends on it; what may change: "
                + ", ".join(others),
            )


_SPANS = 3
"""Ranges of the angle that are listed; of more their number is said."""


def spans_of(angles: Array, where: Mask) -> str:
    """Return the ranges of the angle in which something holds, in words; a single node between two counts."""
    padded = np.concatenate([[False], where, [False]])
    padded[1:-1] |= padded[:-2] & padded[2:]
    edges = np.flatnonzero(np.diff(padded.astype(int)))
    words = []
    for first, behind in zip(edges[::2], edges[1::2], strict=True):
        low, high = (f"{np.degrees(angles[i]):.3g}" for i in (first, behind - 1))
        words.append(f"at {low}°" if low == high else f"from {low}° to {high}°")
    if len(words) > _SPANS:
        low, high = (f"{np.degrees(angles[i]):.3g}" for i in (edges[0], edges[-1] - 1))
        return f"in {len(words)} places from {low}° to {high}°"
    return " and ".join(words)


def row_of(bound: Bound, slack: Expression | float = 0.0) -> Rows:
    """Return a bound as rows of a program, softened by a slack."""
    distance = (bound.expression - bound.value) / bound.scale
    return Rows(distance - slack, -ca.inf, 0.0) if bound.upper else Rows(distance + slack, 0.0, ca.inf)


def carried_over(source: Search, point: Array, into: Search) -> Array:
    """Return a point of one search as a start of another with other numbers free."""
    return into.problem.completed(source.problem.chosen(point))


FIRST_STARTS = 6
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
    least: int = 1  # starts, also where the settings have fewer

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
            batch = range(len(first), min(len(first) + FIRST_STARTS, len(self._starts)))
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
        return list(starts(max(self.least, settings.starts), settings.seed, sizes))

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
