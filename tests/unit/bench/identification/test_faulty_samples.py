"""Faulty samples: found where a sensor or a recorder failed, and nowhere else, in any unit."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification.records.faulty_samples import (
    LONGEST,
    Surroundings,
    Witness,
    faulty_groups,
    repaired,
)
from tests.rig import ACTUATORS, make_records
from tests.rig.conditions import Conditions

COUNT, STEP, AT = 6000, 0.002, 2345
NOISE, QUANTUM = 0.6, 7.67e-4
TIME = np.arange(COUNT) * STEP


def bench() -> dict[str, np.ndarray]:
    """An angle in counts, a current with dry friction and a force, of a rubber that is pulled at 2 Hz."""
    draw = np.random.default_rng(4).standard_normal((2, COUNT))
    angle = 0.44 * np.sin(2 * np.pi * 2.0 * TIME)
    speed = np.cos(2 * np.pi * 2.0 * TIME)
    return {
        "angle": QUANTUM * np.round(angle / QUANTUM),
        "current": 2.0 * angle + 0.4 * np.sign(speed) + 0.04 * draw[0],
        "force": 60.0 + 50.0 * np.abs(angle) / 0.44 + NOISE * draw[1],
    }


def groups_of(columns: dict[str, np.ndarray], name: str, **around: bool) -> list[tuple[int, int, str]]:
    others = [Witness(values) for other, values in columns.items() if other != name]
    groups = faulty_groups(columns[name], Surroundings(others, **around))
    return [(g.first, g.behind, g.kind) for g in groups]


def put(first: int, behind: int, value: float) -> Callable[[np.ndarray], None]:
    def change(values: np.ndarray) -> None:
        values[first:behind] = value

    return change


def add(first: int, behind: int | None, value: float) -> Callable[[np.ndarray], None]:
    def change(values: np.ndarray) -> None:
        values[first:behind] += value

    return change


def hold(first: int, behind: int) -> Callable[[np.ndarray], None]:
    def change(values: np.ndarray) -> None:
        values[first:behind] = values[first]

    return change


FAULTS = {
    "force + 10": ("force", add(AT, AT + 1, 10.0), (AT, AT + 1, "spike")),
    "force - 30": ("force", add(AT, AT + 1, -30.0), (AT, AT + 1, "spike")),
    "force + 300": ("force", add(AT, AT + 1, 300.0), (AT, AT + 1, "spike")),
    "force 99999": ("force", put(AT, AT + 1, 99999.0), (AT, AT + 1, "spike")),
    "current 50 A": ("current", put(AT, AT + 1, 50.0), (AT, AT + 1, "spike")),
    "encoder 0": ("angle", put(AT, AT + 1, 0.0), (AT, AT + 1, "spike")),
    "force 10 ms at zero": ("force", put(AT, AT + 5, 0.0), (AT, AT + 5, "dropout")),
    "force 0.2 s at zero": ("force", put(AT, AT + 100, 0.1), (AT, AT + 100, "stuck")),
    "force holds 10 samples": ("force", hold(AT, AT + 10), (AT + 1, AT + 10, "stuck")),
    "encoder is reset": ("angle", add(AT, None, -0.3), (AT, AT, "jump")),
}


@pytest.mark.parametrize("case", FAULTS)
@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_a_fault_is_found_at_its_rows_and_nothing_else(case: str, scale: float) -> None:
    name, change, expected = FAULTS[case]
    columns = bench()
    change(columns[name])
    columns[name] = scale * columns[name]
    assert groups_of(columns, name, motion=name == "angle") == [expected]
    others = [n for n in columns if n != name]
    assert [groups_of(columns, n, motion=n == "angle") for n in others] == [[], []]


def sine(frequency: float) -> np.ndarray:
    return np.sin(2 * np.pi * frequency * TIME)


PHASE = (1.3 * TIME) % 1.0
SOUND = {
    "sine of 10 samples a period": sine(50.0),
    "chirp": np.sin(2 * np.pi * (1.0 + 3.0 * TIME) * TIME),
    "steps of a command": np.sign(sine(0.7)),
    "stairs": np.floor(3.0 * TIME),
    "dry friction": sine(1.0) + 0.4 * np.sign(sine(1.0 + 1e-9)),
    "stick and slip": np.floor(1.3 * TIME) + np.clip(PHASE / 0.02, 0.0, 1.0),
    "slack": np.maximum(sine(1.0), 0.0),
    "clipped": np.clip(2.0 * sine(1.0), -1.0, 1.0),
    "triangle": np.abs((2.0 * TIME) % 2.0 - 1.0),
    "ringing after a blow": np.exp(-20.0 * (TIME % 2.0)) * np.sin(2 * np.pi * 60.0 * (TIME % 2.0)),
    "held by a slower recorder": np.repeat(sine(1.0)[::5], 5),
    "a single quick bump": np.exp(-0.5 * ((TIME - 6.0) / 0.01) ** 2),
    "motion and rest": np.interp(TIME, [0.0, 2.0, 2.4, 5.0, 5.3, 9.0], [0.0, 0.0, 1.0, 1.0, 0.3, 0.3]),
}


@pytest.mark.parametrize("case", SOUND)
@pytest.mark.parametrize("noise", [0.0, 0.003, 0.03])
@pytest.mark.parametrize("quantum", [0.0, 0.02])
def test_what_machines_do_is_no_fault(case: str, noise: float, quantum: float) -> None:
    values = SOUND[case] + noise * np.random.default_rng(2).standard_normal(COUNT)
    values = quantum * np.round(values / quantum) if quantum else values
    for rows in (slice(None), slice(None, None, 2)):
        for commanded in (False, True):
            assert not faulty_groups(values[rows], Surroundings(commanded=commanded))


def crept(*, jumps: bool) -> dict[str, np.ndarray]:
    """An angle that shakes while it creeps and rests for 0.3 s, and the current that goes on.

    Without a jump it takes up its way where it rested; with one it shows the way that it missed.
    """
    shake = np.round(4.0 * np.random.default_rng(5).standard_normal(COUNT))
    rest = slice(AT, AT + 150)
    speed = np.ones(COUNT)
    if not jumps:
        speed[rest] = 0.0
    angle = np.cumsum(speed) + shake
    angle[rest] = angle[AT - 1]
    if not jumps:
        angle[rest.stop :] += angle[AT - 1] - angle[rest.stop]
    return {"angle": 1e-5 * angle, "current": 0.3 * sine(0.2)}


def test_a_body_that_rests_and_moves_on_from_there_has_no_stuck_encoder() -> None:
    """Cogging holds a motor until its integrator has gone on: stick-slip is no fault."""
    assert groups_of(crept(jumps=False), "angle", motion=True) == []
    ((first, behind, kind),) = groups_of(crept(jumps=True), "angle", motion=True)
    assert (first, behind, kind) == (AT - 1, AT + 150, "stuck")


def test_long_tails_are_no_spikes() -> None:
    values = 0.01 * np.random.default_rng(1).laplace(size=COUNT)
    assert not faulty_groups(values, Surroundings())


def test_a_pulse_that_the_machine_answers_is_no_fault() -> None:
    """A force on a free body for one sample: its speed changes. A pulse that nothing answers is a fault."""
    force = np.zeros(COUNT) + 0.01 * np.random.default_rng(3).standard_normal(COUNT)
    force[AT] += 100.0
    since = np.maximum(TIME - TIME[AT], 0.0)
    answered = np.round(2.0 * (1.0 - np.exp(-since / 0.2)), 3)
    assert groups_of({"force": force, "angle": answered}, "force") == []
    assert groups_of({"force": force, "angle": sine(0.3)}, "force") == [(AT, AT + 1, "spike")]


def test_the_current_of_a_step_is_no_fault_where_the_body_goes() -> None:
    """A position loop at 1 kHz is told to step within 40 ms, of which a log at 200 Hz has eight rows."""
    goal = np.interp(np.arange(6000) * 1e-3, [1.999, 2.039, 3.999, 4.039], [0.0, 0.7, 0.7, -0.1])
    place = speed = filtered = integral = before = 0.0
    rows = []
    for aim, pace in zip(goal.tolist(), np.gradient(goal, 1e-3).tolist(), strict=True):
        read = 7.7e-5 * round(place / 7.7e-5)
        filtered += 0.32 * ((read - before) / 1e-3 - filtered)
        before = read
        error = pace + 9.6 * (aim - read) - filtered
        integral += 6.7e-3 * error
        current = 0.93 * error + integral
        rows.append((read, current))
        for _ in range(10):
            speed += 1e-4 * (1.16 / 0.36 * math.atan(0.36 * current) - 0.081 * speed) / 0.045
            place += 1e-4 * speed
    angle, current = np.array(rows)[::5].T
    current = current + 0.03 * np.random.default_rng(5).standard_normal(len(current))
    assert groups_of({"angle": angle, "current": current}, "current") == []
    # Where the angle does not answer it is a fault of the ammeter.
    elsewhere = {"angle": sine(0.3)[: len(current)], "current": current}
    assert [first for first, _, _ in groups_of(elsewhere, "current")] == [400, 800]


def test_what_is_put_in_for_a_fault_is_near_to_what_was_lost() -> None:
    columns = bench()
    columns["force"][AT : AT + 5] = 0.0
    others = [Witness(columns[n]) for n in ("angle", "current")]
    groups = faulty_groups(columns["force"], Surroundings(others))
    values, mask = repaired(columns["force"], groups)
    assert np.flatnonzero(mask).tolist() == list(range(AT, AT + 5))
    np.testing.assert_allclose(values[mask], bench()["force"][mask], atol=4.0 * NOISE)
    np.testing.assert_array_equal(values[~mask], columns["force"][~mask])
    assert len(groups) <= LONGEST


def test_a_million_samples_are_checked_without_an_array_for_every_sample_and_its_window() -> None:
    tracemalloc = pytest.importorskip("tracemalloc")
    values = np.random.default_rng(5).standard_normal(1_000_000)
    values[777_777] = 60.0
    tracemalloc.start()
    try:
        (group,) = faulty_groups(values, Surroundings())
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert group.first == 777_777
    assert peak < 20 * values.nbytes


MEASURED = ("emps", "xl330", "dfki_pendulum", "vhb4910/loading_unloading", "vhb4910/relaxation")


@pytest.mark.parametrize("name", MEASURED)
def test_no_measured_record_has_a_fault(name: str, shared_folder: Path) -> None:
    files = sorted((shared_folder / "measured" / name).glob("*.csv"))
    assert files
    for file in files:
        table = np.genfromtxt(file, delimiter=",", names=True)
        columns = {head: table[head] for head in table.dtype.names[1:]}
        for head in columns:
            assert groups_of(columns, head) == [], (file.name, head)


def test_a_sample_that_is_off_is_no_jump_of_the_position() -> None:
    """A spike of the encoder of the simulated bench, 6 ms before the force turns at zero angle."""
    spiked = Conditions(spikes=3)
    name = "sine_45deg_0.5Hz"
    rows = make_records(ACTUATORS["shoulder"], {}, 216, conditions=spiked, only=(name,))[name]
    columns = dict(zip(("angle", "current", "force"), rows.T[1:], strict=True))
    assert abs(rows[3195, 1] - rows[3194, 1]) > 0.09, "or the test would show nothing"
    assert "jump" not in {kind for _, _, kind in groups_of(columns, "angle", motion=True)}
