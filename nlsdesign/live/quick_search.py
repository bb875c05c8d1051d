"""What a search of a quick program begins with, how it is set up, and what it comes to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ..foundation.arrays import Array

SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
"""States of the solver that count as solved."""
MOST_ITERATIONS = 120
"""Iterations at most of a search from a start."""
_COMMON: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-9,
    "ipopt.acceptable_tol": 1e-7,
    "ipopt.honor_original_bounds": "yes",
    "ipopt.mumps_permuting_scaling": 0,
    "ipopt.mumps_scaling": 0,
}
_NONE: Array = np.zeros(0)


class QuickPoint(NamedTuple):
    """Where a search begins or ended: unknowns and, where they are known, multipliers of one program."""

    unknowns: Array
    of_bounds: Array = _NONE
    of_rows: Array = _NONE


@dataclass(frozen=True, eq=False)
class QuickOutcome:
    """What a search came to.

    Parameters
    ----------
    state
        ``"solved"``, ``"infeasible"`` or ``"not solved"``.
    words
        Of the solver, or what is in conflict.
    point
        Where it is solved.
    cost
        Sum of the goals.
    conflicts
        Names of the limits that contradict each other.
    room
        What each row of a limit gave where all limits count as kept: rounding leaves a limit that binds at a
        held contour beyond its number by some parts in a thousand million.
    """

    state: str
    words: str
    point: QuickPoint | None = None
    cost: float = math.inf
    conflicts: tuple[str, ...] = ()
    room: Array | float = 0.0


def interior_point(name: str, program: dict[str, Any], *, iterations: int, **options: Any) -> ca.Function:
    """Return the solver of a program."""
    settings = {f"ipopt.{key}": value for key, value in options.items()}
    return ca.nlpsol(name, "ipopt", program, {**_COMMON, **settings, "ipopt.max_iter": iterations})
