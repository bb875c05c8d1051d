"""A task as what is asked on the live page: its curve as the target, and what the motor pays."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.design import curve_for_task, motor_and_gear, motor_cycle, walking_task
from nlsdesign.foundation.errors import NlsError, UnknownNameError, ValueRangeError
from nlsdesign.live.answers import LiveColumn
from nlsdesign.live.edits import edit, move_point
from nlsdesign.live.gallery import gallery_question
from nlsdesign.live.live_design import LiveDesign
from nlsdesign.live.question import LiveQuestion
from nlsdesign.live.saved import reopened, saved
from nlsdesign.live.tasks import (
    MOST_TASKS,
    MotorRow,
    _task,
    add_record,
    drop_task,
    follow_tasks,
    motor_over_tasks,
    record_of,
    set_motor,
    set_task,
    take_gear_ratio,
)


@pytest.fixture(scope="module")
def asked() -> LiveQuestion:
    """Walking, at the ankle, as much of it as the target of the template has."""
    return edit(set_task, 0, "ankle", 75.0).applied(gallery_question("cam-actuator"))


@pytest.fixture(scope="module")
def followed(asked: LiveQuestion) -> LiveQuestion:
    return edit(follow_tasks).applied(edit(set_motor, "resistance", 0.3).applied(asked))


def paid(question: LiveQuestion, live: LiveDesign | None = None) -> dict[str, MotorRow]:
    answer = motor_over_tasks(question, live.answer.design if live else None, 1)
    return {row.spring: row for row in answer.rows}


def test_a_task_asks_for_as_much_torque_as_the_target_has(asked: LiveQuestion) -> None:
    largest = walking_task("ankle", body_mass=75.0).scaled(asked.tasks[0].scale).sampled().torque.max()
    assert largest == pytest.approx(asked.target_size, rel=0.05)
    whole = edit(set_task, 0, "ankle", 75.0, 1.0).applied(asked)
    assert (whole.tasks[0].scale, len(whole.tasks)) == (1.0, 1)


def test_tasks_are_counted_and_refused(asked: LiveQuestion) -> None:
    question = asked
    for index in range(1, MOST_TASKS):
        question = edit(set_task, index, "knee", 80.0, 0.01, 0.5).applied(question)
    for index in (-1, MOST_TASKS):
        with pytest.raises(ValueRangeError, match="task"):
            edit(set_task, index, "knee", 80.0, 0.01).applied(question)
    assert len(edit(drop_task, 1).applied(question).tasks) == MOST_TASKS - 1
    for step, words in (
        (edit(set_task, 2, "knee", 80.0), "task 3"),
        (edit(set_task, 0, "knee", 0.0), "body mass"),
        (edit(set_task, 0, "knee", 80.0, math.nan), "assistance"),
        (edit(set_task, 0, "knee", 80.0, 0.1, 0.0), "share of the time"),
        (edit(drop_task, 1), "task 2"),
        (edit(set_motor, "resistance", 0.0), "resistance"),
    ):
        with pytest.raises(ValueRangeError, match=words):
            step.applied(asked)
    with pytest.raises(UnknownNameError, match="ankle"):
        edit(set_task, 0, "ankel", 75.0).applied(asked)
    with pytest.raises(UnknownNameError, match="gear_ratio"):
        edit(set_motor, "gear_ration", 3.0).applied(asked)
    with pytest.raises(ValueRangeError, match="choose a joint"):
        edit(follow_tasks).applied(replace(asked, tasks=()))


def test_the_target_that_follows_stands_at_round_angles_and_costs_as_little(followed: LiveQuestion) -> None:
    degrees = np.degrees([point.angle for point in followed.points])
    assert followed.points[0] == (0.0, 0.0)
    assert np.allclose(degrees[:-1], 10.0 * np.arange(len(degrees) - 1))
    rows = paid(followed)
    least, drawn = rows["least heat"].heat, rows["target as drawn"].heat
    assert least is not None
    assert drawn == pytest.approx(least, rel=0.02)
    rigid = rows["no spring"].heat
    assert rigid is not None
    assert least < rigid


def test_what_the_motor_pays_is_that_of_the_library(followed: LiveQuestion) -> None:
    task = walking_task("ankle", body_mass=75.0).scaled(followed.tasks[0].scale)
    drive = motor_and_gear(followed.machine.model, resistance=0.3)
    curve, rows = curve_for_task(task, drive), paid(followed)
    assert curve.linear is not None
    for name, cycle in {
        "no spring": curve.rigid,
        "best linear spring": curve.linear,
        "least heat": curve.best,
    }.items():
        assert rows[name].heat == pytest.approx(cycle.heat / task.sampled().period, rel=1e-6), name
        assert rows[name].power == pytest.approx(cycle.peak_power, rel=1e-6), name
    beyond = replace(
        followed.target, angles=(*followed.target.angles, 6.2), torques=(*followed.target.torques, 6.2)
    )
    drawn = motor_cycle(task, drive, spring=beyond)
    assert rows["target as drawn"].current == pytest.approx(np.sqrt(np.mean(drawn.current**2)), rel=1e-2)


@pytest.mark.slow
def test_a_winding_of_which_nothing_is_known_has_no_heat_and_a_ratio_is_only_tried(
    asked: LiveQuestion,
) -> None:
    answer = motor_over_tasks(asked, None, 1)
    assert {row.heat for row in answer.rows} == {None}
    assert "declares no resistance" in answer.words
    assert all(row.current for row in answer.rows if not row.reason)
    known = edit(set_motor, "resistance", 0.3).applied(asked)
    assert "declares no resistance" not in motor_over_tasks(known, None, 1).words
    tried = edit(set_motor, "gear_ratio", 20.0).applied(known)
    assert (motor_over_tasks(known, None, 1).gear_ratio, motor_over_tasks(tried, None, 1).gear_ratio) == (
        10.0,
        20.0,
    )
    assert tried.machine is known.machine
    assert edit(set_motor, "gear_ratio", None).applied(tried).motor == known.motor


def test_a_spring_that_cannot_serve_the_task_says_why(followed: LiveQuestion) -> None:
    *others, (angle, torque) = followed.points
    low = edit(move_point, len(others), angle, 0.8 * torque).applied(followed)
    assert "needs" in paid(low)["target as drawn"].reason
    assert paid(low)["target as drawn"].heat is None
    heavy = edit(set_task, 0, "ankle", 75.0, 1.0).applied(followed)
    answer = motor_over_tasks(heavy, None, 1)
    assert answer.rows == ()
    assert "motor current 15 A would have to be" in answer.words
    with pytest.raises(NlsError, match="ask for less assistance"):
        edit(follow_tasks).applied(heavy)


@pytest.mark.slow
def test_the_design_is_held_against_the_task_with_its_own_curve(followed: LiveQuestion) -> None:
    rows = paid(followed, LiveDesign(followed))
    assert rows["this design"].heat == pytest.approx(rows["target as drawn"].heat, rel=0.02)


@pytest.mark.slow
def test_a_design_that_asks_for_more_current_than_the_drive_gives_is_told(asked: LiveQuestion) -> None:
    heavy = edit(follow_tasks).applied(edit(set_task, 0, "ankle", 75.0, 0.05).applied(asked))
    view = LiveDesign(asked).answer.design
    assert view is not None
    last = heavy.target.last_angle
    rows = {"angle": np.linspace(0.0, last, 50), "torque": np.linspace(0.0, heavy.target_size, 50)}
    straight = replace(view, columns=tuple(LiveColumn(name, "", "", row) for name, row in rows.items()))
    assert "the drive gives 15 A" in motor_over_tasks(heavy, straight, 1).words
    assert "the drive gives" not in motor_over_tasks(asked, straight, 1).words


def test_a_one_sided_cam_leaves_the_other_direction_to_a_stop() -> None:
    """The hip pulls twice as hard one way as the other; a spring for both would reach the larger torque."""
    question = edit(set_task, 0, "hip", 75.0).applied(gallery_question("one-sided-finger"))
    followed = edit(follow_tasks).applied(question)
    torque = walking_task("hip", body_mass=75.0).scaled(question.tasks[0].scale).sampled().torque
    assert followed.target_size == pytest.approx(torque.max(), rel=0.01)
    assert torque.max() < 0.6 * -torque.min()
    rows = paid(followed)
    assert not rows["target as drawn"].reason
    assert rows["target as drawn"].current == pytest.approx(rows["least heat"].current, rel=0.05)


def test_a_spring_that_ends_a_little_early_is_taken_to_go_on(followed: LiveQuestion) -> None:
    *others, (angle, torque) = followed.points
    short = edit(move_point, len(others), angle, 0.995 * torque).applied(followed)
    assert not paid(short)["target as drawn"].reason


def written(rows: str, per_mass: bool) -> bytes:
    """A German table of a squat: half a second down, half a second up."""
    head = "Zeit [ms];Winkel [°];Drehmoment [N*m" + ("/kg]" if per_mass else "]")
    return f"{head}\n{rows}".replace(".", ",").encode("cp1252")


SWING = [math.sin(2.0 * math.pi * k / 100) for k in range(101)]
ROWS = "".join(f"{10.0 * k:.1f};{20.0 * s:.6f};{0.4 * s:.6f}\n" for k, s in enumerate(SWING))


@pytest.mark.parametrize("per_mass", [False, True], ids=["torque", "per mass"])
def test_a_record_of_ones_own_is_a_task(per_mass: bool) -> None:
    question = gallery_question("cam-actuator")
    record = record_of(written(ROWS, per_mass), "squat.csv")
    assert (record.period, record.per_mass) == (pytest.approx(1.0), per_mass)
    own = edit(set_task, 0, "squat.csv", 2.0, 1.0).applied(
        edit(add_record, "squat.csv", record).applied(question)
    )
    assert own.tasks[0].row == ("squat.csv", 2.0, 1.0, 1.0, "per mass" if per_mass else "own")
    largest = 0.8 if per_mass else 0.4
    assert _task(own.tasks[0]).sampled().torque.max() == pytest.approx(largest, rel=1e-4)
    assert _task(own.tasks[0]).sampled().angle.max() == pytest.approx(np.radians(20.0), rel=1e-4)
    assert {"no spring", "least heat"} <= set(paid(own))
    # What is changed later keeps the record, and a saved design brings it back.
    changed = edit(set_task, 0, "squat.csv", 2.0, 0.5).applied(own)
    assert changed.tasks[0].record == record
    assert reopened(saved(changed, {}))[0].tasks == changed.tasks
    many = replace(changed, tasks=MOST_TASKS * changed.tasks)
    with pytest.raises(ValueRangeError, match="drop one first"):
        edit(add_record, "other.csv", record).applied(many)


def test_a_record_that_is_none_says_why() -> None:
    for rows, words in (("", "rows"), (ROWS.replace("0.4", "x"), "no finite number|number")):
        with pytest.raises(NlsError, match=words):
            record_of(written(rows, False), "squat.csv")
    texts = saved(gallery_question("cam-actuator"), {})
    begin = texts.begin.replace("tasks = []", 'tasks = [["a.csv", 1.0, 1.0, 1.0, [1.0, true, [0.0]]]]')
    assert begin != texts.begin
    with pytest.raises(ValueRangeError, match="task of your own"):
        reopened(replace(texts, begin=begin))


@pytest.mark.parametrize("deck", ["cam-actuator", "one_sided_cable_drive"])
def test_the_ratio_that_is_tried_goes_into_the_deck(deck: str) -> None:
    question = edit(set_motor, "gear_ratio", 23.0).applied(gallery_question(deck))
    tried = motor_and_gear(question.machine.model, resistance=1.0).geared(23.0)
    taken = edit(take_gear_ratio).applied(question)
    assert taken.motor == {}
    for name, value in vars(motor_and_gear(taken.machine.model, resistance=1.0)).items():
        assert value == pytest.approx(getattr(tried, name), rel=1e-9), name
    assert "23:1, taken over from the live page" in saved(taken, {}).deck
    with pytest.raises(ValueRangeError, match="none is tried"):
        edit(take_gear_ratio).applied(taken)
