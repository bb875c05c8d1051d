"""From a simulated run to the records of its sensors."""

from __future__ import annotations

import zlib

import numpy as np

from ..components.assembly.named_parts import Assembly
from ..foundation.arrays import Array
from ..foundation.errors import UnitError, ValueRangeError, unknown_name
from ..foundation.quantity import typeset_unit
from .trace import Trace


def measure(run: Trace, assembly: Assembly, *, seed: int) -> Trace:
    """Return the readings of all sensors over a run, with noise, exact delay, sample rate and hold.

    Continuous readings in the run are not used: a sensor starts from the signal that it reads, or from the
    record of an earlier sensor. The noise of each sensor depends on the seed and its name only, so adding or
    removing another sensor does not change it.

    Parameters
    ----------
    run
        Simulated signals, at least as densely as the samples of the fastest sensor.
    assembly
        Its sensors.
    seed
        Of the noise; the same seed gives the same record.

    Returns
    -------
    Trace
        ``<sensor>.reading`` of every sensor, at the times of the run.

    Raises
    ------
    ValueRangeError
        If the assembly has no sensor, or the run is coarser than the samples of a sensor.
    UnknownNameError
        If the run lacks the signal that a sensor reads.
    UnitError
        If a sensor cannot read a signal of that unit.

    Examples
    --------
    >>> from nlsdesign.components import Encoder, Inertia, assembly
    >>> dial = Encoder(of="wheel.angle", quantum=0.1)
    >>> wheel = assembly("a", wheel=Inertia(inertia=1.0), dial=dial)
    >>> run = Trace(np.array([0.0, 1.0]), {"wheel.angle": np.array([0.0, 0.26])}, {"wheel.angle": "rad"})
    >>> measure(run, wheel, seed=1)["dial.reading"].round(3).tolist()
    [0.0, 0.3]
    """
    sensors = assembly.sensors()
    if not sensors:
        raise ValueRangeError(
            f"assembly '{assembly.name}'", "has no sensor", next_step="add for instance an Encoder"
        )
    continuous = {f"{name}.reading" for name in sensors}
    truth = {n: v for n, v in run.signals.items() if n not in continuous}
    readings: dict[str, Array] = {}
    units = dict(run.units)
    for name, sensor in sensors.items():
        known = truth | readings
        if sensor.of not in known:
            raise unknown_name(f"sensor '{name}' reads", sensor.of, known)
        unit = units[sensor.of]
        if not sensor.sees(unit):
            shown = typeset_unit(unit) or "1"
            raise UnitError(f"sensor '{name}' of '{sensor.of}'", f"cannot read a signal in {shown}")
        generator = np.random.default_rng([seed, zlib.crc32(name.encode())])
        readings[f"{name}.reading"] = sensor.recorded(run.time, known[sensor.of], generator)
        units[f"{name}.reading"] = sensor.reading_unit(unit)
    return Trace(run.time, readings, {n: units[n] for n in readings}, run.name, warnings=run.warnings)
