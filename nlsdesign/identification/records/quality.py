"""Checks of measured tables before anything is fitted to them; each names file, column and rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import MeasurementError
from ..statistics.residuals import noise_of, quantum_of

Array = NDArray[np.float64]

_GAP = 1.5
"""A step this much longer than the usual one is a gap."""
_BRIDGED = 20.0
"""Longest gap, in usual steps, for which a slower clock is proposed."""
_JITTER = 0.02
"""Steps that differ by more than this share are interpolated to a uniform grid."""
_CLIPPED_RUN = 5
"""Smallest number of equal extreme samples that may be clipping."""
_APPROACH, _MISSING_COUNTS = 3, 3.0
"""Samples before and after a run from which its slope is taken, and the missing peak height in counts."""


@dataclass(frozen=True)
class Finding:
    """A reason to suspect data that can be read.

    Parameters
    ----------
    place
        File, column and rows.
    text
        The reason.
    """

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


def check_columns(file: str, columns: Mapping[str, Array], *, first_row: int = 2) -> None:
    """Check that every number is finite.

    Parameters
    ----------
    file
        For messages.
    columns
        Numbers as they stand in the file, by head.
    first_row
        Row of the first number: 2 in a text editor, where the heads are row 1.

    Raises
    ------
    MeasurementError
        Naming the column and the first run of rows.
    """
    for head, values in columns.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise MeasurementError(
                f"{file}: column '{head}', {_rows(_first_run(bad), first_row)}",
                f"is not a finite number ({len(bad)} in all)",
                next_step="cut the record before or after these rows",
            )


def check_time(file: str, head: str, time: Array, *, first_row: int = 2, bridged: float = 0.0) -> str:
    """Check that time ascends without gaps.

    Parameters
    ----------
    file, head
        For messages.
    time
        In s, shape (n,).
    first_row
        As above.
    bridged
        Step in s of a slower clock to which the channel will be resampled; shorter gaps are accepted.

    Returns
    -------
    str
        Empty if the grid is uniform; otherwise the change that makes it uniform.

    Raises
    ------
    MeasurementError
        If time stands still, runs backwards or has a gap.
    """
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        what = "runs backwards" if np.any(steps < 0.0) else "stands still"
        raise MeasurementError(
            f"{file}: column '{head}', {_rows(_first_run(back + 1), first_row)}",
            f"time {what} ({time[back[0]]:g} s is followed by {time[back[0] + 1]:g} s)",
            next_step="sort the record, or cut it where the clock was set back",
        )
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > max(_GAP * usual, (1.0 + _JITTER) * bridged))
    if len(gaps):
        raise MeasurementError(
            f"{file}: column '{head}', {_rows(gaps[:1] + 1, first_row)}",
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


def channel_findings(file: str, head: str, values: Array, *, first_row: int = 2) -> list[Finding]:
    """Return findings on a constant, clipped or saturated channel.

    Parameters
    ----------
    file, head
        For messages.
    values
        As they stand in the file.
    first_row
        As above.
    """
    place = f"{file}: column '{head}'"
    if np.ptp(values) == 0.0:
        return [
            Finding(f"{place}, {_rows(np.arange(len(values)), first_row)}", f"is constant at {values[0]:g}")
        ]
    # Without noise a channel may rest on its largest value; with noise this is clipping.
    if noise_of(values) < 2.0 * quantum_of(values):
        return []
    for extreme, which in ((values.max(), "largest"), (values.min(), "smallest")):
        run = _longest_run(values == extreme)
        if len(run) >= _CLIPPED_RUN and _cut_off(values, run):
            return [
                Finding(
                    f"{place}, {_rows(run, first_row)}",
                    f"rests on its {which} value {extreme:g}: clipped or saturated",
                )
            ]
    return []


def _cut_off(values: Array, run: NDArray[np.intp]) -> bool:
    """Tell whether a signal approaches its extreme so fast that its peak must lie beyond it."""
    first, last = int(run[0]), int(run[-1])
    sides = values[max(first - _APPROACH, 0) : first + 1], values[last : last + _APPROACH + 1]
    slopes = [abs(part[-1] - part[0]) / (len(part) - 1) for part in sides if len(part) > 1]
    half = 0.5 * len(run)
    # Peak of the parabola that has this slope half of the approach before the run.
    missing = 0.5 * half**2 * max(slopes, default=0.0) / (half + 0.5 * _APPROACH)
    return missing > _MISSING_COUNTS * max(quantum_of(values), noise_of(values))


def _first_run(indices: NDArray[np.intp]) -> NDArray[np.intp]:
    ends = np.flatnonzero(np.diff(indices) > 1)
    return indices[: int(ends[0]) + 1] if len(ends) else indices


def _longest_run(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    places = np.flatnonzero(mask)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return max(runs, key=len)


def _rows(indices: NDArray[np.intp], first_row: int) -> str:
    first, last = int(indices[0]) + first_row, int(indices[-1]) + first_row
    return f"row {first}" if first == last else f"rows {first} to {last}"
