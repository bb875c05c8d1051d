"""Why no design keeps all limits: which of them are in conflict, and by how much each would have to give."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...errors import ConvergenceError, InfeasibleError
from .limits import Bound
from .problem import DesignProblem
from .program import Program, Rows

Floats = NDArray[np.float64]

_FEASIBLE = 1e-6
"""Relative give below which limits count as kept."""
_INVOLVED = 1e-3
"""Price, in give of the whole per give of this limit, from which a limit counts as part of the conflict."""
_MOST = 1e3


def row_of(bound: Bound, slack: ca.SX | float = 0.0) -> Rows:
    """Return a bound as rows of a program, softened by a slack.

    Parameters
    ----------
    bound
        What must hold.
    slack
        Relative give, a symbol or zero.
    """
    distance = (bound.expression - bound.value) / bound.scale
    return Rows(distance - slack, -ca.inf, 0.0) if bound.upper else Rows(distance + slack, 0.0, ca.inf)


@dataclass(frozen=True)
class Give:
    """How far one bound would have to move for all others to be kept.

    Parameters
    ----------
    bound
        The bound.
    amount
        In SI, positive.
    """

    bound: Bound
    amount: float

    def __str__(self) -> str:
        moved = self.bound.value + (self.amount if self.bound.upper else -self.amount)
        amount, end = self.bound.shown(self.amount), self.bound.shown(moved)
        return f"{self.bound} would have to give by {amount} (to {end})"


def feasible_point(problem: DesignProblem, bounds: Sequence[Bound], progress: Callable[[], None]) -> Floats:
    """Return unknowns that keep all limits, or say why there are none.

    Every limit gets a slack, and the sum of the slacks, each relative to the size of its limit, is made as
    small as possible. Where it does not vanish, each limit that has a price is then relaxed alone.

    Parameters
    ----------
    problem
        Unknowns and geometry.
    bounds
        All limits.
    progress
        Called after each solution.

    Raises
    ------
    InfeasibleError
        With the names of the limits in conflict and how much each would have to give, in its own unit.
    ConvergenceError
        If the solver finds no answer.
    """
    program, count = _softened(problem, bounds), len(problem.variables)
    starts = [np.append(start, np.ones(len(bounds))) for start in problem.starts[:2]]
    solved = [outcome for outcome in program.solve(*starts, progress=progress) if outcome.solved]
    if not solved:
        raise ConvergenceError(
            "design: search for a cam within the limits", "IPOPT found neither a cam nor a proof against it",
            next_step="leave out limits one by one, or start from a deck that is closer to the target",
        )  # fmt: skip
    best = min(solved, key=lambda outcome: outcome.cost)
    if best.cost <= _FEASIBLE * len(bounds):
        return best.point[:count]
    prices = best.prices[len(problem.structure) :]
    involved = [i for i, price in enumerate(prices) if price > _INVOLVED]
    together = [Give(bounds[i], float(best.point[count + i]) * bounds[i].scale) for i in involved]
    alone, hopeless = [], []
    for i in involved:
        only = program.upper.copy()
        only[count:] = np.where(np.arange(len(bounds)) == i, _MOST, 0.0)
        start = np.append(best.point[:count], np.where(np.arange(len(bounds)) == i, 1.0, 0.0))
        (outcome,) = program.solve(start, upper=only, progress=progress)
        if outcome.solved:
            alone.append(Give(bounds[i], outcome.cost * bounds[i].scale))
        elif outcome.status == "Infeasible_Problem_Detected":
            hopeless.append(bounds[i].limit)
    raise _conflict([bounds[i] for i in involved], alone, hopeless, together)


def _softened(problem: DesignProblem, bounds: Sequence[Bound]) -> Program:
    """Return the program that makes the sum of the slacks of all bounds small, and nothing else."""
    slacks = ca.SX.sym("slack", len(bounds))
    rows = [row_of(bound, slacks[i]) for i, bound in enumerate(bounds)]
    program = Program(
        problem.vector,
        np.array([u.lower for u in problem.variables]),
        np.array([u.upper for u in problem.variables]),
        ca.sum1(slacks),
        (*problem.structure, *rows),
    )
    return program.with_unknowns(slacks, 0.0, _MOST)


def _conflict(
    involved: Sequence[Bound], alone: Sequence[Give], hopeless: Sequence[str], together: Sequence[Give]
) -> InfeasibleError:
    names = list(dict.fromkeys(bound.limit for bound in involved))
    if alone:
        advice = "one of these is enough: " + "; or ".join(str(give) for give in alone)
        if hopeless:
            advice += "; no give of " + " or ".join(hopeless) + " alone is enough"
    else:
        needed = [give for give in together if give.amount > _FEASIBLE * give.bound.scale]
        advice = "no single one is enough; together: " + "; and ".join(str(give) for give in needed)
    rule = "contradict each other" if len(names) > 1 else "cannot be kept with what is free"
    return InfeasibleError("limits " + ", ".join(names), rule, next_step=advice)
