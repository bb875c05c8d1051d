"""Checks of measured tables before anything is fitted to them; each names file, column and rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array, Indices
from ....foundation.errors import MeasurementError

_GAP = 1.5
"""A step this much longer than the usual one is a gap."""
_BRIDGED = 20.0
"""Longest gap, in usual steps, for which a slower clock is proposed."""
_JITTER = 0.02
"""Steps that differ by more than this share are interpolated to a uniform grid."""
_LARGEST = 1e100
"""Nothing that is measured is larger in any unit."""


@dataclass(frozen=True)
class Finding:
    """What is odd about data that can be read."""

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


def check_columns(file: str, columns: Mapping[str, Array], *, first_row: int = 2) -> None:
    """Check that every number is finite, and of a size that can be measured."""
    for head, values in columns.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise MeasurementError(
                f"{file}: column '{head}', {rows_in_words(_first_run(bad), first_row)}",
                f"is not a finite number ({len(bad)} in all)",
                next_step="cut the record before or after these rows",
            )
        huge = np.flatnonzero(np.abs(values) > _LARGEST)
        if len(huge):
            raise MeasurementError(
                f"{file}: column '{head}', {rows_in_words(huge[:1], first_row)}",
                f"{values[huge[0]]:g} is larger than anything that is measured",
                next_step="correct the number",
            )


def check_time(file: str, head: str, time: Array, *, first_row: int = 2, bridged: float = 0.0) -> str:
    """Check that time ascends without gaps.

    ``bridged``: step in s of a slower clock to which the channel will be resampled; shorter gaps are
    accepted. Result: empty if the grid is uniform; otherwise the change that makes it uniform.
    """
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        what = "runs backwards" if np.any(steps < 0.0) else "stands still"
        raise MeasurementError(
            f"{file}: column '{head}', {rows_in_words(_first_run(back + 1), first_row)}",
            f"time {what} ({time[back[0]]:g} s is followed by {time[back[0] + 1]:g} s)",
            next_step="sort the record, or cut it where the clock was set back",
        )
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > max(_GAP * usual, (1.0 + _JITTER) * bridged))
    if len(gaps):
        raise MeasurementError(
            f"{file}: column '{head}', {rows_in_words(gaps[:1] + 1, first_row)}",
            f"there is a gap of {steps[gaps[0]]:g} s; samples lie {usual:g} s apart ({len(gaps)} in all)",
            next_step="split the record into one file before and one after the gap" + _slower(steps, usual),
        )
    uneven = float(np.max(np.abs(steps - usual))) / usual
    return (
        ""
        if uneven <= _JITTER
        else f" (interpolated to a uniform grid, steps varied by {100 * uneven:.1f} %)"
    )


def _slower(steps: Array, usual: float) -> str:
    """Return the proposal of a clock slow enough for the gaps; none where these are too long."""
    longest = float(np.max(steps))
    if longest > _BRIDGED * usual:
        return ""
    rate = float(f"{1.0 / longest:.2g}")
    rate = rate if rate * longest <= 1.0 else float(f"{0.95 / longest:.2g}")
    return f", or put it on a slower clock: resample_Hz = {rate:g} in records.toml"


def _first_run(indices: Indices) -> Indices:
    ends = np.flatnonzero(np.diff(indices) > 1)
    return indices[: int(ends[0]) + 1] if len(ends) else indices


def rows_in_words(indices: Indices, first_row: int) -> str:
    """Return the rows of a run of samples, for messages."""
    first, last = int(indices[0]) + first_row, int(indices[-1]) + first_row
    return f"row {first}" if first == last else f"rows {first} to {last}"
