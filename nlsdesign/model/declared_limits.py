"""What a deck declares of the readings of a sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from .flat import FlatModel, Variable
from .plausibility import Plausibility


class DeclaredReading(NamedTuple):
    """What is declared of the sensor that shows a motion.

    Parameters
    ----------
    quantum
        One count, 0 where none is declared.
    limits
        Lowest and highest reading, largest rate and stale time; ``None`` where they are not declared.
    """

    quantum: float
    limits: tuple[float, float, float, float] | None


_LIMITS = ("lowest_reading", "highest_reading", "largest_rate", "stale_time")


def declared_reading(model: FlatModel, measured: str) -> DeclaredReading:
    """Return what the deck declares of the sensor that shows a motion."""
    for reading in model.readings:
        for sensor in reading.sensors if reading.measured == measured else ():
            names = [f"{sensor}.{name}" for name in _LIMITS]
            quantum = model.values.get(f"{sensor}.quantum", 0.0)
            if all(name in model.values for name in names):
                lowest, highest, rate, stale = (model.values[name] for name in names)
                return DeclaredReading(quantum, (lowest, highest, rate, stale))
            if quantum:
                return DeclaredReading(quantum, None)
    return DeclaredReading(0.0, None)


def with_declared_reading(variable: Variable, model: FlatModel, measured: str) -> Variable:
    """Return an input that is measured, with range and largest rate that the deck declares of its readings.

    Not the stale time: without knowing what drives the machine a sensor that is dead looks like one at rest.

    ``variable``: input of a controller or an observer; unchanged where nothing is declared.
    """
    declared = declared_reading(model, measured)
    if declared.limits is None:
        return variable
    lowest, highest, rate, _ = declared.limits
    can = Plausibility(largest_rate=rate, resolution=2.0 * declared.quantum)
    return replace(variable, minimum=lowest, maximum=highest, plausibility=can)
