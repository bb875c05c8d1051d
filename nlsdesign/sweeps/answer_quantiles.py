"""Quantiles of an answer with bounds that need no form of its distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binom

SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
CONFIDENCE = 0.95


class BoundedQuantile(NamedTuple):
    """A quantile with the bounds of its confidence.

    Parameters
    ----------
    share
        Of the values that lie at or below it.
    value
        Of the sample, one of its values.
    lower, upper
        Bounds, values of the sample; not a number where the sample is too small to bound that side.
    """

    share: float
    value: float
    lower: float
    upper: float


def answer_quantiles(values: ArrayLike, shares: Sequence[float] = SHARES) -> list[BoundedQuantile]:
    """Return quantiles, each with the order statistics that bound it with 95 % confidence.

    The bounds hold for independent draws of any continuous distribution: the number of draws below a quantile
    has a binomial distribution. Infinite values count as the largest or smallest.

    ``values``: of one answer; those that are not a number are left out.
    """
    column = np.asarray(values, dtype=float).ravel()
    ordered = np.sort(column[~np.isnan(column)])
    count, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    if not count:
        return []
    result = []
    for share in shares:
        low = int(binom.ppf(tail, count, share))
        high = int(binom.ppf(1.0 - tail, count, share)) + 1
        lower = float(ordered[low - 1]) if low >= 1 else math.nan
        upper = float(ordered[high - 1]) if high <= count else math.nan
        middle = min(count, max(1, math.ceil(count * share - 1e-9)))
        result.append(BoundedQuantile(share, float(ordered[middle - 1]), lower, upper))
    return result
