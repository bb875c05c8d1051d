"""Generated observers and controllers survive a bad sensor: recovery, flags, first reading, no lock-up.

The time constant is that of the slowest pole of the step's own Jacobian, by central differences; the motion,
the faults and the judgement are those of ``tests/recovery_fuzz.c``, which shares nothing with the generator.
"""

from __future__ import annotations

import math
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.components import Encoder, ReadingLimits
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.export.c.guarded_step import (
    INPUT_HELD,
    INPUT_JUMPED,
    INPUT_OUT_OF_RANGE,
    INPUT_SATURATED,
    INPUT_STALE,
    OUT_OF_TABLE,
    PARAMETER_REFUSED,
    RECOVERED,
    STATE_RESTARTED,
    WAITING,
    GuardedModel,
    index_bit,
)
from nlsdesign.export.c.writer import member_paths
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.control import PidTorque, ScheduledTorque, TorqueGains, joined
from nlsdesign.feedback.observer import design_corrected_observer, design_observer_with_details
from nlsdesign.foundation.errors import NlsError
from tests.compiling import compile_program
from tests.unguarded import unguarded

DECK = "austin2015_figure_consistent"
FUZZ = Path(__file__).parents[1] / "recovery_fuzz.c"
ANGLE = index_bit(0)


@cache
def plant(deck: str = DECK) -> nls.FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(deck)))


@cache
def cascade(deck: str = DECK, sample_time: float = 1e-3) -> nls.FlatModel:
    return design_observer_with_details(plant(deck), sample_time=sample_time).model


def time_constant(observer: nls.FlatModel) -> float:
    """Return the slowest time constant over the angle, of a sliding machine, in s."""
    count, slowest = len(observer.states), 0.0
    for angle in np.linspace(-1.0, 1.0, 81):
        w = observer.look_up([0.0] * count, [angle, 0.0])

        def step(x: np.ndarray, u=(angle, 0.0), w=w) -> np.ndarray:
            return np.array(observer.equations(0.0, x, u, [], w)[0]).ravel()

        at = np.zeros(count)
        at[[v.name for v in observer.states].index("motor.speed.memory")] = 20.0
        columns = [(step(at + h) - step(at - h)) / 2e-6 for h in 1e-6 * np.eye(count)]
        slowest = max(slowest, float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T)))))
    return -float(observer.sample_time or 0.0) / math.log(slowest)


def fuzzed(
    observer: nls.FlatModel,
    folder: Path,
    *,
    real: str = "float",
    samples: int = 400_000,
    kind: int = -1,
    wait: float = 5.0,
) -> tuple[int, int, float, int]:
    """Return faults, checks, the worst difference after some time constants over 5 N·m, samples lost."""
    source = nls.export_c(observer, folder, real=real, name="observer")
    length = float(observer.sample_time or 0.0)
    settled = math.ceil(wait * time_constant(cascade(sample_time=length)) / length)
    numbers = {
        "HEADER": '"observer.h"', "NAME(x)": "observer_##x", "REAL": real, "SAMPLE": repr(length),
        "SAMPLES": f"{samples}L", "PERIOD": "100", "SETTLED": str(settled), "SIZE": "5.0", "KIND": str(kind),
        "TORQUE": member_paths(observer.outputs)["spring.torque"],
    }  # fmt: skip
    flags = ["-std=c99", f"-I{folder}", *(f"-D{name}={value}" for name, value in numbers.items())]
    program = compile_program([source.source, FUZZ], folder / "fuzz", flags=flags)
    words = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    return int(words[0]), int(words[1]), float(words[2]), int(words[3])


@pytest.mark.long_cases("finite", "not a number", "jump", "frozen")
@pytest.mark.parametrize("kind", ["finite", "not a number", "jump", "frozen", "any"])
def test_one_fault_is_forgotten_within_five_time_constants(kind: str, tmp_path: Path) -> None:
    number = ["finite", "not a number", "jump", "frozen", "any"].index(kind)
    faults, checks, worst, lost = fuzzed(cascade(), tmp_path, kind=-1 if number == 4 else number)
    assert lost == 0
    assert faults > 300
    assert checks > 30_000
    # One per cent of the torque; a linear observer keeps e^-5 = 0.7 % of what a fault has left behind.
    assert worst <= 0.01


