"""Least squares on the torque balance, one candidate after the other, chosen by Schwarz's criterion.

Shapes that stand in a candidate non-linearly are tried on a grid and count as numbers. The criterion alone
names something in most machines, since rows of a balance are not independent. So an effect has to explain
a least share of what is left. Seeds 20 and 21 chose that share: from 0.17 to 0.4 most cases are right there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.methods._balance import Balance, Candidate, criterion
from benchmarks.methods._candidates import candidates

NAME = f"least squares, BIC (NumPy {version('numpy')})"
GAIN = 0.2
"""Share of the sum of squares by which a further effect has to lower it at least."""
GRID = 7
MOST = 3

Fit = Callable[[Balance, Candidate], Mapping[str, float]]
"""From a candidate and what it stands beside to its shapes."""


def answer(folder: Path) -> dict[str, Any]:
    """Return the effects that are added one after the other, each with its weight among all.

    Parameters
    ----------
    folder
        Of the case.
    """
    return chosen(folder, on_grid)


def on_grid(balance: Balance, candidate: Candidate) -> Mapping[str, float]:
    """Return the shapes on a grid that leave least.

    Parameters
    ----------
    balance, candidate
        As of :data:`Fit`.
    """
    # A ripple is a line in a spectrum: its order needs a finer grid than a shape that bends a curve.
    count = 200 if "order" in candidate.shapes else GRID
    axes = [np.geomspace(low, high, count) for low, high in candidate.shapes.values()]
    grid = [dict(zip(candidate.shapes, values, strict=True)) for values in product(*axes)]
    return min(grid, key=lambda shapes: balance.rest(balance.columns(candidate, shapes)))


def chosen(folder: Path, fit: Fit) -> dict[str, Any]:
    """Return the answer of a forward selection with shapes from a fit.

    Parameters
    ----------
    folder
        Of the case.
    fit
        Of shapes.
    """
    balance, effects, numbers = Balance(folder), [], 0
    rows = len(balance.left)
    for _ in range(MOST):
        left = float(balance.left @ balance.left)
        now = criterion(left, rows, numbers)
        tried = []
        for candidate in candidates(balance):
            columns = balance.columns(candidate, fit(balance, candidate))
            rest, count = balance.rest(columns), numbers + columns.shape[1] + len(candidate.shapes)
            tried.append((criterion(rest, rows, count), rest, count, columns, candidate))
        best, rest, count, columns, candidate = min(tried, key=lambda row: row[0])
        if best >= now or rest > (1.0 - GAIN) * left:
            break
        others = np.array([now, *(row[0] for row in tried if row[4].name != candidate.name)])
        weight = 1.0 / (1.0 + np.sum(np.exp(np.clip(0.5 * (best - others), -700.0, 0.0))))
        if all((e["name"], e["part"]) != (candidate.name, candidate.part) for e in effects):
            effects.append({"name": candidate.name, "part": candidate.part, "probability": float(weight)})
        balance, numbers = balance.beside(columns), count
    return {"effects": effects}
