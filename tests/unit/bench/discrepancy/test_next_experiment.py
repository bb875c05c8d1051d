"""What to measure next, on a motor with a spring whose current is worked out by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import effects
from nlsdesign.bench.discrepancy.planning.candidate_commands import MachineLimits, commands, limits_seen
from nlsdesign.bench.discrepancy.planning.experiment import Experiment, next_experiment, write_command
from nlsdesign.bench.discrepancy.planning.separation import BlockResponse, ReadyHypothesis, apart
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet, load_records
from nlsdesign.bench.identification.equation_error.block_response import DrivenBlock
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import ROTATION, Assembly, Dashpot, GearedMotor, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace

Law = Callable[[Array], Array]

INERTIA, DAMPING, STIFFNESS, TORQUE = 2e-3, 5e-3, 0.8, 0.05
COLUMNS = (Column("angle_deg", "motor.angle", "deg"), Column("current_A", "motor.current", "A"))
UNITS = {"motor.angle": "rad", "motor.current": "A"}
STEP, NOISE = 2e-3, 0.05
LIMITS = MachineLimits(-1.0, 1.0, speed=6.0, acceleration=150.0, drive=(("motor.current", 30.0),))


def number(value: float, unit: str, spread: float = 0.0) -> Quantity:
    return Quantity(value, unit, "by hand", spread)


def machine() -> Assembly:
    return assembly(
        "machine",
        motor=GearedMotor(
            inertia=number(INERTIA, "kg*m^2", 0.1), gear_ratio=1.0,
            torque_constant=number(TORQUE, "N*m/A"), current_limit=number(50.0, "A"),
        ),
        spring=tie(Spring(stiffness=number(STIFFNESS, "N*m/rad", 0.1), domain=ROTATION), "motor"),
        bearing=tie(Dashpot(damping=number(DAMPING, "N*m*s/rad", 0.6), domain=ROTATION), "motor"),
    )  # fmt: skip


def record(name: str, time: Array, angle: Array, friction: Law, seed: int) -> Record:
    """The current that the motion asks for, with a law of friction over the speed, and noise."""
    draw = np.random.default_rng(seed)
    speed = np.gradient(angle, time)
    torque = INERTIA * np.gradient(speed, time) + DAMPING * speed + STIFFNESS * angle + friction(speed)
    signals = {
        "motor.angle": angle + 2e-5 * draw.standard_normal(len(time)),
        "motor.current": torque / TORQUE + NOISE * draw.standard_normal(len(time)),
    }
    return Record(name, Trace(time, signals, UNITS, name))


def dry(speed: Array) -> Array:
    return 0.02 * np.tanh(speed / 0.005)


def stribeck(speed: Array) -> Array:
    return (0.02 + 0.02 * np.exp(-((speed / 0.2) ** 2))) * np.tanh(speed / 0.005)


def quick(friction: Law) -> Record:
    """A quick sine, of which hardly a sample is slow."""
    time = np.arange(0.0, 2.0, STEP)
    return record("quick", time, 0.4 * np.sin(2.0 * np.pi * 2.0 * time), friction, 1)


def fitted(records: Sequence[Record], *names: str) -> tuple[Bench, list[Hypothesis]]:
    chosen = RecordSet(tuple(records), COLUMNS)
    bench = Bench(chosen, blocks_of(flatten(machine()), chosen.signals))
    comparison = Comparison(bench, {"spring.torque": 0.4})
    base = comparison.base(machine())
    experiment = [comparison.with_effect(base, getattr(effects, name)(base.assembly)[0]) for name in names]
    return bench, [h for h in experiment if h is not None]


def left(hypothesis: Hypothesis) -> float:
    return sum(t.squares for t in hypothesis.tallies.values())


@cache
def undecided() -> tuple[Bench, list[Hypothesis]]:
    """A record that is too quick to tell Stribeck friction from Coulomb's, and both fitted to it."""
    return fitted([quick(stribeck)], "coulomb_friction", "stribeck_friction")


