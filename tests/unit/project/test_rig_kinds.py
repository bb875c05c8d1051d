"""Machines under a digital loop: energy, step halving, what the loop holds, files; MuJoCo beside them."""

from __future__ import annotations

import csv
import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks._score_run import opened
from tests.rig import specimens
from tests.rig.cascade import journeys
from tests.rig.digital_loop import Controller, Logger, Ticks, Wanted, logged, run
from tests.rig.kind_cases import ALL_KINDS, CONDITIONS, conditioned, simulated, truth_of, write_kind_case
from tests.rig.kinds import COMMAND, KINDS, Kind, built, stream, wanted
from tests.rig.mujoco_machines import MujocoBodies, available
from tests.rig.two_bodies import STEP, Missing, Plant, TwoBodies

ONE = Plant(inertia=0.4, effort_per_ampere=1.0, damping=0.5, weight=3.0)
TWO = Plant(
    inertia=0.2, effort_per_ampere=1.0, damping=0.3, load_inertia=0.3, load_damping=0.1, stiffness=90.0,
    spring_damping=0.05, weight=2.0,
)  # fmt: skip
OWN = [kind for kind in KINDS.values() if kind.simulator == "own"]
needs_mujoco = pytest.mark.skipif(bool(available()), reason=available())


def driven(plant: Plant, missing: Missing, seconds: float = 1.2, step: float = STEP) -> np.ndarray:
    """States (place, speed, load place, load speed) after every step of a swinging effort."""
    world = TwoBodies(plant, missing, step)
    rows = []
    for effort in efforts(seconds, step).tolist():
        world.advance([effort])
        rows.append((world.place, world.speed, world.load_place, world.load_speed))
    return np.array(rows)


def efforts(seconds: float, step: float) -> np.ndarray:
    time = (np.arange(round(seconds / step)) + 0.5) * step
    effort: np.ndarray = 4.0 * np.sin(2.0 * np.pi * 1.3 * time)
    return effort


@pytest.mark.parametrize("plant", [ONE, TWO], ids=["one body", "two bodies"])
@pytest.mark.parametrize(
    "missing",
    [Missing(), Missing(friction=0.6, joint_friction=0.2), Missing(load_friction=0.2, drag=0.1)],
    ids=["clean", "Coulomb", "load and drag"],
)
def test_work_is_stored_or_lost(plant: Plant, missing: Missing) -> None:
    states = np.vstack([np.zeros(4), driven(plant, missing)])
    place, speed, load_place, load_speed = states.T
    middle, load_middle = (0.5 * (v[1:] + v[:-1]) for v in (speed, load_speed))
    work = STEP * efforts(1.2, STEP) @ middle
    carried = plant.weight * np.sin(place[1:])
    if plant.load_inertia:
        carried = plant.stiffness * (place - load_place)[1:] + plant.spring_damping * (middle - load_middle)
    level = missing.friction + missing.load_friction * np.abs(carried)
    lost = plant.damping * middle**2 + level * np.abs(middle) + missing.drag * np.abs(middle) ** 3
    kinetic = plant.inertia * speed[-1] ** 2
    twist = 0.0
    if plant.load_inertia:
        lost = lost + plant.load_damping * load_middle**2 + missing.joint_friction * np.abs(load_middle)
        lost = lost + plant.spring_damping * (middle - load_middle) ** 2
        kinetic += plant.load_inertia * load_speed[-1] ** 2
        twist = plant.stiffness * (place[-1] - load_place[-1]) ** 2
    stored = 0.5 * (kinetic + twist) + plant.weight * (1.0 - np.cos(load_place[-1]))
    assert np.sum(lost) > 0.0
    assert work == pytest.approx(stored + STEP * np.sum(lost), rel=1e-3)


