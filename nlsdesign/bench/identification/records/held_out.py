"""Which records to hold out by default: those most like another one, whatever the files are called."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from ....foundation.arrays import Array
from ....simulation import Trace

_SHARE = 3
"""One of so many records is held out."""
_PER_SIGNAL = 4
"""Marks of a signal, behind the length of the record."""
_LAGS = 100
"""Rates are taken over this part of the shortest record, where noise counts little."""
_DIGITS = 9
"""Distances that agree to so many digits are equal: they must not depend on the order of a sum."""


def surrounded(traces: Sequence[Trace]) -> tuple[int, ...]:
    """Return the indices of records to hold out: a third, rounded, and at least one of two.

    A record is described by its length and, for every signal, by its smallest and largest value, its usual
    rate, and how unevenly it moves: the root mean square of the rate over its mean size, large where motion
    alternates with rest. Held out, one after the other, is a record of the pair that is most alike among
    those that are left, so that fits keep every kind of motion: the one nearer to the middle of the range of
    all, so that it is predicted by interpolation, and among equals the one of the smaller motion.

    ``traces``: with the same signals; at least two.
    """
    marks = _marks(traces)
    left = list(range(len(traces)))
    chosen: list[int] = []
    while len(chosen) < (len(traces) + 1) // _SHARE:
        distance = dict(zip(left, _distance(marks[left]), strict=True))
        apart = dict(zip(left, _to_nearest(marks[left]), strict=True))
        rank = {k: (apart[k], distance[k], _extent(marks, k), content_digest(traces[k])) for k in left}
        best = min(left, key=rank.__getitem__)
        chosen.append(best)
        left.remove(best)
    return tuple(sorted(chosen))


def content_digest(trace: Trace) -> str:
    """Return a digest of time and signals, whatever their order."""
    digest = hashlib.sha256(trace.time.tobytes())
    for name in sorted(trace.signals):
        digest.update(trace.signals[name].tobytes())
    return digest.hexdigest()


def _marks(traces: Sequence[Trace]) -> Array:
    """Return what describes each record, shape (records, marks)."""
    lag = min(float(t.time[-1] - t.time[0]) for t in traces) / _LAGS
    rows = []
    for trace in traces:
        step = float(trace.time[1] - trace.time[0])
        apart = max(1, round(lag / step))
        row = [float(np.log(trace.time[-1] - trace.time[0]))]
        for name in sorted(traces[0].signals):
            values = trace[name]
            change = np.abs(values[apart:] - values[:-apart])
            rate = float(np.sqrt(np.mean(change**2)))
            form = rate / max(float(np.mean(change)), 1e-300)
            row += [float(values.min()), float(values.max()), _log(rate), _log(form)]
        rows.append(row)
    return np.array(rows)


def _log(value: float) -> float:
    return float(np.log(max(value, 1e-300)))


def _distance(marks: Array) -> list[float]:
    """Return how far each record lies from the middle of the range of all.

    The mean fourth power over the marks: a record that is extreme in one of them is outside, whatever the
    others.
    """
    low, high = marks.min(axis=0), marks.max(axis=0)
    share = (marks - low) / np.where(high > low, high - low, 1.0)
    return [round(float(d), _DIGITS) for d in np.mean((share - 0.5) ** 4, axis=1)]


def _to_nearest(marks: Array) -> list[float]:
    """Return the distance of each record to the one most like it, marks counted in their ranges."""
    low, high = marks.min(axis=0), marks.max(axis=0)
    share = (marks - low) / np.where(high > low, high - low, 1.0)
    apart = np.sqrt(np.mean((share[:, None] - share[None]) ** 2, axis=2))
    np.fill_diagonal(apart, np.inf)
    return [round(float(d), _DIGITS) for d in apart.min(axis=1)]


def _extent(marks: Array, row: int) -> float:
    """Return the mean range of the signals of a record, as a share of the largest."""
    ranges = marks[:, 2::_PER_SIGNAL] - marks[:, 1::_PER_SIGNAL]
    largest = np.where(ranges.max(axis=0) > 0.0, ranges.max(axis=0), 1.0)
    return round(float(np.mean(ranges[row] / largest)), _DIGITS)
