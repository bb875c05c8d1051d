"""Effects of the sensors: delay, bias and gain of the load cell, bias of the ammeter."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import Assembly, CurrentSensor, DelayedForceSensor, ForceSensor
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown


def force_sensor_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose reading comes late.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for name, sensor in assembly.sensors().items():
        if not isinstance(sensor, ForceSensor) or sensor.late_by is not None:
            continue
        late = DelayedForceSensor(
            of=sensor.of,
            gain=sensor.gain,
            bias=sensor.bias,
            noise=sensor.noise,
            delay=Quantity(1e-3, "s", SOURCE),
        )
        found.append(
            Candidate(
                "force_sensor_delay",
                name,
                assembly.with_part(name, late),
                (Unknown(f"{name}.delay", (0.003,), 1e-4, 0.2),),
                "force that follows the motion late, the more the faster; as much in the torque balance",
                "Golub and Van Loan (Padé table)",
            )
        )
    return found


def force_sensor_bias(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose zero is off.

    Parameters
    ----------
    assembly
        As declared.
    """
    return [
        Candidate(
            "force_sensor_bias",
            name,
            assembly,
            (Unknown(f"{name}.bias", (0.0,), -0.5, 0.5, f"{name}.reading"),),
            "the same force missing at every angle, also at rest",
            "data sheets of load cells",
        )
        for name, sensor in assembly.sensors().items()
        if isinstance(sensor, ForceSensor) and sensor.bias.number == 0.0
    ]


def force_sensor_gain(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell that reads too much or too little in proportion.

    Parameters
    ----------
    assembly
        As declared.
    """
    return [
        Candidate(
            "force_sensor_gain",
            name,
            assembly,
            (Unknown(f"{name}.gain", (1.0,), 0.3, 3.0),),
            "all stiffnesses and the torque constant out of their declared range by the same factor",
            "data sheets of load cells",
        )
        for name, sensor in assembly.sensors().items()
        if isinstance(sensor, ForceSensor) and sensor.gain.number == 1.0
    ]


def current_sensor_bias(assembly: Assembly) -> Sequence[Candidate]:
    """An ammeter whose zero is off, or a constant torque on the body that the current drives.

    Parameters
    ----------
    assembly
        As declared.
    """
    return [
        Candidate(
            "current_sensor_bias",
            name,
            assembly,
            (Unknown(f"{name}.bias", (0.0,), -0.5, 0.5, f"{name}.reading"),),
            "the same torque missing at every angle and speed",
            "data sheets of current sensors",
        )
        for name, sensor in assembly.sensors().items()
        if isinstance(sensor, CurrentSensor) and sensor.bias.number == 0.0
    ]
