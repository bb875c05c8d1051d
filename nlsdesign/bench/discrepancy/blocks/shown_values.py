"""What a measured signal shows over a record, behind its sensors."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....model import FlatModel
from ....model.readings import reading_of
from ...identification.records.measurement import Record


def shown_values(model: FlatModel, record: Record, signal: str) -> Array:
    """Return the values behind the readings of a signal, with the numbers that the model has.

    The inverse of each sensor of the chain, the last one first, earlier by the sum of their delays. States of
    sensors, such as a drift so far, are taken as they start.
    """
    reading, values = reading_of(model.readings, signal), np.asarray(record.trace[signal])
    if not reading.sensors:
        return values
    numbers = {v.name: ca.SX(v.start) for v in (*model.parameters, *model.states)}
    symbol = ca.SX.sym("reading")
    behind = ca.Function("behind", [symbol], [reading.inferred(symbol, numbers)])
    shown: Array = behind.map(len(values))(values[None, :]).full().ravel()
    delay = sum(model.values[name] for name in reading.delays)
    stretch = sum(model.values[name] for name in reading.stretches)
    time = record.trace.time
    late = delay + stretch * (time - time[0])
    return np.interp(time + late, time, shown) if delay or stretch else shown
