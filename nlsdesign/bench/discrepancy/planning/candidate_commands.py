"""Candidate experiments: what a bench can be told to do within the limits of its machine.

Every command begins at rest at the same place, grows over a short rise and ends where it began.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ...identification.filters import derivative, smoothing
from ...identification.records.measurement import Record

_WIDTH, _SPAN = 4.0, 30.0
"""Width of the filter and span of a rate, in samples: noise must not count as a large rate."""


@dataclass(frozen=True)
class MachineLimits:
    """Bounds of an experiment, in SI.

    Parameters
    ----------
    low, high
        Travel of the commanded signal.
    speed, acceleration
        Largest first and second derivative of the commanded signal.
    drive
        Largest size of each drive, such as a current, by the name of the measured signal. Drives that are not
        named are not bounded.
    travel
        Lowest and highest value of each measured motion that is not commanded itself, by name.
    """

    low: float
    high: float
    speed: float = float("inf")
    acceleration: float = float("inf")
    drive: tuple[tuple[str, float], ...] = ()
    travel: tuple[tuple[str, float, float], ...] = ()


def limits_seen(
    records: Sequence[Record], commanded: str, *, drives: Sequence[str] = (), motions: Sequence[str] = ()
) -> MachineLimits:
    """Return as limits what the records show that the machine has done.

    ``commanded``: signal that the experiment is going to command. A drive has no limits of rate.
    """

    def smooth(record: Record, signal: str, order: int = 0) -> np.ndarray:
        rows = derivative(record.trace[signal], record.step, order=order, span=_SPAN * record.step)
        filtered: np.ndarray = smoothing(len(rows), _WIDTH, 1) @ rows
        return filtered

    def largest(signal: str, order: int = 0) -> float:
        return max(float(np.max(np.abs(smooth(r, signal, order)))) for r in records)

    def span(signal: str) -> tuple[float, float]:
        values = [smooth(r, signal) for r in records]
        return min(float(v.min()) for v in values), max(float(v.max()) for v in values)

    others = [m for m in motions if m != commanded]
    return MachineLimits(
        *span(commanded),
        float("inf") if commanded in drives else largest(commanded, 1),
        float("inf") if commanded in drives else largest(commanded, 2),
        tuple((name, largest(name)) for name in drives if name != commanded),
        tuple((name, *span(name)) for name in others),
    )


_SIZES = (1.0, 0.3)
"""Amplitudes, as shares of what the limits allow."""
_FREQUENCIES, _PERIODS = 3, 2.0
"""So many frequencies of each amplitude, from so many periods in the record up to the limit of the speed."""
_SAMPLES_PER_PERIOD = 40
"""The highest frequency has so many samples a period, so that its filtered acceleration is still true."""
_SLOWNESS = (0.01, 0.05, 0.25)
"""Speeds of ramps, as shares of the limit."""
_RISE = 0.05
"""Share of the record over which a motion grows from rest and comes back to it."""
_LEVELS = (0.4, 0.9, 0.2, -0.7, 0.0, 1.0)
"""Levels of holds and steps, as shares of the travel to that side."""
_TONES = 6
_OVER = 1.1
"""Rates may exceed their limits by this factor, as the window over the ends adds to those of the motion."""
_SMALL_SIDE = 0.1
"""A side with less than this share of the travel of the other one is not used by motions of both sides."""


@dataclass(frozen=True, eq=False)
class Command:
    """One candidate."""

    words: str  # what it is, without amounts
    value: Array  # commanded signal at each sample, shape (n,), in SI


def smooth_step(x: Array) -> Array:
    """Return the step from 0 to 1 with zero slope and curvature at both ends, 6x⁵ − 15x⁴ + 10x³.

    ``x``: argument; the step is between 0 and 1.
    """
    x = np.clip(x, 0.0, 1.0)
    result: Array = x**3 * (x * (6.0 * x - 15.0) + 10.0)
    return result


def commands(time: Array, rest: float, limits: MachineLimits) -> list[Command]:
    """Return the candidates."""
    up, down = max(limits.high - rest, 0.0), max(rest - limits.low, 0.0)
    family = _Family(time, up, down, limits)
    kept: list[Command] = []
    for words, shape in family.all():
        value = rest + shape
        rate = float(np.max(np.abs(np.gradient(value, time))))
        inside = value.min() >= limits.low - 1e-9 and value.max() <= limits.high + 1e-9
        push = float(np.max(np.abs(np.gradient(np.gradient(value, time), time))))
        if inside and 0.0 < rate <= _OVER * limits.speed and push <= _OVER * limits.acceleration:
            kept.append(Command(words, value))
    return kept


class _Family:
    """The candidates of one machine, relative to rest."""

    def __init__(self, time: Array, up: float, down: float, limits: MachineLimits) -> None:
        self._time, self._up, self._down = time, up, down
        self._speed, self._acceleration = limits.speed, limits.acceleration
        self._duration = float(time[-1] - time[0])
        self._step = self._duration / (len(time) - 1)
        self._highest = 1.0 / (_SAMPLES_PER_PERIOD * self._step)
        rise = _RISE * self._duration
        self._window = smooth_step(time / rise) * smooth_step((self._duration - time) / rise)

    def all(self) -> Iterator[tuple[str, Array]]:
        """Yield words and motion of each."""
        both = min(self._up, self._down)
        if both >= _SMALL_SIDE * max(self._up, self._down):
            yield from self._about(0.0, both, "")
            yield "a multisine", self._multisine(both)
            yield "a sweep of frequency", self._sweep(both)
        for side, size in (("upwards", self._up), ("downwards", -self._down)):
            one_sided = abs(size) >= (1.0 - _SMALL_SIDE) * (self._up + self._down)
            yield from self._about(0.5 * size, abs(0.5 * size), f" {side} only", fewer=not one_sided)
            yield from self._preloaded(size, f" about a preload {side}")
        yield from self._levels()

    def _about(
        self, centre: float, size: float, where: str, *, fewer: bool = False
    ) -> Iterator[tuple[str, Array]]:
        """Yield motions of some size about a centre; a one-sided one begins at its end, at rest."""
        if size <= 0.0:
            return
        for share in _SIZES[:1] if fewer else _SIZES:
            for frequency in self._frequencies(share * size)[-1 if fewer else 0 :]:
                wave = _wave(frequency * self._time, centre != 0.0)
                part = "full travel" if share == 1.0 else f"{100 * share:.0f} % of the travel"
                words = f"a sine of {part}{where} at {frequency:.2g} Hz"
                yield words, self._window * share * _placed(centre, size, wave)
        for slowness in _SLOWNESS[1 if fewer else 0 :]:
            rate = slowness * min(self._speed / size, 2.0 * math.pi * self._highest)
            triangle = self._triangle(rate, centre != 0.0)
            if triangle is not None:
                words = f"a ramp to and fro{where} at {100 * slowness:.0f} % of the largest speed"
                yield words, _placed(centre, size, triangle)
        yield from self._growing(centre, size, where)

    def _frequencies(self, size: float) -> Array:
        quickest = min(self._speed / size, math.sqrt(self._acceleration / size))
        highest = min(self._highest, 0.95 * quickest / (2.0 * np.pi))
        lowest = min(_PERIODS / self._duration, highest)
        return np.unique(np.geomspace(lowest, highest, _FREQUENCIES))

    def _triangle(self, rate: float, one_sided: bool) -> Array | None:
        """Return a rounded triangle of unit size; nothing where it would have no time to move."""
        if not np.isfinite(rate) or rate * self._duration < 0.05:
            return None
        stops = self._duration - 2.0 * _RISE * self._duration
        way = rate * np.clip(self._time - _RISE * self._duration, 0.0, stops)
        # A slow one does not reach its ends: it turns so that it is back at rest at the end.
        least = stops * rate / 2.0 if one_sided else stops * rate / 4.0
        top = min(2.0 if one_sided else 1.0, least)
        if one_sided:
            corner = top - np.abs(np.mod(way, 2.0 * top) - top)
        else:
            corner = top - np.abs(np.mod(way + top, 4.0 * top) - 2.0 * top)
        width = max(3, int(0.02 * len(way)) | 1)
        kernel = np.hanning(width + 2)[1:-1]
        padded = np.concatenate([np.full(width, corner[0]), corner, np.full(width, corner[-1])])
        rounded: Array = np.convolve(padded, kernel / kernel.sum(), mode="same")[width:-width]
        return self._window * rounded

    def _growing(self, centre: float, size: float, where: str) -> Iterator[tuple[str, Array]]:
        """Yield slow cycles that are small first, then large, then small again: what remembers shows."""
        cycles = 6
        frequency = cycles / self._duration
        if 2.0 * np.pi * frequency * size > 0.6 * self._speed:
            size = 0.6 * self._speed / (2.0 * np.pi * frequency)
        number = np.floor(self._time * frequency)
        height = np.where((number >= 2) & (number < 4), 1.0, 0.3)
        kernel = np.hanning(max(3, int(0.04 * len(height)) | 1))
        padded = np.pad(height, len(kernel), mode="edge")
        height = np.convolve(padded, kernel / kernel.sum(), mode="same")[len(kernel) : -len(kernel)]
        wave = _wave(frequency * self._time, centre != 0.0)
        shape = 0.98 * self._window * height * _placed(centre, size, wave)
        yield f"slow cycles, small, then large, then small again{where}", shape

    def _multisine(self, size: float) -> Array:
        """Return tones of falling size, with the phases of Schroeder 1970, so that their peak is low."""
        frequencies = np.geomspace(_PERIODS / self._duration, 0.5 * self._highest, _TONES)
        if np.isfinite(self._speed):
            top = max(4.0 * self._speed / (2.0 * np.pi * size), 2.0 * frequencies[0])
            frequencies = np.geomspace(frequencies[0], min(frequencies[-1], top), _TONES)
        phases = -np.pi * np.arange(_TONES) ** 2 / _TONES
        turns = 2.0 * np.pi * np.outer(frequencies, self._time) + phases[:, None]
        wave = (frequencies[:, None] ** -0.5 * np.sin(turns)).sum(axis=0)
        wave /= np.max(np.abs(wave))
        return self._bounded(self._window * size * wave)

    def _sweep(self, size: float) -> Array:
        """Return a sine whose frequency grows and whose size falls so that its speed stays."""
        low, high = _PERIODS / self._duration, 0.5 * self._highest
        rate = np.log(high / low) / self._duration
        frequency = low * np.exp(rate * self._time)
        turns = 2.0 * np.pi * (frequency - low) / rate
        turn = 2.0 * np.pi * frequency
        shrink = np.minimum(1.0, 0.8 * self._speed / (turn * size))
        shrink = np.minimum(shrink, 0.8 * self._acceleration / (turn**2 * size))
        return self._bounded(self._window * size * shrink * np.sin(turns))

    def _preloaded(self, size: float, where: str) -> Iterator[tuple[str, Array]]:
        """Yield small motions about a preload."""
        small = 0.15 * abs(size)
        rise = smooth_step(self._time / (2.0 * _RISE * self._duration)) * smooth_step(
            (self._duration - self._time) / (2.0 * _RISE * self._duration)
        )
        later = smooth_step((self._time / self._duration - 0.15) / 0.05) * smooth_step(
            (0.85 - self._time / self._duration) / 0.05
        )
        if small <= 0.0:
            return
        for frequency in self._frequencies(small)[1:]:
            wave = _wave(frequency * self._time, False)
            yield (
                f"a small sine{where} at {frequency:.2g} Hz",
                self._bounded(0.8 * size * rise + small * later * wave),
            )

    def _levels(self) -> Iterator[tuple[str, Array]]:
        """Yield holds reached slowly, and steps reached as quickly as allowed."""
        count = len(_LEVELS) + 1
        length = self._duration / count
        for words, share in (("holds", 0.2), ("steps", 0.02)):
            before, value = 0.0, np.zeros_like(self._time)
            for k, level in enumerate((*_LEVELS, 0.0)):
                target = level * (self._up if level > 0.0 else self._down)
                # The smooth step is 15/8 times as steep in its middle as on the whole.
                quickest = 15.0 / 8.0 * abs(target - before) / self._speed if self._speed else length
                # Its largest curvature is 5.77 over the square of its time.
                hardest = math.sqrt(5.8 * abs(target - before) / self._acceleration)
                rise = min(max(share * length, 1.05 * quickest, 1.05 * hardest), 0.8 * length)
                value = value + (target - before) * smooth_step((self._time - k * length) / rise)
                before = target
            yield words, self._bounded(value)

    def _bounded(self, value: Array) -> Array:
        """Return a motion that is as much smaller as its speed and acceleration ask for."""
        slope = np.gradient(value, self._time)
        rate = max(float(np.max(np.abs(slope))), 1e-300)
        push = max(float(np.max(np.abs(np.gradient(slope, self._time)))), 1e-300)
        return value * min(1.0, self._speed / rate, self._acceleration / push)


def _placed(centre: float, size: float, wave: Array) -> Array:
    """Return a wave in (−1, 1), or for one side in (0, 2), with its size and the side of its centre."""
    return (np.sign(centre) or 1.0) * size * wave


def _wave(turns: Array, one_sided: bool) -> Array:
    wave: Array = 1.0 - np.cos(2.0 * np.pi * turns) if one_sided else np.sin(2.0 * np.pi * turns)
    return wave
