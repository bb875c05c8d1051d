"""Sensors: what they refuse, and that they travel through a deck."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    Assembly,
    CurrentSensor,
    Encoder,
    ForceSensor,
    GearedMotor,
    SampleAndHold,
    SampledEncoder,
    Sensor,
    Spring,
    Tachometer,
    TorqueSensor,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.deck import read_deck
from nlsdesign.errors import ArrangementError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, measure


def bench(**sensors: Sensor) -> Assembly:
    motor = GearedMotor(inertia=1e-3, gear_ratio=4.0, torque_constant=0.05)
    return assembly(
        "bench", motor=motor, spring=tie(Spring(stiffness=2.0, domain=ROTATION), "motor"), **sensors
    )


WRONG = {
    "force of an angle": (ForceSensor(of="motor.angle"), r"'a' of 'motor.angle'.*reads N.*is in rad"),
    "force of a torque": (ForceSensor(of="spring.torque"), r"reads N, 'spring.torque' is in N\*m"),
    "torque of an angle": (TorqueSensor(of="motor.angle"), r"reads N\*m.*spring.torque"),
    "angle of a torque": (Encoder(of="spring.torque", quantum=1e-3), r"reads rad.*motor.angle"),
    "current of a speed": (CurrentSensor(of="motor.speed"), r"reads A.*motor.current"),
    "speed of a speed": (
        Tachometer(of="motor.speed", bandwidth=10.0, sample_rate=100.0),
        r"reads rad or m.*motor.angle",
    ),
}


@pytest.mark.parametrize(("sensor", "message"), WRONG.values(), ids=list(WRONG))
def test_a_sensor_of_the_wrong_unit_is_named(sensor: Sensor, message: str) -> None:
    with pytest.raises(UnitError, match=message):
        flatten(bench(a=sensor))


def test_a_record_of_the_wrong_unit_is_named() -> None:
    run = Trace(np.array([0.0, 1.0]), {"motor.angle": np.zeros(2)}, {"motor.angle": "N"})
    with pytest.raises(UnitError, match=r"'dial' of 'motor.angle'.*in N"):
        measure(run, bench(dial=Encoder(of="motor.angle", quantum=1e-3)), seed=1)


def test_a_sensor_reads_only_what_stands_before_it() -> None:
    late = {
        "held": SampleAndHold(of="dial.reading", sample_rate=10.0),
        "dial": Encoder(of="motor.angle", quantum=1e-3),
    }
    with pytest.raises(UnknownNameError, match=r"sensor 'held' reads 'dial.reading'"):
        flatten(bench(**late))
    run = Trace(np.array([0.0, 1.0]), {"motor.angle": np.zeros(2)}, {"motor.angle": "rad"})
    with pytest.raises(UnknownNameError, match=r"sensor 'held' reads 'dial.reading'"):
        measure(run, bench(**late), seed=1)


def test_a_run_coarser_than_the_samples_is_named() -> None:
    run = Trace(np.linspace(0.0, 1.0, 11), {"motor.angle": np.zeros(11)}, {"motor.angle": "rad"})
    fast = SampledEncoder(of="motor.angle", quantum=1e-3, sample_rate=1000.0)
    with pytest.raises(ValueRangeError, match=r"1000 Hz.*0\.1 s apart.*at most 0\.001 s"):
        measure(run, bench(dial=fast), seed=1)
    assert len(
        measure(run, bench(dial=fast.__class__(of="motor.angle", quantum=1e-3, sample_rate=10.0)), seed=1)
    )


def test_nothing_to_measure_with_is_named() -> None:
    run = Trace(np.array([0.0, 1.0]), {"motor.angle": np.zeros(2)}, {"motor.angle": "rad"})
    with pytest.raises(ValueRangeError, match="has no sensor"):
        measure(run, bench(), seed=1)


def test_a_tachometer_does_not_tell_the_angle() -> None:
    with pytest.raises(ArrangementError, match="cannot be inferred"):
        Tachometer(of="motor.angle", bandwidth=10.0, sample_rate=100.0).infer(None, None)  # type: ignore[arg-type]


def test_a_chain_of_sensors_travels_through_a_deck() -> None:
    made = bench(
        dial=SampledEncoder(of="motor.angle", quantum=1e-3, sample_rate=1000.0),
        tacho=Tachometer(of="dial.reading", bandwidth=30.0, sample_rate=1000.0),
    )
    text = deck_text(made)
    again = declare(read_deck(text, Path("bench.toml")))
    assert again.parts == made.parts
    assert [v.unit for v in flatten(again).outputs] == ["rad", "rad/s"]
