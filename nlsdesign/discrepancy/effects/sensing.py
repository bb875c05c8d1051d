"""Effects of the sensors: delay, bias and gain of the load cell, bias of the ammeter."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import (
    Assembly,
    CurrentSensor,
    DelayedForceSensor,
    DriftingForceSensor,
    EccentricEncoder,
    Encoder,
    ForceSensor,
    GearedMotor,
)
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, numbers_of
from .effect import ranked


@ranked(130)
def force_sensor_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose reading comes late.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for name, sensor in assembly.sensors().items():
        if type(sensor) is not ForceSensor:  # another kind has numbers that would be lost
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
                "Golub and Van Loan 2013 (Padé table)",
                explains_lag=True,
            )
        )
    return found


@ranked(140)
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


@ranked(150)
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


@ranked(70)
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


@ranked(200)
def angle_sensor_eccentricity(assembly: Assembly) -> Sequence[Candidate]:
    """An encoder whose disc sits off its shaft, on the shaft that is read or on the motor in front of a gear.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for name, sensor in assembly.sensors().items():
        if not isinstance(sensor, Encoder) or isinstance(sensor, EccentricEncoder):
            continue
        for order in _disc_orders(assembly, sensor.of):
            faulty = EccentricEncoder(
                **numbers_of(sensor),
                sine=Quantity(0.0, "rad", SOURCE),
                cosine=Quantity(0.0, "rad", SOURCE),
                order=order,
            )
            largest = 0.2 / max(order.number, 1.0)
            unknowns = (Unknown(f"{name}.{part}", (0.0,), -largest, largest) for part in ("sine", "cosine"))
            found.append(
                Candidate(
                    "angle_sensor_eccentricity",
                    name,
                    assembly.with_part(name, faulty),
                    tuple(unknowns),
                    "force, torque and inertia that are off together, as a sine of the angle",
                    "geometry; data sheets",
                )
            )
    return found


def _disc_orders(assembly: Assembly, read: str) -> list[Quantity]:
    """Return how often the disc may turn per turn of what is read."""
    once = Quantity(1.0, "1", "once per turn of what is read")
    body = dict(assembly.parts).get(read.partition(".")[0])
    if isinstance(body, GearedMotor) and body.gear_ratio.number != 1.0:
        return [once, Quantity(body.gear_ratio.number, "1", "disc on the shaft of the motor")]
    return [once]


@ranked(250)
def force_sensor_drift(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose zero wanders from the start of each record.

    Parameters
    ----------
    assembly
        As declared; load cells with a fault of their own are left out.
    """
    return [
        Candidate(
            "force_sensor_drift",
            name,
            assembly.with_part(
                name, DriftingForceSensor(**numbers_of(sensor), drift=Quantity(0.0, "N/s", SOURCE))
            ),
            (Unknown(f"{name}.drift", (0.0,), -0.05, 0.05, f"{name}.reading"),),
            "force that is off by more and more over time, also at rest",
            "data sheets of load cells",
        )
        for name, sensor in assembly.sensors().items()
        if type(sensor) is ForceSensor
    ]
