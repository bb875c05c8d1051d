"""Semidefinite programs: the only place that knows the solver. What it finds is checked elsewhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]

SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True, eq=False)
class Inequality:
    """F₀ + Σ xᵢ Fᵢ ⪰ 0.

    Parameters
    ----------
    constant
        F₀, shape (n, n), symmetric.
    factors
        F, shape (unknowns, n, n), symmetric.
    """

    constant: Array
    factors: Array


def minimised(cost: Array, inequalities: Sequence[Inequality]) -> Array | None:
    """Return the unknowns of least cost under matrix inequalities; ``None`` where there are none.

    Parameters
    ----------
    cost
        Shape (unknowns,).
    inequalities
        All have to hold.
    """
    rows, sides, cones = [], [], []
    for each in inequalities:
        n = len(each.constant)
        row, column = _triangle(n)
        weight = np.where(row == column, 1.0, math.sqrt(2.0))
        rows.append(-(each.factors[:, row, column] * weight).T)
        sides.append(each.constant[row, column] * weight)
        cones.append(clarabel.PSDTriangleConeT(n))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    count = len(cost)
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), np.asarray(cost, dtype=float), sparse.csc_matrix(np.vstack(rows)),
        np.concatenate(sides), cones, settings,
    )  # fmt: skip
    solution = solver.solve()
    x = np.array(solution.x)
    return x if str(solution.status) in SOLVED and np.all(np.isfinite(x)) else None


def _triangle(n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of an upper triangle, column by column."""
    pairs = np.array([(i, j) for j in range(n) for i in range(j + 1)])
    return pairs[:, 0], pairs[:, 1]
