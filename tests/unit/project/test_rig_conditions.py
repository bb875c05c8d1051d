"""Disturbances of the rig's records do what they say, and near misses of the catalogue where they say it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.rig import ACTUATORS, COUNTS, Conditions, Hidden, make_records, mistaken, write_records
from tests.rig.bench import Servo, simulate
from tests.rig.commands import STEP, sines
from tests.rig.conditions import first_order_noise
from tests.rig.effects import scale_of
from tests.rig.records import measure, stream_of_mistakes

ELBOW = ACTUATORS["elbow"]
SHORT = "sine_15deg_5.0Hz"


def table(count: int) -> np.ndarray:
    return np.column_stack([np.arange(count) / 500.0, np.zeros((count, 3))])


def test_noise_of_first_order_forgets_over_its_steps() -> None:
    noise = first_order_noise(200_000, 8.0, np.random.default_rng(1))
    assert np.var(noise) == pytest.approx(1.0, rel=0.05)
    for lag in (1, 8, 20):
        assert np.mean(noise[lag:] * noise[:-lag]) == pytest.approx(np.exp(-lag / 8.0), abs=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_coloured_noise_has_its_size_and_a_time_within_its_limits(seed: int) -> None:
    plain = table(50_000)
    noisy = Conditions(coloured=1.5).disturbed(plain, ELBOW.sensors, np.random.default_rng(seed))
    force = noisy[:, 3]
    np.testing.assert_array_equal(noisy[:, :3], plain[:, :3])
    assert np.std(force) == pytest.approx(1.5 * ELBOW.sensors.force_noise, rel=0.1)
    kept = np.mean(force[1:] * force[:-1]) / np.var(force)
    assert 0.004 < -1.0 / (500.0 * np.log(kept)) < 0.13


def test_flicker_falls_with_the_frequency() -> None:
    noisy = Conditions(flicker=1.0).disturbed(table(50_000), ELBOW.sensors, np.random.default_rng(3))
    power = np.abs(np.fft.rfft(noisy[:, 3] * np.hanning(50_000))) ** 2
    frequency = np.fft.rfftfreq(50_000, 0.002)
    bands = [(0.1, 0.3), (1.0, 3.0), (10.0, 30.0)]
    mean = [np.mean(power[(frequency > low) & (frequency < high)]) for low, high in bands]
    slopes = np.diff(np.log10(mean))
    assert np.all((slopes > -1.5) & (slopes < -0.6)), slopes
    assert np.std(noisy[:, 3]) == pytest.approx(ELBOW.sensors.force_noise, rel=0.25)


def test_spikes_are_single_samples_far_off() -> None:
    plain = table(5000)
    noisy = Conditions(spikes=12).disturbed(plain, ELBOW.sensors, np.random.default_rng(4))
    sizes = np.abs(noisy - plain)[:, 1:] / [ELBOW.sensors.angle_quantum, 0.04, 0.6]
    assert np.count_nonzero(sizes) == 12
    assert np.count_nonzero(np.any(sizes > 0.0, axis=0)) == 3
    assert 30.0 <= np.min(sizes[sizes > 0.0]) <= np.max(sizes) <= 3000.0
    assert not np.any(sizes[[0, -1]])


def test_coarse_counts_are_declared_and_measured() -> None:
    for counts in COUNTS:
        conditions = Conditions(counts=counts)
        quantum = conditions.declared(ELBOW).sensors.angle_quantum
        assert quantum == pytest.approx(2.0 * np.pi / counts)
        angle = make_records(ELBOW, {}, 1, only=[SHORT], conditions=conditions)[SHORT][:, 1]
        np.testing.assert_allclose(angle / quantum, np.round(angle / quantum), atol=1e-9)


def test_conditions_leave_everything_else_as_it_was() -> None:
    plain = make_records(ELBOW, {}, 1, only=[SHORT])[SHORT]
    spiked = make_records(ELBOW, {}, 1, only=[SHORT], conditions=Conditions(spikes=2))[SHORT]
    again = make_records(ELBOW, {}, 1, only=[SHORT], conditions=Conditions(spikes=2))[SHORT]
    np.testing.assert_array_equal(spiked, again)
    assert np.count_nonzero(spiked != plain) == 2


def test_one_declared_number_is_wrong_by_30_to_60_per_cent() -> None:
    paths = set()
    for seed in range(30):
        wrong, path = mistaken(ELBOW, stream_of_mistakes(seed))
        paths.add(path)
        drive, rubber = ELBOW.drivetrain, ELBOW.rubber
        ratios = np.array(
            [
                wrong.drivetrain.inertia / drive.inertia,
                wrong.drivetrain.torque_constant / drive.torque_constant,
                wrong.rubber.k / rubber.k,
            ]
        )
        off = np.abs(ratios - 1.0)
        assert np.count_nonzero(off) == 1
        assert 0.3 <= np.max(off) <= 0.6
    assert len(paths) == 3


def test_times_between_milliseconds_are_written_in_full(tmp_path: Path) -> None:
    made = make_records(ACTUATORS["shoulder"], {}, 1, only=[SHORT])
    write_records(tmp_path, made)
    rows = np.loadtxt(tmp_path / f"{SHORT}.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(np.diff(rows[:, 0]), 0.0025, atol=1e-9)


def run(seconds: float = 1.0, **hidden: float) -> np.ndarray:
    """Record of a slow sine without noise: time, angle, current, force."""
    time = np.arange(round(seconds / STEP)) * STEP
    command = sines(time, np.radians([30.0]), np.array([1.0]), np.zeros(1))
    what = Hidden(**hidden)
    return measure(simulate(ELBOW, what, Servo.for_actuator(ELBOW), command), ELBOW.sensors, what, None)


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return run()


def test_a_push_comes_once_and_at_its_time(plain: np.ndarray) -> None:
    pushed = run(push=0.5, push_place=0.5, push_time=0.2)
    apart = np.abs(pushed - plain)[:, 2]
    assert np.max(apart[plain[:, 0] < 0.49]) == 0.0
    assert np.max(apart[(plain[:, 0] > 0.5) & (plain[:, 0] < 0.7)]) > 0.1
    assert np.max(apart[plain[:, 0] > 0.95]) < 0.02


def test_rubber_gets_warm_in_the_middle_of_a_record(plain: np.ndarray) -> None:
    warm = run(cold=0.12, cold_place=0.5)
    before = plain[:, 0] < 0.5
    np.testing.assert_array_equal(warm[before], plain[before])
    force = scale_of(ELBOW).force
    strong = ~before & (plain[:, 3] > 0.3 * force)
    ratio = warm[strong, 3] / plain[strong, 3]
    assert 0.85 < np.min(ratio) <= np.max(ratio) < 0.95


def test_a_stop_acts_only_beyond_its_place(plain: np.ndarray) -> None:
    stopped = run(stop=20.0, stop_place=0.35)
    first = np.argmax(np.abs(plain[:, 1]) > 0.35)
    assert 0 < first < len(plain) - 1
    np.testing.assert_array_equal(stopped[:first], plain[:first])
    assert np.max(np.abs(stopped[:, 1])) < np.max(np.abs(plain[:, 1])) - 0.005


def test_interference_and_filter_touch_the_force_read_alone(plain: np.ndarray) -> None:
    chirped = run(chirp=3.0, chirp_frequency=5.0, chirp_rate=2.0)
    time = plain[:, 0]
    expected = 3.0 * np.sin(2.0 * np.pi * (5.0 + 2.0 * time) * time)
    np.testing.assert_allclose(chirped[:, 3] - plain[:, 3], expected, atol=1e-9)
    filtered = run(lowpass=0.01)
    np.testing.assert_array_equal(filtered[:, :3], plain[:, :3])
    # A slow force is read 2 ζ / ω later.
    late = np.interp(time - 2.0 * 0.7 * 0.01, time, plain[:, 3])
    force = np.std(plain[:, 3])
    assert np.std(filtered[:, 3] - late) < 0.1 * np.std(filtered[:, 3] - plain[:, 3])
    assert np.std(filtered[:, 3] - plain[:, 3]) > 0.05 * force


def test_a_clock_that_runs_fast_and_a_sensor_that_is_not_linear(plain: np.ndarray) -> None:
    time, force = plain[:, 0], plain[:, 3]
    fast = run(clock_error=0.02)
    whole = (1.02 * time) < time[-1]
    # Linear between samples, so not where the rubber begins to stiffen.
    apart = np.abs(fast[whole, 3] - np.interp(1.02 * time[whole], time, force))
    assert np.quantile(apart, 0.98) < 0.02
    assert np.std(fast[whole, 3] - force[whole]) > 1.0
    curved = run(force_curve=1e-3)
    np.testing.assert_allclose(curved[:, 3], force + 1e-3 * force * np.abs(force), rtol=1e-12)


def test_loads_of_the_motor_side_appear_in_the_current_that_holds_an_angle() -> None:
    """Torque constant × current = what the clean one needs and the load, at rest."""
    time = np.arange(round(2.0 / STEP)) * STEP
    rise = np.clip(time / 0.5, 0.0, 1.0)
    angle = np.radians(30.0) * rise * rise * (3.0 - 2.0 * rise)
    command = replace(sines(time, np.zeros(1), np.ones(1), np.zeros(1)), angle=angle)
    per_ampere = ELBOW.drivetrain.torque_per_ampere

    def torque(**hidden: float) -> tuple[float, float]:
        history = simulate(ELBOW, Hidden(**hidden), Servo.for_actuator(ELBOW), command)
        held = history.motor_angle[-1]
        return float(held), per_ampere * float(history.current[-1]) - float(
            ELBOW.cam.lever_arm(held) * history.force[-1]
        )

    angle_held, rest = torque()
    assert rest == pytest.approx(0.0, abs=2e-3)
    for hidden, load in (
        ({"constant_torque": 0.2}, lambda a: -0.2),
        ({"weight": 0.3}, lambda a: 0.3 * np.sin(a)),
        ({"slow_load": 0.2, "slow_frequency": 1e-6, "slow_phase": 0.5 * np.pi}, lambda a: -0.2),
    ):
        held, extra = torque(**hidden)
        assert extra == pytest.approx(load(held), abs=3e-3)
        assert held != angle_held