@pytest.mark.slow
def test_half_the_sampling_rate_and_another_deck(tmp_path: Path) -> None:
    for number, observer in enumerate((cascade(sample_time=2e-3), cascade("austin2015_as_printed"))):
        folder = tmp_path / str(number)
        faults, _, worst, lost = fuzzed(observer, folder, real="double")
        assert (faults > 300, worst <= 0.01, lost) == (True, True, 0)


@pytest.mark.long_cases("float-10", "double-10")
@pytest.mark.parametrize(("real", "millions"), [("float", 1), ("float", 10), ("double", 10)])
def test_ten_million_steps_with_faults(real: str, millions: int, tmp_path: Path) -> None:
    """In the quick run one."""
    faults, _, worst, lost = fuzzed(cascade(), tmp_path, real=real, samples=millions * 1_000_000)
    assert faults > 2_000 * millions
    assert worst <= 0.01
    assert lost == 0


def test_the_fuzz_would_notice(tmp_path: Path) -> None:
    """After a fifth of a time constant the difference is still there."""
    assert fuzzed(cascade(), tmp_path, wait=0.2)[2] > 0.01


@pytest.mark.long_cases("double-5e+306")
@pytest.mark.parametrize(("real", "huge"), [("float", 7.1e36), ("float", 1.15e37), ("double", 5e306)])
def test_a_huge_sample_does_not_lock_an_observer_without_any_range(
    real: str, huge: float, tmp_path: Path
) -> None:
    """The stored state was finite and its successor not: it stayed for good, with flags 0xC."""
    step = CompiledStep(nls.export_c(unguarded(cascade()), tmp_path, real=real))
    never = CompiledStep(nls.export_c(unguarded(cascade()), tmp_path, real=real))
    words = []
    for k in range(400):
        good = [0.4 * math.sin(0.01 * k), 2.0]
        outputs, status = step([huge, 2.0] if k == 50 else good)
        expected, _ = never(good)
        words.append(status)
        assert np.all(np.isfinite(outputs))
    assert any(word & STATE_RESTARTED for word in words)
    assert words[-1] == 0
    assert outputs[0] == pytest.approx(expected[0], abs=0.01)


def test_a_restarted_observer_begins_anew_with_its_reading(tmp_path: Path) -> None:
    model = replace(unguarded(cascade()), begin=cascade().begin)
    step = CompiledStep(nls.export_c(model, tmp_path))
    for k in range(12):
        _, status = step([5e306 if k == 5 else 0.6, 0.0])
        if status & STATE_RESTARTED:
            break
    (after, *_), status = step([0.6, 0.0])
    assert status == 0
    # At its first sample the torque of a machine that rests at this angle, not one that comes from zero.
    assert after == pytest.approx(CompiledStep(nls.export_c(model, tmp_path))([0.6, 0.0])[0][0], rel=1e-12)
    assert after > 1.0


def stepped(model: nls.FlatModel, rows: list[list[float]]) -> list[int]:
    run = GuardedModel(model)
    return [run.step(row)[1] for row in rows]


def test_wrong_but_finite_readings_are_named() -> None:
    swing = [[0.3 * math.sin(0.02 * k), 4.0 * math.sin(0.02 * k)] for k in range(300)]
    clean = stepped(cascade(), swing)
    assert set(clean) == {0}
    for wrong, flag in ((10.0, INPUT_OUT_OF_RANGE), (0.1, INPUT_JUMPED), (-0.5, INPUT_JUMPED)):
        rows = [list(row) for row in swing]
        rows[100][0] += wrong
        words = stepped(cascade(), rows)
        assert words[100] == flag | ANGLE
        assert words[101] == RECOVERED | ANGLE
        assert set(words[:100] + words[102:]) == {0}
    rows = [list(row) for row in swing]
    rows[100][0] = math.nan
    assert stepped(cascade(), rows)[100] == INPUT_HELD | ANGLE


