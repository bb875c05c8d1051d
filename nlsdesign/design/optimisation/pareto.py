"""The front of two or three goals: how it is searched, and what it is as data.

Each goal is first met alone. Between the best and the worst value that it has in these designs each goal
but the first then gets a ladder of bounds, and for every combination of bounds the first goal is met as well
as it can be (ε-constraint). A point starts from its nearest neighbour; one that failed, or that another point
betters within its own bounds, is solved again from there.
Source: Haimes et al. 1971 (ε-constraint).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.csv_tables import Axis, data_frame
from ...foundation.errors import ConvergenceError, ValueRangeError
from ...foundation.quantity import parse_unit, typeset_unit
from ...foundation.text_files import write_table
from ...foundation.work_sharing import parallel_map
from ..curves.numbers import in_unit
from ..curves.target import Target
from .defaults import DesignSettings
from .design_search import Search
from .finish import SolvedSearch, finished, limit_state
from .goals import Goal, GoalMeasure, SmoothContour
from .limits import Limit, MaximumTorqueError, limits_in_words
from .program import Program, Rows, Solution
from .remedies import feasible_point
from .result import CamDesign
from .shape import starts
from .solve import USUAL, Wanted

_SHOWN_IN = {"m": "mm", "m^2": "mm^2"}


class FrontPoint(NamedTuple):
    """One design of a front."""

    values: tuple[float, ...]  # the goals, in SI
    numbers: tuple[tuple[str, float], ...]  # free numbers in SI by full name, besides the contour
    units: tuple[str, ...]  # SI units of these
    binding: tuple[str, ...]  # what limits bound on which the design sits, with their names


class LeftOut(NamedTuple):
    """Bounds for which the front has no point, in words, and why."""

    bounds: str
    reason: str

    def __str__(self) -> str:
        return f"{self.bounds}: {self.reason}"


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Designs that no other design betters in all goals, in ascending order of the first.

    Parameters
    ----------
    target
        Torque curve.
    goals
        What they are about, in words.
    units
        In which they are shown.
    points
        The designs.
    left_out
        What the solver did not find, or another point betters.
    sources
        What whole designs are made from.
    """

    target: Target
    goals: tuple[str, ...]
    units: tuple[str, ...]
    points: tuple[FrontPoint, ...]
    left_out: tuple[LeftOut, ...]
    sources: tuple[SolvedSearch, ...] = field(repr=False)

    @property
    def values(self) -> Array:
        """The goals in SI, shape (points, goals)."""
        return np.array([point.values for point in self.points])

    @property
    def shown(self) -> Array:
        """The goals in the units in which they are shown, shape (points, goals)."""
        factors = np.array([parse_unit(unit).factor for unit in self.units])
        result: Array = self.values / factors
        return result

    def design(self, number: int) -> CamDesign:
        """Return one point as a whole design, measured on an assembly flattened anew.

        Parameters
        ----------
        number
            Of the point, from zero.

        Raises
        ------
        ValueRangeError
            If there is no such point.
        """
        if not 0 <= number < len(self.points):
            raise ValueRangeError(
                f"point {number}", f"the front has points 0 to {len(self.points) - 1}",
                next_step="print the front for its table",
            )  # fmt: skip
        return finished(self.sources[number])

    def write_csv(self, path: Path) -> None:
        """Write one row for each point: goals, free numbers, binding limits.

        Parameters
        ----------
        path
            File; its folder is made if needed.

        Raises
        ------
        ExportError
            If the file cannot be written.
        """
        first = self.points[0]
        units = [_SHOWN_IN.get(unit, unit) for unit in first.units]
        head = [f"{goal} [{unit}]" for goal, unit in zip(self.goals, self.units, strict=True)]
        head += [f"{name} [{unit}]" for (name, _), unit in zip(first.numbers, units, strict=True)]
        rows = []
        for point, shown in zip(self.points, self.shown, strict=True):
            numbers = [v / parse_unit(u).factor for (_, v), u in zip(point.numbers, units, strict=True)]
            row = [f"{value:.9g}" for value in (*shown, *numbers)]
            rows.append([*row, "; ".join(point.binding)])
        head.append("binding limits")
        write_table(path, [head, *rows])

    def to_frame(self) -> Any:
        """Return a ``pandas.DataFrame``, one row for each point, units in its ``attrs``; needs pandas.

        Goals are in the units in which they are shown, free numbers in SI.
        """
        columns: dict[str, Any] = {goal: self.shown[:, k] for k, goal in enumerate(self.goals)}
        units = dict(zip(self.goals, self.units, strict=True))
        first = self.points[0]
        for k, (name, _) in enumerate(first.numbers):
            columns[name] = [point.numbers[k][1] for point in self.points]
        columns["binding limits"] = ["; ".join(point.binding) for point in self.points]
        numbers = {name: unit for (name, _), unit in zip(first.numbers, first.units, strict=True)}
        return data_frame(columns, units=units | numbers, index=Axis("point", "", range(len(self.points))))

    def __str__(self) -> str:
        heads = [
            f"{goal} in {typeset_unit(unit) or '1'}"
            for goal, unit in zip(self.goals, self.units, strict=True)
        ]
        lines = [" | ".join(["point", *heads, "binding limits"])]
        for number, (point, shown) in enumerate(zip(self.points, self.shown, strict=True)):
            cells = [f"{value:.4g}".rjust(len(head)) for value, head in zip(shown, heads, strict=True)]
            lines.append(" | ".join([f"{number:5d}", *cells, ", ".join(point.binding) or "none"]))
        return "\n".join([*lines, *(f"left out: {each}" for each in self.left_out)])


