"""CMA-ES fits of each candidate on the torque balance, chosen by Schwarz's criterion.

The sizes of a candidate are linear and solved for; CMA-ES searches its shapes on a logarithmic scale from the
best point of the grid of ``least_squares``, with a population of 10 for at most 150 evaluations. Criterion
and least gain are those of ``least_squares``.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cma
import numpy as np

from benchmarks.methods._balance import Array, Balance, Candidate
from benchmarks.methods.least_squares import chosen, on_grid

NAME = f"CMA-ES for each candidate, BIC (cma {version('cma')})"
EVALUATIONS = 150


def answer(folder: Path) -> dict[str, Any]:
    """Return the effects that are added one after the other, each with its weight among all.

    Parameters
    ----------
    folder
        Of the case.
    """
    return chosen(folder, evolved)


def evolved(balance: Balance, candidate: Candidate) -> Mapping[str, float]:
    """Return the shapes that CMA-ES finds.

    Parameters
    ----------
    balance, candidate
        As of a fit of ``least_squares``.
    """
    if not candidate.shapes:
        return {}
    begin = on_grid(balance, candidate)
    low, high = np.log(list(candidate.shapes.values())).T

    def shapes(point: Array) -> dict[str, float]:
        return dict(zip(candidate.shapes, np.exp(low + np.clip(point, 0.0, 1.0) * (high - low)), strict=True))

    def left(point: Array) -> float:
        return balance.rest(balance.columns(candidate, shapes(point)))

    start = (np.log(list(begin.values())) - low) / (high - low)
    # CMA-ES needs two dimensions: a second one that nothing depends on is added to a single shape.
    more = np.zeros(1) if len(start) == 1 else np.zeros(0)
    options = {"bounds": [0.0, 1.0], "maxfevals": EVALUATIONS, "popsize": 10, "seed": 1, "verbose": -9}
    best, _ = cma.fmin2(
        lambda x: left(np.asarray(x)[: len(start)]), np.concatenate([start, more]), 0.1, options
    )
    return shapes(np.asarray(best)[: len(start)])
