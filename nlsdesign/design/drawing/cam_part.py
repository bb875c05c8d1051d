"""What is drawn of a cam: outlines, holes, base plate, cable, and the numbers that they were drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import Quantity
from .arc_path import ArcPath


@dataclass(frozen=True, eq=False)
class Hole:
    """A round hole.

    Parameters
    ----------
    name
        What it is for.
    centre
        Shape (2,), in m.
    diameter
        In m.
    base_only
        Whether it goes through the base plate alone, under cable and lips.
    """

    name: str
    centre: Array
    diameter: float
    base_only: bool = False


@dataclass(frozen=True, eq=False)
class CamPart:
    """A cam as it is made, in its own frame: the axis at (0, 0), the cable at angle zero along x; in m.

    Parameters
    ----------
    outlines
        Closed edges under the cable, clockwise: one of a one-sided cam, two (lower, upper) of a two-sided.
    holes
        Round holes.
    base_radius
        Radius of the round base plate that carries the lips in m; zero if the lips are cut through.
    cables
        Centre line of the cable at angle zero, at the last angle and, on two-sided cams, at the last angle of
        the other sense; open paths in the frame of the cam.
    centre_line
        Curve of the cable's centre line on the first lip, shape (n, 2).
    numbers
        Sizes by name, given and derived, with unit and source.
    """

    outlines: tuple[ArcPath, ...]
    holes: tuple[Hole, ...]
    base_radius: float
    cables: tuple[ArcPath, ...]
    centre_line: Array
    numbers: Mapping[str, Quantity]

    @cached_property
    def reach(self) -> float:
        """Largest distance of an edge from the axis in m, without the base plate."""
        return max(float(np.hypot(*outline.polygon().T).max()) for outline in self.outlines)

    @cached_property
    def outermost(self) -> float:
        """Largest distance of any material from the axis in m."""
        return max(self.reach, self.base_radius)

    def number(self, name: str) -> float:
        """Return one of the numbers in SI.

        Parameters
        ----------
        name
            One of ``numbers``.
        """
        return self.numbers[name].number
