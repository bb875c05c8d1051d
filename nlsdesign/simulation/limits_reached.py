"""Which declared limits a run reaches: of the drive, the sensors, the cam and the strength of materials."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..foundation.arrays import Array
from ..foundation.quantity import with_unit
from ..model import FlatModel
from ..model.roles import declared_reading
from .trace import Trace

_ROUNDING = 1e-9
_AT = 1e-6
"""Share of the supply below its limit at which it counts as held there."""


class LimitReached(NamedTuple):
    """A signal that goes beyond a declared number, or is held at it."""

    name: str
    unit: str
    time: float  # of the first sample beyond, in s
    furthest: float  # value furthest beyond
    limit: float  # the declared number, with the sign of the side that is reached
    meaning: str  # what the number is, and what holds beyond it

    def __str__(self) -> str:
        reached, limit = (with_unit(f"{each:.4g}", self.unit) for each in (self.furthest, self.limit))
        way = f"reaches {reached}, beyond {limit}"
        if abs(self.furthest) <= abs(self.limit) * (1.0 + _ROUNDING):
            way = f"is at its limit of {limit}"
        return f"{self.name} {way} from t = {self.time:.4g} s: {self.meaning}"


def limits_reached(model: FlatModel, run: Trace) -> tuple[LimitReached, ...]:
    """Return the declared limits that a run goes beyond."""
    result = [*_drive(model, run), *_sensors(model, run), *_cams(model, run), *_strength(model, run)]
    return tuple(sorted(result, key=lambda each: each.time))


def _drive(model: FlatModel, run: Trace) -> Iterator[LimitReached]:
    for body in model.bodies:
        motor = body.motor
        if motor is None or motor.command not in run or motor.current_limit not in model.values:
            continue
        limit = model.values[motor.current_limit]
        meaning = f"{motor.current_limit}, the drive gives no more"
        yield from _beyond(run, motor.command or "", run[motor.command or ""], (-limit, limit), meaning)
    for body in model.bodies:
        if body.motor is not None:
            yield from _supply(model, run, body.motor.current_limit.rpartition(".")[0])


def _supply(model: FlatModel, run: Trace, motor: str) -> Iterator[LimitReached]:
    """Return where the voltage at a motor is held at the limit of the supply."""
    name, declared = f"{motor}.voltage", f"{motor}.voltage_limit"
    if name not in run or declared not in model.values:
        return
    limit, values = model.values[declared], run[name]
    for side in (-1.0, 1.0):
        held = np.flatnonzero(side * values >= limit * (1.0 - _AT))
        if len(held):
            meaning = f"{declared}, the supply gives no more and the current is less than wanted"
            time = float(run.time[held[0]])
            yield LimitReached(name, run.units[name], time, side * limit, side * limit, meaning)


def _sensors(model: FlatModel, run: Trace) -> Iterator[LimitReached]:
    for reading in model.readings:
        limits = declared_reading(model, reading.measured).limits
        if limits is not None and reading.measured in run:
            meaning = f"outside what {reading.sensors[0]} can show"
            yield from _beyond(run, reading.measured, run[reading.measured], limits[:2], meaning)


def _cams(model: FlatModel, run: Trace) -> Iterator[LimitReached]:
    for cam in (cam for spring in model.springs for cam in spring.cams):
        if cam.last_angle is None or cam.angle not in run:
            continue
        angle, ends_at = run[cam.angle], {1.0: cam.last_angle, -1.0: cam.back_last_angle or cam.last_angle}
        ends = f"the contour of {cam.name} ends, its lever arm is held"
        slack = f"{cam.name} has no lever arm on this side, nothing pulls back"
        for side in (-1.0, 1.0):
            last = model.values[ends_at[side]]
            outside = side * angle > last
            acts = cam.lever_arm not in run or bool(np.any(run[cam.lever_arm][outside] != 0.0))
            limits = (-last, math.inf) if side < 0.0 else (-math.inf, last)
            yield from _beyond(run, cam.angle, angle, limits, ends if acts else slack)


def _strength(model: FlatModel, run: Trace) -> Iterator[LimitReached]:
    values = model.values
    pieces = [piece for spring in model.springs for cam in spring.cams for piece in cam.specimens]
    for piece in pieces:
        if piece.elongation_at_break in values and piece.strain in run:
            limit = values[piece.elongation_at_break or ""]
            meaning = f"{piece.elongation_at_break}, it breaks"
            yield from _beyond(run, piece.strain, run[piece.strain], (-math.inf, limit), meaning)
        if piece.tensile_strength in values and piece.force in run:
            area = math.prod(values[name] for name in piece.section)
            limit = area * values[piece.tensile_strength or ""]
            meaning = f"{piece.tensile_strength} times its section, it breaks"
            yield from _beyond(run, piece.force, run[piece.force], (-math.inf, limit), meaning)


def _beyond(
    run: Trace, name: str, values: Array, limits: tuple[float, float], meaning: str
) -> Iterator[LimitReached]:
    for side, limit in ((-1.0, limits[0]), (1.0, limits[1])):
        over = side * (values - limit)
        outside = np.flatnonzero(over > _ROUNDING * max(1.0, abs(limit)))
        if math.isfinite(limit) and len(outside):
            furthest = float(values[int(np.argmax(over))])
            yield LimitReached(name, run.units[name], float(run.time[outside[0]]), furthest, limit, meaning)
