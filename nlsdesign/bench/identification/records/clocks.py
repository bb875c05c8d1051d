"""Channels on different or uneven clocks, put on one uniform clock by a stated rule.

Rule: where the rate falls, a zero-phase low-pass is the anti-alias filter (Kaiser-windowed
FIR with half its gain at the new Nyquist frequency, as ``scipy.signal.resample_poly`` designs it; at its two
ends a record is continued by point reflection). Where the rate rises, a cubic spline interpolates.
Nothing is extrapolated: the new clock covers the time in which every channel was sampled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import fftconvolve, firwin

from ....foundation.arrays import Array, Indices
from ....foundation.errors import MeasurementError, ValueRangeError
from ..statistics.residuals import noise_of, quantum_of

_HALF_LENGTH, _KAISER = 10, 5.0
"""Half length of the low-pass in new samples, and the shape of its window."""
_SAME = 1e-6
"""Relative difference up to which two rates or times are the same."""
_UNEVEN = 0.02
"""Steps that differ by more than this share do not lie on a uniform grid."""
_LEAST = 50
"""Smallest number of samples of a channel."""
_GAP = 1.5
"""A step longer than this many usual ones is a gap."""


class Resolution(NamedTuple):
    """Standard deviation of the noise and size of one count of a channel, in the unit of the channel.

    After resampling these are the values of equivalent white noise and counts on the new clock, with the same
    power density at low frequency: both scale with the square root of the rate. They can no longer be
    estimated from the samples.
    """

    noise: float
    quantum: float


@dataclass(frozen=True, eq=False)
class Channel:
    """A channel with the times at which it was sampled.

    Parameters
    ----------
    name
        For messages.
    time
        In s, ascending, shape (n,).
    values
        Shape (n,).
    """

    name: str
    time: Array
    values: Array

    def __post_init__(self) -> None:
        if len(self.time) != len(self.values):
            raise MeasurementError(
                self.name, f"has {len(self.values)} samples, its clock has {len(self.time)}",
                next_step="name the clock of this column: time = '<head>' in its table of records.toml",
            )  # fmt: skip
        if len(self.time) < _LEAST:
            raise MeasurementError(self.name, f"has {len(self.time)} samples; at least {_LEAST} are needed")
        if not (np.all(np.isfinite(self.time)) and np.all(np.isfinite(self.values))):
            raise MeasurementError(self.name, "holds a number that is not finite")
        if np.any(np.diff(self.time) <= 0.0):
            row = int(np.argmax(np.diff(self.time) <= 0.0))
            raise MeasurementError(self.name, f"its time does not ascend after sample {row + 1}")

    @property
    def step(self) -> float:
        """Usual time between samples in s."""
        return float(np.median(np.diff(self.time)))

    @property
    def even(self) -> bool:
        """Whether the samples lie on a uniform grid."""
        steps = np.diff(self.time)
        return bool(np.max(np.abs(steps - self.step)) <= _UNEVEN * self.step)

    def resolution(self, step: float | None = None, quantum: float = 0.0) -> Resolution:
        """Return noise and count, scaled to a clock.

        ``step``: of the new clock in s; the channel's own by default. ``quantum``: declared size of one
        count; 0 to estimate it from the samples.
        """
        share = math.sqrt(self.step / step) if step else 1.0
        return Resolution(share * noise_of(self.values), share * (quantum or quantum_of(self.values)))


class Resampled(NamedTuple):
    """Channels on one clock.

    Parameters
    ----------
    time
        In s, uniform, shape (n,).
    values
        By name, shape (n,).
    changes
        One clause for each channel that was changed.
    """

    time: Array
    values: dict[str, Array]
    changes: tuple[str, ...]


def on_one_clock(channels: Sequence[Channel], rate: float) -> Resampled:
    """Put channels on one uniform clock.

    ``channels``: each with its own times; at least one.
    """
    if not (rate > 0.0 and math.isfinite(rate)):
        raise ValueRangeError(f"rate {rate:g} Hz", "must be positive", next_step="give for instance 500")
    time = _common(channels, rate)
    values, changes = {}, []
    for each in channels:
        values[each.name], change = _resampled(each, time, 1.0 / rate)
        changes += [change] if change else []
    first, last = (min(c.time[0] for c in channels), max(c.time[-1] for c in channels))
    for length, end in ((time[0] - first, "first"), (last - time[-1], "last")):
        if length >= 1.0 / rate:
            changes.append(f"{end} {length:.3g} s left out, where not every channel runs")
    return Resampled(time, values, tuple(changes))


def _common(channels: Sequence[Channel], rate: float) -> Array:
    begins, ends = max(channels, key=lambda c: c.time[0]), min(channels, key=lambda c: c.time[-1])
    first, last = float(begins.time[0]), float(ends.time[-1])
    count = math.floor((last - first) * rate + _SAME) + 1
    if count < _LEAST:
        raise MeasurementError(
            f"'{begins.name}' from {first:g} s and '{ends.name}' until {last:g} s",
            f"have {max(count, 0)} samples in common at {rate:g} Hz; at least {_LEAST} are needed",
            next_step="check the units of the clocks, or take a higher rate",
        )
    grid: Array = np.minimum(first + np.arange(count) / rate, last)
    return grid


def _resampled(channel: Channel, time: Array, step: float) -> tuple[Array, str]:
    """Return the values at new times, and the change; empty where samples were only left out."""
    own, steps = channel.step, np.diff(channel.time)
    if np.max(steps) > max(_GAP * own, (1.0 + _UNEVEN) * step):
        row = int(np.argmax(steps))
        raise MeasurementError(
            f"{channel.name}: sample {row + 2}",
            f"there is a gap of {steps[row]:g} s, longer than a step of the new clock ({step:g} s)",
            next_step=f"split the record there, or take at most {1.0 / steps[row]:.3g} Hz",
        )
    named = f"{channel.name} {1.0 / own:.4g} -> {1.0 / step:.4g} Hz"
    slower = step > own * (1.0 + _SAME)
    if not slower:
        interpolated: Array = make_interp_spline(channel.time, channel.values, k=3)(time)
        same = channel.even and abs(step / own - 1.0) < _SAME and _on_samples(channel.time, time)
        return (
            (channel.values[_nearest(channel.time, time)], "")
            if same
            else (interpolated, f"{named} by cubic spline")
        )
    even = channel.time if channel.even else np.linspace(channel.time[0], channel.time[-1], len(channel.time))
    values = channel.values if channel.even else np.interp(even, channel.time, channel.values)
    smooth = _low_pass(channel.name, values, step / float(even[1] - even[0]))
    change = f"{named} with an anti-alias filter" + ("" if channel.even else ", uneven steps interpolated")
    return make_interp_spline(even, smooth, k=3)(np.minimum(time, even[-1])), change


def _low_pass(name: str, values: Array, ratio: float) -> Array:
    half = math.ceil(_HALF_LENGTH * ratio)
    if half >= len(values):
        raise MeasurementError(
            name, f"is shorter than the anti-alias filter of the new clock ({half} samples to either side)",
            next_step="take a higher rate",
        )  # fmt: skip
    taps = firwin(2 * half + 1, 1.0 / ratio, window=("kaiser", _KAISER))
    result: Array = fftconvolve(np.pad(values, half, mode="reflect", reflect_type="odd"), taps, mode="valid")
    return result


def _nearest(time: Array, wanted: Array) -> Indices:
    right = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
    rows: Indices = right - (wanted - time[right - 1] < time[right] - wanted)
    return rows


def _on_samples(time: Array, wanted: Array) -> bool:
    return bool(np.max(np.abs(time[_nearest(time, wanted)] - wanted)) < _UNEVEN * (time[1] - time[0]))


def resolutions(
    channels: Mapping[str, Channel], step: float, quanta: Mapping[str, float]
) -> dict[str, Resolution]:
    """Return the resolution of channels on a new clock.

    ``quanta``: declared sizes of a count; 0 where none is declared.
    """
    return {name: each.resolution(step, quanta.get(name, 0.0)) for name, each in channels.items()}
