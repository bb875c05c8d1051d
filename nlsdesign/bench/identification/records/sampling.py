"""How a signal runs between its samples, and what that makes of it at the samples.

A digital controller holds its command until it computes the next one; an instrument shows the value at an
instant; many drives log the mean over the period before. A residual is filtered over several samples, and so
sees of a signal what a smooth one with the same effect has at the samples. Behind a hold of one period h,
that is the signal half a sample later, times sin(x)/x with x = ωh/2; a mean over the period before the stamp
is the opposite. Both are read with four samples, exact to the fourth order in ωh.

Everything that reads a record between its samples asks here: blocks, fits over windows, simulations that a
record drives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array

_REACH = 3
"""Samples to either side from which a signal is read between two of them."""


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


SAMPLED = Sampling("sampled", "is what the signal was at its stamps")
HELD = Sampling(
    "held",
    "holds each value from its stamp to the next",
    ((-2, -1 / 24), (-1, 13 / 24), (0, 13 / 24), (1, -1 / 24)),
    0.5,
    0,
)
HELD_BEFORE = Sampling(
    "held_before",
    "holds each value from the stamp before to its own",
    ((-1, -1 / 24), (0, 13 / 24), (1, 13 / 24), (2, -1 / 24)),
    -0.5,
    1,
)
AVERAGED = Sampling(
    "averaged",
    "is the mean over the period before each stamp",
    ((-1, -1 / 12), (0, 7 / 12), (1, 7 / 12), (2, -1 / 12)),
    -0.5,
)
FORMS = (SAMPLED, HELD, HELD_BEFORE, AVERAGED)


def shifted(samples: float) -> Sampling:
    """Return a signal that acts a part of a sample behind its stamps, read by a polynomial of sixth degree.

    ``samples``: about one at most, of either sign.
    """
    places = range(-_REACH, _REACH + 1)
    # The weights of Lagrange: of the values at whole places in that of their polynomial in between.
    taps = tuple(
        (own, float(np.prod([(-samples - other) / (own - other) for other in places if other != own])))
        for own in places
    )
    return Sampling("shifted", f"acts {samples:.2g} samples behind its stamps", taps, samples)
