"""How far, how fast and how hard a machine may be driven in an experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...identification.filters import derivative, smoothing
from ...identification.records.measurement import Record

_WIDTH, _SPAN = 4.0, 30.0
"""Width of the filter and span of a rate, in samples: noise must not count as a large rate."""


@dataclass(frozen=True)
class MachineLimits:
    """Bounds of an experiment, in SI.

    Parameters
    ----------
    low, high
        Travel of the commanded signal.
    speed, acceleration
        Largest first and second derivative of the commanded signal.
    drive
        Largest size of each drive, such as a current, by the name of the measured signal. Drives that are not
        named are not bounded.
    travel
        Lowest and highest value of each measured motion that is not commanded itself, by name.
    """

    low: float
    high: float
    speed: float = float("inf")
    acceleration: float = float("inf")
    drive: tuple[tuple[str, float], ...] = ()
    travel: tuple[tuple[str, float, float], ...] = ()


def limits_seen(
    records: Sequence[Record], commanded: str, *, drives: Sequence[str] = (), motions: Sequence[str] = ()
) -> MachineLimits:
    """Return as limits what the records show that the machine has done.

    ``commanded``: signal that the experiment is going to command. A drive has no limits of rate.
    """

    def smooth(record: Record, signal: str, order: int = 0) -> np.ndarray:
        rows = derivative(record.trace[signal], record.step, order=order, span=_SPAN * record.step)
        filtered: np.ndarray = smoothing(len(rows), _WIDTH, 1) @ rows
        return filtered

    def largest(signal: str, order: int = 0) -> float:
        return max(float(np.max(np.abs(smooth(r, signal, order)))) for r in records)

    def span(signal: str) -> tuple[float, float]:
        values = [smooth(r, signal) for r in records]
        return min(float(v.min()) for v in values), max(float(v.max()) for v in values)

    others = [m for m in motions if m != commanded]
    return MachineLimits(
        *span(commanded),
        float("inf") if commanded in drives else largest(commanded, 1),
        float("inf") if commanded in drives else largest(commanded, 2),
        tuple((name, largest(name)) for name in drives if name != commanded),
        tuple((name, *span(name)) for name in others),
    )