def test_a_frozen_encoder_is_stale_and_one_at_rest_is_not() -> None:
    swing = [[0.3 * math.sin(0.02 * k), 4.0 * math.sin(0.02 * k)] for k in range(1500)]
    frozen = [[swing[200][0], row[1]] if 200 <= k < 1200 else row for k, row in enumerate(swing)]
    words = stepped(cascade(), frozen)
    assert set(words[:300]) == {0}
    assert set(words[320:1200]) == {INPUT_STALE | ANGLE}
    assert words[1200] & (RECOVERED | INPUT_JUMPED)
    assert set(words[1205:]) == {0}
    rest = [[0.2, 1.5 + 0.1 * math.sin(0.01 * k)] for k in range(1500)]
    assert set(stepped(cascade(), rest)) == {0}


def test_a_jump_that_stays_is_believed_at_the_third_reading() -> None:
    rows = [[0.1 if k < 50 else 0.9, 0.0] for k in range(60)]
    words = stepped(cascade(), rows)
    jumped = INPUT_JUMPED | ANGLE
    assert words[50:54] == [jumped, jumped, RECOVERED | ANGLE, 0]


def test_beyond_the_table_is_said() -> None:
    rows = [[0.001 * k, 0.0] for k in range(1400)]
    words = stepped(cascade(), rows)
    end = cascade().tables[0].ends[1]
    assert [word for (angle, _), word in zip(rows, words, strict=True) if angle <= end] == [0] * 1135
    assert set(words[1135:]) == {OUT_OF_TABLE}


def test_the_first_reading_sets_the_observer_and_the_controller() -> None:
    """At 0.5 rad and no torque error the controller gave -20 A for two samples instead of what holds it."""
    drive = nls.torque_controller(plant(), gains=TorqueGains())
    names = [v.name for v in drive.inputs]
    at = {"motor.angle": 0.5, "spring.torque": 1.333, "spring.torque.desired": 1.333}
    (current,), status = GuardedModel(drive).step([at[name] for name in names])
    numbers = plant().values
    holding = 1.333 / (numbers["motor.torque_constant"] * numbers["motor.gear_ratio"])
    assert current == pytest.approx(holding, rel=1e-9)
    assert status == 0

    run = GuardedModel(cascade())
    shown = [v.name for v in cascade().outputs]
    outputs = np.array([run.step([0.5, holding])[0] for _ in range(200)])
    torque, speed = (outputs[:, shown.index(name)] for name in ("spring.torque", "motor.speed"))
    # The machine rests: the torque is that of the plant at rest from the first sample on.
    rest = nls.simulate(
        nls.flatten(nls.declare(nls.load_deck(DECK))).with_values({"motor.angle": 0.5}), [0.0, 1e-6]
    )
    assert rest["spring.torque"][0] > torque[0] > 0.5
    assert np.ptp(torque) < 2e-3
    assert abs(speed[0]) < 1e-6


def test_nothing_happens_before_a_usable_reading() -> None:
    run = GuardedModel(cascade())
    for _ in range(3):
        outputs, status = run.step([math.nan, 0.0])
        assert status == WAITING | INPUT_HELD | ANGLE
    outputs, status = run.step([0.5, 0.0])
    assert not status & WAITING
    assert outputs[0] > 0.5


