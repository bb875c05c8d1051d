"""When FMUs exchange values: at every sample of every sampled instance, and in between."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError

MOST_POINTS = 20_000_000
"""Communication points of one run; a run with a hundred signals then fills 16 GB."""
_SAME = 1e-9
"""Times closer than this part of the step are one."""


def sample_times(period: float, stop: float) -> Array:
    """Return the samples of an instance from 0 to the end."""
    return np.arange(math.floor(stop / period + 1e-6) + 1.0) * period


def communication_points(
    stop: float,
    step: float,
    *,
    periods: Iterable[float],
    changes: Iterable[tuple[float, float]],
    parts: int = 1,
) -> Array:
    """Return the communication points in s, from 0 to the end.

    What lies between two samples is divided into equal steps no longer than asked for, so step and sample
    times are independent; sample times need not be multiples of each other.
    """
    rhythms = [(period, 0.0) for period in sorted(set(periods))] + sorted(set(changes))
    expected = parts * (stop / step + sum(stop / period for period, _ in rhythms))
    if not expected <= MOST_POINTS:
        raise ValueRangeError(
            f"stop={stop:g} s in steps of at most {step:g} s",
            f"makes {expected:.3g} communication points, at most {MOST_POINTS} are possible",
            next_step="take a longer step or an earlier end",
        )
    breaks = [np.array([0.0, stop])]
    breaks += [sample_times(period, stop) + delay % period for period, delay in rhythms]
    if not rhythms:
        breaks.append(step * np.arange(math.floor(stop / step + 1e-6) + 1.0))
    merged = _merged(np.concatenate(breaks), stop, _SAME * min([step, *(period for period, _ in rhythms)]))
    gaps = np.diff(merged)
    counts = parts * np.maximum(1, np.ceil(gaps / step - 1e-6).astype(int))
    starts, lengths = np.repeat(merged[:-1], counts), np.repeat(gaps / counts, counts)
    numbers = np.arange(len(starts)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(starts + numbers * lengths, merged[-1])


def _merged(times: Array, stop: float, same: float) -> Array:
    """Return ascending times up to the end, those that are one by rounding taken once."""
    ascending = np.unique(times[times <= stop + same])
    kept: Array = ascending[np.append(True, np.diff(ascending) > same)]
    if len(kept) > 1 and kept[-1] >= stop - same:
        kept[-1] = stop
    return kept


def rows_of(points: Array, times: Array) -> NDArray[np.int64]:
    """Return the numbers of the points that are nearest to times."""
    after = np.clip(np.searchsorted(points, times), 1, max(1, len(points) - 1))
    nearer = np.abs(points[after - 1] - times) <= np.abs(points[np.minimum(after, len(points) - 1)] - times)
    return np.where(nearer, after - 1, np.minimum(after, len(points) - 1))
