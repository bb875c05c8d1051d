"""Effects of sensors: of load cells and torque transducers, of ammeters, of encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ....components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    ClockDrift,
    CurrentSensor,
    Drift,
    Eccentricity,
    Encoder,
    ForceSensor,
    LoadNonlinearity,
    Part,
    Sensor,
    TorqueSensor,
    TransportDelay,
)
from ....components.core.domain import Domain
from ....foundation.quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, free_name
from .effect import ranked
from .places import turning_bodies, turns_per_turn
from .sizes import LONGEST, QUICKEST

_CELLS = (ForceSensor, TorqueSensor)
"""What reads an effort: load cells and torque transducers have the same faults."""


def _inserted(assembly: Assembly, sensor: str, name: str, fault: Sensor) -> Assembly:
    """Return the assembly with a fault between a sensor and what it reads; its reading keeps its name."""
    parts: list[tuple[str, Part]] = []
    for each, part in assembly.parts:
        if each == sensor and isinstance(part, Sensor):
            parts += [(name, fault), (each, replace(part, of=f"{name}.reading"))]
        else:
            parts.append((each, part))
    return replace(assembly, parts=tuple(parts))


def _sensors_without(
    assembly: Assembly, kinds: tuple[type[Sensor], ...], *faults: type[Sensor]
) -> dict[str, Sensor]:
    """Return the sensors of some kinds in whose chain, before or behind, no such fault stands yet."""
    sensors = assembly.sensors()
    chains = [assembly.measured(f"{name}.reading")[1] for name in sensors]
    faulty = {n for chain in chains if any(isinstance(sensors[s], faults) for s in chain) for n in chain}
    return {name: each for name, each in sensors.items() if isinstance(each, kinds) and name not in faulty}


def _domain(cell: Sensor) -> Domain:
    return TRANSLATION if isinstance(cell, ForceSensor) else ROTATION


@ranked(130)
def force_sensor_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell or torque transducer whose reading comes late.

    ``assembly``: as declared; load cells behind or before a delay are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, _CELLS, TransportDelay, ClockDrift).items():
        inserted = free_name(assembly, f"{name}_delay")
        delay = TransportDelay(of=sensor.of, delay=Quantity(1e-3, "s", SOURCE))
        candidates.append(
            Candidate(
                "force_sensor_delay",
                name,
                _inserted(assembly, name, inserted, delay),
                (Unknown(f"{inserted}.delay", (0.1,), 1e-3, 6.0, QUICKEST),),
                "effort that follows the motion late, the more the faster; as much in the balance",
                "Golub and Van Loan 2013 (Padé table)",
                explains_lag=True,
            )
        )
    return candidates


@ranked(140)
def force_sensor_bias(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell or torque transducer whose zero is off."""
    return [
        Candidate(
            "force_sensor_bias",
            name,
            assembly,
            (Unknown(f"{name}.bias", (0.0,), -0.5, 0.5, f"{name}.reading"),),
            "the same effort missing at every place, also at rest",
            "data sheets of load cells",
        )
        for name, sensor in assembly.sensors().items()
        if isinstance(sensor, _CELLS) and sensor.bias.number == 0.0
    ]


@ranked(150)
def force_sensor_gain(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell or torque transducer that reads too much or too little in proportion."""
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
        if isinstance(sensor, _CELLS) and sensor.gain.number == 1.0
    ]


@ranked(70)
def current_sensor_bias(assembly: Assembly) -> Sequence[Candidate]:
    """An ammeter whose zero is off, or a constant torque on the body that the current drives."""
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

    ``assembly``: as declared; encoders behind or before an eccentric disc are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, (Encoder,), Eccentricity).items():
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
    for body in turning_bodies(assembly):
        if measured == f"{body}.angle":
            words = ("once per turn of what is read", "disc on a shaft of its gear")
            turns = turns_per_turn(assembly, body)
            return [Quantity(n, "1", words[0] if n == 1.0 else words[1]) for n in turns]
    return [Quantity(1.0, "1", "once per turn of what is read")]


@ranked(250)
def force_sensor_drift(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell or torque transducer whose zero wanders from the start of each record.

    ``assembly``: as declared; load cells behind or before a drift are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, _CELLS, Drift).items():
        inserted = free_name(assembly, f"{name}_drift")
        kind = _domain(sensor)
        drift = Drift(of=sensor.of, drift=Quantity(0.0, kind.unit("{effort}/s"), SOURCE), domain=kind)
        candidates.append(
            Candidate(
                "force_sensor_drift",
                name,
                _inserted(assembly, name, inserted, drift),
                (Unknown(f"{inserted}.drift", (0.0,), -1.0, 1.0, f"{name}.reading / {LONGEST}"),),
                "effort that is off by more and more over time, also at rest",
                "data sheets of load cells",
            )
        )
    return candidates


@ranked(245)
def force_sensor_nonlinearity(assembly: Assembly) -> Sequence[Candidate]:
    """A load cell or torque transducer whose gain changes with the load.

    ``assembly``: as declared; cells behind or before a nonlinearity are left out.
    """
    candidates = []
    for name, sensor in _sensors_without(assembly, _CELLS, LoadNonlinearity).items():
        inserted, kind = free_name(assembly, f"{name}_nonlinearity"), _domain(sensor)
        unit = Quantity(1.0, kind.effort_unit, "definition: the gain is told per unit of load")
        fault = LoadNonlinearity(of=sensor.of, nonlinearity=Quantity(0.0, "1", SOURCE), full_scale=unit)
        candidates.append(
            Candidate(
                "force_sensor_nonlinearity",
                name,
                _inserted(assembly, name, inserted, fault),
                (Unknown(f"{inserted}.nonlinearity", (0.0,), -0.45, 2.0, f"1 / {name}.reading"),),
                "effort that is off as the square of the load, with its sign, at any place and speed",
                "data sheets of load cells",
            )
        )
    return candidates


@ranked(255)
def clock_drift(assembly: Assembly) -> Sequence[Candidate]:
    """An instrument whose clock is slower or faster than that of the others.

    Encoders keep the time: a shift of all others is a shift of them. Where a reading is delayed already,
    records show the sum of both alone.

    ``assembly``: as declared; instruments behind or before a delay or a drift of the clock are left out.
    """
    candidates = []
    kinds = (*_CELLS, CurrentSensor)
    for name, sensor in _sensors_without(assembly, kinds, ClockDrift, TransportDelay).items():
        inserted, rate = free_name(assembly, f"{name}_clock"), Quantity(0.0, "1", SOURCE)
        candidates.append(
            Candidate(
                "clock_drift",
                name,
                _inserted(assembly, name, inserted, ClockDrift(of=sensor.of, rate=rate)),
                (Unknown(f"{inserted}.rate", (-0.1, 0.1), -2.0, 2.0, f"{QUICKEST} / {LONGEST}"),),
                "a reading that lags or leads by more and more over a record",
                "Oppenheim and Schafer 2010",
                explains_lag=True,
            )
        )
    return candidates
