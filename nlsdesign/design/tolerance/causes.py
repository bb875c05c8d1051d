"""What differs from one made spring to the next, and by how much."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...foundation.spread import Spread
from ...foundation.written_numbers import in_unit


def shown_unit(unit: str) -> str:
    """Return the unit in which a length, an area or a stress of a spring is shown."""
    return {"m": "mm", "m^2": "mm^2", "Pa": "MPa"}.get(unit, unit)


@dataclass(frozen=True)
class Cause(ABC):
    """Base of what differs from one made spring to the next.

    Parameters
    ----------
    name
        Full name of the number, of the row of numbers, or of what is not a number of the model.
    nominal
        Value in SI; 1 where the deviation is relative.
    deviation
        Standard deviation in SI; relative where ``unit`` is ``"1"`` and several numbers move together.
    unit
        Unit in which both are shown.
    source
        Where the deviation comes from: declared, given, or assumed with a reason.
    relative
        Whether it is a share of the numbers, so that it grows with them.
    spread
        How the deviations are distributed.
    """

    name: str
    nominal: float
    deviation: float
    unit: str
    source: str
    relative: bool
    spread: Spread

    @property
    def assumed(self) -> bool:
        """Whether the deviation is an assumption of this package."""
        return self.source.startswith("assumed")

    @property
    def size(self) -> str:
        """The standard deviation as text, in per cent where it is relative."""
        if self.unit == "1":
            return f"{100 * self.deviation:.3g} %"
        return in_unit(self.deviation, self.unit, 3)

    def __str__(self) -> str:
        return f"{self.name} ± {self.size} ({self.source})"


@dataclass(frozen=True)
class NumberCause(Cause):
    """Numbers behind the cam that move together.

    Parameters
    ----------
    numbers
        Pairs of parameter name and its deviation in SI per standard deviation of the cause.
    """

    numbers: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class AnchorCause(Cause):
    """An anchor that stands nearer or farther while the made contour stays the same."""


@dataclass(frozen=True)
class WaveCause(Cause):
    """An error of the contour's support function, a·cos(kπφ/φ_e) over the direction φ of the cable.

    With k = 0 it is an offset: a tool of another radius, or a thicker cable.
    """

    order: int


@dataclass(frozen=True)
class ProfileCause(Cause):
    """Declared numbers of the cam: the contour deviates as the lever arm changes with them.

    Parameters
    ----------
    numbers
        Pairs of parameter name and its deviation in SI per standard deviation of the cause.
    """

    numbers: tuple[tuple[str, float], ...]


def draw_deviations(causes: Sequence[Cause], count: int, *, seed: int) -> Array:
    """Return independent deviations in units of their standard deviations.

    Each cause draws from a generator of its own, seeded by the seed and its name, so that another cause more
    or less, or another design with the same names, changes no other deviation.
    """
    columns = [
        cause.spread.deviate(np.random.default_rng([seed, *cause.name.encode()]).standard_normal(count))
        for cause in causes
    ]
    return np.column_stack(columns) if columns else np.zeros((count, 0))
