"""Any subset of signals: each gives blocks that vanish on records of the model itself, or one message."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nlsdesign import components as c
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification.equation_error.block import Block
from nlsdesign.bench.identification.equation_error.block_response import DrivenBlock
from nlsdesign.bench.identification.filters import smoothing
from nlsdesign.bench.identification.records.measurement import Record
from nlsdesign.components import Assembly, Tie, assembly, tie
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate

TIME = np.arange(4000) * 0.001
WAVE = 1.2 * (1.0 - np.cos(2 * np.pi * 1.5 * TIME)) + 0.4 * np.sin(2 * np.pi * 4.1 * TIME) ** 2


def spring(*ends: str, stiffness: float = 8.0) -> Tie:
    return tie(c.Spring(stiffness=Quantity(stiffness, "N*m/rad")), *ends)


def damped(body: str, damping: float) -> Tie:
    return tie(c.Dashpot(damping=Quantity(damping, "N*m*s/rad")), body)


SERIES = assembly(
    "series",
    motor=c.GearedMotor(inertia=0.01, gear_ratio=25.0, torque_constant=0.03),
    arm=c.Inertia(inertia=0.02),
    spring=spring("motor", "arm"),
    end=spring("arm", stiffness=3.0),
    bearing=damped("arm", 0.02),
    motor_bearing=damped("motor", 0.03),
)
"""A resonance on a shaft: a motor, a spring, and a second inertia on a spring to the frame."""

SERVO_CHAIN = (
    ("loop", c.PositionLoop(proportional=Quantity(8.5, "V/rad"), limit=Quantity(7.4, "V"))),
    ("late", c.DriveDelay(delay=0.012)),
)
SERVO = assembly(
    "servo",
    servo=c.ResistiveMotor(
        inertia=6e-3, torque_constant=0.6, resistance=5.0, voltage_limit=7.4, chain=SERVO_CHAIN
    ),
    weight=tie(c.GravityLoad(weight=c.MassOnArm(mass=0.49, arm=0.1)), "servo"),
    bearing=damped("servo", 0.01),
)
WOUND = assembly(
    "wound",
    motor=c.VoltageDrivenMotor(
        inertia=6e-3, torque_constant=0.6, resistance=5.0, inductance=0.02, current_limit=50.0,
        voltage_limit=24.0,
    ),
    spring=spring("motor", stiffness=2.0),
)  # fmt: skip
PENDULUM = assembly(
    "pendulum",
    arm=c.Inertia(inertia=0.14, chain=(("late", c.DriveDelay(delay=0.02)),)),
    weight=tie(c.GravityLoad(weight=c.HorizontalTorque(horizontal_torque=2.7)), "arm"),
    bearing=damped("arm", 0.05),
)
GEARED = assembly(
    "geared",
    drum=c.Inertia(inertia=4e-3),
    rotor=c.CurrentDrivenMotor(
        inertia=2e-5, torque_constant=0.03, resistance=0.5, current_limit=99.0, voltage_limit=1e4
    ),
    gear=c.Gear(between=("rotor", "drum"), ratio=25.0),
    spring=spring("drum"),
    bearing=damped("drum", 0.03),
)
SCREW = assembly(
    "screw",
    servo=c.CurrentDrivenMotor(
        inertia=2e-4, torque_constant=0.3, resistance=1.0, current_limit=99.0, voltage_limit=1e4
    ),
    carriage=c.Mass(mass=30.0),
    screw=c.Screw(between=("servo", "carriage"), lead=0.01),
    spring=tie(c.Spring(stiffness=Quantity(4e3, "N/m")), "carriage"),
    guide=tie(c.Dashpot(damping=Quantity(300.0, "N*s/m")), "carriage"),
)

MACHINES: dict[str, tuple[Assembly, str, float]] = {
    "series": (SERIES, "motor.current", 1.0),
    "servo": (SERVO, "servo.goal", 0.3),
    "wound": (WOUND, "motor.wanted_voltage", 2.0),
    "pendulum": (PENDULUM, "arm.torque", 0.5),
    "geared": (GEARED, "rotor.current", 1.0),
    "screw": (SCREW, "servo.current", 1.0),
}
"""Machine, what drives it, and how strongly."""

CASES: list[tuple[str, tuple[str, ...], dict[str, str | None]]] = [
    ("series", ("motor.angle", "motor.current"), {"motor": None}),
    ("series", ("motor.speed", "motor.current"), {"motor": None}),
    ("series", ("motor.speed", "motor.acceleration", "motor.current"), {"motor": None}),
    ("series", ("motor.angle", "motor.acceleration", "motor.current"), {"motor": None}),
    ("series", ("motor.angle", "motor.speed", "motor.current"),
        {"motor": None, "motor.speed": "motor.speed"}),
    ("series", ("motor.angle", "motor.current", "spring.torque"), {"motor": None, "spring": "spring.torque"}),
    ("series", ("motor.angle", "arm.angle", "motor.current", "spring.torque"),
        {"motor": None, "arm": None, "spring": "spring.torque"}),
    ("series", ("motor.angle", "arm.angle", "spring.torque", "end.torque"),
        {"arm": None, "spring": "spring.torque", "end": "end.torque"}),
    ("series", ("motor.angle", "spring.torque"), {"spring": "spring.torque"}),
    ("series", ("motor.current", "spring.torque"), {"spring": "spring.torque"}),
    ("series", ("motor.current", "arm.acceleration"), {"arm": "arm.acceleration"}),
    ("series", ("motor.angle", "motor.drive_torque"), {"motor": None}),
    ("series", ("motor.angle", "motor.current", "motor.drive_torque"),
        {"motor": None, "motor.drive_torque": "motor.drive_torque"}),
    ("servo", ("servo.angle", "servo.goal", "servo.wanted_voltage"),
        {"servo": None, "servo.wanted_voltage": "servo.wanted_voltage"}),
    ("servo", ("servo.angle", "servo.wanted_voltage"), {"servo": None}),
    ("servo", ("servo.angle", "servo.goal"), {"servo": None}),
    ("servo", ("servo.speed", "servo.wanted_voltage"), {"servo": None}),
    ("wound", ("motor.angle", "motor.wanted_voltage"), {"motor": None}),
    ("wound", ("motor.angle", "motor.wanted_voltage", "motor.current"),
        {"motor": None, "motor.current": "motor.current"}),
    ("wound", ("motor.angle", "motor.current"), {"motor": None}),
    ("pendulum", ("arm.angle", "arm.torque"), {"arm": None}),
    ("pendulum", ("arm.angle", "arm.torque", "weight.torque"), {"arm": None, "weight": "weight.torque"}),
    ("geared", ("rotor.angle", "rotor.current"), {"drum": None}),
    ("geared", ("rotor.speed", "rotor.current"), {"drum": None}),
    ("geared", ("drum.angle", "rotor.angle", "rotor.current"), {"drum": None, "rotor.angle": "rotor.angle"}),
    ("screw", ("carriage.position", "servo.current"), {"servo": None}),
    ("screw", ("carriage.speed", "servo.current"), {"servo": None}),
    ("screw", ("servo.angle", "carriage.position", "servo.current"),
        {"servo": None, "carriage.position": "carriage.position"}),
    ("screw", ("carriage.position", "spring.force"), {"spring": "spring.force"}),
]  # fmt: skip


@functools.cache
def whole_run(machine: str) -> tuple[FlatModel, Trace]:
    """Return a machine and one run with every signal that a case reads."""
    made, drive, size = MACHINES[machine]
    read = {signal for name, signals, _ in CASES if name == machine for signal in signals} - {drive}
    model = flatten(made, outputs=sorted(read))
    return flatten(made), simulate(model, TIME, inputs={drive: size * WAVE}, tolerance=1e-10)


def simulated(machine: str, signals: tuple[str, ...]) -> tuple[FlatModel, Record]:
    _, drive, size = MACHINES[machine]
    model, run = whole_run(machine)
    values = {s: size * WAVE if s == drive else run[s] for s in signals}
    return model, Record("run", type(run)(TIME, values, {s: "" for s in signals}, "run"))


def left(block: Block, record: Record) -> tuple[float, float]:
    """Root mean squares of what a block leaves over, and of the largest term of it."""
    driven = DrivenBlock(block, [], records=[record])
    output = driven.respond(driven.samples(record, {}), {}).output
    error = (record.trace[block.target] if block.target else 0.0) - output
    kept = slice(200, -200)
    rest = (smoothing(len(TIME), 4.0, 1) @ error)[kept]
    return float(np.sqrt(np.mean(rest**2))), float(np.std(record.trace[block.target or record_drive(record)]))


def record_drive(record: Record) -> str:
    return next(iter(record.trace.signals))


@pytest.mark.parametrize(
    ("machine", "signals", "expected"), CASES, ids=lambda v: "+".join(v) if isinstance(v, tuple) else None
)
def test_every_subset_gives_blocks_that_vanish_on_the_model_itself(
    machine: str, signals: tuple[str, ...], expected: dict[str, str | None]
) -> None:
    model, record = simulated(machine, signals)
    blocks = blocks_of(model, signals)
    assert {block.name: block.target for block in blocks} == expected
    for block in blocks:
        rest, size = left(block, record)
        assert np.isfinite(rest)
        assert rest < 5e-3 * max(size, 0.1), (block.name, rest, size)


@pytest.mark.parametrize(
    ("machine", "signals", "advice"),
    [
        ("series", ("motor.angle",), "'motor.current'; of a motor that was on its log is needed"),
        ("series", ("arm.angle",), "'motor.angle' or 'motor.speed'"),
        ("series", ("motor.acceleration",), "measure for instance 'motor.angle' or 'motor.speed'"),
        ("servo", ("servo.angle",), "'servo.wanted_voltage'"),
        ("series", ("spring.torque",), "'motor.angle' or 'motor.speed'"),
    ],
)
def test_what_cannot_be_compared_says_what_to_measure(
    machine: str, signals: tuple[str, ...], advice: str
) -> None:
    with pytest.raises(MeasurementError, match="measure no motion that drives the model") as caught:
        blocks_of(flatten(MACHINES[machine][0]), signals)
    assert advice in str(caught.value)


def test_the_speed_of_a_prescribed_motion_does_not_say_where_it_is() -> None:
    pulled = assembly(
        "pulled", load=c.Driven(), motor=c.Inertia(inertia=0.01), spring=spring("motor", "load")
    )
    with pytest.raises(
        MeasurementError, match=r"how fast 'load' moves, not where it is.*measure 'load.angle'"
    ):
        blocks_of(flatten(pulled), ["load.speed", "motor.angle", "motor.torque"])


def test_a_torque_without_the_rotor_does_not_drive_an_integrator() -> None:
    """An offset of the torque sensor must not wander off as the square of time."""
    signals = ("motor.current", "spring.torque")
    model, record = simulated("series", signals)
    trace = record.trace
    off = type(trace)(
        trace.time, {**trace.signals, "spring.torque": trace["spring.torque"] + 0.05}, trace.units
    )
    (block,) = blocks_of(model, signals)
    assert left(block, Record("off", off))[0] == pytest.approx(0.05, rel=0.05)
