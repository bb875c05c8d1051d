"""Effects of sensors: delay, drift, bias and gain of load cells, bias of ammeters, eccentric discs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...components import (
    Assembly,
    CurrentSensor,
    Drift,
    Eccentricity,
    Encoder,
    ForceSensor,
    GearedMotor,
    Part,
    Sensor,
    TransportDelay,
)
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, free_name
from .effect import ranked


def _inserted(assembly: Assembly, sensor: str, name: str, fault: Sensor) -> Assembly:
    """Return the assembly with a fault between a sensor and what it reads; its reading keeps its name."""
    parts: list[tuple[str, Part]] = []
    for each, part in assembly.parts:
        if each == sensor and isinstance(part, Sensor):
            parts += [(name, fault), (each, replace(part, of=f"{name}.reading"))]
        else:
            parts.append((each, part))
    return replace(assembly, parts=tuple(parts))


def _sensors_without(assembly: Assembly, kind: type[Sensor], fault: type[Sensor]) -> dict[str, Sensor]:
    """Return the sensors of a kind in whose chain, before or behind, the fault does not stand yet."""
    sensors = assembly.sensors()
    chains = [assembly.measured(f"{name}.reading")[1] for name in sensors]
    faulty = {n for chain in chains if any(isinstance(sensors[s], fault) for s in chain) for n in chain}
    return {name: each for name, each in sensors.items() if isinstance(each, kind) and name not in faulty}


@ranked(130)
def force_sensor_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose reading comes late.

    Parameters
    ----------
    assembly
        As declared; load cells behind or before a delay are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, ForceSensor, TransportDelay).items():
        inserted = free_name(assembly, f"{name}_delay")
        delay = TransportDelay(of=sensor.of, delay=Quantity(1e-3, "s", SOURCE))
        candidates.append(
            Candidate(
                "force_sensor_delay",
                name,
                _inserted(assembly, name, inserted, delay),
                (Unknown(f"{inserted}.delay", (0.003,), 1e-4, 0.2),),
                "force that follows the motion late, the more the faster; as much in the torque balance",
                "Golub and Van Loan 2013 (Padé table)",
                explains_lag=True,
            )
        )
    return candidates


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
            (Unknown(f"{name}.gain", (1.0,), 0.3, 3.0, null=1.0),),
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
        As declared; encoders behind or before an eccentric disc are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, Encoder, Eccentricity).items():
        inserted = free_name(assembly, f"{name}_eccentricity")
        for order in _disc_orders(assembly, assembly.measured(sensor.of)[0]):
            zero, largest = Quantity(0.0, "rad", SOURCE), 0.2 / max(order.number, 1.0)
            disc = Eccentricity(of=sensor.of, sine=zero, cosine=zero, order=order)
            unknowns = (
                Unknown(f"{inserted}.{part}", (0.0,), -largest, largest) for part in ("sine", "cosine")
            )
            candidates.append(
                Candidate(
                    "angle_sensor_eccentricity",
                    name,
                    _inserted(assembly, name, inserted, disc),
                    tuple(unknowns),
                    "force, torque and inertia that are off together, as a sine of the angle",
                    "geometry; data sheets",
                )
            )
    return candidates


def _disc_orders(assembly: Assembly, measured: str) -> list[Quantity]:
    """Return how often the disc may turn per turn of what is measured."""
    orders = [Quantity(1.0, "1", "once per turn of what is read")]
    for name, part in assembly.parts:
        if isinstance(part, GearedMotor) and measured == f"{name}.{part.motion_names[0]}":
            ratio = part.gear_ratio.number
            orders += [Quantity(ratio, "1", "disc on the shaft of the motor")] if ratio != 1.0 else []
    return orders


@ranked(250)
def force_sensor_drift(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell whose zero wanders from the start of each record.

    Parameters
    ----------
    assembly
        As declared; load cells behind or before a drift are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, ForceSensor, Drift).items():
        inserted = free_name(assembly, f"{name}_drift")
        drift = Drift(of=sensor.of, drift=Quantity(0.0, "N/s", SOURCE))
        candidates.append(
            Candidate(
                "force_sensor_drift",
                name,
                _inserted(assembly, name, inserted, drift),
                (Unknown(f"{inserted}.drift", (0.0,), -0.05, 0.05, f"{name}.reading"),),
                "force that is off by more and more over time, also at rest",
                "data sheets of load cells",
            )
        )
    return candidates
