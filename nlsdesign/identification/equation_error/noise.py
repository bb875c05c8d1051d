"""The noise of each measured channel: its level, its colour, and where both are known from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..records.measurement import RecordSet

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """Noise of each measured signal.

    Parameters
    ----------
    level
        Standard deviation of its white part, in SI.
    rounded
        Whether that is mere rounding.
    """

    level: Mapping[str, float]
    rounded: Mapping[str, bool]

    def deviation(self, signal: str) -> float:
        """Return the standard deviation of the whole noise of a signal.

        Parameters
        ----------
        signal
            Full name.
        """
        return self.level[signal]

    def behind(self, signal: str, weights: Array, step: float) -> float:
        """Return the standard deviation of the noise of a signal behind a filter.

        Parameters
        ----------
        signal
            Full name.
        weights
            Of the filter.
        step
            Time between samples in s.
        """
        return self.level[signal] * float(np.linalg.norm(weights))


def estimate_noise(records: RecordSet) -> Noise:
    """Estimate the noise of every channel from the records themselves.

    Parameters
    ----------
    records
        Those held out are not looked at, unless there are no others; the median over the records is taken.

    Returns
    -------
    Noise
        At least that of rounding, quantum/√12. Declared noise is not used: it is a claim.
    """
    seen = records.of("fit", "selection") or records.records
    level, rounded = {}, {}
    for column in records.columns:
        resolutions = [r.resolution_of(column.signal) for r in seen]
        white = float(np.median([g.noise for g in resolutions]))
        # The count of a resampled signal is that of its samples before, as it weighs on the new clock.
        kept = any(column.signal in r.resolution for r in seen)
        declared = 0.0 if kept else column.quantum
        quantum = declared or float(np.median([g.quantum for g in resolutions]))
        rounding = quantum / math.sqrt(12.0)
        level[column.signal] = max(white, rounding)
        rounded[column.signal] = white < 2.0 * rounding
    return Noise(level, rounded)
