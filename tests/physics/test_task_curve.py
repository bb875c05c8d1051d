"""The curve for a task against what is derived here: by samples, non-negative least squares, motion."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize, nnls

from nlsdesign.design import (
    LeastEnergy,
    LeastPeakPower,
    MotorAndGear,
    OddSpring,
    OneSidedSpring,
    SpringLimits,
    Task,
    TaskCurve,
    TaskProblem,
    TwoBranchSpring,
    curve_for_task,
    motor_cycle,
    walking_task,
)

DRIVE = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=120.0)
WALKING = {joint: walking_task(joint, body_mass=75.0).scaled(0.05) for joint in ("hip", "knee", "ankle")}
HEATING = 0.3 / 0.03**2


@functools.cache
def optimum(joint: str) -> TaskCurve:
    return curve_for_task(WALKING[joint], DRIVE)


def fourier_rate(values: np.ndarray, period: float) -> np.ndarray:
    """Derivative of equally spaced samples of one period."""
    turns = 2j * np.pi * np.fft.fftfreq(len(values), period / len(values))
    if len(values) % 2 == 0:
        turns[len(values) // 2] = 0.0
    return np.fft.ifft(turns * np.fft.fft(values)).real


def heat_of(angle: np.ndarray, torque: np.ndarray, period: float) -> float:
    """Joule heat where the output of the gear moves like this; by differences of its angle."""
    step = period / len(angle)
    acceleration = (np.roll(angle, -1) - 2.0 * angle + np.roll(angle, 1)) / step**2
    current = (torque + DRIVE.reflected_inertia * acceleration) / (120.0 * 0.03)
    return float(np.sum(0.3 * current**2) * step)


def deflection_at(curve: TaskCurve, torque: np.ndarray) -> np.ndarray:
    """Deflection under a torque, read from a dense table of the interpolated target."""
    angle = np.linspace(0.0, curve.target.last_angle, 200_001)
    size = np.interp(np.abs(torque), curve.target.torque(angle), angle)
    return np.sign(torque) * size


def without_a_form(joint: str, count: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Least heat with one compliance per pair of neighbouring torques, as Bolívar et al. 2018 sample it.

    Heat is then a sum of squares in increments of the deflection that are not negative: non-negative least
    squares, which shares nothing with the splines and the program of the package. Between the samples the
    motion is not held to the curve, so the number comes from below and rises with the number of samples.
    """
    cycle = WALKING[joint].sampled(count)
    size, step = np.abs(cycle.torque), cycle.period / count
    order = np.argsort(size)
    deflection = np.zeros((count, count))
    deflection[order] = np.tril(np.ones((count, count)))
    deflection *= np.sign(cycle.torque)[:, None]
    twice = (np.roll(deflection, -1, 0) - 2.0 * deflection + np.roll(deflection, 1, 0)) / step**2
    weight = np.sqrt(HEATING * step) / 120.0
    matrix = weight * DRIVE.reflected_inertia * twice
    rigid = weight * (cycle.torque + DRIVE.reflected_inertia * cycle.acceleration)
    floor = np.diff(size[order], prepend=0.0) * 0.01 / np.max(size)
    found, rest = nnls(matrix, -(rigid + matrix @ floor), maxiter=30 * count)
    bent = deflection @ (found + floor)
    assert np.max(np.abs(bent)) < np.pi / 2, "the limit of the deflection is not met"
    return float(rest**2), cycle.torque, bent


@pytest.mark.slow
@pytest.mark.long_cases("ankle-1440", "hip-480")
@pytest.mark.parametrize(("joint", "count"), [("hip", 480), ("knee", 480), ("ankle", 1440)])
def test_no_worse_than_the_optimum_without_a_form(joint: str, count: int) -> None:
    """The quick fall of the ankle's torque takes a tenth of the stride, so that task needs more samples."""
    theirs, _, _ = without_a_form(joint, count)
    fine = WALKING[joint].sampled(8000)
    ours = heat_of(fine.angle + deflection_at(optimum(joint), fine.torque), fine.torque, fine.period)
    assert ours == pytest.approx(optimum(joint).best.heat, rel=2e-3)
    assert ours <= 1.01 * theirs
    assert theirs <= 1.001 * ours, "or the two are not the same problem"


@pytest.mark.parametrize("joint", WALKING)
def test_the_sampled_optimum_is_no_better_between_its_samples(joint: str) -> None:
    _, torque, deflection = without_a_form(joint, 240)
    order = np.argsort(np.abs(torque))
    size, bent = np.abs(torque)[order], np.abs(deflection)[order]
    fine = WALKING[joint].sampled(8000)
    most = np.max(np.abs(fine.torque))
    curve = PchipInterpolator(
        np.concatenate([[0.0], size, [most * 1.01]]), np.concatenate([[0.0], bent, bent[-1:]])
    )
    theirs = heat_of(fine.angle + np.sign(fine.torque) * curve(np.abs(fine.torque)), fine.torque, fine.period)
    assert theirs > optimum(joint).best.heat


