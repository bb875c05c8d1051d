"""Machines of the rig without a cam: power balance, limits, closed forms, files."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.rig import Conditions, Hidden
from tests.rig.commands import STEP, Command
from tests.rig.machines import (
    JOINT,
    MACHINES,
    SHAFT,
    SPINDLE,
    Machine,
    Run,
    machine_commands,
    machine_truth,
    make_machine_records,
    simulate_machine,
    true_numbers_of_machine,
    write_machine_set,
)


@pytest.fixture(params=tuple(MACHINES))
def machine(request: pytest.FixtureRequest) -> Machine:
    return MACHINES[request.param]


def swing(machine: Machine, seconds: float, number: int = 1, **hidden: float) -> Run:
    """The beginning of one of its sines."""
    command = list(machine_commands(machine, np.random.default_rng(1)).values())[number]
    count = round(seconds / STEP)
    part = Command(command.time[:count], command.angle[:count], command.speed[:count])
    return simulate_machine(machine, machine, Hidden(**hidden), part)


def still(machine: Machine, degrees: float, seconds: float, **hidden: float) -> Run:
    """A smooth rise to an angle that is then held."""
    time = np.arange(round(seconds / STEP)) * STEP
    rise = np.clip(time / 0.5, 0.0, 1.0)
    angle = np.radians(degrees) * rise * rise * (3.0 - 2.0 * rise)
    return simulate_machine(
        machine, machine, Hidden(**hidden), Command(time, angle, np.gradient(angle, STEP))
    )


def test_work_of_the_motor_is_stored_or_lost(machine: Machine) -> None:
    level = 0.12 * machine.typical_torque
    run = swing(machine, 2.0, friction=level)
    speed = 0.5 * (run.speed[1:] + run.speed[:-1])
    work = np.sum(machine.torque_per_ampere * run.current[:-1] * run.speed[1:]) * STEP
    lost = np.sum(machine.viscosity * speed**2 + level * np.abs(run.speed[1:])) * STEP
    load_speed = np.diff(run.load_angle, prepend=0.0) / STEP
    twist = run.angle - run.load_angle
    lost += machine.shaft_damping * np.sum((run.speed - load_speed) ** 2) * STEP
    stored = 0.5 * machine.motor_inertia * run.speed[-1] ** 2
    stored += 0.5 * machine.load_inertia * load_speed[-1] ** 2
    stored += 0.5 * machine.shaft_stiffness * twist[-1] ** 2
    stored += machine.weight * (1.0 - np.cos(run.load_angle[-1]))
    assert lost > 0.0
    assert work == pytest.approx(stored + lost, rel=5e-3)


def test_the_loop_follows_within_its_limit(machine: Machine) -> None:
    commands = machine_commands(machine, np.random.default_rng(2))
    for name, seconds in ((list(machine.motions.sines)[1], 2.0), (list(machine.motions.sines)[3], 1.0)):
        command = commands[name]
        count = round(seconds / STEP)
        command = Command(command.time[:count], command.angle[:count], command.speed[:count])
        run = simulate_machine(machine, machine, Hidden(), command)
        assert np.max(np.abs(run.current)) < machine.current_limit, name
        if seconds == 2.0:
            error = np.sqrt(np.mean((run.angle - command.angle) ** 2))
            assert error < 0.2 * np.sqrt(np.mean(command.angle**2)), name


def test_a_current_at_its_limit_stays_there() -> None:
    run = swing(replace(SPINDLE, current_limit=1.0), 0.5, number=2)
    assert np.max(np.abs(run.current)) == 1.0
    assert np.mean(np.abs(run.current) == 1.0) > 0.1


def test_the_weight_asks_for_its_torque_at_rest() -> None:
    run = still(JOINT, 40.0, 3.0, weight=0.5, weight_phase=0.7)
    expected = JOINT.weight * np.sin(run.angle[-1]) + 0.5 * (np.sin(run.angle[-1] + 0.7) - np.sin(0.7))
    assert np.degrees(run.angle[-1]) == pytest.approx(40.0, abs=0.05)
    assert JOINT.torque_per_ampere * run.current[-1] == pytest.approx(expected, rel=1e-3)


def test_nothing_moves_below_the_breakaway_torque() -> None:
    # The loop asks for less than the friction of the motor side until its integral has grown.
    run = still(SPINDLE, 0.5, 0.05, friction=5.0)
    assert np.all(run.speed == 0.0)
    assert np.max(run.current) > 0.0


def test_the_shaft_swings_at_its_own_frequency() -> None:
    """After the motor has come to rest the load rings at √(K/J) / 2π, the motor being held."""
    stuck = replace(SHAFT, shaft_damping=0.0, load_share=0.05, shaft_stiffness=20.0)
    run = still(stuck, 20.0, 1.5, friction=0.3 * SHAFT.typical_torque)
    rest = run.time > 1.0
    assert np.ptp(run.angle[rest]) == 0.0
    twist = (run.load_angle - run.angle)[rest]
    crossings = np.flatnonzero(np.diff(np.signbit(twist - np.mean(twist))))
    frequency = (len(crossings) - 1) / (2.0 * (crossings[-1] - crossings[0]) * STEP)
    assert frequency == pytest.approx(
        np.sqrt(stuck.shaft_stiffness / stuck.load_inertia) / (2.0 * np.pi), rel=0.01
    )


def test_a_hidden_shaft_takes_a_share_of_the_inertia_and_nothing_else() -> None:
    plain, _ = machine_truth(SPINDLE, {}, 4)
    built, _ = machine_truth(SPINDLE, {"drivetrain_resonance": 1.0}, 4)
    assert built.inertia == plain.inertia
    assert built.load_inertia == pytest.approx(0.5 * plain.inertia)
    own = np.sqrt(built.shaft_stiffness / built.load_inertia) / (2.0 * np.pi)
    assert 9.0 / 1.2 <= own <= 9.0 * 1.2
    assert "motor.inertia" not in true_numbers_of_machine(SPINDLE, {"drivetrain_resonance": 1.0}, 4)[1]


def test_built_numbers_lie_within_the_declared_spread(machine: Machine) -> None:
    built = [machine_truth(machine, {}, seed)[0] for seed in range(40)]
    for name in ("inertia", "torque_per_ampere", "weight", "shaft_stiffness"):
        if declared := getattr(machine, name):
            ratios = np.array([getattr(b, name) for b in built]) / declared
            assert 0.04 < np.max(np.abs(ratios - 1.0)) <= 0.06, name
    factors = np.array([b.viscosity for b in built]) / machine.viscosity
    assert 1.3 < np.max(np.maximum(factors, 1.0 / factors)) <= 1.6


@pytest.mark.long_cases("shaft", "spindle")
def test_the_seed_fixes_a_set_and_what_is_hidden_changes_no_number(machine: Machine) -> None:
    short = short_machine(machine)
    one, again, other = (make_machine_records(short, {"coulomb_friction": 1.0}, seed) for seed in (3, 3, 4))
    assert list(one)[1:] == ["hold", "multisine"]
    for name, table in one.items():
        np.testing.assert_array_equal(table, again[name])
        assert np.std(table[:, 2] - other[name][:, 2]) > machine.sensors.current_noise
    assert machine_truth(machine, {}, 3)[0] == machine_truth(machine, {"coulomb_friction": 1.0}, 3)[0]
    with pytest.raises(ValueError, match="nearest: 'coulomb_friction'"):
        make_machine_records(short, {"coulomb_frictoin": 1.0}, 3)


@pytest.mark.slow
def test_every_effect_shows_above_the_noise(machine: Machine) -> None:
    """In a tenth of the usual time, at twice the usual size."""
    short = short_machine(machine)
    noise = [short.sensors.angle_quantum, short.sensors.current_noise]
    clean = make_machine_records(short, {}, 9, noise=False)
    for effect in (*machine.effects, *machine.outside):
        largest = 0.0
        for record, table in make_machine_records(short, {effect: 2.0}, 9, noise=False).items():
            assert np.all(np.isfinite(table)), effect
            assert np.max(np.abs(table[:, 2])) <= machine.current_limit, effect
            rms = np.sqrt(np.mean((table - clean[record]) ** 2, axis=0))[1:]
            largest = max(largest, float(np.max(rms / noise)))
        assert largest > 1.0, effect


def short_machine(machine: Machine) -> Machine:
    """The same with one sine, two holds and a short multisine."""
    second = list(machine.motions.sines)[1]
    sines = {second: (*machine.motions.sines[second][:2], 1.5)}
    motions = replace(
        machine.motions, sines=sines, holds=machine.motions.holds[:2], hold_time=0.5, multisine_time=1.0
    )
    return replace(machine, motions=motions)


@pytest.mark.long_cases("shaft", "spindle")
def test_files_hold_what_was_declared_and_measured(tmp_path: Path, machine: Machine) -> None:
    short = short_machine(machine)
    write_machine_set(tmp_path, short, {}, 5, conditions=Conditions(counts=512))
    deck = tomllib.loads((tmp_path / "deck.toml").read_text(encoding="utf-8"))
    assert deck["encoder"]["quantum"]["value"] == pytest.approx(2.0 * np.pi / 512)
    total = deck["motor"]["inertia"]["value"] + deck.get("load", {}).get("inertia", {}).get("value", 0.0)
    assert total == pytest.approx(machine.inertia)
    assert ("weight" in deck, "shaft" in deck) == (bool(machine.weight), bool(machine.load_share))
    made = make_machine_records(short, {}, 5, conditions=Conditions(counts=512))
    for name, table in made.items():
        with (tmp_path / f"{name}.csv").open(newline="") as stream:
            head, *rows = list(csv.reader(stream))
        assert head == ["t_s", "angle_rad", "current_A"]
        np.testing.assert_allclose(np.array(rows, dtype=float), table, atol=5.1e-5)
    counts = made["multisine"][:, 1] / (2.0 * np.pi / 512)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
