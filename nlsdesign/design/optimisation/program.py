"""Numbers that a solver chooses, each about 1 in size, and the program that it solves for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ...foundation.work_sharing import parallel_map
from ...model import Variable


class DesignVariable(NamedTuple):
    """A number that the solver chooses; ``value`` is it in SI, a function of its symbol of about size 1."""

    name: str
    symbol: Expression
    value: Expression
    lower: float
    upper: float
    start: float


def scalar(variable: Variable, small: float) -> DesignVariable:
    """Return a single number: a length that may be zero in units of its size, all others as a logarithm."""
    symbol = ca.SX.sym(variable.name)
    now, low, high = variable.start, variable.minimum, variable.maximum
    if low > 0.0 and now > 0.0:
        ends = (math.log(low / now), math.log(high / now) if math.isfinite(high) else ca.inf)
        return DesignVariable(variable.name, symbol, now * ca.exp(symbol), *ends, 0.0)
    size = now or small
    return DesignVariable(variable.name, symbol, size * symbol, low / size, high / size, now / size)


class VariableScale(NamedTuple):
    """Value of a variable in SI where its symbol is zero, and where it is one."""

    at_zero: float
    at_one: float

    def position(self, value: float) -> float:
        """Return the symbol's value at which the variable has a value in SI."""
        if self.at_zero > 0.0:
            return math.log(max(value, 1e-300) / self.at_zero)
        return value / self.at_one


def scale_of(variable: DesignVariable) -> VariableScale:
    """Return the scale of a variable."""
    ends = (float(ca.evalf(ca.substitute(variable.value, variable.symbol, at))) for at in (0.0, 1.0))
    return VariableScale(*ends)


def scaled(variable: DesignVariable, value: float, scale: VariableScale | None = None) -> float:
    """Return the symbol's value at which a variable has a value in SI, within its range."""
    position = (scale or scale_of(variable)).position(value)
    return min(max(position, variable.lower), variable.upper)


SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
"""States of IPOPT that count as solved."""
PROVED_INFEASIBLE = "Infeasible_Problem_Detected"
"""IPOPT's status where it has found that no point near keeps all rows."""
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    # Nobody asks how the optimum moves with the parameters.
    "calc_lam_p": False,
    "no_nlp_grad": True,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-11,
    "ipopt.acceptable_tol": 1e-9,
    # Otherwise a bound may be missed by 1e-8, which a pretension of zero would notice.
    "ipopt.honor_original_bounds": "yes",
    # Unknowns and rows are scaled to about 1 already; MUMPS' own scaling takes half of the time of a step.
    "ipopt.mumps_permuting_scaling": 0,
    "ipopt.mumps_scaling": 0,
}


_BESIDE: dict[str, Any] = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-6,
    "mu_strategy": "adaptive",
    **{
        f"warm_start_{each}": 1e-8
        for each in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    },
}


def interior_point(
    name: str, program: dict[str, Any], *, iterations: int, beside: ca.Function | None = None, **options: Any
) -> ca.Function:
    """Return the solver of a program, with options of IPOPT.

    ``beside``: another solver of it, whose derivatives are taken; to make them takes longer than to solve.
    """
    settings = {f"ipopt.{key}": value for key, value in options.items()}
    if beside is not None:
        made = {"hess_lag": "nlp_hess_l", "jac_g": "nlp_jac_g", "grad_f": "nlp_grad_f"}
        settings |= {option: beside.get_function(function) for option, function in made.items()}
    return ca.nlpsol(name, "ipopt", program, {"ipopt.max_iter": iterations, **_OPTIONS, **settings})


