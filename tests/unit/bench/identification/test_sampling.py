"""How a signal runs between its samples: what is declared, what the records tell, and who reads it.

The machines are simulated here in NumPy, with a digital controller that holds its current.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.linalg import expm

from benchmarks._score_run import opened
from nlsdesign.bench.discrepancy import Verdict, diagnose, effects
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.filters import derivative
from nlsdesign.bench.identification.records.measurement import Record
from nlsdesign.bench.identification.records.sampling import AVERAGED, FORMS, HELD, SAMPLED, Sampling, shifted
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.changed_copies import smoothed
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.rig.kind_cases import names_of, write_kind_case

_FINE = 20
"""Steps of the simulation in a period of the controller, where none is exact over a whole one."""

_JOINT = """
[deck]
name = "joint"
description = "a geared joint with a weight"

[motor]
component = "GearedMotor"
inertia = {value = 0.30, unit = "kg*m^2", source = "declared", spread = 0.1}
gear_ratio = {value = 50, unit = "1", source = "declared"}
torque_constant = {value = 0.1, unit = "N*m/A", source = "declared"}

[bearing]
component = "Dashpot"
between = ["motor"]
damping = {value = 0.9, unit = "N*m*s/rad", source = "declared", spread = 0.5}

[friction]
component = "CoulombFriction"
between = ["motor"]
sliding_effort = {value = 2.0, unit = "N*m", source = "declared", spread = 0.3}

[arm]
component = "GravityLoad"
between = ["motor"]
horizontal_torque = {value = 6, unit = "N*m", source = "declared", spread = 0.1}
hanging_angle = {value = 0, unit = "rad", source = "declared"}

[encoder]
component = "Encoder"
of = "motor.angle"
quantum = {value = 2e-5, unit = "rad", source = "declared"}

[ammeter]
component = "CurrentSensor"
of = "motor.current"
bias = {value = 0, unit = "A", source = "declared"}
noise = {value = 0.02, unit = "A", source = "declared"}
"""
_AXIS = """
[deck]
name = "axis"
description = "two masses and a spring"

[motor]
component = "GearedMotor"
inertia = {value = 0.009, unit = "kg*m^2", source = "declared", spread = 0.1}
gear_ratio = {value = 1, unit = "1", source = "declared"}
torque_constant = {value = 0.4, unit = "N*m/A", source = "declared"}

[bearing]
component = "Dashpot"
between = ["motor"]
damping = {value = 0.03, unit = "N*m*s/rad", source = "declared", spread = 0.5}

[load]
component = "Inertia"
inertia = {value = 0.014, unit = "kg*m^2", source = "declared", spread = 0.1}

[belt]
component = "Spring"
between = ["motor", "load"]
stiffness = {value = 45, unit = "N*m/rad", source = "declared", spread = 0.1}

[loss]
component = "Dashpot"
between = ["motor", "load"]
damping = {value = 0.04, unit = "N*m*s/rad", source = "declared", spread = 0.7}

[encoder]
component = "Encoder"
of = "motor.angle"
quantum = {value = 2e-5, unit = "rad", source = "declared"}

[load_encoder]
component = "Encoder"
of = "load.angle"
quantum = {value = 2e-5, unit = "rad", source = "declared"}

