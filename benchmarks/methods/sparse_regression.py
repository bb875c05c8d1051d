"""Sparse regression on the torque balance: sequentially thresholded least squares of PySINDy.

The library has the columns of all candidates, with shapes in the middle of their ranges, in units of the
residual of the declared terms. An effect is named where its columns survive. The threshold was chosen on
seeds 20 and 21.
"""

from __future__ import annotations

import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from pysindy import optimizers

from benchmarks.methods._balance import Balance
from benchmarks.methods._candidates import candidates

NAME = f"sparse regression (PySINDy {version('pysindy')})"
THRESHOLD = 0.4


def answer(folder: Path) -> dict[str, Any]:
    """Return the effects whose terms survive, largest first.

    Parameters
    ----------
    folder
        Of the case.
    """
    balance = Balance(folder)
    owners, library = [], []
    for candidate in candidates(balance):
        middle = {name: float(np.sqrt(low * high)) for name, (low, high) in candidate.shapes.items()}
        columns = balance.columns(candidate, middle)
        owners += [candidate] * columns.shape[1]
        library.append(columns)
    terms, rest = np.column_stack(library), balance.left
    # What the declared terms explain is out of both sides: they are not up for thresholding.
    size = np.maximum(np.sqrt(np.mean(terms**2, axis=0)), 1e-300)
    scale = float(np.sqrt(np.mean(rest**2)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that nothing survives is an answer
        found = optimizers.STLSQ(threshold=THRESHOLD, alpha=1e-3).fit(terms / size, (rest / scale)[:, None])
    weight: dict[tuple[str, str], float] = {}
    for owner, coefficient in zip(owners, np.ravel(found.coef_), strict=True):
        if coefficient:
            key = (owner.name, owner.part)
            weight[key] = weight.get(key, 0.0) + float(coefficient) ** 2
    ranked = sorted(weight, key=lambda key: -weight[key])
    # Stribeck's law holds Coulomb's: both are one finding.
    parts = {part for name, part in ranked if name == "stribeck_friction"}
    return {
        "effects": [
            {"name": name, "part": part}
            for name, part in ranked
            if not (name == "coulomb_friction" and part in parts)
        ]
    }
