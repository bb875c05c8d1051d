"""How far a size may go, all others chosen again, while the torque error stays small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import parse_unit, with_unit
from ...foundation.work_sharing import parallel_map
from .design_search import Search, row_of
from .limits import MaximumTorqueError
from .program import Program, Solution, scaled

_SMALL = 1e-3
"""Rms error, relative to the largest torque, that counts as nothing."""
_WIDE = 1.05
"""Ratio of the ends from which a range is worth a word."""
_FAR = 3.0
"""By what factor from the design the ends are looked for."""
_ITERATIONS = 100


@dataclass(frozen=True)
class SizeRange:
    """Range of one size over which the target is still met; all other free numbers follow."""

    name: str  # full name
    # lowest, highest: ends in SI, None where the solver did not find that end; a third and three times the
    # size of the design stand for as far as was looked
    lowest: float | None
    highest: float | None
    value: float
    unit: str  # in which they are shown
    error: float  # rms torque error in N·m that is allowed on the way

    def __str__(self) -> str:
        ends = f"{self._end(self.lowest)} to {self._end(self.highest)}"
        return f"{self.name} anywhere from {with_unit(ends, self.unit)}"

    def _end(self, end: float | None) -> str:
        if end is None:
            return "?"
        far = max(end / self.value, self.value / end) if self.value > 0.0 < end else 1.0
        return f"{end / parse_unit(self.unit).factor:.4g}" + (" (or beyond)" if far > 0.99 * _FAR else "")

    @property
    def wide(self) -> bool:
        """Whether the ends are clearly apart, or one of them alone was not found."""
        if self.lowest is None or self.highest is None:
            return self.lowest is not self.highest
        return self.highest > _WIDE * self.lowest + 1e-12


def size_ranges(search: Search, best: Array, rms: float) -> tuple[SizeRange, ...]:
    """Return the range of each free size over which the target is met as well, by two more solutions each.

    ``rms``: its torque error in N·m; more than this, or 1 ‰ of the largest torque, is not allowed on the way.
    """
    problem = search.problem
    if not problem.scalars:
        return ()
    allowed = max(1.05 * rms, _SMALL * problem.design.target.largest)
    weights = ca.SX.sym("weight", len(problem.scalars))
    error = [row_of(bound) for bound in MaximumTorqueError(allowed).bounds(problem.design)]
    values = problem.named(best)
    lower, upper = search.program.lower.copy(), search.program.upper.copy()
    for i, variable in enumerate(problem.scalars):
        lower[i] = max(lower[i], scaled(variable, values[variable.name] / _FAR))
        upper[i] = min(upper[i], scaled(variable, values[variable.name] * _FAR))
    program = Program(
        problem.vector,
        lower,
        upper,
        ca.dot(weights, ca.vertcat(*[v.symbol for v in problem.scalars])),
        (*search.program.rows, *error),
        weights,
        _ITERATIONS,
    )
    program.prepare()

    def end(number: int) -> Solution:
        towards = np.zeros(len(problem.scalars))
        towards[number // 2] = 1.0 if number % 2 == 0 else -1.0
        return program.solve(best, parameters=towards)

    outcomes = list(parallel_map(end, 2 * len(problem.scalars)))
    named = [problem.named(outcome.point) if outcome.solved else None for outcome in outcomes]
    return tuple(
        _size_range(search, variable.name, named[2 * i : 2 * i + 2], values[variable.name], allowed)
        for i, variable in enumerate(problem.scalars)
    )


def _size_range(
    search: Search, name: str, ends: Sequence[dict[str, float] | None], value: float, allowed: float
) -> SizeRange:
    lowest, highest = (None if end is None else end[name] for end in ends)
    return SizeRange(name, lowest, highest, value, search.problem.design.shown_units[name], allowed)