_UNBOUNDED = 1e6
"""Bound, relative to the scale of a goal, that never binds."""
_STARTS = 8
"""Starts at most of each end of a front."""
_OTHERS = 1e-3
"""Weight of the other goals, so that what costs the first goal nothing is not given away."""
_BETTER = 1e-3
"""Gain of the first goal, relative to its range, from which a point is solved again from another."""
_LEAST_POINTS, _MOST_POINTS = 3, 50


def pareto(
    actuator: Assembly,
    *,
    target: Target,
    goals: Sequence[Goal],
    free: Sequence[str] | None = None,
    keep: Sequence[Limit] = (),
    points: int = 9,
    settings: DesignSettings = USUAL,
) -> ParetoFront:
    """Return the front of two or three goals: the designs that no other design betters in all of them.

    Every design on it meets the target as the settings ask, unless ``keep`` has a
    :class:`MaximumTorqueError` of its own. The contour is smoothed where that costs nothing.

    Parameters
    ----------
    actuator
        Assembly with a cam spring; its structure must say which.
    target
        Torque curve.
    goals
        Two or three, each of another kind; the first is made small under bounds on the others.
    free, keep
        As :func:`design_cam`.
    points
        On each ladder of bounds, ends included.
    settings
        As :func:`design_cam`; progress is told after each solution.

    Returns
    -------
    ParetoFront
        With the points that no other point betters, and what was left out and why.

    Raises
    ------
    InfeasibleError
        If the limits contradict each other, as :func:`design_cam` says.
    ConvergenceError
        If the solver meets one of the goals from no start.
    ValueRangeError
        If there are fewer than two or more than three goals, two of a kind, or too few or many points.
    """
    if not 2 <= len(goals) <= 3:
        raise ValueRangeError(
            f"goals: {len(goals)}", "a front has two or three",
            next_step="name what is to be traded, for instance goals=(EnergyLost(5.0), LeastSize())",
        )  # fmt: skip
    if len({type(goal) for goal in goals}) < len(goals):
        kinds = ", ".join(type(goal).__name__ for goal in goals)
        raise ValueRangeError(
            f"goals: {kinds}", "two of a kind", next_step="trade goals that are of different kinds"
        )
    if not _LEAST_POINTS <= points <= _MOST_POINTS:
        raise ValueRangeError(f"points = {points}", f"must lie in [{_LEAST_POINTS}, {_MOST_POINTS}]")
    if not any(isinstance(limit, MaximumTorqueError) for limit in keep):
        keep = (*keep, MaximumTorqueError(settings.largest_error * target.largest))
    wanted = Wanted(
        target, None if free is None else tuple(free), tuple(keep), None, (*goals, SmoothContour())
    )
    question, chosen = wanted.question(actuator, settings)
    search = question.search(chosen)
    search.require_influence()
    front = _Ladder(search, tuple(goals), chosen)
    reached = front.ends()
    values = np.array([each.values for each in reached])
    lowest, highest = values.min(axis=0), values.max(axis=0)
    reached += front.between(reached, lowest, highest, points)
    return _front(actuator, front, reached)


