"""One nonlinear program for all questions of one structure, solved from where the last one ended.

A drag changes numbers only: the derivatives stand, and the interior point method begins beside the last
solution, with its multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ..design.optimisation.program import PROVED_INFEASIBLE
from ..design.optimisation.starts import start_values, starts
from ..foundation.arrays import Array
from .question import LiveQuestion
from .quick_conflict import SoftenedProgram
from .quick_outputs import QuickOutputs
from .quick_rows import QuickRows
from .quick_search import MOST_ITERATIONS, SOLVED, QuickOutcome, QuickPoint, interior_point

_WARM = 20
"""Iterations at most of a search with the last multipliers; where they do not help one without takes over."""
_AGAIN = 45
"""Iterations at most of a search from the last design without its multipliers."""
_STARTS = 4
_BESIDE: dict[str, Any] = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-5,
    # Measured over drags of five decks: with the usual rule a flat optimum takes 50 iterations, with this 5.
    "mu_strategy": "adaptive",
    **{
        f"warm_start_{each}": 1e-8
        for each in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    },
}


class QuickProgram:
    """The program of one structure: see :func:`~.quick_rows.structure_of`.

    Parameters
    ----------
    question
        One of its questions, whose sizes scale the variables.
    """

    def __init__(self, question: LiveQuestion) -> None:
        self.rows = QuickRows(question)
        self.outputs = QuickOutputs(self.rows)
        self.softened = SoftenedProgram(self.rows)

    @cached_property
    def _cold(self) -> ca.Function:
        return interior_point("quick", self.rows.program, iterations=MOST_ITERATIONS)

    @cached_property
    def _warm(self) -> ca.Function:
        return interior_point("beside", self.rows.program, iterations=_WARM, **_BESIDE)

    @cached_property
    def _again(self) -> ca.Function:
        return interior_point("again", self.rows.program, iterations=_AGAIN, mu_strategy="adaptive")

    def prepare(self) -> None:
        """Make the derivatives, which takes some tenths of a second."""
        _ = self._cold, self._warm, self._again

    def from_starts(self, question: LiveQuestion) -> QuickOutcome:
        """Return the best solution from the starts that are always taken."""
        best: QuickOutcome | None = None
        problem = self.rows.problem
        for start in starts(_STARTS, 1, []):
            values = start_values(
                start, scalars=problem.scalars, contour=problem.contour, sizes=problem.sizes
            )
            outcome = self._solved(self._cold, question, QuickPoint(self.rows.completed(question, values)))
            if best is None or (outcome.state == "solved", -outcome.cost) > (
                best.state == "solved",
                -best.cost,
            ):
                best = outcome
            if problem.contour is None and best.state == "solved":
                break
        assert best is not None
        return best

    def beside(self, question: LiveQuestion, last: QuickPoint) -> QuickOutcome:
        """Return the solution beside the last one."""
        return self._solved(self._warm, question, last)

    def from_point(self, question: LiveQuestion, point: QuickPoint, room: Array | float) -> QuickOutcome:
        """Return the solution from unknowns that keep all limits, as far as they do there."""
        return self._solved(self._cold, question, point, room)

    def from_values(self, question: LiveQuestion, values: Mapping[str, float]) -> QuickOutcome:
        """Return the solution from scaled values of another program or design."""
        point = QuickPoint(self.rows.completed(question, values))
        return self._solved(self._again, question, point)

    def _solved(
        self, solver: ca.Function, question: LiveQuestion, begin: QuickPoint, room: Array | float = 0.0
    ) -> QuickOutcome:
        low, high = self.rows.ranges_of(question)
        rows_low, rows_high = self.rows.limits_of(question, room)
        given: dict[str, Any] = {"x0": np.clip(begin.unknowns, low, high)}
        if len(begin.of_rows) == len(rows_low):
            given |= {"lam_x0": begin.of_bounds, "lam_g0": begin.of_rows}
        numbers = self.rows.numbers_of(question)
        answer = solver(p=numbers, lbx=low, ubx=high, lbg=rows_low, ubg=rows_high, **given)
        status = str(solver.stats()["return_status"])
        point = QuickPoint(*(np.array(answer[key]).ravel() for key in ("x", "lam_x", "lam_g")))
        cost = float(answer["f"])
        finite = bool(np.all(np.isfinite(point.unknowns)) and math.isfinite(cost))
        if finite and status in SOLVED:
            return QuickOutcome("solved", "", point, cost)
        state = "infeasible" if status == PROVED_INFEASIBLE else "not solved"
        return QuickOutcome(state, f"the solver stopped with '{status}'", point if finite else None)
