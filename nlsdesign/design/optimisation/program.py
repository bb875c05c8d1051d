"""One nonlinear program and its solution by IPOPT with exact derivatives from CasADi."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...symbolic import Expression

Floats = NDArray[np.float64]

_SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-9,
    "ipopt.acceptable_tol": 1e-7,
    "ipopt.max_iter": 300,
    # Otherwise a bound may be missed by 1e-8, which a pretension of zero would notice.
    "ipopt.honor_original_bounds": "yes",
}


@dataclass(frozen=True, eq=False)
class Rows:
    """Constraints lower ≤ expression ≤ upper on a column, scaled to about 1."""

    expression: Expression
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solver stopped.

    Parameters
    ----------
    solved
        Whether it says that this is a solution.
    status
        Status in the words of IPOPT.
    point
        Unknowns, shape (unknowns,).
    cost
        Value of the cost.
    iterations
        Number of iterations.
    prices
        Multiplier of each group of rows, the largest magnitude in it.
    """

    solved: bool
    status: str
    point: Floats
    cost: float
    iterations: int
    prices: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise a cost over unknowns between bounds, subject to rows.

    Parameters
    ----------
    unknowns
        Symbols, shape (n,), scaled to about 1.
    lower, upper
        Their bounds, shape (n,).
    cost
        Scalar.
    rows
        Constraints.
    """

    unknowns: Expression
    lower: Floats
    upper: Floats
    cost: Expression
    rows: tuple[Rows, ...]

    def with_unknowns(self, symbols: Expression, lower: float, upper: float) -> Program:
        """Return a copy with more unknowns at the end, all between the same bounds.

        Parameters
        ----------
        symbols
            Column.
        lower, upper
            Bounds.
        """
        count = symbols.shape[0]
        return replace(
            self,
            unknowns=ca.vertcat(self.unknowns, symbols),
            lower=np.append(self.lower, np.full(count, lower)),
            upper=np.append(self.upper, np.full(count, upper)),
        )

    def solve(
        self, *starts: Floats, upper: Floats | None = None, progress: Callable[[], None] = lambda: None
    ) -> list[Solution]:
        """Solve from each starting point.

        Parameters
        ----------
        *starts
            Shape (n,).
        upper
            Other upper bounds of the unknowns, shape (n,).
        progress
            Called after each.

        Returns
        -------
        list of Solution
            In the order of the starting points.
        """
        sizes = [r.expression.shape[0] for r in self.rows]
        bounds = {
            "lbx": self.lower,
            "ubx": self.upper if upper is None else upper,
            "lbg": np.repeat([r.lower for r in self.rows], sizes),
            "ubg": np.repeat([r.upper for r in self.rows], sizes),
        }
        outcomes = []
        for start in starts:
            outcomes.append(self._outcome(self._solver(x0=start, **bounds), sizes))
            progress()
        return outcomes

    @cached_property
    def _solver(self) -> ca.Function:
        problem: dict[str, Any] = {
            "x": self.unknowns,
            "f": self.cost,
            "g": ca.vertcat(*[r.expression for r in self.rows]),
        }
        return ca.nlpsol("design", "ipopt", problem, _OPTIONS)

    def _outcome(self, answer: dict[str, ca.DM], sizes: list[int]) -> Solution:
        stats = self._solver.stats()
        groups = np.split(np.abs(np.array(answer["lam_g"]).ravel()), np.cumsum(sizes)[:-1])
        finite = bool(np.all(np.isfinite(np.array(answer["x"]))) and np.isfinite(float(answer["f"])))
        return Solution(
            finite and stats["return_status"] in _SOLVED,
            str(stats["return_status"]),
            np.array(answer["x"]).ravel(),
            float(answer["f"]),
            int(stats["iter_count"]),
            tuple(float(np.max(group, initial=0.0)) for group in groups),
        )
