"""What a joint has to do, as a designer asks it: the curve that serves it best, and what the motor pays."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..components import Gear
from ..design import (
    MixedTask,
    MotorAndGear,
    MotorCycle,
    OddSpring,
    OneSidedSpring,
    TabulatedTorque,
    TaskCurve,
    TaskProblem,
    curve_for_task,
    motor_and_gear,
    motor_cycle,
    walking_task,
)
from ..design.curves.numbers import plain
from ..design.curves.task import Task, read_task
from ..design.parametric.cam_question import TargetPoint
from ..foundation.arrays import Array
from ..foundation.errors import ArrangementError, InfeasibleError, NlsError, ValueRangeError, unknown_name
from ..model.roles import driven_body
from .answers import DesignView
from .at_angle import AngleView
from .question import AskedTask, LiveQuestion, TaskRecord, finite_in
from .views import in_words

MOST_TASKS = 4
_POINTS = 12
"""At most, of the target that follows from tasks, besides those at its ends."""
_BEYOND = 0.02
"""Share of its last angle by which a spring is taken to go on as it ends, for tasks that end just there."""
_MOST_ROWS = 60
"""Rows of the table in which a designed spring is held against tasks."""
_RECORD, _MOST_RECORD = 200, 2000
"""Times of one period at which a record of one's own is kept, and most of them that are reopened."""
_USUAL_MASS = 75.0
"""Assumed: body mass in kg of a record whose torque is per mass, until another is given."""
_TAKEN = "gear ratio {:g}:1, taken over from the live page"
_MOTOR = {"resistance": (1e-6, 1e6, "Ohm"), "gear_ratio": (1e-3, 1e4, "1")}
"""Numbers of the motor that a designer may give: their range and unit."""


def set_task(
    question: LiveQuestion, _: AngleView | None, index: int, joint: str, body_mass: float,
    scale: float | None = None, share: float = 1.0,
) -> LiveQuestion:  # fmt: skip
    """Set a task, counted from 0; one after the last is added.

    ``joint``: or the name of a record that is there; ``body_mass``: in kg; ``scale``: part of the torque of
    the joint that the actuator gives, for ``None`` as much as the target has; ``share``: of the time.
    """
    if not 0 <= index <= min(len(question.tasks), MOST_TASKS - 1):
        raise ValueRangeError(
            f"task {index + 1}", f"cannot be set: there are {len(question.tasks)}, at most {MOST_TASKS}",
            next_step="change one that is there",
        )  # fmt: skip
    mass = finite_in("body mass in kg", body_mass, lowest=1.0, highest=500.0)
    known = {each.joint: each.record for each in question.tasks}
    asked = AskedTask(joint, mass, 1.0, 1.0, known.get(joint))
    whole = float(np.max(np.abs(_task(asked).sampled().torque)))
    wanted = float(f"{question.target_size / whole:.2g}") if scale is None else scale
    asked = asked._replace(
        scale=finite_in("assistance", wanted, lowest=1e-6, highest=100.0, unit="%"),
        share=finite_in("share of the time", share, lowest=0.05, highest=1.0, unit="%"),
    )
    tasks = list(question.tasks)
    tasks[index : index + 1] = [asked]
    return replace(question, tasks=tuple(tasks))


def add_record(question: LiveQuestion, _: AngleView | None, name: str, record: TaskRecord) -> LiveQuestion:
    """Add a task of one's own with the whole of its torque; ``name``: of the file."""
    if len(question.tasks) >= MOST_TASKS:
        raise ValueRangeError(f"task '{name}'", f"is one more than {MOST_TASKS}", next_step="drop one first")
    own = AskedTask(name, _USUAL_MASS if record.per_mass else 1.0, 1.0, 1.0, record)
    return replace(question, tasks=(*question.tasks, own))