@cache
def proposed() -> Experiment:
    bench, hypotheses = undecided()
    experiment = next_experiment(hypotheses, bench, limits=LIMITS, duration=4.0)
    assert experiment is not None
    return experiment


def test_the_proposed_record_decides_what_the_first_one_could_not() -> None:
    experiment, (simple, rich) = proposed(), undecided()[1]
    assert abs(left(simple) - left(rich)) < 9.0
    time, angle = experiment.command.time, experiment.command["motor.angle"]
    further = record("further", time, angle, stribeck, 2)
    _, (simple, rich) = fitted([quick(stribeck), further], "coulomb_friction", "stribeck_friction")
    assert left(simple) - left(rich) > 100.0


def test_it_is_slow_where_only_slowness_tells() -> None:
    experiment = proposed()
    speed = np.abs(np.gradient(experiment.command["motor.angle"], experiment.command.time))
    quickest = 0.4 * 2.0 * np.pi * 2.0
    assert np.median(speed[speed > 1e-3]) < 0.2 * quickest


def test_the_expected_current_is_that_of_the_motion() -> None:
    """The record that is expected obeys the balance that was written by hand, with the best numbers."""
    experiment, (simple, _) = proposed(), undecided()[1]
    time, angle = experiment.command.time, experiment.command["motor.angle"]
    speed = np.gradient(angle, time)
    numbers = {n: simple.values[n] for n in simple.values}
    torque = (
        numbers["motor.inertia"] * np.gradient(speed, time)
        + numbers["bearing.damping"] * speed
        + numbers["spring.stiffness"] * angle
        + numbers["dry_friction.sliding_effort"] * np.tanh(speed / 0.02)
    )
    inside = slice(50, -50)
    error = experiment.command["motor.current"][inside] - torque[inside] / TORQUE
    assert np.max(np.abs(error)) < 0.05 * np.max(np.abs(torque)) / TORQUE


