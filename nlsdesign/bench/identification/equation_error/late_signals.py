"""Signals that come late: how a block reads them ahead, and by which parameter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError
from .block import Block, Drive


def advanced(time: Array, signal: Array, delay: Array) -> tuple[Array, Array]:
    """Return a signal read later by linear interpolation, and the slope of the line it is read from."""
    slopes = np.append(np.diff(signal) / np.diff(time), 0.0)
    place = np.clip(np.searchsorted(time, time + delay, side="right") - 1, 0, len(time) - 1)
    return np.interp(time + delay, time, signal), slopes[place]


def late_drives(block: Block, free: Sequence[str]) -> list[Drive]:
    """Return the drives that a free parameter shifts in time."""
    return [d for d in block.drives.values() if set(d.shifted_by) & set(free)]


def free_delay(drive: Drive, free: Sequence[str]) -> str:
    """Return the one delay of a signal that is free; of several, records show the sum alone."""
    names = [name for name in drive.shifted_by if name in free]
    if len(names) > 1:
        raise MeasurementError(
            f"signal '{drive.signal}'",
            f"is delayed by {' and by '.join(names)}, both free, which cannot be told apart",
            next_step="let one of them free, and give the other a number without a spread",
        )
    return names[0]