def record_of(content: bytes, name: str) -> TaskRecord:
    """Return the record of a file with the columns time, angle and torque, of one period.

    ``name``: of the file, without a path.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_bytes(content)
        try:
            task, per_mass = read_task(file), False
        except ValueRangeError:
            task, per_mass = read_task(file, body_mass=1.0), True
    cycle = task.sampled(_RECORD)
    angles, torques = (tuple(float(f"{v:.7g}") for v in row) for row in (cycle.angle, cycle.torque))
    return TaskRecord(cycle.period, per_mass, angles, torques)


def _task(asked: AskedTask) -> Task:
    """Return what a task asks for, with the whole of its torque."""
    record, mass = asked.record, asked.body_mass
    if record is None:
        return walking_task(asked.joint, body_mass=mass)
    time = np.arange(len(record.angles)) * record.period / len(record.angles)
    torque = np.array(record.torques) * (mass if record.per_mass else 1.0)
    return Task(time=time, angle=record.angles, torque=torque, period=record.period)


def drop_task(question: LiveQuestion, _: AngleView | None, index: int) -> LiveQuestion:
    """Take a task away, counted from 0."""
    if not 0 <= index < len(question.tasks):
        raise ValueRangeError(f"task {index + 1}", f"is not there; there are {len(question.tasks)}")
    return replace(question, tasks=question.tasks[:index] + question.tasks[index + 1 :])


def set_motor(
    question: LiveQuestion, _: AngleView | None, name: str, value: float | None = None
) -> LiveQuestion:
    """Give a number of the motor that the deck lacks or that is tried; that of the deck for ``None``."""
    if name not in _MOTOR:
        raise unknown_name("number of the motor", name[:80], _MOTOR)
    rest = {other: number for other, number in question.motor.items() if other != name}
    if value is None:
        return replace(question, motor=rest)
    low, high, unit = _MOTOR[name]
    words = name.replace("_", " ")
    return replace(
        question, motor={**rest, name: finite_in(words, value, lowest=low, highest=high, unit=unit)}
    )


def take_gear_ratio(question: LiveQuestion, _: AngleView | None) -> LiveQuestion:
    """Put the gear ratio that is tried into the machine.

    The inertia of a motor that is declared behind its gear follows with the square of the ratio; friction and
    what else is declared there stays.
    """
    if "gear_ratio" not in question.motor:
        raise ValueRangeError("gear ratio", "none is tried", next_step="give one to try first")
    wanted, model = question.motor["gear_ratio"], question.machine.model
    now, motor = plain(_drive(replace(question, motor={})).gear_ratio), driven_body(model).motor
    known, factor = question.machine.assembly.quantities(), wanted / now
    gears = [f"{path}.ratio" for path, part in question.machine.assembly.walk() if isinstance(part, Gear)]
    changes = {name: factor for name in gears if abs(known[name].number) != 1.0}
    if motor is not None and motor.gear_ratio is not None:
        changes = {motor.gear_ratio: factor, motor.inertia: factor**2}
    changed = {n: known[n].with_value(known[n].number * f, _TAKEN.format(wanted)) for n, f in changes.items()}
    machine = replace(question.machine, assembly=question.machine.assembly.with_values(changed))
    taken = replace(
        question, machine=machine, motor={k: v for k, v in question.motor.items() if k != "gear_ratio"}
    )
    if not math.isclose(plain(_drive(taken).gear_ratio), wanted, rel_tol=1e-6):
        raise ArrangementError(
            "gear ratio",
            f"is that of {len(changes)} gears together",
            next_step="change one of them in the deck",
        )
    return taken


def follow_tasks(question: LiveQuestion, _: AngleView | None) -> LiveQuestion:
    """Take the curve of least motor heat over the tasks as the target, at round angles."""
    curve = curve_of(question).target
    last = math.degrees(curve.last_angle)
    power = 10.0 ** math.floor(math.log10(last / _POINTS))
    step = next(size * power for size in (1.0, 2.0, 5.0, 10.0) if size * power >= last / _POINTS)
    degrees = [float(f"{v:.4g}") for v in (*np.arange(step, last - step / 2.0, step), last)]
    torques = curve.torque(np.minimum(np.radians(degrees), curve.last_angle))
    points = [TargetPoint(math.radians(a), float(f"{t:.3g}")) for a, t in zip(degrees, torques, strict=True)]
    return question.with_points((TargetPoint(0.0, 0.0), *points))


def reopened_tasks(question: LiveQuestion, rows: object, motor: object) -> LiveQuestion:
    """Return a question with the tasks and numbers of the motor of a saved design, checked."""
    for index, row in enumerate(rows if isinstance(rows, list) else ()):
        if not (isinstance(row, list) and len(row) in (4, 5) and isinstance(row[0], str)):
            raise ValueRangeError(f"live.toml: task {index + 1}", "is no row of joint and three numbers")
        for each in row[4:]:
            question = add_record(question, None, row[0], _reopened_record(each))
        question = set_task(question, None, index, *row[:4])
    for name, value in motor.items() if isinstance(motor, dict) else ():
        question = set_motor(question, None, str(name), value)
    return question


def _reopened_record(row: object) -> TaskRecord:
    given: Any = row
    try:
        period, per_mass, *columns = given
        angles, torques = (tuple(float(v) for v in column) for column in columns)
        if len(angles) <= _MOST_RECORD:
            return TaskRecord(float(period), per_mass is True, angles, torques)
    except (TypeError, ValueError):
        pass
    raise ValueRangeError(
        "live.toml: a task of your own", f"is no period with at most {_MOST_RECORD} angles and torques",
        next_step="save the design again",
    )  # fmt: skip


def curve_of(question: LiveQuestion) -> TaskCurve:
    """Return the curve of least motor heat over the tasks of a question."""
    if not question.tasks:
        raise ValueRangeError("task", "there is none", next_step="choose a joint first")
    try:
        return least_heat(question.tasks, _drive(question), question.cam.anchor_distance is None)
    except InfeasibleError as error:
        raise InfeasibleError(
            "tasks", error.rule, next_step="ask for less assistance, or try another gear ratio"
        ) from error


@lru_cache(maxsize=16)
def least_heat(tasks: tuple[AskedTask, ...], drive: MotorAndGear, one_sided: bool) -> TaskCurve:
    """Return the curve of least heat; the last ones are remembered, as a hand that moves asks again."""
    symmetry = OneSidedSpring() if one_sided else OddSpring()
    return curve_for_task(_mixed(tasks), drive, TaskProblem(symmetry=symmetry))


def _mixed(tasks: Iterable[AskedTask]) -> MixedTask:
    return MixedTask(tuple((_task(asked).scaled(asked.scale), asked.share) for asked in tasks))


def _drive(question: LiveQuestion) -> MotorAndGear:
    """Return motor and gear; a winding of which nothing is known has one ohm, which no curve depends on."""
    drive = motor_and_gear(question.machine.model, resistance=question.motor.get("resistance", 1.0))
    return drive.geared(question.motor.get("gear_ratio", plain(drive.gear_ratio)))


@dataclass(frozen=True)
class MotorRow:
    """What the motor pays with one spring, as means and peaks over all tasks."""

    spring: str  # in words
    heat: float | None  # mean Joule heat in W; None where no resistance of the winding is known
    current: float | None  # rms current in A
    power: float | None  # peak power at the shaft in W
    reason: str = ""  # why there is none of these

    @classmethod
    def of(cls, name: str, cycle: MotorCycle | NlsError, known: bool) -> MotorRow:
        """Return the row of a cycle, or of the reason why there is none; ``known``: the winding."""
        if isinstance(cycle, NlsError):
            return cls(name, None, None, None, f"cannot serve the tasks: {in_words(cycle.rule)}")
        current = math.sqrt(cycle.cycle.over_period(cycle.current**2) / cycle.cycle.period)
        heat = cycle.heat / cycle.cycle.period if known else None
        return cls(name, heat, current, cycle.peak_power)


@dataclass(frozen=True, eq=False)
class MotorAnswer:
    """What the motor pays for the tasks, with this spring and with others."""

    revision: int  # of the question
    rows: tuple[MotorRow, ...]
    # angles, torques: the curve of least heat in rad and N·m
    angles: Array
    torques: Array
    gear_ratio: float
    words: str  # what the figures hold for, or why there are none


def motor_over_tasks(question: LiveQuestion, view: DesignView | None, revision: int) -> MotorAnswer:
    """Return what the motor pays; ``view``: the design that is shown, ``None`` without one."""
    empty = np.zeros(0)
    try:
        curve, drive = curve_of(question), _drive(question)
    except NlsError as error:
        return MotorAnswer(revision, (), empty, empty, 0.0, in_words(str(error)))
    body = driven_body(question.machine.model)
    known = "resistance" in question.motor or f"{body.name}.resistance" in question.machine.model.values
    springs: dict[str, MotorCycle | NlsError] = {"no spring": curve.rigid}
    if curve.linear is not None:
        springs["best linear spring"] = curve.linear
    springs["least heat"] = curve.best
    rows = {"target as drawn": (question.target.angles, question.target.torques)}
    if view is not None:
        angle, torque = view.columns[0].values, view.column("torque").values
        every = max(1, len(angle) // _MOST_ROWS)
        rows["this design"] = (tuple(angle[::every]), tuple(torque[::every]))
    for name, (angles, torques) in rows.items():
        springs[name] = cycle_through(
            _mixed(question.tasks), drive, curve, np.array(angles), np.array(torques)
        )
    limit = plain(drive.current_limit)
    words = "Friction and the losses of the gear are left out."
    if not known:
        words = f"The deck declares no resistance of the winding: give it to see the heat. {words}"
    design = springs.get("this design")
    # The curve of least heat keeps the limit at every fourth time.
    if isinstance(design, MotorCycle) and design.peaks["current"] > 1.01 * limit:
        words = f"The design asks for {design.peaks['current']:.3g} A; the drive gives {limit:.3g} A. {words}"
    return MotorAnswer(
        revision, tuple(MotorRow.of(name, cycle, known) for name, cycle in springs.items()),
        np.array(curve.target.angles), np.array(curve.target.torques), plain(drive.gear_ratio), words,
    )  # fmt: skip


def cycle_through(
    task: MixedTask, drive: MotorAndGear, curve: TaskCurve, angles: Array, torques: Array
) -> MotorCycle | NlsError:
    """Return what the motor does with a spring of this table, or why it cannot."""
    last, slope = angles[-1], (torques[-1] - torques[-2]) / (angles[-1] - angles[-2])
    beyond = (1.0 + _BEYOND) * last, torques[-1] + _BEYOND * last * slope
    try:
        spring = TabulatedTorque(angles=(*angles, beyond[0]), torques=(0.0, *torques[1:], beyond[1]))
        return motor_cycle(task, drive, spring=spring, opposite=curve.opposite)
    except NlsError as error:
        return error
