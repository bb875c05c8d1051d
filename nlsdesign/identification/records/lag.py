"""The lag between two channels that show the same motion: by cross-correlation, finer than a sample."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize_scalar
from scipy.signal import correlate, find_peaks

from ...errors import MeasurementError
from ..statistics.residuals import autocorrelation, effective_size
from .clocks import Channel, on_one_clock

Array = NDArray[np.float64]

LEAST_CORRELATION = 0.7
"""Half of the variance of one channel is then that of the other."""
_SHARE = 0.25
"""Largest lag looked for, as a share of the shorter record, unless one is given."""
_WIDTH = 2.0
"""Both channels pass the same Gaussian of this many samples, so that noise does not pull to whole samples."""
_SIGNIFICANT = 5.0


@dataclass(frozen=True)
class Lag:
    """How much later one channel shows what another shows.

    Parameters
    ----------
    seconds
        Positive where the first channel is late.
    standard_error
        In s; allows for coloured residuals.
    correlation
        At that lag.
    late, reference
        Names of the channels.
    """

    seconds: float
    standard_error: float
    correlation: float
    late: str
    reference: str

    def __str__(self) -> str:
        return (
            f"{self.late} is {1e3 * self.seconds:.4g} ± {1e3 * self.standard_error:.2g} ms later than "
            f"{self.reference}, correlation {self.correlation:.3f}"
        )


def lag_between(late: Channel, reference: Channel, *, longest: float | None = None) -> Lag:
    """Estimate by how much one channel comes later than another.

    The correlation of what overlaps is maximised over whole samples, then over a shift in between. The
    standard error is that of the least-squares shift, with the long-run variance of its score (Newey and
    West 1987) in place of that of white noise.

    Parameters
    ----------
    late, reference
        Both show the same motion, perhaps in other units and with another sign of the offset, not with the
        sign turned.
    longest
        Largest lag looked for, to either side, in s; a quarter of the shorter record by default.

    Raises
    ------
    MeasurementError
        If a channel is constant, the correlation is below 0.7 everywhere, is largest at the end of the range,
        or is as large at another lag.
    """
    step = max(late.step, reference.step)
    span = min(late.time[-1] - late.time[0], reference.time[-1] - reference.time[0])
    most = _SHARE * span if longest is None else longest
    one, other = (_smooth(each, step) for each in (late, reference))
    origin = float(one.time[0] - other.time[0])
    lags, found = _correlations(one.values, other.values, step, (origin, most))
    pair = f"'{late.name}' against '{reference.name}'"
    peak = int(np.argmax(found))
    if found[peak] < LEAST_CORRELATION:
        raise MeasurementError(
            f"lag of {pair}",
            f"they are too different: correlation at most {found[peak]:.2f}, at {lags[peak]:.4g} s; "
            f"at least {LEAST_CORRELATION} is needed",
            next_step="take two channels that show the same motion, or look for a longer lag (longest)",
        )
    if peak in (0, len(lags) - 1):
        raise MeasurementError(
            f"lag of {pair}", f"the correlation is largest at the end of the range, {lags[peak]:.4g} s",
            next_step="look for a longer lag (longest)",
        )  # fmt: skip
    shift = _between(one, other, float(lags[peak]), step)
    error, residual = _standard_error(one, other, shift)
    _check_unique(pair, lags, found, effective_size(residual))
    return Lag(shift, error, _at(one, other, shift), late.name, reference.name)


def _smooth(channel: Channel, step: float) -> Channel:
    if np.ptp(channel.values) == 0.0:
        raise MeasurementError(f"'{channel.name}'", "is constant, so it shows no motion to be aligned by")
    even = on_one_clock([channel], 1.0 / step)
    smooth = gaussian_filter1d(even.values[channel.name], _WIDTH, mode="nearest")
    return Channel(channel.name, even.time, smooth)


def _correlations(
    late: Array, reference: Array, step: float, reach: tuple[float, float]
) -> tuple[Array, Array]:
    """Return lags in s and the correlation of what overlaps at each, all sums by FFT."""
    origin, most = reach
    ones = np.ones_like(late), np.ones_like(reference)
    a, b = late - late.mean(), reference - reference.mean()
    count = np.maximum(correlate(ones[0], ones[1], method="fft"), 1.0)
    first, second = correlate(a, ones[1], method="fft"), correlate(ones[0], b, method="fft")
    square_a = correlate(a * a, ones[1], method="fft") - first**2 / count
    square_b = correlate(ones[0], b * b, method="fft") - second**2 / count
    product = correlate(a, b, method="fft") - first * second / count
    lags = (np.arange(len(count)) - (len(reference) - 1)) * step + origin
    kept = (np.abs(lags) <= most) & (count >= 0.5 * min(len(late), len(reference)))
    size = np.sqrt(np.maximum(square_a * square_b, 0.0))
    if not np.any(kept) or float(np.max(size[kept])) <= 0.0:
        raise MeasurementError(
            "lag", f"the channels do not overlap by half within lags of {most:g} s",
            next_step="look for a longer lag (longest)",
        )  # fmt: skip
    floor = 1e-9 * float(np.max(size[kept]))
    return lags[kept], product[kept] / np.maximum(size[kept], floor)


def _overlap(late: Channel, reference: Channel, shift: float) -> tuple[Array, Array, Array]:
    """Return the late channel moved by a shift, its rate, and the reference, where both run."""
    times = reference.time
    inside = (times + shift >= late.time[0]) & (times + shift <= late.time[-1])
    spline = make_interp_spline(late.time, late.values, k=3)
    at = times[inside] + shift
    return spline(at), spline.derivative()(at), reference.values[inside]


def _at(late: Channel, reference: Channel, shift: float) -> float:
    moved, _, target = _overlap(late, reference, shift)
    return float(np.corrcoef(moved, target)[0, 1])


def _between(late: Channel, reference: Channel, lag: float, step: float) -> float:
    found = minimize_scalar(
        lambda shift: -_at(late, reference, shift),
        bounds=(lag - step, lag + step),
        method="bounded",
        options={"xatol": 1e-5 * step},
    )
    return float(found.x)


def _standard_error(late: Channel, reference: Channel, shift: float) -> tuple[float, Array]:
    moved, rate, target = _overlap(late, reference, shift)
    design = np.column_stack([moved, np.ones_like(moved)])
    gain, _ = np.linalg.lstsq(design, target, rcond=None)[0]
    residual = target - design @ np.linalg.lstsq(design, target, rcond=None)[0]
    # What a shift does beyond a gain and an offset.
    own = gain * (rate - design @ np.linalg.lstsq(design, rate, rcond=None)[0])
    score = own * residual
    rho = autocorrelation(score, min(len(score) - 1, len(score) // 4))[1:]
    quiet = np.flatnonzero(rho < 2.0 / math.sqrt(len(score)))
    colour = max(1.0, 1.0 + 2.0 * float(np.sum(rho[: quiet[0]] if len(quiet) else rho)))
    return math.sqrt(len(score) * float(np.mean(score**2)) * colour) / float(own @ own), residual


def _check_unique(pair: str, lags: Array, found: Array, worth: float) -> None:
    best = float(np.max(found))
    # Twice the same motion: what a second peak leaves over is no more than what the first does.
    allowed = (1.0 - best**2) * (1.0 + _SIGNIFICANT * math.sqrt(2.0 / max(worth, 1.0))) + 1e-9
    peaks = [k for k in find_peaks(found)[0] if 1.0 - found[k] ** 2 <= allowed and found[k] > 0.0]
    if len(peaks) > 1:
        told = " and ".join(f"{lags[k]:.4g} s" for k in sorted(peaks, key=lambda k: -found[k])[:2])
        raise MeasurementError(
            f"lag of {pair}",
            f"is not unique: the motion repeats, so {told} fit as well",
            next_step="look for a lag below half a period (longest), or record a motion that does not repeat",
        )