def test_what_a_number_can_absorb_does_not_count() -> None:
    """D² = |δ|² less what the slopes of the other hypothesis hold of δ, as far as its numbers are open."""
    rival = SimpleNamespace(information={"b": np.zeros((1, 1))})
    plain = SimpleNamespace(stiff=False)
    slope, aside = np.array([[3.0], [4.0], [0.0]]), np.array([0.0, 0.0, 2.0])

    def squares(delta: Array, information: float) -> float:
        rival.information["b"] = np.array([[information]])
        one = {"b": BlockResponse(np.zeros(3), slope, cast(DrivenBlock, plain))}
        other = {"b": BlockResponse(delta, slope, cast(DrivenBlock, plain))}
        return apart([one], other, cast(ReadyHypothesis, rival), {"b": 1.0}).squares

    along = 0.2 * slope.ravel()
    assert squares(along, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert squares(along + aside, 0.0) == pytest.approx(4.0)
    assert squares(along, 1e9) == pytest.approx(along @ along, rel=1e-6)
    assert squares(along, 25.0) == pytest.approx(0.5 * along @ along)


def test_every_command_stays_within_the_limits() -> None:
    time = np.arange(0.0, 6.0, STEP)
    for limits in (LIMITS, MachineLimits(-0.1, 1.0, speed=0.5, acceleration=10.0), MachineLimits(0.0, 2.0)):
        experiment = commands(time, 0.0, limits)
        assert len(experiment) > 8
        assert len({c.words for c in experiment}) == len(experiment)
        for each in experiment:
            slope = np.gradient(each.value, time)
            assert limits.low - 1e-9 <= each.value.min(), each.words
            assert each.value.max() <= limits.high + 1e-9, each.words
            assert np.max(np.abs(slope)) <= 1.1 * limits.speed, each.words
            assert np.max(np.abs(np.gradient(slope, time))) <= 1.1 * limits.acceleration, each.words
            assert abs(each.value[0]) < 1e-6 * (limits.high - limits.low), each.words
            assert abs(slope[0]) <= 0.05 * np.max(np.abs(slope)), each.words


def test_the_drive_stays_within_its_limit() -> None:
    bench, hypotheses = undecided()
    tight = replace(LIMITS, drive=(("motor.current", 4.0),))
    experiment = next_experiment(hypotheses, bench, limits=tight, duration=4.0)
    assert experiment is not None
    assert np.max(np.abs(experiment.command["motor.current"])) <= 1.02 * 4.0
    assert (
        next_experiment(hypotheses, bench, limits=replace(LIMITS, drive=(("motor.current", 1e-3),))) is None
    )


def test_limits_are_what_the_records_show() -> None:
    first = quick(dry)
    seen = limits_seen([first], "motor.angle", drives=("motor.current",), motions=("motor.angle",))
    turn = 2.0 * np.pi * 2.0
    assert (seen.low, seen.high) == pytest.approx((-0.4, 0.4), rel=0.01)
    assert seen.speed == pytest.approx(0.4 * turn, rel=0.02)
    assert seen.acceleration == pytest.approx(0.4 * turn**2, rel=0.1)
    torque = (STIFFNESS - INERTIA * turn**2) * 0.4, DAMPING * 0.4 * turn + 0.02
    assert dict(seen.drive)["motor.current"] == pytest.approx(np.hypot(*torque) / TORQUE, rel=0.1)


def test_a_command_is_written_with_the_head_and_unit_of_its_column(tmp_path: Path) -> None:
    experiment = proposed()
    write_command(experiment, tmp_path / "next_record.csv")
    lines = (tmp_path / "next_record.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "t_s,angle_deg"
    assert len(lines) == len(experiment.command.time) + 1
    table = np.loadtxt(tmp_path / "next_record.csv", delimiter=",", skiprows=1)
    assert np.radians(table[:, 1]) == pytest.approx(experiment.command["motor.angle"], abs=1e-8)
    assert table[:, 0] == pytest.approx(experiment.command.time, abs=1e-8)
    (tmp_path / "records.toml").write_text(
        '[time]\ncolumn = "t_s"\nunit = "s"\n[columns.angle_deg]\nsignal = "motor.angle"\nunit = "deg"\n',
        encoding="utf-8",
    )
    again = load_records(tmp_path, flatten(machine()))
    assert again.records[0].trace["motor.angle"][10] == pytest.approx(
        experiment.command["motor.angle"][10], abs=1e-8
    )


def test_words_say_what_to_record_and_what_it_would_show() -> None:
    experiment = proposed()
    text = experiment.words()
    for part in (
        experiment.motion,
        "motor.angle",
        "4 s",
        "coulomb_friction and stribeck_friction",
        "deg",
        "`motor`",
    ):
        assert part in text
    assert experiment.to_dict()["separations"][0]["one"] == "coulomb_friction"


@pytest.mark.slow
def test_an_open_loop_drive_is_commanded_through_the_model() -> None:
    """The motor alone with its current commanded: the motion that is expected is that of a simulation."""
    bench, hypotheses = undecided()
    limits = MachineLimits(-8.0, 8.0, travel=(("motor.angle", -1.0, 1.0),))
    experiment = next_experiment(hypotheses, bench, commanded="motor.current", limits=limits, duration=1.0)
    assert experiment is not None
    assert experiment.signal == "motor.current"
    assert np.max(np.abs(experiment.command["motor.current"])) <= 8.0
    assert 0.01 < np.max(np.abs(experiment.command["motor.angle"])) <= 1.1


def test_what_cannot_be_commanded_is_said() -> None:
    bench, hypotheses = undecided()
    assert next_experiment(hypotheses[:1], bench) is None
    with pytest.raises(MeasurementError, match=r"command one of: motor\.angle, motor\.current"):
        next_experiment(hypotheses, bench, commanded="spring.torque")