class _Tried(NamedTuple):
    """An outcome, the bounds under which it was reached, and what the goals are there."""

    bounds: tuple[float, ...]
    outcome: Solution
    values: Array

    def within(self, bounds: Sequence[float]) -> bool:
        """Whether this design keeps other bounds than its own."""
        return self.outcome.solved and bool(np.all(self.values[1:] <= np.array(bounds) * (1 + 1e-9)))


@dataclass(frozen=True, eq=False)
class _Ladder:
    """The search with weights and bounds of the goals as parameters."""

    search: Search
    goals: tuple[Goal, ...]
    free: tuple[str, ...]

    @cached_property
    def measures(self) -> tuple[GoalMeasure, ...]:
        return tuple(goal.measured(self.search.problem.design) for goal in self.goals)

    @cached_property
    def _points(self) -> list[Array]:
        settings, problem = self.search.question.settings, self.search.problem
        sizes = [v.name for v in problem.scalars if v.name != problem.law.cam.pretension]
        return [problem.at(start) for start in starts(min(settings.starts, _STARTS), settings.seed, sizes)]

    @cached_property
    def scales(self) -> Array:
        """Size of each goal at the first start."""
        return _sizes(self.values(self._points[0]))

    def values(self, point: Array) -> Array:
        """Return the goals at a point in SI."""
        problem = self.search.problem
        return np.array([float(np.max(problem.evaluate(m.expression, point))) for m in self.measures])

    @cached_property
    def program(self) -> Program:
        base, count = self.search.program, len(self.goals)
        weights, bounds = ca.SX.sym("weight", count), ca.SX.sym("bound", count - 1)
        costs = [goal.cost(self.search.problem.design) for goal in self.goals]
        tie = SmoothContour().cost(self.search.problem.design)
        rows = [
            Rows(measure.expression / scale - bounds[i], -ca.inf, 0.0)
            for i, (measure, scale) in enumerate(zip(self.measures[1:], self.scales[1:], strict=True))
        ]
        return Program(
            base.unknowns, base.lower, base.upper, ca.dot(weights, ca.vertcat(*costs)) + tie,
            (*base.rows, *rows), ca.vertcat(weights, bounds),
        )  # fmt: skip

    @cached_property
    def _cost_scales(self) -> Array:
        design = self.search.problem.design
        costs = ca.vertcat(*[goal.cost(design) for goal in self.goals])
        return _sizes(self.search.problem.evaluate(costs, self._points[0]))

    def _solved(self, start: Array, goal: int, bounds: Sequence[float]) -> _Tried:
        # Small costs are made about 1; large ones are squares of errors, which may become small.
        weights = _OTHERS / self._cost_scales
        weights[goal] = 1.0 / min(self._cost_scales[goal], 1.0)
        relative = np.minimum(np.array(bounds) / self.scales[1:], _UNBOUNDED)
        outcome = self.program.solve(start, parameters=np.concatenate([weights, relative]))
        return _Tried(tuple(bounds), outcome, self.values(outcome.point))

    def ends(self) -> list[_Tried]:
        """Return the best design of each goal alone, from all starts and from each other."""
        _ = self._cost_scales
        self.program.prepare()
        count, open_ended = len(self.goals), [np.inf] * (len(self.goals) - 1)
        reached: list[_Tried] = []
        for goal in range(count):
            begin = [*self._points, *(each.outcome.point for each in reached)]

            def tried(number: int, goal: int = goal, begin: list[Array] = begin) -> _Tried:
                return self._solved(begin[number], goal, open_ended)

            outcomes = []
            for each in parallel_map(tried, len(begin)):
                outcomes.append(each)
                self.search.question.settings.progress()
            solved = [each for each in outcomes if each.outcome.solved]
            if not solved:
                start = feasible_point(self.search, self.free)
                solved = [self._solved(start, goal, [np.inf] * (len(self.goals) - 1))]
            if not solved[-1].outcome.solved:
                raise ConvergenceError(
                    f"pareto: {type(self.goals[goal]).__name__} alone",
                    f"IPOPT stopped with '{solved[-1].outcome.status}'",
                    next_step="free one number more, or bound the sizes, as by a RestLengthRange",
                )
            reached.append(min(solved, key=lambda each: each.outcome.cost))
        return reached

    def between(self, ends: list[_Tried], lowest: Array, highest: Array, points: int) -> list[_Tried]:
        """Return the best of the first goal for each combination of bounds on the others."""
        ladders = [
            np.linspace(low, high, points)[1:-1][::-1]
            for low, high in zip(lowest[1:], highest[1:], strict=True)
        ]
        span = np.maximum(highest - lowest, 1e-12 * self.scales)
        grid = [tuple(float(b) for b in bounds) for bounds in itertools.product(*ladders)]
        cells: dict[tuple[float, ...], _Tried] = {}
        for bounds in grid:
            known = [each for each in (*ends, *cells.values()) if each.outcome.solved]
            cells[bounds] = self._from_nearest(known, bounds, span)
        for bounds in reversed(grid):
            cells[bounds] = self._bettered(cells[bounds], [*ends, *cells.values()], span)
        return list(cells.values())

    def _from_nearest(self, known: Sequence[_Tried], bounds: tuple[float, ...], span: Array) -> _Tried:
        def distance(each: _Tried) -> float:
            return float(np.sum(((each.values[1:] - np.array(bounds)) / span[1:]) ** 2))

        tried = None
        for each in sorted(known, key=distance)[:2]:
            tried = self._solved(each.outcome.point, 0, bounds)
            self.search.question.settings.progress()
            if tried.outcome.solved:
                break
        assert tried is not None
        return tried

    def _bettered(self, cell: _Tried, known: Sequence[_Tried], span: Array) -> _Tried:
        inside = [each for each in known if each.within(cell.bounds)]
        if not inside:
            return cell
        best = min(inside, key=lambda each: float(each.values[0]))
        if cell.outcome.solved and best.values[0] >= cell.values[0] - _BETTER * span[0]:
            return cell
        again = self._solved(best.outcome.point, 0, cell.bounds)
        self.search.question.settings.progress()
        return again if again.outcome.solved else cell


