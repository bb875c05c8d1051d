"""The spectrum of broadband noise: a white part and parts that remember, with no lines and no resonances.

The density per sample is that of white noise plus first-order processes, s(ω) = σ² + Σ vᵢ·(1 − aᵢ²)/(1 −
2aᵢ·cos ω + aᵢ²), aᵢ = e^(−h/τᵢ): it falls with frequency, so a line or a resonance has no part in it. It is
fitted to the medians of bands of the periodogram, which one line in a band does not move.

Stretches are shorter than records, and below the lowest frequency that they show nothing is known. A residual
passes what is there. So noise that still rises towards that frequency is taken to rise on, by the same power
of the frequency, down to one period in a record, unless the corner of a single process is plainly seen: to
let it end where the view ends would make the noise of a record too small, by a factor of two for 1/f noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from ....foundation.arrays import Array

_DEGREE = 4
"""Degree of the polynomial that is taken from a stretch: what is slower is no noise that can be known."""
_LOWEST = 2.5
"""Periods in a stretch below which its polynomial has taken the noise too."""
_BAND = 2.0 ** (1.0 / 3.0)
_LEAST_IN_BAND, _LEAST_BANDS = 8, 4
_TIMES_PER_DECADE = 4
_ROUNDS = 20
_NEAR_LOWEST = 5.0
"""Multiple of the lowest frequency up to which the density tells how it goes on below."""
_STEEPEST = 1.0
"""Power of the frequency with which noise is taken to rise beyond what is seen, at most: 1/f is the steepest
law that goes on for long; what rises faster, as behind the corner of a first-order process, bends."""
_STEEPER = 3.0
"""Times longer than what the lowest frequency shows, tried for one process: where such a one is the best, no
corner is in view, and how far down it goes as 1/f² is open."""
_POWERS = np.linspace(0.1, _STEEPEST, 10)
_PLAINLY_ONE = 4.0
"""Deviance by which one first-order process must describe the bands better than a power of the frequency, for
its corner to count as seen: it is then seven times as probable."""
_PLAIN = 1.5
"""Density at the lowest frequency over that of the white part, up to which noise counts as white."""


class Stretch(NamedTuple):
    """Samples in which a signal shows its noise alone.

    Parameters
    ----------
    samples
        Shape (n,).
    step
        Time between them in s.
    lag
        Samples after which it was subtracted from itself, divided by √2; zero where it was not.
    """

    samples: Array
    step: float
    lag: int


class NoisePart(NamedTuple):
    """A first-order process: its variance, and the time in s after which it has forgotten all but 37 %."""

    variance: float
    time: float


class Colour(NamedTuple):
    """White variance, and the parts that remember."""

    white: float
    parts: tuple[NoisePart, ...]


def variance_behind(parts: Sequence[NoisePart], weights: Array, step: float) -> float:
    """Return the variance of first-order processes behind a filter."""
    if not parts:
        return 0.0
    size = 1 << (2 * len(weights)).bit_length()
    power: Array = np.abs(np.fft.rfft(weights, size)) ** 2
    own = np.fft.irfft(power, size)[: len(weights)]
    own[1:] *= 2.0
    lags = step * np.arange(len(weights))
    return float(sum(part.variance * (own @ np.exp(-lags / part.time)) for part in parts))


def independent_number(parts: Sequence[NoisePart], rows: int, spacing: float) -> float:
    """Return how many independent samples rows of coloured noise are equivalent to.

    For the variance of a mean square, n/(1 + 2Σ(1 − k/n)·ρₖ²) (Bartlett 1946), from what the noise is known
    to remember. The autocorrelation of a short sample shows too little of slow noise.
    """
    lags = np.arange(1, rows)
    rho = sum((p.variance * np.exp(-spacing * lags / p.time) for p in parts), np.zeros(len(lags)))
    return rows / (1.0 + 2.0 * float((1.0 - lags / max(rows, 1)) @ rho**2))


def colour_of(stretches: Sequence[Stretch], duration: float = 0.0) -> Colour | None:
    """Return the spectrum of the noise in stretches of a signal; ``None`` if they are too short to show it.

    ``duration``: of the longest record in s, down to one period in which noise that rises is taken to rise
    on; zero to end where the stretches end.
    """
    bands = _bands([_periodogram(s) for s in stretches if len(s.samples) > 8 * _DEGREE])
    if len(bands) < _LEAST_BANDS:
        return None
    step = float(np.median([s.step for s in stretches]))
    frequency, density, count = (np.array(column) for column in zip(*bands, strict=True))
    if not np.any(density > 0.0):
        return None
    seen, parts = _fitted(frequency, density, count, step)
    model = _total(seen, parts, frequency, step)
    if model.max() < _PLAIN * max(seen, model.min()):
        return Colour(float(np.sum(model * count) / np.sum(count)), ())
    below = _continued(frequency, density - seen, count, duration)
    if below is None or _has_one_time(frequency, density, count, step):
        return Colour(seen, parts)
    weight = np.full_like(below[0], np.median(count))
    return Colour(
        *_fitted(
            np.append(below[0], frequency),
            np.append(below[1] + seen, density),
            np.append(weight, count),
            step,
        )
    )


def _fitted(
    frequency: Array, density: Array, count: Array, step: float
) -> tuple[float, tuple[NoisePart, ...]]:
    """Return the white variance and the parts whose density comes nearest to that of the bands."""
    longest = 1.0 / (2.0 * math.pi * frequency.min())
    number = max(1, round(_TIMES_PER_DECADE * math.log10(max(longest / step, 1.0))))
    times = [float(t) for t in np.geomspace(step, max(longest, 2.0 * step), number + 1)[1:]]
    columns = np.column_stack([np.ones_like(frequency), *[_density(t, frequency, step) for t in times]])
    model = np.full_like(density, np.exp(np.mean(np.log(np.maximum(density, 1e-300)))))
    for _ in range(_ROUNDS):
        # Relative errors count: a periodogram scatters in proportion to its mean.
        weights = np.sqrt(count) / model
        solution, _ = nnls(columns * weights[:, None], density * weights)
        model = np.maximum(columns @ solution, 1e-12 * density.max())
    parts = tuple(NoisePart(float(v), t) for v, t in zip(solution[1:], times, strict=True) if v > 0.0)
    return float(solution[0]), parts


def _has_one_time(frequency: Array, density: Array, count: Array, step: float) -> bool:
    """Tell whether noise is plainly that of one first-order process, which is flat below its corner.

    It is compared with a power of the frequency; both stand beside white noise and have three numbers.
    """
    longest = 1.0 / (2.0 * math.pi * frequency.min())
    times = np.geomspace(step, max(2.0 * step, _STEEPER * longest), 6 * _TIMES_PER_DECADE)
    corners = [_deviance(_density(float(t), frequency, step), density, count) for t in times]
    best = int(np.argmin(corners))
    powers = [_deviance((frequency / frequency[0]) ** -power, density, count) for power in _POWERS]
    return bool(times[best] <= longest and corners[best] < min(powers) - _PLAINLY_ONE)


def _deviance(coloured: Array, density: Array, count: Array) -> float:
    """Return twice the loss in log likelihood of white noise and one part, of bands of a periodogram."""
    columns, model = np.column_stack([np.ones_like(density), coloured]), density
    for _ in range(_ROUNDS):
        weights = np.sqrt(count) / model
        solution, _ = nnls(columns * weights[:, None], density * weights)
        model = np.maximum(columns @ solution, 1e-12 * density.max())
    # A median knows as much as ln²2 of the numbers that it is taken from.
    off = np.log(np.maximum(density, 1e-300) / model)
    return float(math.log(2.0) ** 2 * count @ off**2)


def _continued(frequency: Array, risen: Array, count: Array, duration: float) -> tuple[Array, Array] | None:
    """Return frequencies below those seen, and the density above the white one as it rises on there.

    The power is that of the bands near the lowest, plus its standard error: it is not to be too small.
    """
    lowest = float(frequency[0])
    near = (frequency <= _NEAR_LOWEST * lowest) & (risen > 0.0)
    if np.count_nonzero(near) < 2 or duration * lowest <= _BAND:
        return None
    at, high = np.log(frequency[near] / lowest), np.log(risen[near])
    # The logarithm of the median of n exponential numbers scatters by 1/(ln 2·√n).
    weight = count[near] * math.log(2.0) ** 2
    middle, mean = np.average(at, weights=weight), np.average(high, weights=weight)
    spread = float(weight @ (at - middle) ** 2)
    rise = -float(weight @ ((at - middle) * (high - mean))) / spread
    power = min(max(rise, 0.0) + 1.0 / math.sqrt(spread), _STEEPEST)
    number = math.ceil(math.log(duration * lowest) / math.log(_BAND))
    below = np.geomspace(1.0 / duration, lowest, number + 1)[:-1]
    return below, np.exp(mean - power * (np.log(below / lowest) - middle))


def _total(white: float, parts: Sequence[NoisePart], frequency: Array, step: float) -> Array:
    return white + sum(
        (p.variance * _density(p.time, frequency, step) for p in parts), np.zeros_like(frequency)
    )


def _density(time: float, frequency: Array, step: float) -> Array:
    memory = math.exp(-step / time)
    turn = 2.0 * np.pi * frequency * step
    result: Array = (1.0 - memory**2) / (1.0 - 2.0 * memory * np.cos(turn) + memory**2)
    return result


def _periodogram(stretch: Stretch) -> tuple[Array, Array]:
    """Return frequencies in Hz and the density per sample, freed of the gain of the subtraction."""
    n = len(stretch.samples)
    at = np.linspace(-1.0, 1.0, n)
    smooth = np.polynomial.legendre.legval(at, np.polynomial.legendre.legfit(at, stretch.samples, _DEGREE))
    window = np.hanning(n)
    power: Array = np.abs(np.fft.rfft((stretch.samples - smooth) * window)) ** 2 / np.sum(window**2)
    frequency = np.asarray(np.fft.rfftfreq(n, stretch.step), dtype=np.float64)
    seen = frequency > _LOWEST / (n * stretch.step)
    seen[-1] = False
    gain = np.ones_like(frequency)
    if stretch.lag:
        # The window blurs the comb that a subtraction makes, all the more the fewer periods it holds.
        kept = (
            float(window[stretch.lag :] @ window[: n - stretch.lag] / (window @ window))
            if stretch.lag < n
            else 0.0
        )
        gain = 1.0 - kept * np.cos(2.0 * np.pi * frequency * stretch.step * stretch.lag)
        seen &= gain > 0.5
    return frequency[seen], power[seen] / gain[seen]


def _bands(given: Sequence[tuple[Array, Array]]) -> list[tuple[float, float, int]]:
    """Return middle, density and number of frequencies of each band, from the median of all in it."""
    if not given:
        return []
    frequency, power = (np.concatenate([pair[k] for pair in given]) for k in (0, 1))
    order = np.argsort(frequency)
    frequency, power = frequency[order], power[order]
    result, first = [], 0
    while first < len(frequency):
        behind = int(np.searchsorted(frequency, _BAND * frequency[first], side="right"))
        behind = max(behind, min(first + _LEAST_IN_BAND, len(frequency)))
        if len(frequency) - behind < _LEAST_IN_BAND:
            behind = len(frequency)
        some = power[first:behind]
        # The median of an exponential distribution is ln 2 of its mean.
        middle = float(np.exp(np.mean(np.log(frequency[first:behind]))))
        result.append((middle, float(np.median(some)) / math.log(2.0), len(some)))
        first = behind
    return result
