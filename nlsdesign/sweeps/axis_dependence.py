"""Whether the axes of a sample are independent of each other, as far as the sample shows it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from ..foundation.arrays import Array

LEAST_CORRELATION: Final = 0.1
_DEVIATIONS: Final = 4.0


def codes(values: NDArray[Any]) -> Array:
    """Return numbers as they are, and words as the numbers of their place in the alphabet."""
    column = np.asarray(values)
    if column.dtype.kind in "fiub":
        return column.astype(float)
    return np.unique(column.astype(str), return_inverse=True)[1].ravel().astype(float)


def dependent_axes(axes: Mapping[str, NDArray[Any]]) -> str:
    """Return which two axes depend most on each other, as text; empty where none do.

    The ranks of the values are compared, and their distances from the middle rank, which shows two axes that
    lie on a circle or a wedge. What does not show in either is not seen.

    ``axes``: values of each axis, shape (n,); words too.
    """
    ranks = {name: rankdata(codes(values)) for name, values in axes.items()}
    worst, words = 0.0, ""
    for one, other in combinations(ranks, 2):
        for first, second in _views(ranks[one], ranks[other]):
            size = _correlation(first, second)
            limit = max(LEAST_CORRELATION, _DEVIATIONS / np.sqrt(len(first)))
            if size > max(limit, worst):
                worst, words = (
                    size,
                    f"axes {one} and {other} depend on each other (rank correlation {size:.2f})",
                )
    return words


def _views(first: Any, second: Any) -> list[tuple[Any, Any]]:
    wide = [np.abs(each - np.median(each)) for each in (first, second)]
    return [(first, second), (wide[0], wide[1]), (wide[0], second), (first, wide[1])]


def _correlation(first: Any, second: Any) -> float:
    if np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return 0.0
    return float(abs(np.corrcoef(first, second)[0, 1]))