def _sizes(values: Array) -> Array:
    sizes = np.abs(values)
    return np.where(np.isfinite(sizes) & (sizes > 0.0), sizes, 1.0)


def _front(actuator: Assembly, ladder: _Ladder, reached: Sequence[_Tried]) -> ParetoFront:
    search, measures = ladder.search, ladder.measures
    solved = sorted((each for each in reached if each.outcome.solved), key=lambda each: tuple(each.values))
    left_out = [
        LeftOut(_bounds_text(measures, each.bounds), f"IPOPT stopped with '{each.outcome.status}'")
        for each in reached
        if not each.outcome.solved
    ]
    kept: list[_Tried] = []
    scale = np.ptp([each.values for each in solved], axis=0)
    for each in solved:
        # The last digits of two solutions of the same design differ.
        digits, values = 1e-5 * scale, each.values
        better = [
            other
            for other in solved
            if np.all(other.values <= values + digits) and np.any(other.values < values - 10.0 * digits)
        ]
        same = [other for other in kept if np.all(np.abs(other.values - values) <= digits)]
        if better or same:
            why = "another point betters it" if better else "it is the same design as another point"
            left_out.append(LeftOut(_bounds_text(measures, each.bounds), why))
        else:
            kept.append(each)
    return ParetoFront(
        target=search.problem.design.target,
        goals=tuple(measure.what for measure in measures),
        units=tuple(measure.unit for measure in measures),
        points=tuple(_point(search, each) for each in kept),
        left_out=tuple(left_out),
        sources=tuple(
            SolvedSearch(actuator, search, ladder.free, [each.outcome], 0, each.outcome) for each in kept
        ),
    )


def _point(search: Search, tried: _Tried) -> FrontPoint:
    problem, point = search.problem, tried.outcome.point
    names = [v.name for v in problem.scalars]
    values = problem.named(point)
    states = [limit_state(problem, bound, point) for bound in search.bounds]
    return FrontPoint(
        values=tuple(float(v) for v in tried.values),
        numbers=tuple((name, values[name]) for name in names),
        units=tuple(search.question.model.variable(name).unit for name in names),
        binding=limits_in_words((state.limit, state.of) for state in states if state.active),
    )


def _bounds_text(measures: Sequence[GoalMeasure], bounds: Sequence[float]) -> str:
    def parts() -> Iterator[str]:
        for measure, bound in zip(measures[1:], bounds, strict=True):
            if np.isfinite(bound):
                yield f"{measure.what} ≤ {in_unit(float(bound), measure.unit)}"

    return " and ".join(parts()) or "a goal alone"