@pytest.mark.parametrize("joint", WALKING)
def test_the_best_linear_spring_in_closed_form(joint: str) -> None:
    cycle = WALKING[joint].sampled(600)
    rate = fourier_rate(fourier_rate(cycle.torque, cycle.period), cycle.period)
    rigid = cycle.torque + DRIVE.reflected_inertia * fourier_rate(
        fourier_rate(cycle.angle, cycle.period), cycle.period
    )
    compliance = -(rigid @ rate) / (DRIVE.reflected_inertia * (rate @ rate))
    assert 1.0 / optimum(joint).linear_stiffness == pytest.approx(compliance, rel=1e-3)


def free_oscillation(amplitude: float) -> tuple[Task, MotorAndGear]:
    """Motor and load that swing on a cubic spring by themselves: the motor needs no torque at all."""
    motor, load, stiffness, hardening = 0.02, 0.05, 6.0, 9.0
    reduced = motor * load / (motor + load)

    def law(deflection: np.ndarray) -> np.ndarray:
        return stiffness * deflection + hardening * deflection**3

    def quarter(_: float, x: np.ndarray) -> float:
        return float(x[1])

    quarter.terminal = False  # type: ignore[attr-defined]
    quarter.direction = 1.0  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda _, x: [x[1], -law(x[0]) / reduced],
        (0.0, 2.0), [amplitude, -1e-14], events=quarter, rtol=1e-11, atol=1e-13, dense_output=True,
    )  # fmt: skip
    period = 2.0 * float(run.t_events[0][0])
    time = np.linspace(0.0, period, 201)
    deflection = run.sol(time)[0]
    task = Task(time=time, angle=-motor / (motor + load) * deflection, torque=law(deflection))
    return task, MotorAndGear(inertia=motor / 50.0**2, torque_constant=0.03, resistance=0.3, gear_ratio=50.0)


def test_a_cubic_spring_is_found_from_its_own_oscillation() -> None:
    task, drive = free_oscillation(0.6)
    curve = curve_for_task(task, drive)
    angle = np.linspace(0.05, 0.58, 30)
    assert curve.target.torque(angle) == pytest.approx(6.0 * angle + 9.0 * angle**3, rel=5e-3)
    assert curve.best.heat < 1e-4 * curve.rigid.heat
    assert curve.linear.heat > 20.0 * curve.best.heat, "a linear spring does not swing like this"


@pytest.mark.slow
@pytest.mark.long_cases("knee", "hip")
@pytest.mark.parametrize("joint", WALKING)
def test_the_motor_torque_moves_the_motor_as_claimed(joint: str) -> None:
    """Forward in time: the claimed torque on motor and gear, against the spring, gives the claimed motion."""
    curve = optimum(joint)
    fine = motor_cycle(WALKING[joint], DRIVE, spring=curve.target, count=4000)
    cycle, last = fine.cycle, curve.target.last_angle
    period, table = cycle.period, np.linspace(0.0, last, 50_001)
    torques = curve.target.torque(table)

    def at(values: np.ndarray, time: float) -> float:
        return float(np.interp(time, cycle.time, values, period=period))

    def rates(time: float, x: np.ndarray) -> list[float]:
        deflection = x[0] - at(cycle.angle, time)
        resisting = np.sign(deflection) * np.interp(abs(deflection), table, torques)
        return [x[1], (120.0 * at(fine.torque, time) - resisting) / DRIVE.reflected_inertia]

    start = [cycle.angle[0] + fine.deflection[0], fine.speed[0] / 120.0]
    run = solve_ivp(rates, (0.0, 0.25 * period), start, rtol=1e-8, atol=1e-10, max_step=period / 2000)
    claimed = np.interp(run.t, cycle.time, cycle.angle + fine.deflection)
    assert np.max(np.abs(run.y[0] - claimed)) < 0.01 * np.ptp(cycle.angle)


@pytest.mark.parametrize("joint", WALKING)
def test_a_spring_takes_no_energy(joint: str) -> None:
    """What the motor does in a period is what the joint gets: inertia and spring give everything back."""
    curve, task = optimum(joint), WALKING[joint]
    angle, torque = np.append(task.angle, task.angle[0]), np.append(task.torque, task.torque[0])
    by_area = float(np.sum(np.diff(angle) * (torque[1:] + torque[:-1]) / 2.0))
    scale = task.peak_power * curve.best.cycle.period
    for motor in (curve.rigid, curve.linear, curve.best):
        assert abs(motor.energy - motor.heat - by_area) < 2e-3 * scale


@pytest.mark.parametrize("joint", WALKING)
def test_no_spring_gets_below_the_bound(joint: str) -> None:
    """Springs at random, checked one by one; and the bound is not just low, the optimum touches it."""
    curve, problem = optimum(joint), TaskProblem()
    program = problem.program(WALKING[joint], DRIVE)
    best = problem.goal.best(program).unknowns
    assert curve.bound is not None
    assert curve.gap == pytest.approx(0.0, abs=2e-3)
    random = np.random.default_rng(1)
    for spread in (0.001, 0.01, 0.1, 0.5, 2.0):
        for _ in range(20):
            tried = np.maximum(best * np.exp(spread * random.standard_normal(len(best))), program.floor)
            assert program.motor(tried).energy >= curve.bound - 1e-4 * curve.best.heat


