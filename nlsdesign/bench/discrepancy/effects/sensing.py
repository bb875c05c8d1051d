"""Effects of sensors: of load cells and torque transducers, of ammeters, of encoders."""

from __future__ import annotations

from collections.abc import Iterator
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
    EncoderOffset,
    ForceSensor,
    LoadNonlinearity,
    Part,
    Sensor,
    TorqueSensor,
    TransportDelay,
)
from ....components.core.domain import Domain
from ....foundation.quantity import Quantity
from .effect import Candidate, Edit, Effect, Form, Places, Unknown, free_name, number
from .places import domain_of, turning_bodies, turns_per_turn
from .sizes import LONGEST, MIDDLE, QUICKEST, SHIFT

_CELLS = (ForceSensor, TorqueSensor)
"""What reads an effort: load cells and torque transducers have the same faults."""


def _chain_without(kinds: tuple[type[Sensor], ...], *faults: type[Sensor]) -> Places:
    """Return the sensors of some kinds that have no such fault yet in their chain, before or behind them."""

    def places(assembly: Assembly) -> list[str]:
        sensors = assembly.sensors()
        chains = [assembly.measured(f"{name}.reading")[1] for name in sensors]
        faulty = {n for chain in chains if any(isinstance(sensors[s], faults) for s in chain) for n in chain}
        return [name for name, sensor in sensors.items() if isinstance(sensor, kinds) and name not in faulty]

    return places


def _exact(kinds: tuple[type[Sensor], ...], field: str, value: float) -> Places:
    """Return the sensors of some kinds with a number that is declared as that of an exact sensor."""

    def places(assembly: Assembly) -> list[str]:
        sensors = assembly.sensors()
        return [n for n, s in sensors.items() if isinstance(s, kinds) and getattr(s, field).number == value]

    return places


def _with_fault(assembly: Assembly, sensor: str, wanted: str, fault: Sensor) -> tuple[Assembly, str]:
    """Return the assembly with a fault between a sensor and what it reads, and the name of the fault.

    The reading of the sensor keeps its name.
    """
    name = free_name(assembly, f"{sensor}_{wanted}")
    parts: list[tuple[str, Part]] = []
    for present, part in assembly.parts:
        if present == sensor and isinstance(part, Sensor):
            parts += [(name, fault), (present, replace(part, of=f"{name}.reading"))]
        else:
            parts.append((present, part))
    return replace(assembly, parts=tuple(parts)), name


def _against_others(*faults: type[Sensor]) -> Places:
    """Return the encoders without such a fault where there are several: one alone says where things are."""

    def places(assembly: Assembly) -> list[str]:
        encoders = [name for name, sensor in assembly.sensors().items() if isinstance(sensor, Encoder)]
        return list(_chain_without((Encoder,), *faults)(assembly)) if len(encoders) > 1 else []

    return places


def _domain(cell: Sensor) -> Domain:
    return TRANSLATION if isinstance(cell, ForceSensor) else ROTATION


def _bias(assembly: Assembly, name: str) -> Iterator[Edit]:
    yield Edit(assembly, (Unknown(f"{name}.bias", (0.0,), -0.5, 0.5, f"{name}.reading"),))


def _zero(assembly: Assembly, name: str) -> Iterator[Edit]:
    kind = domain_of(assembly, assembly.measured(f"{name}.reading")[0].partition(".")[0])
    off = EncoderOffset(of=assembly.sensors()[name].of, offset=number(0.0, kind.motion_unit), domain=kind)
    edited, fault = _with_fault(assembly, name, "offset", off)
    yield Edit(edited, (Unknown(f"{fault}.offset", (0.0,), -0.5, 0.5, f"{name}.reading"),))


def _gain(assembly: Assembly, name: str) -> Iterator[Edit]:
    yield Edit(assembly, (Unknown(f"{name}.gain", (1.0,), 0.3, 3.0, null=1.0),))


