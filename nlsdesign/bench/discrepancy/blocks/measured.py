"""What measured signals stand for in a model: motions, rates, accelerations, commands, efforts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ....foundation.quantity import same_dimension
from ....foundation.symbolic import Expression, depends
from ....model import FlatModel
from ....model.readings import ReadingNames, reading_of
from ....model.structure import MovingBody

MOTION, RATE, ACCELERATION = 0, 1, 2
"""How often the motion of a body is derived to give what is measured."""


@dataclass(frozen=True)
class Measured:
    """A measured signal and what it stands for.

    Parameters
    ----------
    reading
        What it shows, through which sensors.
    shown
        Name of the variable that follows from it: a state or input, or the signal that is shown.
    body
        The body whose motion that is, ``None`` if it is none.
    order
        Of a motion: 0 for the motion itself, 1 for the rate, 2 for the acceleration.
    """

    reading: ReadingNames
    shown: str
    body: MovingBody | None = None
    order: int = MOTION

    @property
    def signal(self) -> str:
        """Name of what was measured."""
        return self.reading.signal


def measured_signals(model: FlatModel, signals: Sequence[str]) -> list[Measured]:
    """Return what each measured signal stands for."""
    return [_measured(model, signal) for signal in signals]


def _measured(model: FlatModel, signal: str) -> Measured:
    reading = reading_of(model.readings, signal)
    shown = _variable_behind(model, reading.measured)
    for body in model.bodies:
        orders = (body.motion, body.rate, body.acceleration)
        if shown in orders:
            return Measured(reading, shown, body, orders.index(shown))
    return Measured(reading, shown)


def _variable_behind(model: FlatModel, name: str) -> str:
    """Return the state or input that a signal follows from through a fixed ratio: an angle behind a gear."""
    s = model.symbols()
    known = {v.name: (v, s.signal[i]) for i, v in enumerate(model.signals)}
    if name not in known:
        return name
    variable, value = known[name]
    moving = [(v, s.state[i]) for i, v in enumerate(model.states)]
    moving += [(v, s.input[i]) for i, v in enumerate(model.inputs)]
    inside = [(v, symbol) for v, symbol in moving if depends(value, symbol)]
    if len(inside) != 1 or not same_dimension(inside[0][0].unit, variable.unit):
        return name
    behind, symbol = inside[0]
    everything = ca.vertcat(s.state, s.input, s.time)
    return name if depends(ca.jacobian(value, symbol), everything) else behind.name


def behind_ratio(measured: Measured, value: Expression, known: Mapping[str, Expression]) -> Expression:
    """Return the variable that a measured value stands for, where a fixed ratio lies between."""
    name = measured.reading.measured
    if measured.shown == name:
        return value
    seen, symbol = known[name], known[measured.shown]
    offset = ca.substitute(seen, symbol, ca.SX(0))
    return (value - offset) / ca.jacobian(seen, symbol)
