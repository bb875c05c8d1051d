"""A spring beside the drive for a task, the choice of its place, and the gear ratio with it; by other roads.

Independent roads: non-negative least squares and linear programs over one step of the torque for each sampled
angle, without splines; the motor's torque from differences of the joint's angle; a scan of the gear ratio.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog, minimize, minimize_scalar, nnls

from nlsdesign.design import (
    LeastPeakPower,
    MotorAndGear,
    SpringLimits,
    Task,
    TaskProblem,
    choose_spring,
    curve_beside,
    curve_for_task,
    walking_task,
)
from nlsdesign.design.curves.beside import BesideCurve
from nlsdesign.foundation.errors import InfeasibleError, ValueRangeError

DRIVE = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=60.0)
WALKING = {joint: walking_task(joint, body_mass=75.0).scaled(0.05) for joint in ("hip", "knee", "ankle")}
WIDE = (10.0, 300.0)


@functools.cache
def beside(joint: str, both_ways: bool) -> BesideCurve:
    return curve_beside(WALKING[joint], DRIVE, both_ways=both_ways)


def rigid_torque(task: Task, count: int, drive: MotorAndGear = DRIVE) -> tuple[np.ndarray, np.ndarray, float]:
    """Torque at the output that the motor has to give, and angle; by differences of the angle."""
    cycle = task.sampled(count)
    step = cycle.period / count
    acceleration = (np.roll(cycle.angle, -1) - 2.0 * cycle.angle + np.roll(cycle.angle, 1)) / step**2
    return cycle.torque + drive.reflected_inertia * acceleration, cycle.angle, cycle.period


def hinges(angle: np.ndarray, ways: tuple[float, ...], count: int) -> np.ndarray:
    """Columns: a spring of stiffness one on the joint beyond each of some angles, each way."""
    columns = []
    for way in ways:
        knots = np.linspace(np.min(way * angle), np.max(way * angle), count, endpoint=False)
        columns.append(-way * np.maximum(way * angle[:, None] - knots, 0.0) * np.ones(count))
    return np.hstack(columns)


@pytest.mark.parametrize("joint", WALKING)
@pytest.mark.parametrize("both_ways", [False, True])
def test_the_heat_beside_a_spring_is_that_of_least_squares_without_splines(
    joint: str, both_ways: bool
) -> None:
    """Torques that fall along 60 straight pieces, each with a slope of its own."""
    count, knots = 600, 60
    torque, angle, period = rigid_torque(WALKING[joint], count)
    weight = math.sqrt(0.3 * period / count) / (60.0 * 0.03)
    theirs = math.inf
    for ways in [(1.0, -1.0)] if both_ways else [(1.0,), (-1.0,)]:
        bent = hinges(angle, ways, knots)
        # From a stiffness that only grows to one that only is not negative: hinges with both ends.
        pieces = bent - np.hstack([np.column_stack([each[:, 1:], np.zeros(count)])
                                   for each in np.split(bent, len(ways), axis=1)])  # fmt: skip
        theirs = min(theirs, nnls(weight * pieces, weight * torque, maxiter=4000)[1] ** 2)
    ours = beside(joint, both_ways).best.heat
    assert ours == pytest.approx(theirs, rel=0.01)


@pytest.mark.parametrize("joint", WALKING)
def test_the_motor_beside_the_spring_gives_what_the_spring_does_not(joint: str) -> None:
    """From the tables that are handed out; over a period the spring takes no energy."""
    curve, count = beside(joint, True), 1200
    torque, angle, period = rigid_torque(WALKING[joint], count)
    spring = sum(side.torque(angle) for side in curve.sides)
    current = (torque - spring) / (60.0 * 0.03)
    assert 0.3 * float(np.mean(current**2)) * period == pytest.approx(curve.best.heat, rel=2e-3)
    around = np.append(angle, angle[0])
    work = float(np.sum(np.diff(around) * 0.5 * (spring + np.roll(spring, -1))))
    assert abs(work) < 1e-3 * WALKING[joint].peak_power * period
    front, back = curve.sides
    assert front.engaged == pytest.approx(back.engaged, abs=0.02), (
        "next to each other: one cam with two sides"
    )
    assert front.torque(np.array([front.engaged])) == 0.0
    if joint != "knee":  # the torque passes through zero there; at the knee there is a dead angle
        for table in (front.target, back.target):
            risen = table.angles[1] * 0.5 * (table.slopes[0] + table.slopes[1])
            assert table.torques[1] == pytest.approx(risen, rel=0.1)


@pytest.mark.long_cases("False")
@pytest.mark.parametrize("both_ways", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_no_spring_beside_the_drive_gets_below_the_bound(both_ways: bool) -> None:
    curve, random = beside("ankle", both_ways), np.random.default_rng(2)
    assert curve.bound == pytest.approx(curve.best.energy, abs=2e-4 * curve.best.heat)
    torque, angle, period = rigid_torque(WALKING["ankle"], 1200)
    base = float(np.sum([side.torque(angle) for side in curve.sides], axis=0) @ np.ones(1200)) * 0.0
    work = curve.best.energy - curve.best.heat
    for _ in range(50):
        tried = base + sum(
            side.torque(angle - 0.05 * random.standard_normal()) * (1.0 + 0.2 * random.standard_normal())
            for side in curve.sides
        )
        heat = 0.3 * float(np.mean(((torque - tried) / (60.0 * 0.03)) ** 2)) * period
        assert heat + work >= curve.bound - 1e-3 * curve.best.heat


@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_the_peak_power_beside_a_spring_is_that_of_a_linear_program_without_splines(joint: str) -> None:
    problem, count = TaskProblem(goal=LeastPeakPower()), 240
    curve = curve_beside(WALKING[joint], DRIVE, problem, both_ways=True)
    torque, angle, period = rigid_torque(WALKING[joint], count)
    speed = (np.roll(angle, -1) - np.roll(angle, 1)) / (2.0 * period / count)
    bent = hinges(angle, (1.0, -1.0), 60)
    columns = speed[:, None] * (bent - np.hstack([np.roll(each, -1, axis=1) * (np.arange(60) < 59)
                                                  for each in np.split(bent, 2, axis=1)]))  # fmt: skip
    sides = np.vstack([np.column_stack([sign * columns, -np.ones(count)]) for sign in (1.0, -1.0)])
    power = speed * torque
    cost = np.append(np.zeros(columns.shape[1]), 1.0)
    theirs = linprog(cost, A_ub=sides, b_ub=np.concatenate([power, -power]), bounds=(0.0, None)).fun
    assert curve.best.peak_power == pytest.approx(theirs, rel=0.03)
    assert curve.bound == pytest.approx(curve.best.peak_power, rel=1e-3)


def test_a_joint_on_a_spring_of_its_own_asks_nothing_of_the_motor() -> None:
    """A load that swings on a spring with a dead angle: that spring comes out, and where it engages."""
    time = np.linspace(0.0, 1.0, 401)
    angle = 0.4 * np.sin(2.0 * np.pi * time)
    passive = -8.0 * np.maximum(angle - 0.15, 0.0) ** 2
    task = Task(time=time, angle=angle, torque=passive, harmonics=24)
    light = replace(DRIVE, inertia=1e-9)
    curve = curve_beside(task, light)
    (side,) = curve.sides
    assert side.way == 1.0
    assert np.degrees(side.engaged) == pytest.approx(np.degrees(0.15), abs=1.5)
    assert side.torque(np.linspace(0.2, 0.39, 9)) == pytest.approx(
        -8.0 * (np.linspace(0.2, 0.39, 9) - 0.15) ** 2, abs=0.01
    )
    assert curve.best.heat < 1e-4 * choose_spring(task, light).none.heat


def test_the_stiffness_and_the_current_are_kept() -> None:
    free = beside("hip", False)
    stiffest = float(np.max(np.array(free.sides[0].target.slopes)))
    kept = curve_beside(WALKING["hip"], DRIVE, TaskProblem(limits=SpringLimits(stiffness=0.5 * stiffest)))
    assert np.max(kept.sides[0].target.slopes) == pytest.approx(0.5 * stiffest, rel=0.02)
    assert kept.best.heat > free.best.heat
    most = 0.9 * free.best.peaks["current"]
    held = curve_beside(WALKING["hip"], replace(DRIVE, current_limit=most), both_ways=True)
    assert held.best.peaks["current"] <= 1.002 * most
    with pytest.raises(InfeasibleError, match="motor speed 50 rad/s would have to be"):
        curve_beside(WALKING["hip"], DRIVE, TaskProblem(limits=SpringLimits(motor_speed=50.0)))
    time = np.linspace(0.0, 1.0, 41)
    still = Task(time=time, angle=0.0 * time, torque=np.sin(2.0 * np.pi * time))
    with pytest.raises(ValueRangeError, match="no motion"):
        curve_beside(still, DRIVE)


# --- the place ----------------------------------------------------------------------------------------


def test_the_place_follows_from_what_the_task_asks_for() -> None:
    """Holding alone is what a spring beside the drive does; friction is what none can."""
    time = np.linspace(0.0, 1.0, 201)
    slow = Task(
        time=10.0 * time, angle=0.5 * np.sin(2 * np.pi * time), torque=-6.0 * np.sin(2 * np.pi * time)
    )
    choice = choose_spring(slow, DRIVE)
    assert choice.best.startswith("beside the drive")
    assert "follows the angle of the joint, here 100 % of the squared motor torque" in choice.reason
    # A load of friction, moved slowly: no spring can take that over.
    rubbing = Task(
        time=10.0 * time, angle=0.5 * np.sin(2 * np.pi * time), torque=6.0 * np.cos(2 * np.pi * time)
    )
    assert choose_spring(rubbing, DRIVE).best == "no spring"


def test_a_later_place_has_to_be_better_by_two_per_cent() -> None:
    choice = choose_spring(WALKING["ankle"], DRIVE.geared(80.0))
    paid = {name: choice.paid(motor) for name, motor in choice.motors.items()}
    assert 0.98 * paid["in series"] < paid["beside the drive, both ways"] < paid["in series"]
    assert choice.best == "in series"
    assert "1 % more than beside the drive, both ways" in choice.reason


# --- the gear ratio -----------------------------------------------------------------------------------

LIMITED = replace(DRIVE, current_limit=7.0, voltage_limit=24.0, damping=1e-5)


QUICK = ("ankle-free-beside", "ankle-limited-in series")
CASES = [
    f"{joint}-{drive}-{place}"
    for joint in WALKING
    for drive in ("free", "limited")
    for place in ("in series", "beside", "both ways")
]


@pytest.mark.slow
@pytest.mark.long_cases(*(case for case in CASES if case not in QUICK))
@pytest.mark.parametrize("place", ["in series", "beside", "both ways"])
@pytest.mark.parametrize("drive", [DRIVE, LIMITED], ids=["free", "limited"])
@pytest.mark.parametrize("joint", WALKING)
def test_a_scan_finds_no_better_gear_ratio(joint: str, drive: MotorAndGear, place: str) -> None:
    task, limits = WALKING[joint], SpringLimits(motor_speed=500.0)
    free = TaskProblem(limits=limits, gear_ratios=WIDE)
    fixed = TaskProblem(limits=limits)
    if place == "in series":
        ours = curve_for_task(task, drive, free).best
    else:
        ours = curve_beside(task, drive, free, both_ways=place == "both ways").best

    def energy(log_ratio: float) -> float:
        at = drive.geared(math.exp(log_ratio))
        try:
            if place == "in series":
                program = fixed.program(task, at)
                return float(program.motor(fixed.goal.best(program).unknowns).energy)
            return float(curve_beside(task, at, fixed, both_ways=place == "both ways").best.energy)
        except InfeasibleError:
            return math.inf

    grid = np.log(np.geomspace(*WIDE, 8))
    scanned = [energy(each) for each in grid]
    at = int(np.argmin(scanned))
    bounds = (grid[max(at - 1, 0)], grid[min(at + 1, 7)])
    finer = minimize_scalar(energy, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    assert ours.energy == pytest.approx(min(finer.fun, scanned[at]), abs=2e-4 * ours.heat)
    assert math.log(ours.drive.gear_ratio) == pytest.approx(finer.x, abs=0.02)


@pytest.mark.slow
def test_a_limit_decides_the_gear_ratio() -> None:
    """The motor may turn only so fast: the ratio is then what the fastest motion leaves."""
    task = WALKING["hip"]
    most = 0.5 * float(beside_free("hip").best.peaks["speed"])
    curve = curve_beside(
        task, DRIVE, TaskProblem(limits=SpringLimits(motor_speed=most), gear_ratios=WIDE), both_ways=True
    )
    fastest = float(np.max(np.abs(task.sampled().speed)))
    assert curve.best.drive.gear_ratio == pytest.approx(most / fastest, rel=1e-3)


@functools.cache
def beside_free(joint: str) -> BesideCurve:
    return curve_beside(WALKING[joint], DRIVE, TaskProblem(gear_ratios=WIDE), both_ways=True)


def test_spring_and_ratio_against_another_solver_from_other_starts() -> None:
    """SLSQP on eight linear pieces of the stiffness and the ratio: each start comes to the same place."""
    torque, angle, period = rigid_torque(WALKING["hip"], 400, replace(DRIVE, inertia=0.0))
    rotor = rigid_torque(WALKING["hip"], 400, replace(DRIVE, gear_ratio=1.0))[0] - torque
    knots = np.linspace(angle.min(), angle.max(), 9)
    width = knots[1] - knots[0]
    front = np.clip(angle[:, None] - knots[None, :-1], 0.0, width)
    columns = np.hstack([-front, width - front])

    def heat(x: np.ndarray) -> float:
        ratio = 50.0 * x[0]
        current = ((torque - columns @ x[1:]) / ratio + ratio * rotor) / 0.03
        return 0.3 * float(np.mean(current**2)) * period * 10.0

    ends = []
    for start in (0.3, 1.0, 4.0):
        first = np.append(start, np.full(16, 2.0))
        bounds = [(0.2, 6.0), *([(0.0, None)] * 16)]
        ends.append(
            minimize(heat, first, method="SLSQP", bounds=bounds, options={"maxiter": 500, "ftol": 1e-12})
        )
    assert np.ptp([end.fun for end in ends]) < 1e-3 * ends[0].fun
    best = min(ends, key=lambda end: end.fun)
    ours = beside_free("hip").best
    assert ours.heat <= best.fun / 10.0
    assert ours.heat == pytest.approx(best.fun / 10.0, rel=0.1), "eight pieces are coarse"
    assert ours.drive.gear_ratio == pytest.approx(50.0 * best.x[0], rel=0.05)


def test_what_cannot_be_geared_says_so() -> None:
    weak = replace(DRIVE, current_limit=0.5)
    with pytest.raises(InfeasibleError, match=r"gear ratio from 10 to 20.*widen the range"):
        curve_for_task(WALKING["ankle"], weak, TaskProblem(gear_ratios=(10.0, 20.0)))
    with pytest.raises(ValueRangeError, match=r"gear_ratios = \(40, 20\).*ascend"):
        TaskProblem(gear_ratios=(40.0, 20.0))


def test_the_peak_power_has_a_gear_ratio_too() -> None:
    problem = TaskProblem(goal=LeastPeakPower(), pieces=6, gear_ratios=(20.0, 200.0))
    ours = curve_beside(WALKING["hip"], DRIVE, problem, both_ways=True)
    fixed = TaskProblem(goal=LeastPeakPower(), pieces=6)
    for ratio in np.geomspace(20.0, 200.0, 6):
        other = curve_beside(WALKING["hip"], DRIVE.geared(ratio), fixed, both_ways=True)
        assert ours.best.peak_power <= 1.001 * other.best.peak_power