def _delay(assembly: Assembly, name: str) -> Iterator[Edit]:
    delay = TransportDelay(of=assembly.sensors()[name].of, delay=number(1e-3, "s"))
    edited, fault = _with_fault(assembly, name, "delay", delay)
    unknown = Unknown(f"{fault}.delay", (0.1,), 1e-3, 6.0, QUICKEST, beyond=SHIFT)
    yield Edit(edited, (unknown,), {"explains_lag": True})


def _clock(assembly: Assembly, name: str) -> Iterator[Edit]:
    clock = ClockDrift(of=assembly.sensors()[name].of, rate=number(0.0, "1"))
    edited, fault = _with_fault(assembly, name, "clock", clock)
    # Up to half a sample a channel may be late anyway, and a drift of as much on average imitates that.
    unknown = Unknown(
        f"{fault}.rate", (-0.1, 0.1), -2.0, 2.0, f"{QUICKEST} / {LONGEST}", beyond=f"{SHIFT} / {MIDDLE}"
    )
    yield Edit(edited, (unknown,), {"explains_lag": True})


def _drift(assembly: Assembly, name: str) -> Iterator[Edit]:
    cell = assembly.sensors()[name]
    kind = _domain(cell)
    drift = Drift(of=cell.of, drift=number(0.0, kind.unit("{effort}/s")), domain=kind)
    edited, fault = _with_fault(assembly, name, "drift", drift)
    unknown = Unknown(f"{fault}.drift", (0.0,), -1.0, 1.0, f"{name}.reading / {LONGEST}")
    yield Edit(edited, (unknown,), {"bends_reading": True})


def _nonlinearity(assembly: Assembly, name: str) -> Iterator[Edit]:
    cell = assembly.sensors()[name]
    unit = Quantity(1.0, _domain(cell).effort_unit, "definition: the gain is told per unit of load")
    law = LoadNonlinearity(of=cell.of, nonlinearity=number(0.0, "1"), full_scale=unit)
    edited, fault = _with_fault(assembly, name, "nonlinearity", law)
    unknown = Unknown(f"{fault}.nonlinearity", (0.0,), -0.45, 2.0, f"1 / {name}.reading")
    yield Edit(edited, (unknown,), {"bends_reading": True})


def _encoders_of_angles(assembly: Assembly) -> list[str]:
    """Return the encoders whose disc may sit off its shaft: those of angles, where none is declared so."""
    sensors = assembly.sensors()
    encoders = _chain_without((Encoder,), Eccentricity)(assembly)
    return [n for n in encoders if (e := sensors[n]) and isinstance(e, Encoder) and e.domain == ROTATION]


def _eccentric_disc(assembly: Assembly, name: str) -> Iterator[Edit]:
    encoder = assembly.sensors()[name]
    for order in _disc_orders(assembly, assembly.measured(encoder.of)[0]):
        zero, largest = number(0.0, "rad"), 0.2 / max(order.number, 1.0)
        disc = Eccentricity(of=encoder.of, sine=zero, cosine=zero, order=order)
        edited, fault = _with_fault(assembly, name, "eccentricity", disc)
        size = tuple(Unknown(f"{fault}.{part}", (0.0,), -largest, largest) for part in ("sine", "cosine"))
        yield Edit(edited, size)
        # Beside another encoder it shows where it was set to zero: not always where the machine is at zero.
        if name in _against_others(EncoderOffset)(edited):
            for zeroed in _zero(edited, name):
                yield Edit(zeroed.assembly, (*size, replace(zeroed.unknowns[0], null=None)))


def _disc_orders(assembly: Assembly, measured: str) -> list[Quantity]:
    """Return how often the disc may turn per turn of what is measured."""
    for body in turning_bodies(assembly):
        if measured == f"{body}.angle":
            where = ("once per turn of what is read", "disc on a shaft of its gear")
            turns = turns_per_turn(assembly, body)
            return [Quantity(n, "1", where[0] if n == 1.0 else where[1]) for n in turns]
    return [Quantity(1.0, "1", "once per turn of what is read")]


