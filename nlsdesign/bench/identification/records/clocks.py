"""Channels on different or uneven clocks, put on one uniform clock by a stated rule.

Rule: where the rate falls, a zero-phase low-pass is the anti-alias filter (Kaiser-windowed
FIR with half its gain at the new Nyquist frequency, as ``scipy.signal.resample_poly`` designs it; at its two
ends a record is continued by point reflection). Where the rate rises, a cubic spline interpolates.
Nothing is extrapolated: the new clock covers the time in which every channel was sampled.

The lag between two channels that show the same motion is found by cross-correlation, to a fraction of a
sample.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array, Indices
from ....foundation.errors import MeasurementError, ValueRangeError
from ..residuals import autocorrelation, effective_size, noise_of, quantum_of

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
LEAST_CORRELATION = 0.7
"""At this correlation half of the variance of one channel is explained by the other."""
_SHARE = 0.25
"""Default of the largest lag, as a share of the shorter record."""
_WIDTH = 2.0
"""Both channels pass a Gaussian filter of this many samples, which removes the bias to whole samples."""
_SIGNIFICANT = 5.0
"""Standard deviations by which a second peak of the correlation must be lower."""


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
    """A channel with the times at which it was sampled."""

    name: str  # for messages
    time: Array  # in s, ascending, shape (n,)
    values: Array  # shape (n,)

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
    """Channels on one clock."""

    time: Array  # in s, uniform, shape (n,)
    values: dict[str, Array]  # by name, shape (n,)
    changes: tuple[str, ...]  # one clause for each channel that was changed


def on_one_clock(channels: Sequence[Channel], rate: float) -> Resampled:
    """Put channels on one uniform clock.

    ``channels``: each with its own times; at least one.
    """
    if not (rate > 0.0 and math.isfinite(rate)):
        raise ValueRangeError(f"rate {rate:g} Hz", "must be positive", next_step="give for instance 500")
    begins, ends = max(channels, key=lambda c: c.time[0]), min(channels, key=lambda c: c.time[-1])
    start, stop = float(begins.time[0]), float(ends.time[-1])
    count = math.floor((stop - start) * rate + _SAME) + 1
    if count < _LEAST:
        raise MeasurementError(
            f"'{begins.name}' from {start:g} s and '{ends.name}' until {stop:g} s",
            f"have {max(count, 0)} samples in common at {rate:g} Hz; at least {_LEAST} are needed",
            next_step="check the units of the clocks, or take a higher rate",
        )
    time: Array = np.minimum(start + np.arange(count) / rate, stop)
    values, changes = {}, []
    for each in channels:
        values[each.name], change = _resampled(each, time, 1.0 / rate)
        changes += [change] if change else []
    first, last = (min(c.time[0] for c in channels), max(c.time[-1] for c in channels))
    for length, end in ((time[0] - first, "first"), (last - time[-1], "last")):
        if length >= 1.0 / rate:
            changes.append(f"{end} {length:.3g} s left out, where not every channel runs")
    return Resampled(time, values, tuple(changes))


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
        interpolated: Array = scipy.interpolate.make_interp_spline(channel.time, channel.values, k=3)(time)
        same = channel.even and abs(step / own - 1.0) < _SAME and _on_samples(channel.time, time)
        return (
            (channel.values[_nearest(channel.time, time)], "")
            if same
            else (interpolated, f"{named} by cubic spline")
        )
    even = channel.time if channel.even else np.linspace(channel.time[0], channel.time[-1], len(channel.time))
    values = channel.values if channel.even else np.interp(even, channel.time, channel.values)
    ratio = step / float(even[1] - even[0])
    half = math.ceil(_HALF_LENGTH * ratio)
    if half >= len(values):
        raise MeasurementError(
            channel.name,
            f"is shorter than the anti-alias filter of the new clock ({half} samples to either side)",
            next_step="take a higher rate",
        )
    taps = scipy.signal.firwin(2 * half + 1, 1.0 / ratio, window=("kaiser", _KAISER))
    padded = np.pad(values, half, mode="reflect", reflect_type="odd")
    smooth: Array = scipy.signal.fftconvolve(padded, taps, mode="valid")
    change = f"{named} with an anti-alias filter" + ("" if channel.even else ", uneven steps interpolated")
    return scipy.interpolate.make_interp_spline(even, smooth, k=3)(np.minimum(time, even[-1])), change


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


@dataclass(frozen=True)
class Lag:
    """Time by which one channel is delayed against another."""

    seconds: float  # positive where the first channel is delayed
    standard_error: float  # in s; allows for coloured residuals
    correlation: float  # at that lag
    # delayed, reference: names of the channels
    delayed: str
    reference: str

    def __str__(self) -> str:
        return (
            f"{self.delayed} is {1e3 * self.seconds:.4g} ± {1e3 * self.standard_error:.2g} ms later than "
            f"{self.reference}, correlation {self.correlation:.3f}"
        )


def lag_between(delayed: Channel, reference: Channel, *, longest: float | None = None) -> Lag:
    """Estimate the time by which one channel is delayed against another.

    The correlation of the overlap is maximised over whole samples, then between samples. The
    standard error is that of the least-squares shift, with the long-run variance of its score (Newey and
    West 1987) in place of that of white noise.

    ``delayed``, ``reference``: both show the same motion; units and offsets may differ, the sign may not.
    ``longest``: largest lag to either side in s; a quarter of the shorter record by default.
    """
    step = max(delayed.step, reference.step)
    span = min(delayed.time[-1] - delayed.time[0], reference.time[-1] - reference.time[0])
    most = _SHARE * span if longest is None else longest
    one, other = (_smooth(each, step) for each in (delayed, reference))
    origin = float(one.time[0] - other.time[0])
    lags, correlations = _correlations(one.values, other.values, step, (origin, most))
    pair = f"'{delayed.name}' against '{reference.name}'"
    peak = int(np.argmax(correlations))
    if correlations[peak] < LEAST_CORRELATION:
        raise MeasurementError(
            f"lag of {pair}",
            f"they are too different: correlation at most {correlations[peak]:.2f}, at {lags[peak]:.4g} s; "
            f"at least {LEAST_CORRELATION} is needed",
            next_step="take two channels that show the same motion, or look for a longer lag (longest)",
        )
    if peak in (0, len(lags) - 1):
        raise MeasurementError(
            f"lag of {pair}", f"the correlation is largest at the end of the range, {lags[peak]:.4g} s",
            next_step="look for a longer lag (longest)",
        )  # fmt: skip
    shift = _refined(one, other, float(lags[peak]), step)
    error, residual = _standard_error(one, other, shift)
    best = float(np.max(correlations))
    # A second peak of a repeating motion leaves as little unexplained variance as the first.
    allowed = (1.0 - best**2) * (
        1.0 + _SIGNIFICANT * math.sqrt(2.0 / max(effective_size(residual), 1.0))
    ) + 1e-9
    peaks = [
        k
        for k in scipy.signal.find_peaks(correlations)[0]
        if 1.0 - correlations[k] ** 2 <= allowed and correlations[k] > 0.0
    ]
    if len(peaks) > 1:
        equal = " and ".join(f"{lags[k]:.4g} s" for k in sorted(peaks, key=lambda k: -correlations[k])[:2])
        raise MeasurementError(
            f"lag of {pair}",
            f"is not unique: the motion repeats, so {equal} fit as well",
            next_step="look for a lag below half a period (longest), or record a motion that does not repeat",
        )
    return Lag(shift, error, _at(one, other, shift), delayed.name, reference.name)


def _smooth(channel: Channel, step: float) -> Channel:
    if np.ptp(channel.values) == 0.0:
        raise MeasurementError(f"'{channel.name}'", "is constant, so it shows no motion to be aligned by")
    even = on_one_clock([channel], 1.0 / step)
    smooth = scipy.ndimage.gaussian_filter1d(even.values[channel.name], _WIDTH, mode="nearest")
    return Channel(channel.name, even.time, smooth)


def _correlations(
    delayed: Array, reference: Array, step: float, reach: tuple[float, float]
) -> tuple[Array, Array]:
    """Return lags in s and the correlation of the overlap at each; all sums by FFT."""
    origin, most = reach
    ones = np.ones_like(delayed), np.ones_like(reference)
    a, b = delayed - delayed.mean(), reference - reference.mean()
    correlate = scipy.signal.correlate
    count = np.maximum(correlate(ones[0], ones[1], method="fft"), 1.0)
    first, second = correlate(a, ones[1], method="fft"), correlate(ones[0], b, method="fft")
    square_a = correlate(a * a, ones[1], method="fft") - first**2 / count
    square_b = correlate(ones[0], b * b, method="fft") - second**2 / count
    product = correlate(a, b, method="fft") - first * second / count
    lags = (np.arange(len(count)) - (len(reference) - 1)) * step + origin
    kept = (np.abs(lags) <= most) & (count >= 0.5 * min(len(delayed), len(reference)))
    size = np.sqrt(np.maximum(square_a * square_b, 0.0))
    if not np.any(kept) or float(np.max(size[kept])) <= 0.0:
        raise MeasurementError(
            "lag", f"the channels do not overlap by half within lags of {most:g} s",
            next_step="look for a longer lag (longest)",
        )  # fmt: skip
    floor = 1e-9 * float(np.max(size[kept]))
    return lags[kept], product[kept] / np.maximum(size[kept], floor)


def _overlap(delayed: Channel, reference: Channel, shift: float) -> tuple[Array, Array, Array]:
    """Return the delayed channel moved by a shift, its rate, and the reference, where both run."""
    times = reference.time
    inside = (times + shift >= delayed.time[0]) & (times + shift <= delayed.time[-1])
    spline = scipy.interpolate.make_interp_spline(delayed.time, delayed.values, k=3)
    at = times[inside] + shift
    return spline(at), spline.derivative()(at), reference.values[inside]


def _at(delayed: Channel, reference: Channel, shift: float) -> float:
    moved, _, target = _overlap(delayed, reference, shift)
    return float(np.corrcoef(moved, target)[0, 1])


def _refined(delayed: Channel, reference: Channel, lag: float, step: float) -> float:
    optimum = scipy.optimize.minimize_scalar(
        lambda shift: -_at(delayed, reference, shift),
        bounds=(lag - step, lag + step),
        method="bounded",
        options={"xatol": 1e-5 * step},
    )
    return float(optimum.x)


def _standard_error(delayed: Channel, reference: Channel, shift: float) -> tuple[float, Array]:
    moved, rate, target = _overlap(delayed, reference, shift)
    design = np.column_stack([moved, np.ones_like(moved)])
    gain, _ = np.linalg.lstsq(design, target, rcond=None)[0]
    residual = target - design @ np.linalg.lstsq(design, target, rcond=None)[0]
    # Sensitivity to a shift, beyond a gain and an offset.
    own = gain * (rate - design @ np.linalg.lstsq(design, rate, rcond=None)[0])
    score = own * residual
    rho = autocorrelation(score, min(len(score) - 1, len(score) // 4))[1:]
    quiet = np.flatnonzero(rho < 2.0 / math.sqrt(len(score)))
    colour = max(1.0, 1.0 + 2.0 * float(np.sum(rho[: quiet[0]] if len(quiet) else rho)))
    return math.sqrt(len(score) * float(np.mean(score**2)) * colour) / float(own @ own), residual
