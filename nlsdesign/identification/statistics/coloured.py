"""The spectrum of broadband noise: a white part and parts that remember, with no lines and no resonances.

The density per sample is that of white noise plus first-order processes, s(ω) = σ² + Σ vᵢ·(1 − aᵢ²)/(1 −
2aᵢ·cos ω + aᵢ²), aᵢ = e^(−h/τᵢ): it falls with frequency, so a line or a resonance has no part in it. It is
fitted to the medians of bands of the periodogram, which one line in a band does not move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.float64]

_DEGREE = 4
"""Degree of the polynomial that is taken from a stretch: what is slower is no noise that can be known."""
_LOWEST = 2.5
"""Periods in a stretch below which its polynomial has taken the noise too."""
_BAND = 2.0 ** (1.0 / 3.0)
_LEAST_IN_BAND, _LEAST_BANDS = 8, 4
_TIMES_PER_DECADE = 4
_ROUNDS = 20
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
    """Return the variance of first-order processes behind a filter.

    Parameters
    ----------
    parts
        Of the noise.
    weights
        Of the filter.
    step
        Time between samples in s.
    """
    if not parts:
        return 0.0
    size = 1 << (2 * len(weights)).bit_length()
    power: Array = np.abs(np.fft.rfft(weights, size)) ** 2
    own = np.fft.irfft(power, size)[: len(weights)]
    own[1:] *= 2.0
    lags = step * np.arange(len(weights))
    return float(sum(part.variance * (own @ np.exp(-lags / part.time)) for part in parts))


def colour_of(stretches: Sequence[Stretch]) -> Colour | None:
    """Return the spectrum of the noise in stretches of a signal; ``None`` if they are too short to show it.

    Parameters
    ----------
    stretches
        Of one signal.
    """
    bands = _bands([_periodogram(s) for s in stretches if len(s.samples) > 8 * _DEGREE])
    if len(bands) < _LEAST_BANDS:
        return None
    step = float(np.median([s.step for s in stretches]))
    frequency, density, count = (np.array(column) for column in zip(*bands, strict=True))
    longest = 1.0 / (2.0 * math.pi * frequency.min())
    number = max(1, round(_TIMES_PER_DECADE * math.log10(max(longest / step, 1.0))))
    times = [float(t) for t in np.geomspace(step, max(longest, 2.0 * step), number + 1)[1:]]
    columns = np.column_stack([np.ones_like(frequency), *[_density(t, frequency, step) for t in times]])
    if not np.any(density > 0.0):
        return None
    model = np.full_like(density, np.exp(np.mean(np.log(np.maximum(density, 1e-300)))))
    for _ in range(_ROUNDS):
        # Relative errors count: a periodogram scatters in proportion to its mean.
        weights = np.sqrt(count) / model
        solution, _ = nnls(columns * weights[:, None], density * weights)
        model = np.maximum(columns @ solution, 1e-12 * density.max())
    if model.max() < _PLAIN * max(solution[0], model.min()):
        return Colour(float(np.sum(model * count) / np.sum(count)), ())
    parts = tuple(NoisePart(float(v), t) for v, t in zip(solution[1:], times, strict=True) if v > 0.0)
    return Colour(float(solution[0]), parts)


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