@pytest.mark.long_cases("both", "corrected")
@pytest.mark.parametrize("which", ["cascade", "corrected", "both"])
def test_c_does_what_the_reference_does_under_faults(which: str, tmp_path: Path) -> None:
    models = {
        "cascade": cascade,
        "corrected": lambda: design_corrected_observer(plant()).model,
        "both": lambda: joined(cascade(), nls.torque_controller(plant())),
    }
    model = models[which]()
    step, run, chance = (
        CompiledStep(nls.export_c(model, tmp_path)),
        GuardedModel(model),
        np.random.default_rng(7),
    )
    words, worst, frozen = set(), 0.0, 0.0
    for k in range(1500):
        reading = 0.767e-3 * round((0.5 * math.sin(0.012 * k) + 0.3) / 0.767e-3)
        other = 3.0 * math.sin(0.01 * k)
        frozen = reading if k < 700 else frozen
        reading = frozen if 700 <= k < 1000 else reading
        if k < 700 and chance.random() < 0.05:
            reading = float(chance.choice([math.nan, math.inf, 7e36, reading + chance.normal(), -4.0]))
        other = 1e9 if k == 1200 else math.nan if k == 1210 else other
        found, status = step([reading, other])
        expected, expected_status = run.step([reading, other])
        assert status == expected_status
        words.add(status)
        worst = max(worst, float(np.max(np.abs(np.array(found) - expected) / (1.0 + np.abs(expected)))))
    assert worst < 1e-9
    for flag in (INPUT_HELD, INPUT_JUMPED, INPUT_OUT_OF_RANGE, INPUT_STALE, RECOVERED):
        assert any(word & flag for word in words)


def one_sample(machine: nls.FlatModel) -> ca.Function:
    """Return state and spring torque after 1 ms with a held current: ten steps of Runge and Kutta."""
    x, current = ca.MX.sym("x", len(machine.states)), ca.MX.sym("current")
    numbers, step, after = machine.start(machine.parameters), 1e-4, x

    def slope(at: ca.MX) -> ca.MX:
        return machine.equations(0.0, at, current, numbers, [])[0]

    for _ in range(10):
        one = slope(after)
        two = slope(after + step / 2.0 * one)
        three = slope(after + step / 2.0 * two)
        four = slope(after + step * three)
        after = after + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    place = [v.name for v in machine.signals].index("spring.torque")
    torque = machine.equations(0.0, after, current, numbers, [])[2][place]
    return ca.Function("sample", [x, current], [after, torque])


FAULTY = 200


def after_one_command(both: nls.FlatModel, bad: float | None) -> tuple[np.ndarray, list[int]]:
    """Return the spring's torque and the words of 0.4 s in closed loop; ``bad`` is asked for once."""
    machine, sample = plant(), one_sample(plant())
    angle = [v.name for v in machine.states].index("motor.angle")
    current = [v.name for v in both.outputs].index("motor.current")
    run, state, acting, torques, words = GuardedModel(both), machine.start(machine.states), 0.0, [], []
    for k in range(2 * FAULTY):
        wish = 2.0 * math.sin(2.0 * math.pi * 1.3e-3 * k)
        reading = 0.767e-3 * round(float(state[angle]) / 0.767e-3)
        outputs, word = run.step([reading, bad if bad is not None and k == FAULTY else wish])
        state, torque = sample(state, acting)
        torques.append(float(torque))
        words.append(word)
        acting = outputs[current]
    return np.array(torques), words


@pytest.mark.parametrize("law", ["scheduled", pytest.param("pid", marks=pytest.mark.slow)])
def test_one_sample_of_the_command_is_named_and_soon_forgotten(law: str) -> None:
    """Without a range and a largest rate 540 N·m were seen for 0.2 s, 5e5 N·m for 0.29 s."""
    outer = ScheduledTorque() if law == "scheduled" else PidTorque()
    both = joined(cascade(), nls.torque_controller(plant(), law=outer))
    undisturbed, words = after_one_command(both, None)
    assert set(words) == {0}
    command = INPUT_SATURATED | index_bit(1)
    for bad in (430.0, -7e4, 3e30):
        torques, words = after_one_command(both, bad)
        assert words[FAULTY] & command == command
        assert set(words[:FAULTY] + words[FAULTY + 3 :]) == {0}
        # One per cent of 5 N·m, as for readings, after five time constants of the observer.
        apart = np.abs(torques - undisturbed)
        assert np.max(apart[FAULTY + math.ceil(5.0 * time_constant(cascade()) / 1e-3) :]) < 0.05
        assert np.max(apart) < 0.5


