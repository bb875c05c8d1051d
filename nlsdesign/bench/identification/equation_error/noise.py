"""The noise of each measured channel: its level, its colour, and where both are known from."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from ....foundation.arrays import Array
from ..records.measurement import Record, RecordSet
from ..statistics.coloured import NoisePart, Stretch, colour_of, variance_behind

Evidence: TypeAlias = Literal["rest", "repetition", "white only"]
"""Where the colour of a noise is known from; ``white only`` where nothing shows it."""

_STILL = 1.5
"""Counts within which a motion is at rest, or comes again."""
_ELSEWHERE = 10.0
_NEARLY_ALL = 0.95
_LEAST_SAMPLES = 100
_MOST_STRETCHES = 200
"""Stretches of rest in a record, at most, so that the search for them ends."""
_MOST_SAMPLES, _SHORTEST = 3000, 8
"""Samples on which a period is looked for, and its least length in them."""


@dataclass(frozen=True)
class Noise:
    """Noise of each measured signal.

    Parameters
    ----------
    level
        Standard deviation of its white part, in SI.
    rounded
        Whether that is mere rounding.
    parts
        Parts of it that remember, beside the white one; nothing for signals without.
    evidence
        Where that is known from.
    seen
        Lengths in s of the stretches in which the parts were seen.
    """

    level: Mapping[str, float]
    rounded: Mapping[str, bool]
    parts: Mapping[str, tuple[NoisePart, ...]] = field(default_factory=dict)
    evidence: Mapping[str, Evidence] = field(default_factory=dict)
    seen: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def deviation(self, signal: str) -> float:
        """Return the standard deviation of the whole noise of a signal."""
        return math.sqrt(self.level[signal] ** 2 + sum(p.variance for p in self.parts.get(signal, ())))

    def behind(self, signal: str, weights: Array, step: float) -> float:
        """Return the standard deviation of the noise of a signal behind a filter."""
        white = self.level[signal] * float(np.linalg.norm(weights))
        return math.sqrt(white**2 + variance_behind(self.parts.get(signal, ()), weights, step))

    def memory(self, signal: str, weights: Array, step: float) -> tuple[NoisePart, ...]:
        """Return the parts of the noise of a signal that remember, with their variances behind a filter."""
        parts = self.parts.get(signal, ())
        return tuple(NoisePart(variance_behind([p], weights, step), p.time) for p in parts)


def estimate_noise(records: RecordSet, targets: Collection[str] = ()) -> Noise:
    """Estimate the noise of every channel from the records themselves.

    ``records``: those held out are not looked at, unless there are no others; the median over the records is
    taken. ``targets``: signals that blocks predict, whose noise may have a colour: it is told where all
    motions are at rest, and from what is left of a motion that repeats when it is subtracted from itself one
    period later. What drives a block varies at rest for other reasons than noise.
    """
    seen = records.of("fit", "selection") or records.records
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
    quiet = [(r, *_quiet(r, motions)) for r in seen] if motions else []
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
    return Noise(level, rounded, parts, evidence, lengths)


def _length(stretches: Sequence[Stretch]) -> float:
    return sum(s.step * len(s.samples) for s in stretches)


def _difference(record: Record, signal: str, rows: slice, lag: int) -> Stretch:
    """Return a signal less itself one period before, of the variance of its noise."""
    values = record.trace[signal]
    later = values[rows.start + lag : rows.stop + lag]
    return Stretch((later - values[rows]) / math.sqrt(2.0), record.step, lag)


def _quiet(record: Record, motions: Mapping[str, float]) -> tuple[list[slice], list[tuple[slice, int]]]:
    """Return where all motions rest, and where the record repeats itself after so many samples."""
    counts = [record.trace[name] / quantum for name, quantum in motions.items()]
    return _rests(counts), _repeats(counts)


def _rests(counts: Sequence[Array]) -> list[slice]:
    """Return the stretches in which no motion leaves its count by more than one, without their first third.

    There rubber still creeps, which would be taken for slow noise.
    """
    n = len(counts[0])
    least = max(_LEAST_SAMPLES, n // _MOST_STRETCHES)
    result, first = [], 0
    while first < n - least:
        behind = min(
            first + int(np.argmax(np.append(np.abs(each[first:] - each[first]) > _STILL, True)))
            for each in counts
        )
        if behind - first >= least:
            result.append(slice(first + (behind - first) // 3, behind))
            first = behind
        else:
            # What has moved on since this sample is not at rest at any sample before it left either.
            first += max(1, (behind - first) // 2)
    return result


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
    return (
        _misses(counts, lag, first) <= near and _misses(counts, max(1, lag // 2), first) > _ELSEWHERE * near
    )
