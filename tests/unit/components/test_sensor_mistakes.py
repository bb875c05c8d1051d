"""Sensors: what they refuse, and that they travel through a deck."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import nlsdesign.components as room
from nlsdesign.cli import main
from nlsdesign.components import (
    ROTATION,
    Assembly,
    CurrentSensor,
    Encoder,
    ForceSensor,
    GearedMotor,
    SampleAndHold,
    Sensor,
    Spring,
    Tachometer,
    TorqueSensor,
    TransportDelay,
    tie,
)
from nlsdesign.components.assembly.deck_reader import component_classes
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import (
    ArrangementError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, measure


def bench(**sensors: Sensor) -> Assembly:
    motor = GearedMotor(inertia=1e-3, gear_ratio=4.0, torque_constant=0.05)
    return assembly(
        "bench", motor=motor, spring=tie(Spring(stiffness=2.0, domain=ROTATION), "motor"), **sensors
    )


WRONG = {
    "force of an angle": (ForceSensor(of="motor.angle"), r"'a' of 'motor.angle'.*reads N.*is in rad"),
    "force of a torque": (ForceSensor(of="spring.torque"), r"reads N, 'spring.torque' is in N·m"),
    "torque of an angle": (TorqueSensor(of="motor.angle"), r"reads N·m.*spring.torque"),
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
    with pytest.raises(ArrangementError, match=r"'held' reads 'dial.reading'.*write 'dial' before 'held'"):
        bench(**late)


def test_sensors_that_read_one_another_in_a_circle_are_named() -> None:
    circle = {
        "bus": TransportDelay(of="log.reading", delay=1e-3),
        "log": TransportDelay(of="dial.reading", delay=1e-3),
        "dial": Encoder(of="bus.reading", quantum=1e-3),
    }
    with pytest.raises(
        ArrangementError, match=r"'bus' reads 'log.reading': .*circle: bus ◁ log ◁ dial ◁ bus"
    ):
        bench(**circle)
    with pytest.raises(ArrangementError, match=r"'dial' reads 'dial.reading': .*circle: dial ◁ dial"):
        bench(dial=Encoder(of="dial.reading", quantum=1e-3))


@pytest.mark.parametrize(
    "old",
    [
        "DelayedForceSensor", "DelayedMotor", "DriftingForceSensor", "EccentricEncoder", "SampledEncoder",
        "SaturatingMotor",
    ],
)  # fmt: skip
def test_a_combination_of_part_and_fault_is_written_as_a_chain_now(old: str) -> None:
    text = deck_text(bench(dial=Encoder(of="motor.angle", quantum=1e-3)))
    text = text.replace('component = "Encoder"', f'component = "{old}"')
    problem, *_ = deck_problems(read_deck(text, Path("bench.toml")))
    parts = re.findall(r"\b[A-Z]\w+", str(problem).partition("-> write ")[2])
    assert parts
    assert set(parts) & set(component_classes()), str(problem)
    with pytest.raises(UnknownNameError, match=f"'{old}': has another name now -> write "):
        getattr(room, old)


DANGLING = {
    "no such part": ("motr.angle", r"'a' reads 'motr.angle': no such name; did you mean 'motor.angle'"),
    "no such part inside": ("spring.cabel.force", r"'a' reads 'spring.cabel.force': no such name"),
    "a body": ("motor", r"'a' reads 'motor': .*a part, not a signal; did you mean 'motor.angle'"),
    "a tie": ("spring", r"'a' reads 'spring': .*a part, not a signal; did you mean 'spring.torque'"),
    "a sensor": ("dial", r"'a' reads 'dial': .*a part, not a signal; did you mean 'dial.reading'"),
}


@pytest.mark.parametrize(("of", "message"), DANGLING.values(), ids=list(DANGLING))
def test_a_chain_that_ends_nowhere_is_named_in_deck_and_model(of: str, message: str) -> None:
    made = bench(dial=Encoder(of="motor.angle", quantum=1e-3), a=TransportDelay(of=of, delay=1e-3))
    with pytest.raises(NlsError, match=message):
        flatten(made)
    (problem,) = deck_problems(read_deck(deck_text(made), Path("bench.toml")))
    assert re.search(r"bench.toml:\d+:\d+: a.of: sensor " + message, str(problem))


def test_a_circle_in_a_deck_has_its_place() -> None:
    text = deck_text(bench(dial=Encoder(of="motor.angle", quantum=1e-3)))
    text = text.replace('of = "motor.angle"', 'of = "dial.reading"')
    (problem,) = deck_problems(read_deck(text, Path("bench.toml")))
    assert re.search(r"bench.toml:\d+:\d+: dial.of: sensor 'dial' reads.*circle: dial ◁ dial", str(problem))


def test_a_misspelt_signal_of_a_part_is_named_by_the_check_of_a_deck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    deck = tmp_path / "bench.toml"
    deck.write_text(deck_text(bench(dial=Encoder(of="motor.anlge", quantum=1e-3))), encoding="utf8")
    monkeypatch.setattr(sys, "argv", ["nlsdesign", "deck", "check", str(deck)])
    with pytest.raises(SystemExit) as leaving:
        main()
    assert leaving.value.code == 2
    shown = capsys.readouterr().err
    assert "sensor 'dial' reads 'motor.anlge'" in shown
    assert "did you mean 'motor.angle'" in shown


def test_a_run_coarser_than_the_samples_is_named() -> None:
    run = Trace(np.linspace(0.0, 1.0, 11), {"motor.angle": np.zeros(11)}, {"motor.angle": "rad"})
    with pytest.raises(ValueRangeError, match=r"1000 Hz.*0\.1 s apart.*at most 0\.001 s"):
        measure(run, bench(held=SampleAndHold(of="motor.angle", sample_rate=1000.0)), seed=1)
    assert len(measure(run, bench(held=SampleAndHold(of="motor.angle", sample_rate=10.0)), seed=1))


def test_nothing_to_measure_with_is_named() -> None:
    run = Trace(np.array([0.0, 1.0]), {"motor.angle": np.zeros(2)}, {"motor.angle": "rad"})
    with pytest.raises(ValueRangeError, match="has no sensor"):
        measure(run, bench(), seed=1)


def test_a_tachometer_does_not_tell_the_angle() -> None:
    with pytest.raises(ArrangementError, match="cannot be inferred"):
        Tachometer(of="motor.angle", bandwidth=10.0, sample_rate=100.0).infer(None, None)  # type: ignore[arg-type]


def test_a_chain_of_sensors_travels_through_a_deck() -> None:
    made = bench(
        dial=Encoder(of="motor.angle", quantum=1e-3),
        latch=SampleAndHold(of="dial.reading", sample_rate=1000.0),
        tacho=Tachometer(of="latch.reading", bandwidth=30.0, sample_rate=1000.0),
    )
    text = deck_text(made)
    again = declare(read_deck(text, Path("bench.toml")))
    assert again.parts == made.parts
    assert [v.unit for v in flatten(again).outputs] == ["rad", "rad", "rad/s"]
