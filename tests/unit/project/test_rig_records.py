"""Sensors, sets and files of the simulated bench."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from tests.rig import (
    ACTUATORS,
    EFFECTS,
    LATER_EFFECTS,
    OUTSIDE_ANY_CATALOGUE,
    Hidden,
    make_records,
    truth,
    write_collection,
    write_set,
)
from tests.rig.actuators import Actuator
from tests.rig.bench import Servo, simulate
from tests.rig.commands import RECORDS, SINES, STEP, sines
from tests.rig.effects import scale_of
from tests.rig.records import measure
from tests.selection import quick_only

WIDEST = "sine_45deg_0.5Hz"


@pytest.fixture(params=tuple(ACTUATORS))
def actuator(request: pytest.FixtureRequest) -> Actuator:
    return ACTUATORS[request.param]


def test_sensors_add_what_they_say(actuator: Actuator) -> None:
    time = np.arange(round(1.0 / STEP)) * STEP
    command = sines(time, np.radians([25.0]), np.array([2.0]), np.zeros(1))
    history = simulate(actuator, Hidden(), Servo.for_actuator(actuator), command)
    plain = measure(history, actuator.sensors, Hidden(), None)
    every = {500.0: 40, 400.0: 50}[actuator.sensors.sample_rate]
    np.testing.assert_array_equal(plain[:, 3], history.force[::every])
    np.testing.assert_array_equal(plain[:, 0], history.time[::every])
    wrong = Hidden(force_delay=0.010, force_gain=1.15, force_bias=3.0, current_bias=0.2)
    table = measure(history, actuator.sensors, wrong, None)
    late = round(0.010 * actuator.sensors.sample_rate)
    assert late == 200 // every
    np.testing.assert_allclose(table[late:, 3], 1.15 * plain[:-late, 3] + 3.0, rtol=1e-12)
    np.testing.assert_array_equal(table[:late, 3], 3.0)
    np.testing.assert_allclose(table[:, 2], plain[:, 2] + 0.2, rtol=1e-12)
    np.testing.assert_array_equal(table[:, :2], plain[:, :2])

    noisy = measure(history, actuator.sensors, Hidden(), np.random.default_rng(1))
    quantum = actuator.sensors.angle_quantum
    assert quantum * actuator.sensors.counts == pytest.approx(2.0 * np.pi, rel=1e-12)
    np.testing.assert_allclose(noisy[:, 1] / quantum, np.round(noisy[:, 1] / quantum), atol=1e-9)
    assert np.max(np.abs(noisy[:, 1] - plain[:, 1])) <= 0.5 * quantum * (1.0 + 1e-9)
    for column, spread in ((2, actuator.sensors.current_noise), (3, actuator.sensors.force_noise)):
        assert np.std(noisy[:, column] - plain[:, column]) == pytest.approx(spread, rel=0.1)


@pytest.fixture(scope="module")
def mixed_set() -> dict[str, np.ndarray]:
    return make_records(ACTUATORS["arm"], {"coulomb_friction": 1.0, "second_relaxation": 0.5}, seed=5)


@pytest.mark.slow
def test_a_set_is_six_finite_records_at_the_sample_rate(mixed_set: dict[str, np.ndarray]) -> None:
    assert tuple(mixed_set) == RECORDS == (*SINES, "hold", "multisine")
    durations = [12.0, 8.0, 5.0, 3.0, 12.0, 10.0]
    for (name, table), duration in zip(mixed_set.items(), durations, strict=True):
        assert table.shape == (round(500 * duration), 4), name
        np.testing.assert_allclose(np.diff(table[:, 0]), 0.002, rtol=1e-9)
        assert np.all(np.isfinite(table)), name
        assert np.max(np.abs(table[:, 1])) < np.radians(50.0), name
        assert np.max(np.abs(table[:, 2])) < 12.0, f"{name}: the current is at its limit"


@pytest.mark.slow
def test_the_seed_fixes_a_set(mixed_set: dict[str, np.ndarray]) -> None:
    effects, name = {"coulomb_friction": 1.0, "second_relaxation": 0.5}, "sine_15deg_5.0Hz"
    again = make_records(ACTUATORS["arm"], effects, seed=5, only=[name])
    other = make_records(ACTUATORS["arm"], effects, seed=6, only=[name])
    assert list(again) == [name]
    np.testing.assert_array_equal(again[name], mixed_set[name])
    assert np.std(again[name][:, 3] - other[name][:, 3]) > 0.6


def test_what_is_hidden_changes_neither_actuator_nor_noise() -> None:
    arm, name = ACTUATORS["arm"], "sine_15deg_5.0Hz"
    assert truth(arm, {}, 5)[0].rubber == truth(arm, {"backlash": 1.0}, 5)[0].rubber
    plain, biased = (
        make_records(arm, effects, 5, only=[name])[name] for effects in ({}, {"force_sensor_bias": 1.0})
    )
    bias = 0.03 * scale_of(arm).force
    np.testing.assert_allclose(biased - plain, np.array([0.0, 0.0, 0.0, bias]) + 0.0 * plain, atol=1e-9)


@pytest.fixture(scope="module")
def clean_swing() -> np.ndarray:
    return make_records(ACTUATORS["wrist"], {"none": 1.0}, 9, noise=False, only=[WIDEST])[WIDEST]


ADDED = [name for name in (*EFFECTS, *LATER_EFFECTS, *OUTSIDE_ANY_CATALOGUE) if name != "none"]


@pytest.mark.long_cases("torque_constant_saturation", "winding_heat")
@pytest.mark.parametrize("effect", quick_only(ADDED, ADDED[::16]))
def test_every_effect_shows_above_the_noise(clean_swing: np.ndarray, effect: str) -> None:
    wrist = ACTUATORS["wrist"]
    wrong = make_records(wrist, {effect: 1.0}, 9, noise=False, only=[WIDEST])[WIDEST]
    rms = np.sqrt(np.mean((wrong - clean_swing) ** 2, axis=0))[1:]
    noise = [wrist.sensors.angle_quantum, wrist.sensors.current_noise, wrist.sensors.force_noise]
    assert np.all(np.isfinite(wrong))
    assert np.max(rms / noise) > 1.0


def test_strength_scales_the_effect_and_wrong_names_are_told() -> None:
    arm = ACTUATORS["arm"]
    one, two = (
        truth(arm, {"second_relaxation": s, "cable_compliance": s, "force_sensor_gain": s}, 1)[1]
        for s in (1.0, 2.0)
    )
    assert two.branch_modulus == pytest.approx(2.0 * one.branch_modulus)
    assert two.branch_time == one.branch_time
    assert two.cable_stiffness == pytest.approx(0.5 * one.cable_stiffness)
    assert two.force_gain - 1.0 == pytest.approx(2.0 * (one.force_gain - 1.0))
    assert truth(arm, {"backlash": 0.0}, 1)[1] == Hidden()
    with pytest.raises(ValueError, match="nearest: 'backlash'"):
        truth(arm, {"backlsh": 1.0}, 1)
    with pytest.raises(ValueError, match="strength of backlash"):
        truth(arm, {"backlash": -1.0}, 1)


# --- files ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_hold_what_was_declared_and_measured(
    tmp_path: Path, actuator: Actuator, mixed_set: dict[str, np.ndarray]
) -> None:
    write_set(tmp_path, actuator, mixed_set)
    declared = tomllib.loads((tmp_path / "rig.toml").read_text(encoding="utf-8"))
    assert declared["rubber"]["k_star_Pa"] == list(actuator.rubber.k_star)
    assert declared["rubber"]["delta_i_m"] == list(actuator.rubber.engage)
    assert declared["drivetrain"]["J_kg_m2"] == actuator.drivetrain.inertia
    assert declared["cam"] == {"table": "cam.csv"}
    assert declared["sensors"]["sample_rate_Hz"] == actuator.sensors.sample_rate
    assert declared["sensors"]["theta_quantum_rad"] == pytest.approx(actuator.sensors.angle_quantum, abs=1e-9)
    with (tmp_path / "cam.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["theta_rad", "delta_m", "lever_arm_m"]
    cam = np.array(rows, dtype=float)
    np.testing.assert_allclose(cumulative_trapezoid(cam[:, 2], cam[:, 0]), cam[1:, 1], rtol=2e-3, atol=1e-7)
    for name, table in mixed_set.items():
        file = tmp_path / f"{name}.csv"
        assert file.read_text(encoding="utf-8").startswith("t_s,theta_rad,current_A,force_N\n0.000,")
        written = np.loadtxt(file, delimiter=",", skiprows=1)
        np.testing.assert_allclose(
            written, table, atol=0.0051 * np.array([0.1, 1e-4, 0.1, 1.0]).max(), rtol=0
        )


def test_declaration_has_the_fields_of_the_practice_bench(shared_folder: Path, tmp_path: Path) -> None:
    practice = shared_folder / "practice"
    records = {"hold": np.zeros((2, 4))}
    write_collection(tmp_path, ACTUATORS["arm"], {"a01": (["backlash"], records), "a02": (["none"], records)})
    ours, theirs = (
        tomllib.loads((folder / "rig.toml").read_text(encoding="utf-8")) for folder in (tmp_path, practice)
    )
    assert {table: list(fields) for table, fields in ours.items()} == {
        table: list(fields) for table, fields in theirs.items()
    }
    for name in ("cam.csv",):
        heads = [
            (folder / name).read_text(encoding="utf-8").splitlines()[0] for folder in (tmp_path, practice)
        ]
        assert heads[0] == heads[1]
    heads = [
        (f / "hold.csv").read_text(encoding="utf-8").splitlines()[0]
        for f in (tmp_path / "a01", practice / "p07")
    ]
    assert heads[0] == heads[1]
    assert (tmp_path / "labels.json").read_text(encoding="utf-8").replace("\n", "").replace(" ", "") == (
        '{"a01":["backlash"],"a02":[]}'
    )
    assert sorted(file.stem for file in (practice / "p07").glob("*.csv")) == sorted(RECORDS)
