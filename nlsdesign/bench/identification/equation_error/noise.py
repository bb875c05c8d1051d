"""The noise of each measured channel: its level, its colour, and where both are known from.

The spectrum of broadband noise is a white part and parts that remember, with no lines and no resonances.
The density per sample is that of white noise plus first-order processes, s(ω) = σ² + Σ vᵢ·(1 − aᵢ²)/(1 −
2aᵢ·cos ω + aᵢ²), aᵢ = e^(−h/τᵢ): it falls with frequency, so a line or a resonance has no part in it. It is
fitted to the medians of bands of the periodogram, which one line in a band does not move.

Stretches are shorter than records, and below the lowest frequency that they show nothing is known. A residual
passes what is there. So noise that still rises towards that frequency is taken to rise on, by the same power
of the frequency, down to one period in a record, unless the corner of a single process is plainly seen: to
let it end where the view ends would make the noise of a record too small, by a factor of two for 1/f noise.

A controller that takes a rate from coarse counts gives a current that jumps with each of them. That current
acts; it is no noise of the ammeter. So the noise of what drives a block is that of its part which no linear
filter of the readings of motion gives.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import scipy

from ....foundation.arrays import Array
from ....foundation.symbolic import remembered
from ....simulation import Trace
from ..filters import filter_weights
from ..records.measurement import Record, RecordSet

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
_CONTRADICTED = 4.0
"""Standard errors by which a test may be missed: some forty are made, and the model is not exact."""
_LAGS, _CLASSES = 3, 3
_STILL = 1.5
"""Counts within which a motion is at rest, or comes again."""
_ELSEWHERE = 10.0
_NEARLY_ALL = 0.95
_LEAST_SAMPLES = 100
_MOST_STRETCHES = 200
"""Stretches of rest in a record, at most, so that the search for them ends."""
_MOST_SAMPLES, _SHORTEST = 3000, 8
"""Samples on which a period is looked for, and its least length in them."""


class Stretch(NamedTuple):
    """Samples in which a signal shows its noise alone."""

    samples: Array  # shape (n,)
    step: float  # time between them in s
    lag: int  # samples after which it was subtracted from itself, divided by √2; zero where it was not


class Band(NamedTuple):
    """A band of a spectrum: its middle in Hz, its density per sample, and of how many frequencies it is."""

    frequency: float
    density: float
    number: int


class OneProcess(NamedTuple):
    """Variances of white noise and of one first-order process, and twice the likelihood that they lose."""

    white: float
    variance: float
    deviance: float


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
    bands = bands_of([s for s in stretches if len(s.samples) > 8 * _DEGREE])
    if len(bands) < _LEAST_BANDS:
        return None
    step = float(np.median([s.step for s in stretches]))
    frequency, density, count = (np.array(column) for column in zip(*bands, strict=True))
    if not np.any(density > 0.0):
        return None
    seen, parts = _fitted(frequency, density, count, step)
    model = seen + sum(
        (p.variance * _density(p.time, frequency, step) for p in parts), np.zeros_like(frequency)
    )
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
        solution, _ = scipy.optimize.nnls(columns * weights[:, None], density * weights)
        model = np.maximum(columns @ solution, 1e-12 * density.max())
    parts = tuple(NoisePart(float(v), t) for v, t in zip(solution[1:], times, strict=True) if v > 0.0)
    return float(solution[0]), parts


def _has_one_time(frequency: Array, density: Array, count: Array, step: float) -> bool:
    """Tell whether noise is plainly that of one first-order process, which is flat below its corner.

    It is compared with a power of the frequency; both stand beside white noise and have three numbers.
    """
    longest = 1.0 / (2.0 * math.pi * frequency.min())
    times = np.geomspace(step, max(2.0 * step, _STEEPER * longest), 6 * _TIMES_PER_DECADE)
    corners = [_one_process(_density(float(t), frequency, step), density, count).deviance for t in times]
    best = int(np.argmin(corners))
    rising = [(frequency / frequency[0]) ** -power for power in _POWERS]
    powers = [_one_process(each, density, count).deviance for each in rising]
    return bool(times[best] <= longest and corners[best] < min(powers) - _PLAINLY_ONE)


def fitted_at(time: float, bands: Sequence[Band], step: float) -> OneProcess:
    """Return the white noise and the first-order process of one time in s nearest to bands of a periodogram.

    ``time``: zero for white noise alone.
    """
    frequency, density, count = (np.array(column) for column in zip(*bands, strict=True))
    return _one_process(_density(time, frequency, step) if time else np.zeros_like(density), density, count)


def is_white(rows: Array, speed: Array) -> bool:
    """Tell whether rows are white noise of variance 1, early and late, in slow and in fast motion."""
    count = len(rows)
    by_speed = np.array_split(rows[np.argsort(speed, kind="stable")], _CLASSES)
    misses = [
        (float(np.mean(part**2)) - 1.0) * math.sqrt(len(part) / 2.0)
        for part in (*by_speed, *np.array_split(rows, _CLASSES))
    ]
    misses += [float(rows[k:] @ rows[:-k]) / math.sqrt(count) for k in range(1, _LAGS + 1)]
    return not np.max(np.abs(misses)) > _CONTRADICTED


def _one_process(coloured: Array, density: Array, count: Array) -> OneProcess:
    """Return the white noise and the part of one form nearest to bands of a periodogram."""
    columns, model = np.column_stack([np.ones_like(density), coloured]), density
    for _ in range(_ROUNDS):
        weights = np.sqrt(count) / model
        solution, _ = scipy.optimize.nnls(columns * weights[:, None], density * weights)
        model = np.maximum(columns @ solution, 1e-12 * density.max())
    # A median knows as much as ln²2 of the numbers that it is taken from.
    off = np.log(np.maximum(density, 1e-300) / model)
    return OneProcess(float(solution[0]), float(solution[1]), float(math.log(2.0) ** 2 * count @ off**2))


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


def bands_of(stretches: Sequence[Stretch]) -> list[Band]:
    """Return the bands of the periodograms of some stretches, from the median of all in each."""
    if not stretches:
        return []
    given = [_periodogram(each) for each in stretches]
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
        result.append(Band(middle, float(np.median(some)) / math.log(2.0), len(some)))
        first = behind
    return result


def scatter(count: int) -> float:
    """Return the standard error of the logarithm of the median of so many exponential numbers."""
    return 1.0 / (math.log(2.0) * math.sqrt(count))


Evidence: TypeAlias = Literal["rest", "repetition", "above motion", "white only"]
"""Where the colour of a noise is known from; ``white only`` where nothing shows it."""


@dataclass(frozen=True)
class Noise:
    """Noise of each measured signal."""

    level: Mapping[str, float]  # standard deviation of its white part, in SI
    rounded: Mapping[str, bool]  # whether that is mere rounding
    # parts: parts of it that remember, beside the white one; nothing for signals without
    parts: Mapping[str, tuple[NoisePart, ...]] = field(default_factory=dict)
    evidence: Mapping[str, Evidence] = field(default_factory=dict)  # where that is known from
    # seen: lengths in s of the stretches in which the parts were seen
    seen: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    # taps: weights of neighbouring samples with which a signal is read that is held or averaged
    taps: Mapping[str, Array] = field(default_factory=dict)
    # colours: of a signal in each record that shows it, by signal and record
    colours: Mapping[str, Mapping[str, Colour]] = field(default_factory=dict)

    def deviation(self, signal: str) -> float:
        """Return the standard deviation of the whole noise of a signal."""
        return math.sqrt(self.level[signal] ** 2 + sum(p.variance for p in self.parts.get(signal, ())))

    def behind(
        self, signal: str, step: float, *, width: float = 0.0, order: int = 0, span: float = 0.0
    ) -> float:
        """Return the standard deviation of the noise of a signal behind a derivative and a filter.

        ``width`` of the Gaussian, ``span`` of rates and the ``step`` between samples are in s.
        """
        weights = self._weights(signal, width, order, step, span)
        white = self.level[signal] * float(np.linalg.norm(weights))
        return math.sqrt(white**2 + variance_behind(self.parts.get(signal, ()), weights, step))

    def memory(self, signal: str, step: float, *, width: float) -> tuple[NoisePart, ...]:
        """Return the parts of the noise of a signal that remember, with their variances behind a filter."""
        weights = self._weights(signal, width, 0, step, 0.0)
        parts = self.parts.get(signal, ())
        return tuple(NoisePart(variance_behind([p], weights, step), p.time) for p in parts)

    def covariance(self, signal: str, step: float, *, width: float, time: float, count: int) -> Array:
        """Return the covariance at lags of 0 to ``count`` samples of a first-order process behind a filter.

        Per variance of the process. ``time``: after which it has forgotten all but 37 %, in s; zero where it
        is white.
        """
        weights = self._weights(signal, width, 0, step, 0.0)
        size = 1 << (2 * (len(weights) + count) + math.ceil(8.0 * time / step)).bit_length()
        power: Array = np.abs(np.fft.rfft(weights, size)) ** 2
        if time:
            power *= _density(time, np.asarray(np.fft.rfftfreq(size, step), dtype=np.float64), step)
        return np.asarray(np.fft.irfft(power, size)[: count + 1], dtype=np.float64)

    def with_colours(self, signal: str, colours: Mapping[str, Colour], lengths: Sequence[float]) -> Noise:
        """Return the noise with the colour of a signal in records of so many s, and elsewhere their mean."""
        white = sum(each.white for each in colours.values()) / len(colours)
        parts = tuple(NoisePart(p.variance / len(colours), p.time) for c in colours.values() for p in c.parts)
        return replace(
            self,
            level={**self.level, signal: math.sqrt(white)},
            parts={**self.parts, signal: parts},
            evidence={**self.evidence, signal: "above motion"},
            seen={**self.seen, signal: tuple(lengths)},
            colours={**self.colours, signal: colours},
        )

    def in_record(self, name: str) -> Noise:
        """Return the noise in one record, where that shows a colour of its own."""
        own = {signal: of[name] for signal, of in self.colours.items() if name in of}
        level = {signal: math.sqrt(colour.white) for signal, colour in own.items()}
        parts = {signal: colour.parts for signal, colour in own.items()}
        return replace(self, level={**self.level, **level}, parts={**self.parts, **parts}) if own else self

    def read_as(self, records: RecordSet) -> Noise:
        """Return the noise as it is behind the way in which records run between their samples.

        ``records``: those that are read.
        """
        return replace(self, taps={s: f.weights for r in records.records for s, f in r.sampling.items()})

    def _weights(self, signal: str, width: float, order: int, step: float, span: float) -> Array:
        """Return the weights of the samples of a signal behind a derivative and a filter."""
        weights, taps = filter_weights(width, order, step, span), self.taps.get(signal)
        return weights if taps is None else np.convolve(weights, taps)


def estimate_noise(records: RecordSet, targets: Collection[str] = ()) -> Noise:
    """Estimate the noise of every channel from the records themselves.

    ``records``: those held out are not looked at, unless there are no others; the median over the records is
    taken. ``targets``: signals that blocks predict, whose noise may have a colour: it is told where all
    motions are at rest, and from what is left of a motion that repeats when it is subtracted from itself one
    period later. What drives a block varies at rest for other reasons than noise.
    """
    seen = records.deciding
    level, rounded, quanta = {}, {}, {}
    for column in records.columns:
        resolutions = [r.resolution_of(column.signal) for r in seen]
        white = float(np.median([g.noise for g in resolutions]))
        # The count of a resampled signal is that of its samples before, as it weighs on the new clock.
        kept = any(column.signal in r.resolution for r in seen)
        declared = 0.0 if kept else column.quantum
        quantum = declared or float(np.median([g.quantum for g in resolutions]))
        rounding = quantum / math.sqrt(12.0)
        level[column.signal] = max(white, rounding)
        rounded[column.signal] = white < 2.0 * rounding
        quanta[column.signal] = quantum
    motions = {name: quanta[name] for name, coarse in rounded.items() if coarse and name not in targets}
    parts: dict[str, tuple[NoisePart, ...]] = {}
    lengths: dict[str, tuple[float, ...]] = {}
    evidence: dict[str, Evidence] = dict.fromkeys(level, "white only")
    counted = [name for name, coarse in rounded.items() if coarse]
    for signal in level.keys() - {*targets, *counted}:
        levels = [min(r.resolution_of(signal).noise, r.noise_beside(signal, counted)) for r in seen]
        level[signal] = max(float(np.median(levels)), quanta[signal] / math.sqrt(12.0))
    quiet = [(r, *_quiet(r.trace, tuple(motions.items()))) for r in seen] if motions else []
    for signal in targets:
        if signal not in level or rounded[signal]:
            continue
        at_rest = [Stretch(r.trace[signal][s], r.step, 0) for r, rest, _ in quiet for s in rest]
        repeated = [_difference(r, signal, *pair) for r, _, repeats in quiet for pair in repeats]
        colour = colour_of(at_rest + repeated, max(r.step * len(r.trace) for r in seen))
        if colour is None:
            continue
        evidence[signal] = "rest" if _length(at_rest) >= _length(repeated) else "repetition"
        if colour.parts:
            least = quanta[signal] / math.sqrt(12.0)
            level[signal], parts[signal] = max(math.sqrt(colour.white), least), colour.parts
            lengths[signal] = tuple(s.step * len(s.samples) for s in at_rest + repeated)
    return Noise(level, rounded, parts, evidence, lengths).read_as(records)


def _length(stretches: Sequence[Stretch]) -> float:
    return sum(s.step * len(s.samples) for s in stretches)


def _difference(record: Record, signal: str, rows: slice, lag: int) -> Stretch:
    """Return a signal less itself one period before, of the variance of its noise."""
    values = record.trace[signal]
    later = values[rows.start + lag : rows.stop + lag]
    return Stretch((later - values[rows]) / math.sqrt(2.0), record.step, lag)


@remembered(64)  # the same samples are asked again each time that they are read otherwise
def _quiet(trace: Trace, motions: Sequence[tuple[str, float]]) -> tuple[list[slice], list[tuple[slice, int]]]:
    """Return where all motions rest, and where the record repeats itself after so many samples."""
    counts = [trace[name] / quantum for name, quantum in motions]
    # The stretches in which no motion leaves its count by more than one, without their first third. There
    # rubber still creeps, which would be taken for slow noise.
    n = len(counts[0])
    least = max(_LEAST_SAMPLES, n // _MOST_STRETCHES)
    result, first = [], 0
    while first < n - least:
        for end in (first + least, n):  # most stretches are left soon
            behind = min(
                first + int(np.argmax(np.append(np.abs(each[first:end] - each[first]) > _STILL, True)))
                for each in counts
            )
            if behind < end:
                break
        if behind - first >= least:
            result.append(slice(first + (behind - first) // 3, behind))
            first = behind
        else:
            # What has moved on since this sample is not at rest at any sample before it left either.
            first += max(1, (behind - first) // 2)
    return result, _repeats(counts)


def _repeats(counts: Sequence[Array]) -> list[tuple[slice, int]]:
    """Return the rows that come again one period later, with the period in samples; nothing if none do."""
    n = len(counts[0])
    thin = max(1, n // _MOST_SAMPLES)
    coarse = [each[::thin] for each in counts]
    for lag in range(_SHORTEST, len(coarse[0]) // 3):
        if not all(_comes_again(each, lag, lag, thin) for each in coarse):
            continue
        around = range(max(1, (lag - 1) * thin), (lag + 1) * thin + 1)
        best = min(around, key=lambda k: sum(_misses(each, k, k) for each in counts))
        if all(_misses(each, best, best) <= _STILL for each in counts):
            return [(slice(best, n - best), best)]
    return []


def _misses(counts: Array, lag: int, first: int) -> float:
    """Return by how many counts nearly all samples miss those one lag later."""
    apart = np.abs(counts[first + lag :] - counts[first:-lag])
    return float(np.quantile(apart, _NEARLY_ALL))


def _comes_again(counts: Array, lag: int, first: int, thin: int) -> bool:
    """Tell whether a motion comes again after a lag, and was elsewhere in between."""
    near = _STILL + (float(np.max(np.abs(np.diff(counts)))) if thin > 1 else 1.0)
    close = int(np.count_nonzero(np.abs(counts[first + lag :] - counts[first:-lag]) <= near))
    # Most lags have too few samples that are close: counting them is quicker than sorting all.
    return close > int(_NEARLY_ALL * (len(counts) - first - lag - 1)) and (
        _misses(counts, lag, first) <= near and _misses(counts, max(1, lag // 2), first) > _ELSEWHERE * near
    )