[ammeter]
component = "CurrentSensor"
of = "motor.current"
bias = {value = 0, unit = "A", source = "declared"}
noise = {value = 0.005, unit = "A", source = "declared"}
"""


def joint(seed: int, *, rate: float = 500.0, missing: float = 0.0, late: int = 0) -> Array:
    """Return time, angle and held current of a joint; ``missing`` is Coulomb friction beyond the declared."""

    def step(state: Sequence[float], current: float, h: float) -> Sequence[float]:
        angle, before = state[:2]
        speed = before + h * (5.0 * current - 0.8 * before - 6.2 * math.sin(angle)) / 0.31
        stuck = h * (2.1 + missing) / 0.31
        speed = max(speed - stuck, 0.0) if speed > 0.0 else min(speed + stuck, 0.0)
        return angle + 0.5 * h * (before + speed), speed, 0.0, 0.0

    table = held(seed, step, rate=rate, gains=(0.31 * 900.0 / 5.0, 0.31 * 48.0 / 5.0), size=0.9, late=late)
    return np.column_stack([table[:, 0], 2e-5 * np.round(table[:, 1] / 2e-5), table[:, 3]])


def axis(seed: int, *, late: float = 0.0, count: float = 2e-5) -> Array:
    """Return time, both angles and held current of two masses, 250 Hz; the damping of the belt is 0.03.

    ``late``: samples by which the angle of the load is older than its stamp. ``count``: of encoders, rad.
    """
    motor, load, stiffness, loss = 0.0085, 0.0145, 46.0, 0.03
    rates = np.zeros((5, 5))
    rates[0, 1] = rates[2, 3] = 1.0
    belt = np.array([stiffness, loss, -stiffness, -loss, 0.0])
    rates[1] = -belt / motor + np.array([0.0, -0.025, 0.0, 0.0, 0.4]) / motor
    rates[3] = belt / load
    exact = expm(rates / 250.0)

    def step(state: Sequence[float], current: float, _: float) -> Sequence[float]:
        return (exact[:4] @ (*state, current)).tolist()  # type: ignore[no-any-return]

    gains = 0.023 * 400.0 / 0.4, 0.023 * 32.0 / 0.4
    table = held(seed, step, rate=250.0, gains=gains, size=1.5, steps=1)
    if late:
        between = make_interp_spline(table[:, 0], table[:, 2], k=7)
        table[:, 2] = between(np.maximum(table[:, 0] - late / 250.0, 0.0))
    table[:, 1:3] = count * np.round(table[:, 1:3] / count)
    return table


def held(
    seed: int,
    step: Callable[[Sequence[float], float, float], Sequence[float]],
    *,
    rate: float,
    gains: tuple[float, float],
    size: float,
    late: int = 0,
    steps: int = _FINE,
) -> Array:
    """Run a controller that holds its current; return time, both angles and the current at its instants.

    ``late``: steps of the simulation after which a new current acts. ``steps``: in a period.
    """
    draw = np.random.default_rng(seed)
    frequencies, phases = draw.uniform(0.3, 3.0, 4), draw.uniform(0.0, math.tau, 4)
    period, before, rows = 1.0 / rate, 0.0, []
    state: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
    last = 0.0
    for k in range(round(6.0 * rate)):
        ramp = min(1.0, k * period)
        waves = np.sin(math.tau * frequencies * k * period + phases) / frequencies
        goal = ramp * size * 0.25 * float(np.sum(waves))
        error = goal - state[0]
        current = gains[0] * error + gains[1] * (error - before) / period
        before = error
        rows.append((k * period, state[0], state[2], current))
        for fine in range(steps):
            state = step(state, last if fine < late else current, period / steps)
        last = current
    table = np.array(rows)
    table[:, 3] += (0.02 if size < 1.0 else 0.005) * draw.standard_normal(len(table))
    return table


def bench(
    folder: Path, deck: str, tables: list[Array], between: str | None = None, *, backward: bool = False
) -> tuple[Assembly, RecordSet]:
    """Write a deck and its records, the last one held out, and read them as a user would.

    ``backward``: list the columns from the last to the first.
    """
    (folder / "deck.toml").write_text(deck, encoding="utf-8")
    signals = ["encoder", "load_encoder", "ammeter"] if tables[0].shape[1] == 4 else ["encoder", "ammeter"]
    lines = [f'held_out = ["run{len(tables) - 1}"]', '[time]\ncolumn = "t_s"']
    for name in reversed(signals) if backward else signals:
        lines += [
            f"[columns.{name}]",
            f'signal = "{name}.reading"',
            f'unit = "{"A" if name == "ammeter" else "rad"}"',
        ]
        lines += [f'between_samples = "{between}"'] if between and name == "ammeter" else []
    (folder / "records.toml").write_text("\n".join(lines), encoding="utf-8")
    for k, table in enumerate(tables):
        np.savetxt(
            folder / f"run{k}.csv", table, "%.9g", ",", header=",".join(["t_s", *signals]), comments=""
        )
    declared = smoothed(declare(load_deck(str(folder / "deck.toml"))))
    return declared, load_records(folder, flatten(declared))


def forms(declared: Assembly, records: RecordSet) -> dict[str, Sampling | None]:
    model = flatten(declared)
    seen = Bench(records, blocks_of(model, records.signals))
    return {column.name: column.sampling for column in seen.records.columns}


def remarks(found: Verdict) -> str:
    return " ".join(found.remarks)


@pytest.mark.parametrize("between", [None, pytest.param("held", marks=pytest.mark.slow)])
def test_nothing_is_missing_from_a_joint_whose_controller_holds_its_current(
    tmp_path: Path, between: str | None
) -> None:
    found = diagnose(*bench(tmp_path, _JOINT, [joint(seed) for seed in range(5)], between))
    assert found.verdict == "none"
    assert ("is taken as held" in remarks(found)) is (between is None)


@pytest.mark.slow
def test_nothing_is_missing_from_an_axis_and_the_damping_of_its_belt_is_right(tmp_path: Path) -> None:
    found = diagnose(*bench(tmp_path, _AXIS, [axis(seed) for seed in range(5)]))
    assert found.verdict == "none"
    numbers = {p.name: (f.values[p.name], f.standard_error(p.name)) for f in found.fits for p in f.parameters}
    value, error = numbers["loss.damping"]
    assert value == pytest.approx(0.03, abs=max(3.0 * error, 6e-4))


def test_a_held_current_is_told_beside_friction_that_nobody_declared(tmp_path: Path) -> None:
    told = forms(*bench(tmp_path, _JOINT, [joint(seed, missing=3.0) for seed in range(4)]))
    assert told["ammeter"] is not None
    assert told["ammeter"].late == pytest.approx(0.5, abs=0.1)
    assert told["encoder"] is SAMPLED


def test_a_held_current_is_told_beside_friction_that_follows_a_belt(tmp_path: Path) -> None:
    """Its force is no input; it was taken for a current that acts 0.4 of a sample early.

    The force that accelerates the load is that of the belt but for its damping: a fifth of a sample is left.
    """
    write_kind_case(tmp_path, "belt_axis", ("load_dependent_friction",), 1.0, 1322, condition="plain")
    told = forms(*opened(tmp_path))[names_of("belt_axis", 1322)["current"]]
    assert told is not None
    assert told.late == pytest.approx(0.5, abs=0.25)


def test_a_held_current_that_acts_half_a_sample_late_is_read_so(tmp_path: Path) -> None:
    """A delay of 1.05 samples is at the least one that an effect could have: nobody would name it."""
    told = forms(*bench(tmp_path, _JOINT, [joint(seed, late=11) for seed in range(4)]))
    assert told["ammeter"] is not None
    assert told["ammeter"].late == pytest.approx(1.05, abs=0.03)


@pytest.mark.long_cases("None")
@pytest.mark.parametrize("declared", [None, "held"])
def test_a_hold_behind_which_something_lags_is_read_as_late_as_it_is(
    tmp_path: Path, declared: str | None
) -> None:
    """A current loop that lags by a quarter of a sample is no fault, also where the hold is declared."""
    deck, records = bench(tmp_path, _JOINT, [joint(seed, late=5) for seed in range(4)], declared)
    told = forms(deck, records)["ammeter"]
    assert told is not None
    assert told.late == pytest.approx(0.75, abs=0.02)


def test_a_hold_declared_beside_a_lag_of_a_whole_sample_stays_declared(tmp_path: Path) -> None:
    """That is a delay, which an effect has to explain."""
    deck, records = bench(tmp_path, _JOINT, [joint(seed, late=20) for seed in range(4)], "held")
    assert forms(deck, records)["ammeter"] is HELD


@pytest.mark.parametrize(
    ("count", "backward", "between"),
    [
        pytest.param(5e-4, False, None, marks=pytest.mark.slow),
        pytest.param(5e-4, True, None, marks=pytest.mark.slow),
        (1e-4, True, "held"),
        pytest.param(1e-4, False, "held", marks=pytest.mark.slow),
        pytest.param(1e-4, False, None, marks=pytest.mark.slow),
        pytest.param(2e-5, False, None, marks=pytest.mark.slow),
    ],
)
def test_encoders_that_are_sampled_in_turn_are_no_fault(
    tmp_path: Path, count: float, backward: bool, between: str | None
) -> None:
    """The load's encoder is read 0.4 of a sample after the motor's; the machine lacks nothing.

    With fine counts a second relaxation was named, or nothing could be decided; with the load's encoder in
    front of the motor's too.
    """
    deck, tables = (
        _AXIS.replace("2e-5", f"{count:g}"),
        [axis(seed, late=0.4, count=count) for seed in range(5)],
    )
    found = diagnose(*bench(tmp_path, deck, tables, between, backward=backward))
    assert found.verdict == "none"
    remark = next(text for text in found.remarks if "load_encoder" in text)
    late = re.search(r"is read about (0\.\d+) of a sample later", remark)
    assert late, remark
    assert float(late[1]) == pytest.approx(0.4, abs=0.02)


@pytest.mark.slow
def test_encoders_that_are_sampled_in_turn_hide_no_damping(tmp_path: Path) -> None:
    """The belt's damping is missing, and the load's encoder is read 0.6 of a sample before the motor's."""
    whole = _AXIS.replace("2e-5", "1e-4")
    deck = whole[: whole.index("[loss]")] + whole[whole.index("[encoder]") :]
    rivals = (effects.spring_damping, effects.quadratic_drag, effects.second_relaxation)
    tables = [axis(seed, late=-0.6, count=1e-4) for seed in range(5)]
    found = diagnose(*bench(tmp_path, deck, tables), catalogue=rivals)
    assert [(each.name, found.complete) for each in found.effects] == [("spring_damping", True)]
    (damping,) = (value for value, *_ in found.effects[0].parameters.values())
    assert damping == pytest.approx(0.03, rel=0.02)
    assert any("of a sample earlier, as where channels are sampled in turn" in text for text in found.remarks)


