"""Tasks, motors and what a curve for a task refuses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.design import (
    MixedTask,
    MotorAndGear,
    OneSidedSpring,
    PowerTorque,
    SpringLimits,
    Task,
    TaskCurve,
    TaskProblem,
    curve_for_task,
    motor_and_gear,
    motor_cycle,
    read_task,
    scan_gear_ratio,
    walking_task,
)
from nlsdesign.foundation.errors import (
    ArrangementError,
    InfeasibleError,
    MeasurementError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import quantity

PHASE = np.linspace(0.0, 2.0 * np.pi, 81)
SWING = Task(time=PHASE / 5.0, angle=0.4 * np.sin(PHASE), torque=-4.0 * np.sin(PHASE) + np.cos(3.0 * PHASE))
MOTOR = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=80.0)


# --- the record -----------------------------------------------------------------------------------


def test_a_series_gives_exact_derivatives() -> None:
    cycle = SWING.sampled(500)
    phase = 5.0 * cycle.time
    assert cycle.period == pytest.approx(2.0 * np.pi / 5.0)
    assert cycle.speed == pytest.approx(2.0 * np.cos(phase), abs=1e-9)
    assert cycle.acceleration == pytest.approx(-10.0 * np.sin(phase), abs=1e-8)
    assert cycle.torque_rate == pytest.approx(-20.0 * np.cos(phase) - 15.0 * np.sin(3 * phase), abs=1e-8)
    assert cycle.torque_acceleration == pytest.approx(
        100.0 * np.sin(phase) - 225.0 * np.cos(3 * phase), abs=1e-6
    )


def test_open_and_closed_records_are_the_same_task() -> None:
    opened = Task(
        time=np.asarray(SWING.time)[:-1],
        angle=np.asarray(SWING.angle)[:-1],
        torque=np.asarray(SWING.torque)[:-1],
        period=SWING.period,
    )
    assert opened.sampled().torque_rate == pytest.approx(SWING.sampled().torque_rate, abs=1e-8)
    assert opened.work == pytest.approx(SWING.work, abs=1e-10)


def test_a_share_of_the_torque() -> None:
    half = SWING.scaled(0.5)
    assert half.peak_power == pytest.approx(0.5 * SWING.peak_power)
    assert half.angle == pytest.approx(SWING.angle)
    with pytest.raises(ValueRangeError, match="share = 0"):
        SWING.scaled(0.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time": PHASE[:5], "angle": PHASE[:5], "torque": PHASE[:5]}, "at least eight rows"),
        ({"angle": PHASE[:-1]}, "one angle and one torque for each time"),
        ({"time": np.where(PHASE[7] == PHASE, 0.0, PHASE)}, "row 8, column 'time': time must ascend"),
        ({"torque": np.where(PHASE[3] == PHASE, np.nan, 1.0)}, "row 4, column 'torque'"),
        ({"angle": PHASE}, "column 'angle', is not periodic|column 'angle': is not periodic"),
        ({"period": 1.0}, "its rows cover"),
    ],
)
def test_a_wrong_record_is_named(change: dict[str, object], words: str) -> None:
    given: dict[str, object] = {
        "time": PHASE / 5.0,
        "angle": np.sin(PHASE),
        "torque": np.cos(PHASE),
        **change,
    }
    with pytest.raises(MeasurementError, match=words):
        Task(**given)  # type: ignore[arg-type]


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str, str], Path]:
    def write(head: str, extra: str = "") -> Path:
        rows = [f"{t:.6f},{10 * np.sin(5 * t):.6f},{np.cos(5 * t):.6f}" for t in PHASE / 5.0]
        (tmp_path / "task.csv").write_text("\n".join(["# made up", head, *rows, extra]), encoding="utf-8")
        return tmp_path / "task.csv"

    return write


def test_read_in_degrees_and_per_body_mass(written: Callable[..., Path]) -> None:
    plain = read_task(written("time [s],angle [deg],torque [N*m]"))
    assert np.ptp(plain.sampled().angle) == pytest.approx(np.radians(20.0), rel=1e-4)
    heavy = read_task(written("time [s],angle [deg],torque [N*m/kg]"), body_mass=quantity(80.0, "kg"))
    assert heavy.sampled().torque == pytest.approx(80.0 * plain.sampled().torque)


@pytest.mark.parametrize(
    ("head", "extra", "options", "error", "words"),
    [
        ("time [s],angle [deg],torque [N*m/kg]", "", {}, ValueRangeError, "needs a body mass"),
        (
            "time [s],angle [deg],torque [N*m]",
            "",
            {"body_mass": 80.0},
            ValueRangeError,
            "leave out body_mass",
        ),
        ("time [s],angle [deg],torque [N]", "", {}, UnitError, "no unit of it"),
        ("time,angle [deg],torque [N*m]", "", {}, UnitError, "names no unit"),
        ("time [s],angle [deg],force [N]", "", {}, MeasurementError, "column 'force"),
        (
            "time [s],angle [deg],torque [N*m]",
            "0.1,0,0",
            {},
            MeasurementError,
            "line 84, column 'time': time must",
        ),
        (
            "time [s],angle [deg],torque [N*m]",
            "9,50,0",
            {},
            MeasurementError,
            r"task\.csv: task, column '\w+': is not",
        ),
    ],
)
def test_a_wrong_file_is_named(
    written: Callable[..., Path],
    head: str,
    extra: str,
    options: dict[str, float],
    error: type[NlsError],
    words: str,
) -> None:
    with pytest.raises(error, match=words):
        read_task(written(head, extra), **options)  # type: ignore[arg-type]


def test_an_unknown_joint() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'ankle'"):
        walking_task("ankel", body_mass=75.0)


# --- several tasks --------------------------------------------------------------------------------


def test_each_task_counts_by_its_share_of_the_time() -> None:
    other = Task(time=PHASE / 3.0, angle=0.2 * np.sin(PHASE), torque=2.5 * np.cos(PHASE))
    mixed = MixedTask(((SWING, 3.0), (other, 1.0)))
    cycles = {each: motor_cycle(each, MOTOR) for each in (mixed, SWING, other)}
    mean = {each: cycle.heat / cycle.cycle.period for each, cycle in cycles.items()}
    assert mean[mixed] == pytest.approx(0.75 * mean[SWING] + 0.25 * mean[other], rel=1e-9)
    assert cycles[mixed].peak_power == pytest.approx(
        max(cycles[each].peak_power for each in (SWING, other)), rel=1e-3
    )
    assert cycles[mixed].cycle.period == 1.0
    rare = MixedTask(((SWING, 0.98), (other, 0.02))).sampled()
    assert len(rare.time) >= 50 * 8 * SWING.harmonics


def test_the_curve_for_several_tasks_is_the_best_for_all_together() -> None:
    joints = {name: walking_task(name, body_mass=75.0).scaled(0.03) for name in ("ankle", "knee")}
    mixed = MixedTask(tuple((task, 1.0) for task in joints.values()))
    best = curve_for_task(mixed, MOTOR)
    assert best.gap is not None
    assert best.gap < 1e-3
    of_ankle = curve_for_task(joints["ankle"], MOTOR).target  # the ankle's torque is the larger one
    assert best.best.energy < motor_cycle(mixed, MOTOR, spring=of_ankle).energy
    assert best.best.energy < best.rigid.energy


@pytest.mark.parametrize("shares", [(), (1.0, 0.005), (1.0, -0.5), (1.0, float("nan"))])
def test_a_share_that_is_none_is_refused(shares: tuple[float, ...]) -> None:
    with pytest.raises(ValueRangeError):
        MixedTask(tuple((SWING, share) for share in shares))


# --- the motor ------------------------------------------------------------------------------------


def test_motor_and_gear_of_a_deck() -> None:
    model = nls.flatten(nls.models.one_sided_cable_drive(nls.load_deck("one_sided_cable_drive")))
    motor = motor_and_gear(model)
    assert motor.gear_ratio == pytest.approx(12.0)
    assert motor.inertia == pytest.approx(140e-7)
    assert motor.output_inertia == pytest.approx(0.5e-4)
    assert motor.reflected_inertia == pytest.approx(144.0 * 140e-7 + 0.5e-4)
    assert (motor.resistance, motor.current_limit, motor.voltage_limit) == pytest.approx((0.3, 20.0, 24.0))
    assert motor.geared(24.0).reflected_inertia == pytest.approx(576.0 * 140e-7 + 0.5e-4)


def test_a_motor_without_a_resistance_is_refused() -> None:
    model = nls.flatten(nls.models.cam_rubber_actuator(nls.load_deck("austin2015_figure_consistent")))
    with pytest.raises(
        ArrangementError, match=r"no resistance of its winding.*MotorAndGear\(\.\.\., resistance"
    ):
        motor_and_gear(model)


def test_a_motor_that_is_declared_behind_its_gear_moves_the_same_load() -> None:
    """At the output: n·k_T·I against the inertia that the deck declares there."""
    model = nls.flatten(nls.models.cam_rubber_actuator(nls.load_deck("austin2015_figure_consistent")))
    motor, numbers = motor_and_gear(model, resistance=0.4), model.values
    assert motor.resistance == 0.4
    assert motor.gear_ratio == pytest.approx(numbers["motor.gear_ratio"])
    assert motor.reflected_inertia == pytest.approx(numbers["motor.inertia"])
    cycle = motor_cycle(SWING, motor)
    needed = cycle.cycle.torque + numbers["motor.inertia"] * cycle.cycle.acceleration
    per_ampere = numbers["motor.gear_ratio"] * numbers["motor.torque_constant"]
    assert cycle.current == pytest.approx(needed / per_ampere)
    declared = nls.flatten(nls.models.one_sided_cable_drive(nls.load_deck("one_sided_cable_drive")))
    assert motor_and_gear(declared, resistance=9.0).resistance == pytest.approx(0.3)  # the deck knows it


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"inertia": -1e-5}, ValueRangeError, "inertia = -1e-05"),
        ({"resistance": 0.0}, ValueRangeError, "resistance = 0"),
        ({"torque_constant": quantity(0.03, "N*m")}, UnitError, "torque_constant"),
        ({"gear_ratio": float("nan")}, ValueRangeError, "gear_ratio = nan"),
    ],
)
def test_wrong_numbers_of_a_motor(change: dict[str, float], error: type[NlsError], words: str) -> None:
    given = {"inertia": 1e-5, "torque_constant": 0.03, "resistance": 0.3, "gear_ratio": 80.0, **change}
    with pytest.raises(error, match=words):
        MotorAndGear(**given)


def test_a_spring_that_cannot_carry_the_task() -> None:
    short = PowerTorque(coefficient=5.0, exponent=1.0, angle=0.1)
    with pytest.raises(InfeasibleError, match=r"up to 0\.5 N·m: the task needs"):
        motor_cycle(SWING, MOTOR, spring=short)
    flat = PowerTorque(coefficient=50.0, exponent=2.0, angle=1.0)
    with pytest.raises(InfeasibleError, match="stiffness is not positive"):
        motor_cycle(Task(time=PHASE, angle=np.sin(PHASE), torque=np.sin(PHASE)), MOTOR, spring=flat, count=80)


# --- the curve ------------------------------------------------------------------------------------


def test_the_curve_is_a_rising_target() -> None:
    curve = curve_for_task(SWING, MOTOR)
    assert not curve.target.falls
    assert curve.opposite is None
    assert curve.target.largest >= np.max(np.abs(SWING.sampled().torque))
    assert "no spring of this kind gets below" in str(curve)
    assert len(curve.rows()) == 7


def test_limits_that_no_spring_keeps_are_named_with_the_amount() -> None:
    with pytest.raises(
        InfeasibleError, match=r"motor current 1 A would have to be (\d\.\d+).*gear ratio"
    ) as refused:
        curve_for_task(SWING, MotorAndGear(
            inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=80.0, current_limit=1.0
        ))  # fmt: skip
    needed = float(str(refused.value).partition("have to be ")[2].split()[0].rstrip(";"))
    for share, kept in ((0.999, False), (1.003, True)):
        motor = MotorAndGear(
            inertia=1.4e-5,
            torque_constant=0.03,
            resistance=0.3,
            gear_ratio=80.0,
            current_limit=share * needed,
        )
        if kept:
            curve = curve_for_task(SWING, motor)
            assert curve.best.peaks["current"] == pytest.approx(needed, rel=0.01)
        else:
            with pytest.raises(InfeasibleError, match="motor current"):
                curve_for_task(SWING, motor)


def test_a_drive_without_inertia_is_told_that_no_spring_helps() -> None:
    light = MotorAndGear(inertia=0.0, torque_constant=0.03, resistance=0.3, gear_ratio=80.0)
    with pytest.raises(InfeasibleError, match="does not depend on the spring"):
        curve_for_task(SWING, light)


def test_a_task_that_needs_no_spring() -> None:
    still = Task(time=PHASE, angle=np.sin(PHASE), torque=0.0 * PHASE)
    with pytest.raises(ValueRangeError, match="has no torque"):
        curve_for_task(still, MOTOR)
    pushing = Task(time=PHASE, angle=np.sin(PHASE), torque=-2.0 + np.sin(PHASE))
    with pytest.raises(ValueRangeError, match="no positive torque"):
        curve_for_task(pushing, MOTOR, TaskProblem(symmetry=OneSidedSpring()))


def test_wrong_limits() -> None:
    with pytest.raises(ValueRangeError, match="deflection = 90"):
        SpringLimits(deflection=90.0)
    with pytest.raises(UnitError, match="stiffness"):
        SpringLimits(stiffness=quantity(5.0, "N*m"))
    with pytest.raises(ValueRangeError, match="pieces = 2"):
        curve_for_task(SWING, MOTOR, TaskProblem(pieces=2))


def stiffest(curve: TaskCurve) -> float:
    angle = np.linspace(0.0, curve.target.last_angle, 4001)
    return float(np.max(np.diff(curve.target.torque(angle)) / np.diff(angle)))


def test_the_largest_stiffness_is_kept() -> None:
    free = curve_for_task(SWING, MOTOR)
    kept = curve_for_task(SWING, MOTOR, TaskProblem(limits=SpringLimits(stiffness=0.9 * stiffest(free))))
    assert stiffest(kept) == pytest.approx(0.9 * stiffest(free), rel=0.02)
    assert kept.best.heat > free.best.heat


def test_gear_ratios_and_those_that_are_out_of_question() -> None:
    motor = MotorAndGear(
        inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=80.0, voltage_limit=12.0
    )
    curves = scan_gear_ratio(SWING, motor, [20.0, 60.0, 2000.0])
    assert list(curves) == [20.0, 60.0, 2000.0]
    assert isinstance(curves[60.0], TaskCurve)
    assert isinstance(curves[2000.0], InfeasibleError)
    assert "motor voltage" in str(curves[2000.0])