@dataclass(frozen=True, eq=False)
class Rows:
    """Constraints lower ≤ expression ≤ upper on a column, scaled to about 1.

    ``words``: what is held, where a designer is told of it.
    """

    expression: Expression
    lower: float
    upper: float
    words: str = ""


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solver stopped."""

    solved: bool  # whether it says that this is a solution
    status: str  # status in the words of IPOPT
    point: Array  # unknowns, shape (unknowns,)
    cost: float  # value of the cost
    iterations: int  # number of iterations
    prices: tuple[float, ...]  # multiplier of each group of rows, the largest magnitude in it
    multipliers: tuple[Array, Array]  # of the bounds of the unknowns, and of all rows


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise a cost over unknowns between bounds, subject to rows."""

    unknowns: Expression  # symbols, shape (n,), scaled to about 1
    # lower, upper: their bounds, shape (n,)
    lower: Array
    upper: Array
    cost: Expression  # scalar
    rows: tuple[Rows, ...]  # constraints
    parameters: Expression | None = None  # symbols that get numbers at each solution; none for None
    iterations: int = 300  # at which the solver gives up

    def with_unknowns(self, symbols: Expression, upper: float) -> Program:
        """Return a copy with more unknowns at the end, all between zero and the same upper bound."""
        count = symbols.shape[0]
        return replace(
            self,
            unknowns=ca.vertcat(self.unknowns, symbols),
            lower=np.append(self.lower, np.zeros(count)),
            upper=np.append(self.upper, np.full(count, upper)),
        )

    def solve(
        self,
        start: Array,
        *,
        lower: Array | None = None,
        upper: Array | None = None,
        parameters: Array | None = None,
        beside: tuple[Array, Array] | None = None,
    ) -> Solution:
        """Solve from a starting point.

        ``lower``, ``upper``: other bounds of the unknowns, shape (n,); an unknown is held where they are
        equal. ``beside``: multipliers of a solution of nearly the same program, to which the search keeps.
        """
        sizes = [r.expression.shape[0] for r in self.rows]
        solver, known = self._solver, {}
        if beside is not None:
            solver, known = self._warm, {"lam_x0": beside[0], "lam_g0": beside[1]}
        answer = solver(
            x0=start,
            p=[] if parameters is None else parameters,
            lbx=self.lower if lower is None else lower,
            ubx=self.upper if upper is None else upper,
            lbg=np.repeat([r.lower for r in self.rows], sizes),
            ubg=np.repeat([r.upper for r in self.rows], sizes),
            **known,
        )
        stats = solver.stats()
        multipliers = (np.array(answer["lam_x"]).ravel(), np.array(answer["lam_g"]).ravel())
        groups = np.split(np.abs(multipliers[1]), np.cumsum(sizes)[:-1])
        finite = bool(np.all(np.isfinite(np.array(answer["x"]))) and np.isfinite(float(answer["f"])))
        return Solution(
            finite and stats["return_status"] in SOLVED,
            str(stats["return_status"]),
            np.array(answer["x"]).ravel(),
            float(answer["f"]),
            int(stats["iter_count"]),
            tuple(float(np.max(group, initial=0.0)) for group in groups),
            multipliers,
        )

    def prepare(self) -> None:
        """Make the derivatives once, before the work is shared out to other processes."""
        _ = self._solver

    def prepare_beside(self) -> None:
        """Make the derivatives of searches beside a solution."""
        _ = self._warm

    def solve_all(self, starts: Sequence[Array]) -> list[Solution]:
        """Solve from several starting points side by side on the cores; the order is kept."""
        self.prepare()
        return list(parallel_map(lambda number: self.solve(starts[number]), len(starts)))

    @cached_property
    def _solver(self) -> ca.Function:
        return self._interior_point()

    @cached_property
    def _warm(self) -> ca.Function:
        return self._interior_point(beside=self._solver, **_BESIDE)

    def _interior_point(self, **options: Any) -> ca.Function:
        problem: dict[str, Any] = {
            "x": self.unknowns,
            "f": ca.densify(ca.SX(self.cost)),  # no limit that could give leaves a zero without an entry
            "g": ca.vertcat(*[r.expression for r in self.rows]),
        }
        if self.parameters is not None:
            problem["p"] = self.parameters
        return interior_point("design", problem, iterations=self.iterations, **options)