@pytest.mark.parametrize("late", [-0.6, 0.0, 0.3, 0.9])
def test_a_held_acceleration_is_read_as_sampled_positions_have_it(late: float) -> None:
    """A double integrator, integrated exactly in twenty parts of each sample; the motion is slow to 3 %."""
    draw = np.random.default_rng(1)
    time = np.arange(400.0)
    waves = [(draw.uniform(0.05, 1.2), draw.uniform(0.0, math.tau)) for _ in range(8)]
    given = sum(np.sin(rate * time + phase) for rate, phase in waves)
    fine = np.repeat(given, _FINE)
    acts = np.roll(fine, round(late * _FINE))
    speed = np.concatenate([[0.0], np.cumsum(acts)]) / _FINE
    place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / _FINE
    wanted = derivative(place[::_FINE][:400], 1.0, order=2)
    read = shifted(HELD, 0.5 + late).at_samples(given)
    inside = slice(20, -20)
    assert read[inside] == pytest.approx(wanted[inside], abs=2e-3 * float(np.max(np.abs(given))))


@pytest.mark.parametrize("form", FORMS)
def test_a_wave_is_read_at_the_samples_as_a_filter_sees_it(form: Sampling) -> None:
    """A hold of one period passes a wave half a sample later, times sin(x)/x; a mean is undone."""
    turn, at = 0.3, np.arange(200)
    gain = {"sampled": 1.0, "averaged": (0.5 * turn) / math.sin(0.5 * turn)}
    expected = gain.get(form.name, math.sin(0.5 * turn) / (0.5 * turn)) * np.sin(turn * (at - form.late))
    np.testing.assert_allclose(form.at_samples(np.sin(turn * at))[5:-5], expected[5:-5], atol=3e-4)


