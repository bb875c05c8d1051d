"""Blocks cut at measured signals: driven by a simulation of the whole, their residual vanishes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects import current_sensor_bias, force_sensor_delay, force_sensor_gain
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification.equation_error.block import Block
from nlsdesign.bench.identification.equation_error.block_response import DrivenBlock
from nlsdesign.bench.identification.filters import smoothing
from nlsdesign.bench.identification.records.measurement import Record
from nlsdesign.components import (
    ROTATION,
    Assembly,
    CurrentDrivenMotor,
    CurrentSensor,
    Dashpot,
    Eccentricity,
    Encoder,
    Fixed,
    Gear,
    Inertia,
    SampleAndHold,
    Spring,
    TransportDelay,
    WindingHeat,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate

SIGNALS = ("motor_encoder.reading", "current_sensor.reading", "force_sensor.reading")
TIME = np.arange(2000) * 0.001
WIDTH = 4.0


@pytest.fixture(scope="module")
def rig() -> Assembly:
    return declare(load_deck("test_rig"))


def simulated(declared: Assembly, signals: tuple[str, ...] = SIGNALS) -> Record:
    """The whole model under current, with readings free of rounding."""
    fine = declared.with_values({"motor_encoder.quantum": 1e-9})
    model = flatten(fine, outputs=list(signals))
    current = 1.5 * (1.0 - np.cos(2 * np.pi * 1.5 * TIME))
    return Record("run", simulate(model, TIME, inputs={"motor.current": current}))


@pytest.mark.long_cases("gain", "bias")
@pytest.mark.parametrize("change", ["none", "gain", "bias", "delay"])
def test_both_blocks_vanish_on_records_of_the_model_itself(rig: Assembly, change: str) -> None:
    edited = {
        "none": rig,
        "gain": force_sensor_gain(rig)[0].assembly.with_values({"force_sensor.gain": 1.2}),
        "bias": current_sensor_bias(rig)[0].assembly.with_values({"current_sensor.bias": 0.3}),
        "delay": force_sensor_delay(rig)[0].assembly.with_values({"force_sensor_delay.delay": 0.006}),
    }[change]
    record = simulated(edited)
    sizes = {"spring": np.max(record.trace["force_sensor.reading"]), "motor": 0.755 * 3.0}
    for block in blocks_of(flatten(edited), SIGNALS):
        assert remaining(block, record) < 2e-3 * sizes[block.name], block.name


def test_a_chain_of_sensors_is_read_back_to_what_its_first_one_sees(rig: Assembly) -> None:
    """Bias in the cell, delay on the bus behind it, a hold behind the encoder."""
    edited = rig.with_values({"force_sensor.bias": 2.0}).with_part(
        "bus", TransportDelay(of="force_sensor.reading", delay=0.006)
    )
    edited = edited.with_part("held", SampleAndHold(of="motor_encoder.reading", sample_rate=1000.0))
    signals = ("held.reading", "current_sensor.reading", "bus.reading")
    record = simulated(edited, signals)
    spring, motor = blocks_of(flatten(edited), signals)
    assert (spring.target, motor.moving) == ("bus.reading", "held.reading.rate")
    assert {d.late_by for d in motor.drives.values()} == {(), ("bus.delay",)}
    sizes = {"spring": np.max(record.trace["bus.reading"]), "motor": 0.755 * 3.0}
    for block in (spring, motor):
        assert remaining(block, record) < 2e-3 * sizes[block.name], block.name


@pytest.mark.parametrize("cosine", [0.0, 0.025])
def test_a_bent_reading_bends_the_acceleration_behind_it(cosine: float) -> None:
    """The reading of an eccentric encoder accelerates by its slope, and by its curvature times the speed²."""
    disc = Eccentricity(of="body.angle", sine=0.04, cosine=cosine)
    encoder = Encoder(of="disc.reading", quantum=1e-9)
    turning = assembly("turning", body=Inertia(inertia=0.5), disc=disc, encoder=encoder)
    time = np.arange(4000) * 1e-3
    angle = 1.5 * np.sin(3.0 * time)
    units = {"encoder.reading": "rad", "body.torque": "N*m"}
    reading = angle + 0.04 * np.sin(angle) + cosine * (np.cos(angle) - 1.0)
    rows = dict(zip(units, (reading, -0.5 * 9.0 * angle), strict=True))
    record = Record("turning", Trace(time, rows, units, "turning"))
    (block,) = blocks_of(flatten(turning), tuple(units))
    assert remaining(block, record) < 1e-4 * 0.5 * 9.0 * 1.5


def geared(rig: Assembly) -> Assembly:
    """The rig with its inertia split between a rotor and a drum; the rubber pulls at the drum."""
    winding = {"resistance": 0.5, "current_limit": 100.0, "voltage_limit": 1e4}
    motor = CurrentDrivenMotor(inertia=2e-5, torque_constant=0.0302, **winding)
    declared = {name: part for name, part in rig.parts if name not in ("motor", "spring", "bearing")}
    spring = tie(rig.element("spring"), "drum", "load")
    return assembly(
        "geared",
        drum=Inertia(inertia=4e-3),
        motor=motor,
        gear=Gear(between=("motor", "drum"), ratio=25.0),
        spring=spring,
        bearing=tie(rig.element("bearing"), "drum"),
        **{**declared, "motor_encoder": Encoder(of="drum.angle", quantum=1e-9)},
    )


def test_the_balance_of_a_geared_train_is_in_torque_at_its_leading_body(rig: Assembly) -> None:
    """A drum that is 1 g·m² heavier than declared shows as that times its acceleration."""
    declared = geared(rig)
    record = simulated(declared.with_values({"drum.inertia": 5e-3}))
    assert flatten(declared).evaluate([0.0] * 3)["drum.train_inertia"] == pytest.approx(4e-3 + 625 * 2e-5)
    (motor,) = (b for b in blocks_of(flatten(declared), SIGNALS) if b.target is None)
    driven = DrivenBlock(motor, [], records=[record])
    output = driven.respond(driven.samples(record, {}), {}).output
    seen = smoothing(len(TIME), WIDTH, 5) @ output
    assert motor.name == "drum"
    expected = 1e-3 * (smoothing(len(TIME), WIDTH, 5) @ record.trace["drum.acceleration"])
    assert np.std(expected) > 0.05
    assert np.std((seen + expected)[50:-50]) < 0.02 * np.std(expected)


def test_delays_on_one_line_add_up(rig: Assembly) -> None:
    late = rig.with_part("bus", TransportDelay(of="force_sensor.reading", delay=0.006))
    late = late.with_part("log", TransportDelay(of="bus.reading", delay=0.002))
    signals = ("motor_encoder.reading", "current_sensor.reading", "log.reading")
    record = simulated(late, signals)
    blocks = {b.name: b for b in blocks_of(flatten(late), signals)}
    assert ("log.delay", "bus.delay") in {d.late_by for d in blocks["motor"].drives.values()}
    assert remaining(blocks["motor"], record) < 2e-3 * 0.755 * 3.0
    # Left out, or taken for the sum, either of them is missed.
    wrong = blocks_of(flatten(late.with_values({"log.delay": 1e-6})), signals)
    assert remaining(wrong[1], record) > 4e-3 * 0.755 * 3.0


def test_two_delays_on_one_line_that_are_both_free_cannot_be_told_apart(rig: Assembly) -> None:
    late = rig.with_part("bus", TransportDelay(of="force_sensor.reading", delay=0.006))
    late = late.with_part("log", TransportDelay(of="bus.reading", delay=0.002))
    signals = ("motor_encoder.reading", "current_sensor.reading", "log.reading")
    motor = blocks_of(flatten(late), signals)[1]
    with pytest.raises(MeasurementError, match=r"'log.reading'.*log.delay and by bus.delay, both free"):
        DrivenBlock(motor, ["log.delay", "bus.delay"], records=[])
    assert DrivenBlock(motor, ["bus.delay"], records=[]).needs_new_samples


def test_what_no_delay_shifts_is_worked_out_once(rig: Assembly) -> None:
    """A late force leaves the motion of the motor as it is, and moves all that it enters itself."""
    late = rig.with_part("log", TransportDelay(of="force_sensor.reading", delay=0.002))
    signals = ("motor_encoder.reading", "current_sensor.reading", "log.reading")
    record = simulated(late, signals)
    (motor,) = (block for block in blocks_of(flatten(late), signals) if block.target is None)
    driven = DrivenBlock(motor, ["log.delay"], records=[record])
    first, anew = (driven.samples(record, {"log.delay": delay}) for delay in (0.002, 0.005))
    moved = (first.at != anew.at).any(axis=1)
    assert moved.any()
    assert not moved.all()
    for known, expected in zip(driven.samples(record, {"log.delay": 0.005}, first), anew, strict=True):
        np.testing.assert_array_equal(known, expected)
    spoiled = first._replace(at=np.where(moved[:, None], np.nan, first.at))
    np.testing.assert_array_equal(driven.samples(record, {"log.delay": 0.005}, spoiled).at, anew.at)


def remaining(block: Block, record: Record) -> float:
    """Root mean square of what a block leaves over of a record, filtered."""
    driven = DrivenBlock(block, [], records=[record])
    output = driven.respond(driven.samples(record, {}), {}).output
    error = (record.trace[block.target] if block.target else 0.0) - output
    return float(np.sqrt(np.mean((smoothing(len(TIME), WIDTH, 5) @ error) ** 2)))


@pytest.mark.parametrize("bias", [None, 0.0, 0.5])
def test_a_drive_that_grows_warm_is_not_judged_by_what_it_would_give_once_warm(bias: float | None) -> None:
    """A wrong damping is as large as it is: at 8 A the steady torque I/(1 + (I/4 A)²) falls with current.

    An ammeter with a bias shows zero where a current flows, which warms the drive too. The current of the
    first sample has not flowed before: the winding is cold.
    """
    heat = WindingHeat(halving=4.0, cooling_time=3.0)
    motor = CurrentDrivenMotor(
        inertia=1e-3, torque_constant=0.1, resistance=0.5, current_limit=99.0, voltage_limit=1e4,
        chain=(("heat", heat),),
    )  # fmt: skip
    bearing = tie(Dashpot(damping=Quantity(0.02, "N*m*s/rad")), "motor")
    sensors = {} if bias is None else {"ammeter": CurrentSensor(of="motor.current", noise=0.0, bias=bias)}
    made, signal = assembly("warm", motor=motor, bearing=bearing, **sensors), "ammeter.reading"
    if bias is None:
        signal = "motor.current"
    current = 8.0 * np.sin(2.0 * np.pi * 1.5 * TIME + 0.5)
    run = simulate(
        flatten(made, outputs=["motor.angle", "motor.speed"]), TIME,
        inputs={"motor.current": current}, tolerance=1e-10,
    )  # fmt: skip
    speed = run["motor.speed"]
    record = Record(
        "run", replace(run, signals={"motor.angle": run["motor.angle"], signal: current + (bias or 0.0)})
    )
    (block,) = blocks_of(flatten(made), ("motor.angle", signal))
    driven = DrivenBlock(block, ["bearing.damping"], records=[record])
    wrong = {"bearing.damping": 0.05}
    left = driven.respond(driven.samples(record, wrong), wrong).output
    expected = 0.03 * speed[100:-100]
    np.testing.assert_allclose(left[100:-100], expected, atol=0.02 * np.abs(expected).max())


def test_a_wrong_number_shows_only_in_its_own_block(rig: Assembly) -> None:
    record = simulated(rig.with_values({"motor.inertia": 0.012}))
    found = {}
    for block in blocks_of(flatten(rig), SIGNALS):
        driven = DrivenBlock(block, [], records=[record])
        output = driven.respond(driven.samples(record, {}), {}).output
        error = (record.trace[block.target] if block.target else 0.0) - output
        found[block.name] = float(np.std(smoothing(len(TIME), WIDTH, 5) @ error))
    # 0.003 kg·m² times the acceleration.
    acceleration = np.gradient(np.gradient(record.trace["motor_encoder.reading"], 0.001), 0.001)
    assert found["motor"] == pytest.approx(0.003 * np.std(acceleration[50:-50]), rel=0.05)
    assert found["spring"] < 0.1


def test_blocks_say_where_they_are_and_what_drives_them(rig: Assembly) -> None:
    spring, motor = blocks_of(flatten(rig), SIGNALS)
    assert (spring.name, spring.target, spring.unit) == ("spring", "force_sensor.reading", "N")
    assert (motor.name, motor.target, motor.unit) == ("motor", None, "N*m")
    assert {d.order for d in motor.drives.values() if d.signal == "motor_encoder.reading"} == {0, 1, 2}
    assert motor.moving == "motor_encoder.reading.rate"
    assert [v.name for v in motor.model.states] == []
    assert [v.name for v in spring.model.states] == ["spring.cable.rubber.relaxing.dashpot.strain"]


def test_a_positioning_drive_without_a_spring_has_one_block() -> None:
    drive = assembly(
        "drive",
        stage=Inertia(inertia=0.02),
        base=Fixed(),
        end=tie(Spring(stiffness=1e-3, domain=ROTATION), "stage"),
    )
    (block,) = blocks_of(flatten(drive), ["stage.angle", "stage.torque"])
    assert block.name == "stage"
    assert block.target is None


def test_nothing_to_compare_is_said(rig: Assembly) -> None:
    with pytest.raises(MeasurementError, match="measure no motion that drives the model"):
        blocks_of(flatten(rig), ["force_sensor.reading"])