current_sensor_bias = Effect(
    "current_sensor_bias",
    "An ammeter whose zero is off, or a constant torque on the body that the current drives.",
    70,
    (
        Form(
            _exact((CurrentSensor,), "bias", 0.0),
            _bias,
            "the same torque missing at every angle and speed",
            "data sheets of current sensors",
        ),
    ),
)
force_sensor_delay = Effect(
    "force_sensor_delay",
    "A load cell or torque transducer whose reading comes late.",
    130,
    (
        Form(
            _chain_without(_CELLS, TransportDelay, ClockDrift),
            _delay,
            "effort that follows the motion late, the more the faster; as much in the balance",
            "Golub and Van Loan 2013 (Padé table)",
        ),
    ),
)
force_sensor_bias = Effect(
    "force_sensor_bias",
    "A load cell or torque transducer whose zero is off.",
    140,
    (
        Form(
            _exact(_CELLS, "bias", 0.0),
            _bias,
            "the same effort missing at every place, also at rest",
            "data sheets of load cells",
        ),
    ),
)
force_sensor_gain = Effect(
    "force_sensor_gain",
    "A load cell or torque transducer that reads too much or too little in proportion.",
    150,
    (
        Form(
            _exact(_CELLS, "gain", 1.0),
            _gain,
            "all stiffnesses and the torque constant out of their declared range by the same factor",
            "data sheets of load cells",
        ),
    ),
)
angle_sensor_eccentricity = Effect(
    "angle_sensor_eccentricity",
    "An encoder whose disc sits off its shaft, on the shaft that is read or on the motor in front of a gear.",
    200,
    (
        Form(
            _encoders_of_angles,
            _eccentric_disc,
            "force, torque and inertia that are off together, as a sine of the angle",
            "geometry; data sheets",
        ),
    ),
)
angle_sensor_bias = Effect(
    "angle_sensor_bias",
    "An encoder whose zero is off against that of another one.",
    205,
    (
        Form(
            _against_others(EncoderOffset),
            _zero,
            "a constant effort of what lies between two encoders, at any place and speed",
            "data sheets of encoders",
        ),
    ),
)
angle_sensor_delay = Effect(
    "angle_sensor_delay",
    "An encoder whose reading comes late against that of another one.",
    155,
    (
        Form(
            _against_others(TransportDelay, ClockDrift),
            _delay,
            "an effort of what lies between two encoders in proportion to their speed",
            "Golub and Van Loan 2013 (Padé table)",
        ),
    ),
)


def delays(assembly: Assembly) -> list[Candidate]:
    """Return the encoders that may be sampled later than they are read, by up to two shifts of channels."""
    return [
        replace(
            each,
            unknowns=(replace(each.unknowns[0], starts=(1.0,), lower=1e-3, upper=2.4, of=SHIFT, beyond=""),),
            explains_lag=False,
        )
        for each in angle_sensor_delay(assembly)
    ]


force_sensor_nonlinearity = Effect(
    "force_sensor_nonlinearity",
    "A load cell or torque transducer whose gain changes with the load.",
    245,
    (
        Form(
            _chain_without(_CELLS, LoadNonlinearity),
            _nonlinearity,
            "effort that is off as the square of the load, with its sign, at any place and speed",
            "data sheets of load cells",
        ),
    ),
)
force_sensor_drift = Effect(
    "force_sensor_drift",
    "A load cell or torque transducer whose zero wanders from the start of each record.",
    250,
    (
        Form(
            _chain_without(_CELLS, Drift),
            _drift,
            "effort that is off by more and more over time, also at rest",
            "data sheets of load cells",
        ),
    ),
)
# Encoders keep the time: a shift of all others is a shift of them. Where a reading is delayed already,
# records show the sum of both alone.
clock_drift = Effect(
    "clock_drift",
    "An instrument whose clock is slower or faster than that of the others.",
    255,
    (
        Form(
            _chain_without((*_CELLS, CurrentSensor), ClockDrift, TransportDelay),
            _clock,
            "a reading that lags or leads by more and more over a record",
            "Oppenheim and Schafer 2010",
        ),
    ),
)