def test_more_freedom_is_never_worse() -> None:
    task = WALKING["knee"]
    energies = {
        kind: curve_for_task(task, DRIVE, TaskProblem(symmetry=kind)).best.energy
        for kind in (OddSpring(), OneSidedSpring(), TwoBranchSpring())
    }
    most = 1e-3 * abs(energies[OddSpring()])
    assert energies[TwoBranchSpring()] < energies[OddSpring()] + most
    assert energies[TwoBranchSpring()] < energies[OneSidedSpring()] + most
    assert curve_for_task(task, DRIVE).two_branch == pytest.approx(energies[TwoBranchSpring()], abs=most)


def test_peak_power_against_every_linear_spring() -> None:
    task = WALKING["ankle"]
    curve = curve_for_task(task, DRIVE, TaskProblem(goal=LeastPeakPower(), pieces=8))
    cycle = task.sampled(2000)
    again = fourier_rate(fourier_rate(cycle.torque, cycle.period), cycle.period)

    def peak(stiffness: float) -> float:
        speed = cycle.speed + cycle.torque_rate / stiffness
        torque = cycle.torque + DRIVE.reflected_inertia * (cycle.acceleration + again / stiffness)
        return float(np.max(np.abs(torque * speed)))

    by_trying = min(peak(stiffness) for stiffness in np.geomspace(3.0, 400.0, 1500))
    assert curve.linear.peak_power == pytest.approx(by_trying, rel=0.01)
    assert curve.best.peak_power < 0.98 * by_trying
    assert curve.bound is None


def test_peak_power_against_another_solver() -> None:
    """The same unknowns and samples in SLSQP, from the spring of least energy: it finds nothing better."""
    problem = TaskProblem(goal=LeastPeakPower(), pieces=8)
    program = problem.program(WALKING["ankle"], DRIVE)
    start = LeastEnergy().best(program).unknowns
    (a, b), (c, d) = (program.affine()[name] for name in ("torque", "speed"))
    a, b, c, d = a[::2] * start, b[::2], c[::2] * start, d[::2]

    def power(x: np.ndarray) -> np.ndarray:
        return (a @ x[:-1] + b) * (c @ x[:-1] + d)

    def slope(x: np.ndarray) -> np.ndarray:
        along = a * (c @ x[:-1] + d)[:, None] + c * (a @ x[:-1] + b)[:, None]
        return np.column_stack([along, np.zeros(len(b))])

    last = np.eye(len(start) + 1)[-1]
    deflection = program.affine()["deflection"][0][::2] * start
    rows = np.column_stack([deflection, np.zeros(len(deflection))])
    first = np.append(np.ones(len(start)), np.max(np.abs(power(np.append(np.ones(len(start)), 0.0)))))
    theirs = minimize(
        lambda x: x[-1], first, jac=lambda x: last, method="SLSQP", options={"maxiter": 300},
        bounds=[(program.floor / each, None) for each in start] + [(0.0, None)],
        constraints=[
            {"type": "ineq", "fun": lambda x: x[-1] - power(x), "jac": lambda x: last - slope(x)},
            {"type": "ineq", "fun": lambda x: x[-1] + power(x), "jac": lambda x: last + slope(x)},
            {"type": "ineq", "fun": lambda x: np.pi / 2 - rows @ x, "jac": lambda x: -rows},
            {"type": "ineq", "fun": lambda x: np.pi / 2 + rows @ x, "jac": lambda x: rows},
        ],
    )  # fmt: skip
    assert theirs.fun < 0.97 * first[-1], "it went somewhere"
    ours = program.motor(problem.goal.best(program).unknowns).peak_power
    assert ours <= 1.01 * theirs.fun


def test_a_limit_is_kept_and_costs_heat() -> None:
    free = optimum("ankle")
    most = 0.6 * free.best.peaks["deflection"]
    kept = curve_for_task(WALKING["ankle"], DRIVE, TaskProblem(limits=SpringLimits(deflection=most)))
    assert kept.best.peaks["deflection"] == pytest.approx(most, rel=1e-3)
    assert kept.best.heat > 1.001 * free.best.heat
    assert kept.gap == pytest.approx(0.0, abs=2e-3)


def test_the_damping_of_the_motor_is_paid_for() -> None:
    task = WALKING["ankle"]
    damped = MotorAndGear(
        inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=120.0, damping=2e-5
    )
    curve = curve_for_task(task, damped)
    motor = curve.best
    lost = float(np.mean(2e-5 * motor.speed**2)) * motor.cycle.period
    assert motor.energy == pytest.approx(motor.heat + lost + task.work, rel=2e-3)
    assert curve.gap == pytest.approx(0.0, abs=2e-3)