@pytest.mark.parametrize("plant", [ONE, TWO], ids=["one body", "two bodies"])
@pytest.mark.parametrize(
    ("missing", "falls_to"),
    [(Missing(), 0.26), (Missing(friction=0.6), 1.0), (Missing(gap=0.02), 1.0)],
    ids=["clean", "Coulomb", "gap"],
)
def test_halving_the_step_changes_little(plant: Plant, missing: Missing, falls_to: float) -> None:
    # Errors fall to a quarter; a reversal of dry friction and a touch of teeth fall between steps by chance.
    places = {n: driven(plant, missing, step=n * STEP)[8 // n - 1 :: 8 // n, 0] for n in (8, 4, 2, 1)}
    errors = {n: np.max(np.abs(places[n] - places[n // 2])) for n in (8, 4, 2)}
    assert errors[2] < 1e-4 * np.max(np.abs(places[1]))
    assert errors[2] + errors[4] < falls_to * (errors[4] + errors[8])


def test_friction_that_sticks_leaves_no_speed() -> None:
    world = TwoBodies(replace(ONE, weight=0.0), Missing(friction=1.0))
    world.advance([0.99] * 200)
    assert (world.place, world.speed) == (0.0, 0.0)
    world.advance([1.2] * 200)
    assert world.speed > 0.0


def test_a_tail_swings_at_its_own_frequency_and_keeps_the_energy() -> None:
    missing = Missing(tail_share=0.3, tail_frequency=7.0)
    held = replace(TWO, load_inertia=5e4, weight=0.0, stiffness=1.0, damping=0.0, load_damping=0.0)
    world = TwoBodies(held, missing)
    world.tail_place = 0.1
    places = []
    for _ in range(10000):
        world.advance([0.0])
        places.append(world.tail_place - world.load_place)
    crossings = np.flatnonzero(np.diff(np.signbit(places)))
    assert (len(crossings) - 1) / (2.0 * (crossings[-1] - crossings[0]) * STEP) == pytest.approx(
        7.0 / np.sqrt(0.7), rel=2e-3
    )


@pytest.mark.parametrize("kind", OWN, ids=lambda kind: kind.name)
def test_the_loop_holds_its_current_and_follows(kind: Kind) -> None:
    plant, missing = built(kind, (), 0.0, 3)
    command = next(iter(wanted(kind, stream(3, COMMAND)).values()))
    ticks = followed(kind, plant, missing, command)
    assert np.max(np.abs(ticks.current)) < kind.limit
    error = np.sqrt(np.mean((ticks.place - command.place) ** 2))
    assert error < 0.06 * np.sqrt(np.mean(command.place**2))


def followed(kind: Kind, plant: Plant, missing: Missing, command: object, world: object = None) -> Ticks:
    return run(
        world or TwoBodies(plant, missing), kind.controller(kind.logger.quantum), command,  # type: ignore
        plant.effort_per_ampere, missing,
    )  # fmt: skip


def test_a_delay_is_one_of_the_drive_beyond_the_hold() -> None:
    """A free mass: the place after k ticks is the double integral of the held, late current."""
    kind = KINDS["direct_drive"]
    plant = Plant(inertia=0.5, effort_per_ampere=2.0, damping=0.0)
    late = 0.0034
    command = next(iter(wanted(kind, stream(3, COMMAND)).values()))
    ticks = followed(kind, plant, Missing(drive_delay=late), command)
    effort = np.repeat(2.0 * ticks.current, 10)
    effort = np.concatenate([np.zeros(34), effort])[: len(effort)]
    speed = np.concatenate([[0.0], np.cumsum(effort) * STEP / 0.5])
    place = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (speed[1:] + speed[:-1]))])
    assert ticks.place == pytest.approx(place[:-1:10], abs=1e-9)


@pytest.mark.long_cases("direct_drive", "elastic_joint", "belt_axis", "screw_carriage", "rack_carriage")
@pytest.mark.parametrize("kind", OWN, ids=lambda kind: kind.name)
def test_a_cascade_goes_where_it_is_told_and_its_current_lags(kind: Kind) -> None:
    plant, missing = built(kind, (), 1.0, 5)
    plant = replace(
        plant, weight=0.0
    )  # the cascade has no forward term for an arm's weight, which lags by 7 %
    made = simulated(kind, plant, missing, 5, kind.logger.quantum, cascaded=True)
    told = journeys(kind.sines[0][0], kind.multisine[-1], kind.rate, stream_behind_the_lag(kind))
    assert list(made) == list(told) == ["points_1", "chirp", "spline", "slow", "points_2", "steps"]
    for name, size in (("slow", 0.05), ("points_1", 0.12)):
        error = made[name].place - told[name].place
        assert np.std(error) < size * np.std(told[name].place), name
    assert max(np.max(np.abs(ticks.current)) for ticks in made.values()) <= kind.limit


def stream_behind_the_lag(kind: Kind) -> np.random.Generator:
    """Chance as the motions of seed 5 see it: the lag of the current loop was drawn first."""
    draw = stream(5, COMMAND)
    draw.uniform(0.1, 0.4)
    return draw


def test_a_current_that_lags_acts_as_late_as_it_says() -> None:
    """Of a free body under a ramp of current the speed falls behind by the time constant."""
    free = replace(ONE, weight=0.0, damping=0.0)
    time = np.arange(1000) * 1e-3
    ramp = Wanted(time, np.zeros_like(time), np.zeros_like(time), time)
    loop = Controller(
        rate=1000.0, proportional=0.0, derivative=0.0, integral=0.0, limit=9.0, counts=1e-9, feed=1.0
    )
    none, lagging = (
        run(TwoBodies(free, Missing()), replace(loop, lag=lag), ramp, free.effort_per_ampere, Missing())
        for lag in (0.0, 0.02)
    )
    speeds = [np.gradient(each.place, time)[900] for each in (none, lagging)]
    # The speed is half the square of the time over the inertia; 20 ms late it is less by that times the time.
    expected = 0.02 * time[900] - 0.02**2
    assert (speeds[0] - speeds[1]) * free.inertia == pytest.approx(expected, rel=0.01)


def test_a_log_is_slow_coarse_averaged_late_and_biased() -> None:
    time = np.arange(40) * 0.01
    ticks = Ticks(time, np.sin(time), 2.0 * time, np.arange(40.0))
    draw = np.random.default_rng(1)
    plain = Logger(every=4, quantum=0.1, load_quantum=1e-9, current_noise=0.0)
    missing = Missing(current_bias=0.5, encoder_bias=0.2, encoder_delay=0.05)
    table = logged(ticks, plain, missing, draw)
    assert len(table) == 10
    assert table[:, 1] == pytest.approx(0.1 * np.round(10.0 * np.sin(time[::4])))
    assert table[2:, 2] == pytest.approx(2.0 * (time[::4] - 0.05)[2:] + 0.2)
    assert table[:, 3] == pytest.approx(np.arange(0.0, 40.0, 4.0) + 0.5)
    mean = logged(ticks, replace(plain, averaged=True), Missing(), draw)
    assert mean[1:, 3] == pytest.approx(np.arange(4.0, 40.0, 4.0) - 2.5), "of the four ticks before the row"


def test_a_strip_relaxes_as_its_branch_does() -> None:
    strip, missing = specimens.Strip(), specimens.MissingInStrip()
    way = np.full(4001, 0.01)
    way[0] = 0.0
    force = specimens.force_of(strip, missing, way)
    strain, late = 0.01 / specimens.REST_LENGTH, strip.viscosity / strip.branch
    expected = strip.modulus + strip.branch * np.exp(-4.0 / late)
    assert force[-1] == pytest.approx(specimens.AREA * strain * expected, rel=1e-3)


def test_every_effect_changes_its_machine_and_scales_with_its_strength() -> None:
    for kind in KINDS.values():
        clean = built(kind, (), 0.0, 5)
        for effect in (*kind.effects, *kind.not_listed, *(e for pair in kind.pairs for e in pair)):
            left_out = effect in ("viscous_friction", "spring_damping", "gravity_load")
            whole, half = (built(kind, (effect,), strength, 5) for strength in (1.0, 0.5))
            assert whole != half, (kind.name, effect)
            assert whole != clean or left_out, (kind.name, effect)
    with pytest.raises(ValueError, match="no_such"):
        built(KINDS["belt_axis"], ("no_such",), 1.0, 1)


@pytest.mark.long_cases(
    "geared_joint", "elastic_joint", "direct_drive", "belt_axis", "screw_carriage", "rack_carriage"
)
@pytest.mark.parametrize("kind", [name for name in ALL_KINDS if not name.startswith("mujoco")])
def test_the_files_of_a_case_are_what_the_package_reads(kind: str, tmp_path: Path) -> None:
    condition = CONDITIONS[ALL_KINDS.index(kind) % len(CONDITIONS)]
    truth = write_kind_case(tmp_path, kind, ("coulomb_friction",), 1.0, 1, condition=condition)
    declared, records = opened(tmp_path)
    assert len(records.records) == len(list(tmp_path.glob("*.csv"))) >= 6
    known = declared.quantities()
    for name, true in truth.numbers.items():
        if true and name in known:
            assert known[name].number / true == pytest.approx(1.0, abs=0.6), name
    assert sum(name in known for name in truth.numbers) >= 3
    assert json.loads((tmp_path / "truth.json").read_text())["effects"] == ["coulomb_friction"]
    assert truth == truth_of(kind, ("coulomb_friction",), 1.0, 1, condition=condition)
    with next(tmp_path.glob("*.csv")).open() as file:
        assert len(next(csv.reader(file))) == (4 if kind in KINDS and KINDS[kind].sides == 2 else 3)


def test_conditions_change_the_log_and_not_the_machine() -> None:
    for kind in KINDS.values():
        slow = conditioned(kind, "slow")
        assert kind.rate / slow.every <= 130.0
        assert conditioned(kind, "coarse").quantum > 10.0 * kind.logger.quantum
        assert conditioned(kind, "coloured").coloured > 0.0
        assert conditioned(kind, "averaged").averaged
        assert conditioned(kind, "plain") == kind.logger


@pytest.mark.long_cases("mujoco_tendon", "mujoco_motor")
@needs_mujoco
@pytest.mark.parametrize("name", ["mujoco_motor", "mujoco_tendon", "mujoco_gear"])
def test_mujoco_moves_as_the_own_simulator_does(name: str) -> None:
    """Simulators that share only numbers agree to the way of half a step; soft friction yields more."""
    kind = KINDS[name]
    for effect, soft in (("", 0.0), ("gravity_load", 0.0), ("coulomb_friction", 4e-4), ("backlash", 6e-4)):
        if effect and effect not in kind.effects:
            continue
        plant, missing = built(kind, (effect,) if effect else (), 1.0, 2)
        command = wanted(kind, stream(2, COMMAND))["sine_1.5Hz"]
        short = type(command)(*(getattr(command, f.name)[:750] for f in fields(command)))
        ours = followed(kind, plant, missing, short)
        theirs = followed(kind, plant, missing, short, MujocoBodies(plant, missing))
        most = soft + 0.5 * STEP * np.sqrt(np.mean(short.speed**2))
        for own, foreign in ((ours.place, theirs.place), (ours.load_place, theirs.load_place)):
            assert np.sqrt(np.mean((own - foreign) ** 2)) < most, effect
