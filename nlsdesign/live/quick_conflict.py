"""Which limits contradict each other, from the quick program with a slack for each of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from .limit_kinds import LIMIT_KINDS
from .question import LiveQuestion
from .quick_rows import QuickRows
from .quick_search import MOST_ITERATIONS, SOLVED, QuickOutcome, QuickPoint, interior_point

_INVOLVED = 1e-3
"""Price from which a limit counts as part of a conflict, as in the whole design."""
_KEPT = 1e-6
"""Relative give below which a limit counts as kept."""


class SoftenedProgram:
    """The program of one structure with limits that give."""

    def __init__(self, rows: QuickRows) -> None:
        self._rows = rows

    def conflict(self, question: LiveQuestion, begin: Array) -> QuickOutcome:
        """Find out whether any cam keeps all limits, and which are in conflict where none does."""
        rows = self._rows
        count = len(rows.bounds)
        if not count:
            return QuickOutcome("not solved", "the solver found no design, and there is no limit to widen")
        low, high = rows.ranges_of(question)
        rows_low, rows_high = rows.limits_of(question)
        # A give counts relative to the limit as it is now, not as it was when the program was made.
        price = rows.scales / np.array([abs(value) or 1.0 for value in rows.values_of(question)[:count]])
        answer = self._softened(
            x0=np.concatenate([begin, np.full(count, 0.1)]),
            p=np.concatenate([rows.numbers_of(question), price]),
            lbx=np.concatenate([low, np.zeros(count)]), ubx=np.concatenate([high, np.full(count, 1e3)]),
            lbg=rows_low, ubg=rows_high,
        )  # fmt: skip
        point, status = np.array(answer["x"]).ravel(), str(self._softened.stats()["return_status"])
        if status not in SOLVED or not np.all(np.isfinite(point)):
            return QuickOutcome("not solved", f"the solver stopped with '{status}'")
        gives = point[len(point) - count :]
        if float(gives @ price) <= _KEPT * count:
            return QuickOutcome("solved", "", QuickPoint(point[:-count]), room=gives)
        sizes = [row.expression.shape[0] for row in rows.problem.structure]
        sizes += [bound.expression.shape[0] for bound in rows.bounds]
        groups = np.split(np.abs(np.array(answer["lam_g"]).ravel()), np.cumsum(sizes)[:-1])
        limits = groups[len(rows.problem.structure) :]
        involved = [i for i, each in enumerate(limits) if np.max(each, initial=0.0) > _INVOLVED * price[i]]
        return QuickOutcome(
            "infeasible", self._words(question, involved, gives),
            conflicts=tuple(dict.fromkeys(rows.bounds[i].limit for i in involved)),
        )  # fmt: skip

    @cached_property
    def _softened(self) -> ca.Function:
        return interior_point("softened", self.program, iterations=MOST_ITERATIONS)

    @cached_property
    def program(self) -> dict[str, ca.SX]:
        """The program with a slack for each limit; their sum, relative to the limits, is made small."""
        problem, bounds = self._rows.problem, self._rows.bounds
        slacks, prices = ca.SX.sym("slack", len(bounds)), ca.SX.sym("price", len(bounds))
        rows = [row.expression for row in problem.structure]
        for i, row in enumerate(self._rows.limit_rows):
            rows.append(row + (-slacks[i] if bounds[i].upper else slacks[i]))
        return {
            "x": ca.vertcat(problem.vector, slacks),
            "f": ca.dot(slacks, prices),
            "g": ca.vertcat(*rows),
            "p": ca.vertcat(self._rows.target.symbols, prices),
        }

    def _words(self, question: LiveQuestion, involved: Sequence[int], gives: Array) -> str:
        bounds = self._rows.bounds
        kinds = [LIMIT_KINDS[name] for name in dict.fromkeys(bounds[i].limit for i in involved)]
        rule = "contradict each other" if len(kinds) > 1 else "cannot be kept with what is free"
        limits, values = question.limit_values, self._rows.values_of(question)
        needed = []
        for i in involved:
            bound, give = bounds[i], float(gives[i] * self._rows.scales[i])
            if gives[i] > _KEPT:
                moved = values[i] + give if bound.upper else values[i] - give
                kind = LIMIT_KINDS[bound.limit]
                needed.append(f"{kind.title} from {kind.shown(values[i])} to about {kind.shown(moved)}")
        names = [f"{kind.title} ({kind.shown(limits[kind.name].value)})" for kind in kinds]
        words = f"{' and '.join(names)} {rule}"
        return words + (f"; it would be enough to move {' and '.join(needed)}" if needed else "")
