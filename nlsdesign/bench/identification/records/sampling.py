"""How a signal runs between its samples, and what that makes of it at the samples.

A digital controller holds its command until it computes the next one; an instrument shows the value at an
instant; many drives log the mean over the period before. A residual is filtered over several samples, and so
sees of a signal what a smooth one with the same effect has at the samples.

What is held, from wherever in a period, acts on a position that is sampled in the same period h. The second
difference of the positions is h² times the mean of the acceleration under a triangle of two periods, whatever
its course; a mean under that triangle of a smooth acceleration is it times (sin x/x)², x = ωh/2. So a held
signal is read with its share of the triangle for each value, divided by (sin x/x)². A mean over the period
before the stamp of a smooth signal is read divided by sin x/x. Both divisions are exact to the sixth order.

Everything that reads a record between its samples asks here: blocks, fits over windows, simulations that a
record drives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np

from ....foundation.arrays import Array

_REACH = 3
"""Samples to either side from which a signal is read between two of them."""
_SQUARE = (1.0, 1.0 / 12.0, 1.0 / 240.0, 1.0 / 6048.0)
"""Series of (x/sin x)², x = ω/2, in even powers of ω: coefficients of 1, ω², ω⁴, ω⁶."""
_SINGLE = (1.0, 1.0 / 24.0, 7.0 / 5760.0, 31.0 / 967680.0)
"""The same of x/sin x."""


@dataclass(frozen=True)
class Sampling:
    """How a signal runs between its samples."""

    name: str  # as records.toml writes it
    words: str  # what it means, for remarks
    # taps: weights of neighbouring samples, by how many samples later they stand, whose sum is what a smooth
    # signal with the same effect has at a sample
    taps: tuple[tuple[int, float], ...] = ((0, 1.0),)
    late: float = 0.0  # how many samples the signal acts behind its stamps
    # held_from: where it is held from one sample to the next: how many samples later the value in force
    # stands; None where it is not held
    held_from: int | None = None

    @property
    def weights(self) -> Array:
        """Weights of the samples one after the other, of unit sum."""
        return np.array([weight for _, weight in self.taps])

    def at_samples(self, values: Array) -> Array:
        """Return what a smooth signal with the same effect has at the samples, shape (n,).

        ``values``: as logged; before the first and after the last sample nothing changes.
        """
        if len(self.taps) == 1:
            return values
        result = np.zeros(len(values))
        for later, weight in self.taps:
            result += weight * _later(values, later)
        return result

    def as_computed(self, values: Array) -> Array:
        """Return what the signal is at the samples by whoever gives it out: what a prediction must equal.

        What is held was computed at the instant from which it holds.
        """
        return self.at_samples(values) if self.held_from is None else _later(values, self.held_from)

    def over_steps(self, values: Array) -> tuple[Array, Array]:
        """Return the signal at the beginning and at the end of each step, shape (n − 1,) each."""
        if self.held_from is None:
            smooth = self.at_samples(values)
            return smooth[:-1], smooth[1:]
        held = _later(values, self.held_from)[:-1]
        return held, held


def _later(values: Array, samples: int) -> Array:
    places = np.clip(np.arange(len(values)) + samples, 0, len(values) - 1)
    result: Array = values[places]
    return result


def _symmetric(places: Sequence[float], series: Sequence[float]) -> Array:
    """Return weights at places and their mirror images, of which one is as many, by their response.

    ``series``: coefficients of the even powers of ω in the sum of weights times cos(place·ω), as many as
    places, the least first.
    """
    powers = [
        [(-1) ** m * place ** (2 * m) / factorial(2 * m) for place in places] for m in range(len(series))
    ]
    return np.linalg.solve(np.array(powers), np.array(series))


def _held(late: float) -> tuple[tuple[int, float], ...]:
    """Return the taps of a signal of which each value acts from so many samples behind its stamp, for one."""

    def below(x: float) -> float:
        """Return the share of the triangle between −1 and 1 that lies below a place."""
        x = min(max(x, -1.0), 1.0)
        return 0.5 * (1.0 + x) ** 2 if x < 0.0 else 1.0 - 0.5 * (1.0 - x) ** 2

    first, last = math.floor(-2.0 - late), math.ceil(1.0 - late)
    shares = [below(own + 1.0 + late) - below(own + late) for own in range(first, last + 1)]
    one_side = _symmetric(range(_REACH + 1), _SQUARE)
    weights = np.convolve(shares, [*0.5 * one_side[:0:-1], one_side[0], *0.5 * one_side[1:]])
    return tuple((first - _REACH + k, float(weight)) for k, weight in enumerate(weights) if weight)


SAMPLED = Sampling("sampled", "is what the signal was at its stamps")
HELD = Sampling("held", "holds each value from its stamp to the next", _held(0.0), 0.5, 0)
HELD_BEFORE = Sampling(
    "held_before", "holds each value from the stamp before to its own", _held(-1.0), -0.5, 1
)
_LATER = 0.5 * _symmetric([k + 0.5 for k in range(_REACH + 1)], _SINGLE)
AVERAGED = Sampling(
    "averaged",
    "is the mean over the period before each stamp",
    tuple((k - _REACH, float(weight)) for k, weight in enumerate([*_LATER[::-1], *_LATER])),
    -0.5,
)
FORMS = (SAMPLED, HELD, HELD_BEFORE, AVERAGED)


def shifted(form: Sampling, samples: float) -> Sampling:
    """Return a signal that runs as it does and acts so late in all; between samples by a polynomial.

    ``samples``: behind its stamps, about one beyond those of the form at most, of either sign.
    """
    words = f"acts {samples:.2g} samples behind its stamps"
    if form.held_from is not None:
        return Sampling(f"shifted {form.name}", words, _held(samples - HELD.late), samples)
    places, beyond = range(-_REACH, _REACH + 1), samples - form.late
    # The weights of Lagrange: of the values at whole places in that of their polynomial in between.
    between = [
        float(np.prod([(-beyond - other) / (own - other) for other in places if other != own]))
        for own in places
    ]
    weights = np.convolve(form.weights, between)
    taps = tuple((form.taps[0][0] - _REACH + k, float(weight)) for k, weight in enumerate(weights))
    return Sampling(f"shifted {form.name}", words, taps, samples)
