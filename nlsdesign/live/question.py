"""What a designer asks at one moment: machine, target points, limits, what is free; immutable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..design.parametric.cam_question import CamQuestion, TargetPoint
from ..foundation.errors import ValueRangeError, brief

FEWEST_POINTS, MOST_POINTS = 2, 50
"""Points of a target with the first one at angle zero, which has no torque."""
LEAST_STEP = 1e-3
"""Least distance of two points in rad."""
LARGEST_ANGLE = 6.28
LARGEST_TORQUE = 1e5
_READ_IN = {
    "rad": ("°", 180.0 / math.pi),
    "m": ("mm", 1e3),
    "m^2": ("mm²", 1e6),
    "Pa": ("MPa", 1e-6),
    "N*m": ("N·m", 1.0),
    "N*m/rad": ("N·m/rad", 1.0),
    "%": ("%", 100.0),
}
"""Units of the page and their factors, by unit in SI; "%" stands for a ratio that is read so."""


class TaskRecord(NamedTuple):
    """A motion of one's own at equal times of one period."""

    period: float  # in s
    per_mass: bool  # whether the torque is in N·m per kg of body mass
    # angles, torques: in rad and N·m
    angles: tuple[float, ...]
    torques: tuple[float, ...]


class AskedTask(NamedTuple):
    """What the actuator has to do for a part of the time: walking at one joint, or a record of one's own."""

    joint: str  # or the name of the file
    body_mass: float  # in kg
    scale: float  # part of the torque of the joint that the actuator gives
    share: float  # of the time, beside the shares of the other tasks
    record: TaskRecord | None = None  # None for walking

    @property
    def row(self) -> tuple[str | float, ...]:
        """What the page shows of it: the numbers, and whether it is walking, one's own, or that per mass."""
        kind = "walking"
        if self.record is not None:
            kind = "per mass" if self.record.per_mass else "own"
        return (*self[:4], kind)


@dataclass(frozen=True, eq=False)
class LiveQuestion(CamQuestion):
    """What is asked on the page: a question with a title, its points within what the page can draw."""

    title: str = ""
    tasks: tuple[AskedTask, ...] = ()  # against which motor and spring are held
    motor: Mapping[str, float] = field(default_factory=dict)  # numbers in SI in place of those of the deck

    def with_points(self, points: tuple[TargetPoint, ...]) -> LiveQuestion:
        """Return the question with another target."""
        if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
            raise ValueRangeError(
                f"target with {len(points)} points", f"has {FEWEST_POINTS} to {MOST_POINTS} of them",
                next_step="remove a point" if len(points) > MOST_POINTS else "keep the last two points",
            )  # fmt: skip
        for number, point in enumerate(points, start=1):
            finite_in(f"angle of point {number}", point.angle, lowest=0.0, highest=LARGEST_ANGLE, unit="rad")
            finite_in(
                f"torque of point {number}", point.torque, lowest=0.0, highest=LARGEST_TORQUE, unit="N*m"
            )
        angles = np.array([point.angle for point in points])
        if points[0] != (0.0, 0.0):
            raise ValueRangeError(
                "point 1 of the target", "stays at angle zero without torque: the spring is odd or one-sided",
                next_step="move another point",
            )  # fmt: skip
        close = np.flatnonzero(np.diff(angles) < LEAST_STEP * (1.0 - 1e-9))
        if len(close):
            raise ValueRangeError(
                f"points {close[0] + 1} and {close[0] + 2} of the target",
                f"are out of order or nearer than {math.degrees(LEAST_STEP):.2g}°",
                next_step="move the point between its neighbours",
            )
        if max(point.torque for point in points) < 1e-6:
            raise ValueRangeError("target", "asks for no torque at all", next_step="raise a point")
        return replace(self, points=points)


def finite_in(what: str, value: object, *, lowest: float, highest: float, unit: str = "1") -> float:
    """Return a number that a designer gave, checked.

    ``unit``: unit in SI of value and range; people read them in the unit of the page.
    """
    try:
        sound = not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        sound = False
    if not sound or not isinstance(value, int | float):
        raise ValueRangeError(
            f"{what} = {brief(value)}", "is no finite number", next_step="give a number like 12.5"
        )
    if not lowest <= value <= highest:
        shown, factor = _READ_IN.get(unit, ("" if unit == "1" else unit, 1.0))
        raise ValueRangeError(
            f"{what} = {factor * value:.4g} {shown}".rstrip(),
            f"must lie in [{factor * lowest:.4g}, {factor * highest:.4g}] {shown}".rstrip(),
            next_step="give a number in that range",
        )
    return float(value)