def test_parameters_of_a_joined_step_say_whom_they_reach(tmp_path: Path) -> None:
    """A higher current limit let the observer, which believes 20 A at most, err by 15 rad/s with status 0."""
    both = joined(cascade(), nls.torque_controller(plant(), law=ScheduledTorque()))
    numbers = {v.name: v for v in both.parameters}
    limit = numbers.pop("motor.current_limit")
    assert (limit.start, limit.maximum) == (20.0, 20.0)
    for name, v in numbers.items():
        assert ("controller only" in v.description) == (not name.startswith("controller."))
    source = nls.export_c(both, tmp_path, real="float")
    step, values = CompiledStep(source), [v.start for v in both.parameters]
    place = [v.name for v in both.parameters].index("motor.current_limit")
    values[place] = 10.0
    assert step.set_parameters(values) == 0
    values[place] = 40.0
    assert step.set_parameters(values) & PARAMETER_REFUSED
    # Two tables over one range of one angle are one question.
    (line,) = (line for line in source.source.read_text().splitlines() if "OUT_OF_TABLE : 0u" in line)
    assert line.count("<") == line.count(">") == 1


def test_both_are_the_observer_and_the_controller_with_the_current_between() -> None:
    observer, controller = cascade(), nls.torque_controller(plant())
    both = joined(observer, controller)
    eye, hand, run = GuardedModel(observer), GuardedModel(controller), GuardedModel(both)
    acting = 0.0
    for k in range(300):
        reading = 0.5 + 0.767e-3 * round(0.3 * math.sin(0.02 * k) / 0.767e-3)
        estimate, _ = eye.step([reading, acting])
        wish = math.sin(0.01 * k)
        at = {
            "motor.angle": reading,
            "spring.torque": estimate[0],
            "spring.torque.desired": wish,
        }
        (acting,), _ = hand.step([at[v.name] for v in controller.inputs])
        outputs, status = run.step([reading, wish])
        assert status == 0
        assert outputs == pytest.approx([*estimate, acting], rel=1e-12, abs=1e-12)


def test_what_cannot_be_joined_is_refused() -> None:
    observer, controller = cascade(), nls.torque_controller(plant())
    with pytest.raises(NlsError, match="sampled alike"):
        joined(observer, nls.torque_controller(plant(), sample_time=2e-3))
    with pytest.raises(NlsError, match="at least one sample"):
        joined(observer, controller, delay=0)
    with pytest.raises(NlsError, match="reads no output of the controller"):
        joined(observer, nls.torque_controller(plant(), current="arm.current"))
    with pytest.raises(NlsError, match="reads no output of the observer"):
        joined(
            replace(observer, outputs=tuple(replace(v, name=f"other.{v.name}") for v in observer.outputs)),
            controller,
        )


def test_a_load_that_moves_has_the_same_guards() -> None:
    moved = nls.flatten(with_moved_load(nls.declare(nls.load_deck(DECK))))
    controller = nls.torque_controller(moved)
    limits = [v.plausibility for v in controller.inputs if v.name == "motor.angle"]
    assert limits[0] is not None
    assert limits[0].largest_rate == 95.0


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"lowest_reading": 1.5, "highest_reading": -1.5}, "leave no reading that could be used"),
        ({"largest_rate": 0.001}, "less than one count per sample"),
        ({"stale_time": 1e-4}, "shorter than two samples"),
    ],
)
def test_limits_that_no_reading_can_keep_are_refused(changed: dict[str, float], rule: str) -> None:
    numbers = {
        "lowest_reading": -1.5,
        "highest_reading": 1.5,
        "largest_rate": 95.0,
        "stale_time": 0.1,
        **changed,
    }

    def observer() -> object:
        encoder = Encoder(of="motor.angle", quantum=0.767e-3, limits=ReadingLimits(**numbers))
        machine = nls.declare(nls.load_deck(DECK)).with_part("motor_encoder", encoder)
        return design_observer_with_details(nls.flatten(machine))

    with pytest.raises(NlsError, match=rule):
        observer()
