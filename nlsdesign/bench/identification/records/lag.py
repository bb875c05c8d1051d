"""The lag between two channels that show the same motion, by cross-correlation, to a fraction of a sample."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize_scalar
from scipy.signal import correlate, find_peaks

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError
from ..statistics.residuals import autocorrelation, effective_size
from .clocks import Channel, on_one_clock

LEAST_CORRELATION = 0.7
"""At this correlation half of the variance of one channel is explained by the other."""
_SHARE = 0.25
"""Default of the largest lag, as a share of the shorter record."""
_WIDTH = 2.0
"""Both channels pass a Gaussian filter of this many samples, which removes the bias to whole samples."""
_SIGNIFICANT = 5.0
"""Standard deviations by which a second peak of the correlation must be lower."""


@dataclass(frozen=True)
class Lag:
    """Time by which one channel is delayed against another.

    Parameters
    ----------
    seconds
        Positive where the first channel is delayed.
    standard_error
        In s; allows for coloured residuals.
    correlation
        At that lag.
    delayed, reference
        Names of the channels.
    """

    seconds: float
    standard_error: float
    correlation: float
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
    _check_unique(pair, lags, correlations, effective_size(residual))
    return Lag(shift, error, _at(one, other, shift), delayed.name, reference.name)


def _smooth(channel: Channel, step: float) -> Channel:
    if np.ptp(channel.values) == 0.0:
        raise MeasurementError(f"'{channel.name}'", "is constant, so it shows no motion to be aligned by")
    even = on_one_clock([channel], 1.0 / step)
    smooth = gaussian_filter1d(even.values[channel.name], _WIDTH, mode="nearest")
    return Channel(channel.name, even.time, smooth)


def _correlations(
    delayed: Array, reference: Array, step: float, reach: tuple[float, float]
) -> tuple[Array, Array]:
    """Return lags in s and the correlation of the overlap at each; all sums by FFT."""
    origin, most = reach
    ones = np.ones_like(delayed), np.ones_like(reference)
    a, b = delayed - delayed.mean(), reference - reference.mean()
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
    spline = make_interp_spline(delayed.time, delayed.values, k=3)
    at = times[inside] + shift
    return spline(at), spline.derivative()(at), reference.values[inside]


def _at(delayed: Channel, reference: Channel, shift: float) -> float:
    moved, _, target = _overlap(delayed, reference, shift)
    return float(np.corrcoef(moved, target)[0, 1])


def _refined(delayed: Channel, reference: Channel, lag: float, step: float) -> float:
    optimum = minimize_scalar(
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


def _check_unique(pair: str, lags: Array, correlations: Array, effective: float) -> None:
    best = float(np.max(correlations))
    # A second peak of a repeating motion leaves as little unexplained variance as the first.
    allowed = (1.0 - best**2) * (1.0 + _SIGNIFICANT * math.sqrt(2.0 / max(effective, 1.0))) + 1e-9
    peaks = [
        k
        for k in find_peaks(correlations)[0]
        if 1.0 - correlations[k] ** 2 <= allowed and correlations[k] > 0.0
    ]
    if len(peaks) > 1:
        equal = " and ".join(f"{lags[k]:.4g} s" for k in sorted(peaks, key=lambda k: -correlations[k])[:2])
        raise MeasurementError(
            f"lag of {pair}",
            f"is not unique: the motion repeats, so {equal} fit as well",
            next_step="look for a lag below half a period (longest), or record a motion that does not repeat",
        )