def test_a_held_signal_is_read_held_between_its_samples() -> None:
    values = np.array([0.0, 1.0, 3.0, 3.0, 2.0])
    np.testing.assert_array_equal(HELD.over_steps(values)[1], values[:-1])
    assert AVERAGED.over_steps(values)[0].shape == (4,)


def test_a_motion_that_is_held_is_refused(tmp_path: Path) -> None:
    bench(tmp_path, _JOINT, [joint(0)[:200], joint(1)[:200]])
    text = (tmp_path / "records.toml").read_text(encoding="utf-8")
    spoilt = text.replace('unit = "rad"', 'unit = "rad"\nbetween_samples = "held"')
    (tmp_path / "records.toml").write_text(spoilt, encoding="utf-8")
    with pytest.raises(MeasurementError, match="a motion moves on between its samples"):
        load_records(tmp_path, flatten(smoothed(declare(load_deck(str(tmp_path / "deck.toml"))))))
    (tmp_path / "records.toml").write_text(spoilt.replace('= "held"', '= "holds"'), encoding="utf-8")
    with pytest.raises(MeasurementError, match="no way to run between samples"):
        load_records(tmp_path, flatten(smoothed(declare(load_deck(str(tmp_path / "deck.toml"))))))


def test_a_derivative_is_taken_once_for_each_way_to_read_a_trace() -> None:
    time = np.arange(400) * 0.002
    trace = Trace(time, {"a": np.sin(9.0 * time), "i": np.cos(9.0 * time)}, {"a": "rad", "i": "A"})
    record, held = Record("r", trace), Record("other", trace, sampling={"i": HELD})
    for signal, order in (("a", 0), ("a", 1), ("a", 2), ("i", 1)):
        expected = derivative(held.at_samples(signal), 0.002, order=order, span=0.04)
        np.testing.assert_array_equal(held.derived(signal, order, 0.04), expected)
    assert record.derived("a", 1, 0.04) is held.derived("a", 1, 0.04)
    assert not np.array_equal(record.derived("i", 1, 0.04), held.derived("i", 1, 0.04))
    assert not np.array_equal(record.derived("a", 1, 0.04), record.derived("a", 1, 0.06))
    with pytest.raises(ValueError, match="read-only"):
        record.derived("a", 1, 0.04)[0] = 1.0
