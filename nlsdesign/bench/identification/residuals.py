"""What a residual tells: its noise floor, its size, its shape, and how many independent numbers it holds.

A residual of force over extension also has a loop, whose sign tells whether a piece takes work over a cycle,
as a passive one must, or gives any.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array, Mask

_ORDERS, _PLAINLY = (4, 8, 12), 0.6
_MEDIAN_OF_NORMAL = 0.6744897501960817
_PAST, _AHEAD = 16, 1
"""Samples of a reading that a controller may make a signal of: a filter of its rate remembers some, and a
stamp may be one late."""
_SAMPLES_PER_WEIGHT = 20
"""Samples for each weight of such a controller, at least."""
_BACK = 0.03
"""A path has come back where it is this near its beginning, as a share of its range."""
_SIGNIFICANT = 5.0
_LEAST_SHARE = 0.01
"""Below this share of the work on the way, rounding and filters decide on the sign."""


def noise_of(signal: Array) -> float:
    """Estimate the standard deviation of the white noise in a sampled signal.

    The fourth difference removes everything smooth; its median size is that of the noise. Where differences
    of higher order are plainly smaller, the signal moves fast for its sampling, and these are taken. Source:
    von Neumann et al. 1941 (the idea); Gasser et al. 1986 (a robust form).

    Parameters
    ----------
    signal
        Shape (n,), sampled faster than ten times a period.
    """
    level = _difference_level(signal, _ORDERS[0])
    for order in _ORDERS[1:]:
        higher = _difference_level(signal, order)
        if higher >= _PLAINLY * level:
            break
        level = higher
    return level


def _difference_level(signal: Array, order: int) -> float:
    """Return the standard deviation of white noise whose differences of an order have this median size."""
    weights = np.array([(-1.0) ** k * math.comb(order, k) for k in range(order + 1)])
    if len(signal) <= order:
        return 0.0
    differences = np.convolve(signal, weights, mode="valid") / np.linalg.norm(weights)
    return float(np.median(np.abs(differences)) / _MEDIAN_OF_NORMAL)


def noise_beside(signal: Array, readings: Array, masked: Mask) -> float:
    """Estimate the white noise in a signal, shape (n,), beside a linear filter of readings, shape (n, m).

    ``masked``: samples that tell nothing, shape (n,). Infinite where samples are too few for the weights.
    """
    rows, count = len(signal) - _PAST - _AHEAD, (_PAST + _AHEAD + 1) * readings.shape[1]
    if rows - _ORDERS[0] < _SAMPLES_PER_WEIGHT * count:
        return math.inf
    shifted = np.hstack([readings[k : k + rows] for k in range(_PAST + _AHEAD + 1)])
    itself = signal[_PAST : _PAST + rows]
    # Behind the difference nothing but the quick part of a signal is left.
    quick, answer = (np.diff(each, _ORDERS[0], axis=0) for each in (shifted, itself))
    rest = itself - shifted @ np.linalg.lstsq(quick, answer, rcond=None)[0]
    share = math.sqrt(rows / (rows - count))  # of what is left, the weights have taken some
    return share * noise_of(rest[~masked[_PAST : _PAST + rows]])


def quantum_of(signal: Array) -> float:
    """Return the size of one count: the smallest step between two values that occur."""
    steps = np.diff(np.unique(signal))
    steps = steps[steps > 1e-9 * max(1e-300, float(np.ptp(signal)))]
    return float(steps.min()) if len(steps) else 0.0


def autocorrelation(residual: Array, lags: int) -> Array:
    """Return the autocorrelation at lags 0 to ``lags``."""
    centred = residual - residual.mean()
    size = 1 << int(np.ceil(np.log2(2 * len(centred))))
    power: Array = np.abs(np.fft.rfft(centred, size)) ** 2
    covariance = np.fft.irfft(power, size)[: lags + 1]
    result: Array = covariance / covariance[0] if covariance[0] > 0.0 else np.eye(1, lags + 1)[0]
    return result


def effective_size(residual: Array) -> float:
    """Return how many independent samples a coloured residual is equivalent to.

    n/(1 + 2Σρₖ²), the size for the variance of a mean square (Bartlett 1946), summed while ρ is above its
    own noise.
    """
    n = len(residual)
    rho = autocorrelation(residual, min(n - 1, max(10, n // 4)))[1:]
    quiet = np.flatnonzero(np.abs(rho) < 2.0 / np.sqrt(n))
    kept = rho[: quiet[0]] if len(quiet) else rho
    return float(n / (1.0 + 2.0 * np.sum(kept**2)))


class Binned(NamedTuple):
    """Mean residual over a quantity: centres of the bins, means, and their standard errors."""

    centre: Array
    mean: Array
    error: Array


def binned(residual: Array, over: Array, bins: int = 30) -> Binned:
    """Return the mean residual over an angle, speed, force or time.

    ``bins``: number of bins of equal width; empty ones are left out.
    """
    edges = np.linspace(float(over.min()), float(over.max()), bins + 1)
    place = np.clip(np.digitize(over, edges) - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    full = count > 1
    mean = np.bincount(place, residual, bins)[full] / count[full]
    square = np.bincount(place, residual**2, bins)[full] / count[full]
    error = np.sqrt(np.maximum(square - mean**2, 0.0) / count[full])
    return Binned((0.5 * (edges[1:] + edges[:-1]))[full], mean, error)


def spectrum(residual: Array, step: float, bins: int = 60) -> Binned:
    """Return the power of a residual over frequency in Hz."""
    window = np.hanning(len(residual))
    power: Array = np.abs(np.fft.rfft((residual - residual.mean()) * window)) ** 2 / np.sum(window**2)
    return binned(power, np.asarray(np.fft.rfftfreq(len(residual), step), dtype=np.float64), bins)


def shapes(
    residual: Array, signals: Mapping[str, Array], *, speed: Array | None, time: Array, step: float
) -> dict[str, Binned]:
    """Return the residual over every measured signal, over frequency, and over the signals by direction.

    ``speed``: rate of the motion, whose sign is the direction; ``None`` if there is none.
    """
    result = {f"over {name}": binned(residual, values) for name, values in signals.items()}
    result["over frequency"] = spectrum(residual, step)
    result["over time"] = binned(residual, time)
    if speed is not None:
        result["over speed"] = binned(residual, speed)
        for direction, mask in (("forward", speed > 0.0), ("backward", speed < 0.0)):
            if mask.sum() > 100:
                result |= {
                    f"over {n}, {direction}": binned(residual[mask], v[mask]) for n, v in signals.items()
                }
    return result


class Agreement(NamedTuple):
    """How well a prediction meets a measurement.

    Parameters
    ----------
    rmse
        Root mean square error, in the unit of the signal.
    relative
        Mean relative error in per cent, as in Austin et al. 2015: mean of |error|/|measured|.
    of_spread
        RMSE in per cent of the measurement's standard deviation.
    noise_ratio
        RMSE over the noise floor; 1 is as good as it can be.
    """

    rmse: float
    relative: float
    of_spread: float
    noise_ratio: float


def rmse(error: Array) -> float:
    """Return the root mean square of an error.

    Parameters
    ----------
    error
        Shape (n,).
    """
    return float(np.sqrt(np.mean(np.square(error))))


def agreement(measured: Array, predicted: Array, *, noise: float = 0.0) -> Agreement:
    """Compare a prediction with a measurement.

    Parameters
    ----------
    measured, predicted
        Shape (n,).
    noise
        Noise floor in the unit of the signal; with zero the ratio is infinite.

    Returns
    -------
    Agreement
        The relative error leaves out samples below a tenth of the largest measured size, where the quotient
        says nothing.
    """
    error = predicted - measured
    size = np.abs(measured)
    large = size > 0.1 * size.max()
    spread = float(np.std(measured))
    size_of_error = rmse(error)
    return Agreement(
        size_of_error,
        float(100.0 * np.mean(np.abs(error[large]) / size[large])) if np.any(large) else float("nan"),
        100.0 * size_of_error / spread if spread > 0.0 else float("inf"),
        size_of_error / noise if noise > 0.0 else float("inf"),
    )


class Loop(NamedTuple):
    """Work over a path that comes back to where it began."""

    work: float  # ∮F dδ in J: what the piece has taken
    share: float  # of ∮|F dδ|, the work that went in and out
    uncertainty: float  # standard deviation of the work, from the noise of the force, in J
    # first, last: indices of the samples between which the path is closed
    first: int
    last: int
    # late_by: least delay of the force against the extension in s that turns the sign: with the force read so
    # much earlier the loop is empty. Zero where the work is not negative.
    late_by: float

    @property
    def gives(self) -> bool:
        """Whether the piece has plainly given work."""
        return self.work < -_SIGNIFICANT * self.uncertainty and self.share < -_LEAST_SHARE

    @property
    def takes(self) -> bool:
        """Whether the piece has plainly taken work."""
        return self.work > _SIGNIFICANT * self.uncertainty and self.share > _LEAST_SHARE


def loop_of(extension: Array, force: Array, step: float, *, noise: float = 0.0) -> Loop | None:
    """Return the loop of a record, or ``None`` if its path does not come back.

    ``extension``, ``force``: of a piece, force positive against positive extension; shape (n,).
    """
    span = float(np.ptp(extension))
    back = np.flatnonzero(np.abs(extension - extension[0]) <= _BACK * span)
    last = int(back[-1])
    if span == 0.0 or last < len(extension) // 2:
        return None
    path, pull = extension[: last + 1], force[: last + 1]
    steps = np.diff(path)
    parts = 0.5 * (pull[1:] + pull[:-1]) * steps
    work = float(parts.sum() - np.mean(pull[[0, -1]]) * (path[-1] - path[0]))
    # A force that comes late by τ takes τ·∫ (dF/dt) dδ from the work, to first order.
    per_second = float(np.sum(np.diff(pull) * steps)) / step
    delay = -work / per_second if work < 0.0 < per_second else 0.0
    return Loop(
        work,
        work / max(float(np.abs(parts).sum()), 1e-300),
        noise * float(np.linalg.norm(steps)),
        0,
        last,
        delay,
    )
