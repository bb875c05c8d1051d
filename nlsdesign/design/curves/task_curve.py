"""The torque curve of the spring that serves a task best, for a declared motor and gear.

The gear ratio as one more unknown of the program for the spring of a task.

With u = n² motor torque and speed are τ = (L + u·R)/n and ω = n·S, where L is what acts at the output, R what
the rotor takes and S the speed of the output. Beside the drive L alone depends on the unknowns y, linearly;
in series R and S do, so that with w = u·y the terms L + u·R and u·S are linear in (w, u). Either way τ² = (L
+ u·R)²/u is the square of something linear over something linear, which is convex, and so is ω²; |L + u·R| ≤
τ_max·√u is a convex limit, as the root is concave, and those of current, voltage and speed are such limits.
So the least energy over y and n together has no local optimum besides the global one. Two cases are only
locally best: an inertia between gear and series spring, and the peak power of a series spring.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeVar

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError, NlsError, ValueRangeError
from ...foundation.quantity import Quantity, with_unit
from .compliance import OddSpring, SpringSymmetry, TwoBranchSpring
from .motor_and_gear import MotorAndGear, MotorCycle, beside_cycle, motor_cycle
from .numbers import in_si, plain
from .target import TabulatedTorque
from .task import MixedTask, Task
from .task_program import (
    QUIET,
    THIN,
    Affine,
    SeriesProgram,
    TaskOptimum,
    TaskProgram,
    conflict,
    least_energy,
    least_peak_power,
)


def best_ratio(
    program: TaskProgram, first: Array, ratios: tuple[float, float], *, power: bool
) -> tuple[float, Array]:
    """Return gear ratio and unknowns of least energy, or of least peak power, together.

    ``first``: unknowns to begin with, at the ratio of the program; ``ratios``: the range.
    """
    size, begin = len(first), program.motor(first)
    # Units of the unknowns in which the energy has slopes of one size.
    diagonal = np.diag(program.quadratic()[0])
    unit = 1.0 / np.sqrt(np.maximum(diagonal, max(1e-12 * np.max(diagonal), 1e-300)))
    x = ca.MX.sym("x", size + 2)  # y in its units, log n, and the peak power over that at the beginning
    z, n = ca.vertcat(unit * x[:size], 1.0), ca.exp(x[size])
    paid: Any = ca.MX(0, 1)
    objective: Any = x[size + 1]
    if power:
        load, rotor, speed = (ca.DM(_whole(each)[::2]) @ z for each in program.parts[:3])
        rows = (load * speed + n**2 * rotor * speed) / begin.peak_power
        paid = ca.vertcat(rows - objective, -rows - objective)
    else:
        objective = energy_of_period(program, z, n) / max(begin.heat, 1e-300)
    limits = limit_matrices(program)
    held = np.zeros(len(limits[0]), dtype=bool)  # most limits are far away: a row comes in when it is passed
    low = np.concatenate([program.floor / unit, np.log(ratios[:1]), [0.0]])
    high = np.concatenate([np.full(size, np.inf), np.log(ratios[1:]), [np.inf if power else 1.0]])
    point = np.concatenate([first / unit, [np.log(plain(program.drive.gear_ratio)), 1.0]])
    while True:
        kept = _along([each[held] for each in limits], z, n)
        inside: Any = {"x": x, "f": objective, "g": ca.vertcat(paid, kept)}
        solver = ca.nlpsol("gear_ratio", "ipopt", inside, {**QUIET, "ipopt.tol": 1e-9})
        least = np.concatenate([np.full(paid.shape[0], -np.inf), np.full(kept.shape[0], -1.0)])
        most = np.concatenate([np.zeros(paid.shape[0]), np.ones(kept.shape[0])])
        solution = solver(x0=point, lbx=low, ubx=high, lbg=least, ubg=most)
        if not solver.stats()["success"]:
            ends = f"spring and a gear ratio from {ratios[0]:g} to {ratios[1]:g}"
            raise InfeasibleError(
                ends, "no spring keeps the limits at any of them",
                next_step=f"widen the range, or take another motor; at one of them: {conflict(program)}",
            )  # fmt: skip
        point = np.array(solution["x"]).ravel()
        ratio, y = float(np.exp(point[size])), np.maximum(unit * point[:size], program.floor)
        rows_now = np.abs(_along(limits, np.append(y, 1.0), ratio))
        peaks = (rows_now >= np.roll(rows_now, 1)) & (rows_now >= np.roll(rows_now, -1))
        passed = peaks & ~held & (rows_now > 1.0 + 1e-6)
        if not np.any(passed):
            return ratio, y
        held |= passed


def _whole(affine: Affine) -> Array:
    return np.column_stack([affine.matrix, affine.offset])


def energy_of_period(program: TaskProgram, z: Any, n: Any) -> Any:
    """Return heat and work of the damping in a period over z = (y, 1) and the ratio."""
    drive, cycle = program.drive, program.cycle
    load, rotor, speed = (_whole(each) for each in program.parts[:3])
    heating, damping = plain(drive.resistance) / plain(drive.torque_constant) ** 2, plain(drive.damping)
    turning = heating * rotor.T @ rotor + damping * speed.T @ speed
    grams = (heating * load.T @ load, heating * (load.T @ rotor + rotor.T @ load), turning)
    over, beside, times = (ca.bilin(ca.DM(gram), z, z) for gram in grams)
    return cycle.period / len(cycle.time) * (over / n**2 + beside + n**2 * times)


def limit_matrices(program: TaskProgram) -> list[Array]:
    """Return matrices P, Q and K of the limits |P·z/n + Q·z·n + K·z| ≤ 1."""
    drive, parts = program.drive, program.parts
    load, rotor, speed = (_whole(each)[::THIN] for each in parts[:3])
    constant, heating = plain(drive.torque_constant), plain(drive.resistance) / plain(drive.torque_constant)
    current, voltage = constant * plain(drive.current_limit), plain(drive.voltage_limit)
    own = [_whole(Affine(each.matrix, each.offset)) / each.largest for each in program.own_limits()]
    none = np.zeros_like(load)
    zeros = [np.zeros_like(each) for each in own]
    stated = (
        [load / current, heating * load / voltage, none, *zeros],
        [
            rotor / current,
            (heating * rotor + constant * speed) / voltage,
            speed / program.largest_speed,
            *zeros,
        ],
        [none, none, none, *own],
    )
    return [np.vstack(each) for each in stated]


def _along(limits: list[Array], z: Any, n: Any) -> Any:
    """Return the rows of limits at z and a ratio, in symbols or numbers."""
    over, times, alone = [ca.DM(each) for each in limits] if isinstance(z, ca.MX) else limits
    return over @ z / n + times @ z * n + alone @ z


_RIGID = 0.01
"""Deflection in rad under the largest torque below which a spring counts as rigid."""
_POINTS = 4
"""Points of the table of the curve for each piece of the compliance."""
_RATIO, _HALVINGS = 1.5, 8
"""Between two points the stiffness changes by this factor at most; else there are points between them."""


class TaskGoal(ABC):
    """What is made small over a period of a task; a small object, chosen by the designer."""

    power: ClassVar[bool] = False
    """Whether it is a peak of the power, else the energy."""

    @abstractmethod
    def best(self, program: TaskProgram) -> TaskOptimum:
        """Return the best spring of a program."""

    @abstractmethod
    def of(self, motor: MotorCycle) -> float:
        """Return the number that is made small, in SI."""


@dataclass(frozen=True)
class LeastEnergy(TaskGoal):
    """Least Joule heat and work of a period in J. Convex: the optimum is global, with a proved bound.

    Source: Bolívar et al. 2018.
    """

    def best(self, program: TaskProgram) -> TaskOptimum:
        """Return the global optimum."""
        return least_energy(program)

    def of(self, motor: MotorCycle) -> float:
        """Return heat and work in J."""
        return motor.energy


@dataclass(frozen=True)
class LeastPeakPower(TaskGoal):
    """Least peak power at the motor shaft in W.

    Of a spring beside the drive a linear program, with its bound. In series it is not convex: the best of
    three local optima, unproved.
    """

    power: ClassVar[bool] = True

    def best(self, program: TaskProgram) -> TaskOptimum:
        """Return the best local optimum."""
        return least_peak_power(program)

    def of(self, motor: MotorCycle) -> float:
        """Return the peak power in W."""
        return motor.peak_power


@dataclass(frozen=True, kw_only=True)
class SpringLimits:
    """Limits of the spring of a task; those of motor and supply are in :class:`MotorAndGear`.

    Parameters
    ----------
    stiffness
        Largest stiffness in N·m/rad; ``None`` for one that deflects by 0.01 rad (0.6°) under the largest
        torque, beyond which a spring is as good as rigid.
    deflection
        Largest deflection in rad; a quarter turn, more than which a cable through the centre of a cam does
        not reach.
    motor_speed
        In rad/s; infinite for none but the supply's.
    """

    stiffness: Quantity | float | None = None
    deflection: Quantity | float = np.pi / 2.0
    motor_speed: Quantity | float = float("inf")

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            object.__setattr__(
                self, "stiffness", in_si("stiffness", self.stiffness, "N*m/rad", minimum=1e-6, maximum=1e9)
            )
        for name, unit, most in (("deflection", "rad", 6.3), ("motor_speed", "rad/s", float("inf"))):
            object.__setattr__(self, name, in_si(name, getattr(self, name), unit, minimum=1e-3, maximum=most))

    def floor(self, torque: float) -> float:
        """Return the smallest compliance in rad/(N·m).

        Parameters
        ----------
        torque
            Largest of the task in N·m.
        """
        return _RIGID / torque if self.stiffness is None else 1.0 / plain(self.stiffness)


@dataclass(frozen=True, eq=False)
class TaskCurve:
    """The curve for a task, and what it is worth.

    Parameters
    ----------
    target
        Torque over deflection for positive torque, rising; what :func:`design_cam` takes.
    opposite
        For negative torque, with both signs turned; ``None`` for an odd spring.
    goal
        What was made small.
    rigid, linear, best
        The motor over a period: rigidly coupled, with the best linear spring, and with the curve as it stands
        in ``target`` and ``opposite``. The rigid drive need not keep the limits; ``linear`` is ``None`` where
        no linear spring does.
    linear_stiffness
        Of the best linear spring in N·m/rad, ``None`` where there is none.
    bound
        Below which no spring of this symmetry gets, in the unit of the goal; ``None`` if nothing is proved.
    two_branch
        The goal with a spring whose directions differ; what an odd or one-sided one cannot have. ``None``
        where it was not found.
    """

    target: TabulatedTorque
    opposite: TabulatedTorque | None
    goal: TaskGoal
    rigid: MotorCycle
    linear: MotorCycle | None
    best: MotorCycle
    linear_stiffness: float | None
    bound: float | None
    two_branch: float | None

    @property
    def gap(self) -> float | None:
        """How far the curve is above the bound, as a share of the heat of its period."""
        if self.bound is None:
            return None
        return (self.goal.of(self.best) - self.bound) / max(self.best.heat, 1e-300)

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return a table: what, rigid, best linear spring, this curve."""
        cycles = (self.rigid, self.linear, self.best)

        def row(name: str, unit: str, value: Callable[[MotorCycle], float]) -> tuple[str, str, str, str]:
            a, b, c = (with_unit(f"{value(each):.4g}", unit) if each else "none" for each in cycles)
            return name, a, b, c

        return [
            row("Joule heat per period", "J", lambda motor: motor.heat),
            row("heat and work per period", "J", lambda motor: motor.energy),
            row("peak power of the motor", "W", lambda motor: motor.peak_power),
            row("peak current", "A", lambda motor: motor.peaks["current"]),
            row("peak voltage", "V", lambda motor: motor.peaks["voltage"]),
            row("peak motor speed", "rad/s", lambda motor: motor.peaks["speed"]),
            row("peak deflection", "deg", lambda motor: float(np.degrees(motor.peaks["deflection"]))),
        ]

    def __str__(self) -> str:
        unit = "J" if isinstance(self.goal, LeastEnergy) else "W"

        def shown(value: float | None, unit: str) -> str:
            return "none keeps the limits" if value is None else with_unit(f"{value:.4g}", unit)

        proof = (
            "no bound is proved: the problem is not convex"
            if self.bound is None
            else f"no spring of this kind gets below {shown(self.bound, unit)}"
        )
        lines = [f"{name}: rigid {a}, linear {b}, curve {c}" for name, a, b, c in self.rows()]
        return "\n".join(
            [
                *lines,
                f"best linear spring: {shown(self.linear_stiffness, 'N*m/rad')}",
                proof,
                f"with a curve of its own in each direction: {shown(self.two_branch, unit)}",
            ]
        )


@dataclass(frozen=True, kw_only=True)
class TaskProblem:
    """Everything that a curve for a task depends on, besides task and drive.

    Parameters
    ----------
    goal
        :class:`LeastEnergy` or :class:`LeastPeakPower`.
    symmetry
        :class:`OddSpring`, :class:`OneSidedSpring` or :class:`TwoBranchSpring`.
    limits
        Of the spring.
    pieces
        Of the compliance over the range of torque, or of the stiffness over that of the angle.
    gear_ratios
        Least and greatest gear ratio, of which the best is found together with the spring; ``None`` for that
        of the drive.

    Raises
    ------
    ValueRangeError
        If the range of the gear ratio is none.
    """

    goal: TaskGoal = field(default_factory=LeastEnergy)
    symmetry: SpringSymmetry = field(default_factory=OddSpring)
    limits: SpringLimits = field(default_factory=SpringLimits)
    pieces: int = 48
    gear_ratios: tuple[Quantity | float, Quantity | float] | None = None

    def __post_init__(self) -> None:
        if self.gear_ratios is None:
            return
        low, high = (in_si("gear_ratios", end, "1", minimum=1e-3, maximum=1e4) for end in self.gear_ratios)
        if not low < high:
            raise ValueRangeError(
                f"gear_ratios = ({low:g}, {high:g})", "must ascend",
                next_step="give the least and the greatest, or one ratio with drive.geared(...)",
            )  # fmt: skip
        object.__setattr__(self, "gear_ratios", (low, high))

    def program(self, task: Task | MixedTask, drive: MotorAndGear) -> SeriesProgram:
        """Return the program.

        Parameters
        ----------
        task, drive
            What is asked for and what drives.

        Raises
        ------
        ValueRangeError
            If the task has no torque, or there are too few pieces.
        """
        cycle = task.sampled()
        most = float(np.max(np.abs(cycle.torque)))
        if most == 0.0:
            raise ValueRangeError("task", "has no torque, so no spring is needed")
        if not 4 <= self.pieces <= 200:
            raise ValueRangeError(f"pieces = {self.pieces}", "must lie in [4, 200]")
        spline, floor = self.symmetry.spline(cycle, self.pieces), self.limits.floor(most)
        freedom, offset = self.symmetry.freedom(spline, floor)
        if freedom.shape[1] == 0:
            raise ValueRangeError(
                "task for a one-sided spring", "has no positive torque",
                next_step="turn the signs of angle and torque",
            )  # fmt: skip
        limits = self.limits
        return SeriesProgram(
            cycle, drive, spline, freedom, offset, floor, plain(limits.deflection), plain(limits.motor_speed)
        )


def curve_for_task(
    task: Task | MixedTask, drive: MotorAndGear, problem: TaskProblem | None = None
) -> TaskCurve:
    """Return the torque curve of the series spring that serves a task best.

    Unknown is the compliance over the torque, a spline with many pieces; motor torque and speed are affine in
    it. Least energy is a convex quadratic program, solved to the global optimum with a proved bound.
    Friction and the losses of the gear are not in it. Source: Bolívar et al. 2018.

    Parameters
    ----------
    task
        Motion and torque of the joint.
    drive
        Motor and gear, for instance from :func:`motor_and_gear`.
    problem
        Goal, symmetry and limits; least energy with an odd spring if it is left out.

    Raises
    ------
    InfeasibleError
        If no spring keeps the limits, with the amounts; or if the spring has no influence on the motor.
    ValueRangeError
        If the task has no torque.

    Examples
    --------
    >>> from nlsdesign.design import walking_task
    >>> motor = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=60.0)
    >>> curve = curve_for_task(walking_task("ankle", body_mass=75.0).scaled(0.05), motor)
    >>> curve.best.heat < 0.4 * curve.rigid.heat
    True
    """
    problem = problem or TaskProblem()
    whole = problem.program(task, drive)
    program, solution = solved(problem, whole)
    target, opposite = _branches(program, solution.unknowns)
    odd = isinstance(problem.symmetry, OddSpring)
    straight = _solved_or_none(problem, whole.linear())
    any_spring = _solved_or_none(problem, replace(problem, symmetry=TwoBranchSpring()).program(task, drive))
    return TaskCurve(
        target=target,
        opposite=None if odd else opposite,
        goal=problem.goal,
        rigid=rigid_motor(problem, task, drive),
        linear=straight[0].motor(straight[1].unknowns) if straight else None,
        best=motor_cycle(task, program.drive, spring=target, opposite=None if odd else opposite),
        linear_stiffness=1.0 / float(straight[1].unknowns[0]) if straight else None,
        bound=solution.bound,
        two_branch=problem.goal.of(any_spring[0].motor(any_spring[1].unknowns)) if any_spring else None,
    )


Program = TypeVar("Program", bound=TaskProgram)


def _solved_or_none(problem: TaskProblem, program: Program) -> tuple[Program, TaskOptimum] | None:
    try:
        return solved(problem, program)
    except InfeasibleError:  # the curve keeps the limits and this comparison does not: there is none to show
        return None


def solved(problem: TaskProblem, program: Program) -> tuple[Program, TaskOptimum]:
    """Return the best spring of a program, and the program at the best gear ratio where that is free."""
    goal, ratios = problem.goal, problem.gear_ratios
    if ratios is None:
        return program, goal.best(program)
    ends = plain(ratios[0]), plain(ratios[1])
    begin = program.geared(_rigid_ratio(goal, program, ends))
    try:
        first = goal.best(begin).unknowns
    except InfeasibleError:  # another ratio may do
        first = np.full(program.freedom.shape[1], program.floor)
    ratio, unknowns = best_ratio(begin, first, ends, power=goal.power)
    made, together = program.geared(ratio), TaskOptimum(unknowns, None)
    try:  # the same ratio with the bound of its own program
        again = goal.best(made)
    except InfeasibleError:  # the limits leave one point, which the tolerance of a solver misses
        return made, together
    one, other = (goal.of(made.motor(each.unknowns)) for each in (again, together))
    return made, again if one <= other + 1e-6 * abs(other) else together


def _rigid_ratio(goal: TaskGoal, program: TaskProgram, ratios: tuple[float, float]) -> float:
    """Return the gear ratio of a motor without a spring that has the least of the goal."""

    def paid(log_ratio: float) -> float:
        drive = program.drive.geared(float(np.exp(log_ratio)))
        return goal.of(beside_cycle(program.cycle, drive, np.zeros_like(program.cycle.time)))

    options = {"xatol": 1e-6}
    least = scipy.optimize.minimize_scalar(paid, bounds=np.log(ratios), method="bounded", options=options)
    return float(np.exp(least.x))


def rigid_motor(problem: TaskProblem, task: Task | MixedTask, drive: MotorAndGear) -> MotorCycle:
    """Return the motor without a spring, at its best gear ratio if that is free; it need not keep limits."""
    if problem.gear_ratios is not None:
        ends = plain(problem.gear_ratios[0]), plain(problem.gear_ratios[1])
        drive = drive.geared(_rigid_ratio(problem.goal, problem.program(task, drive), ends))
    return motor_cycle(task, drive)


def _branches(program: TaskProgram, unknowns: Array) -> tuple[TabulatedTorque, TabulatedTorque]:
    """Return the curve for positive and for negative torque, each as a table from zero."""
    tables = []
    for most in (program.spline.high, program.spline.low):
        if most == 0.0:  # no torque in this direction: a short line as stiff as allowed, which nothing uses
            angles = np.linspace(0.0, _RIGID, 3)
            tables.append(TabulatedTorque(angles=tuple(angles), torques=tuple(angles / program.floor)))
            continue
        along = np.unique(program.spline.knots * np.sign(most))
        knots = np.concatenate([[0.0], along[along > 1e-9 * abs(most)]])
        torque = np.interp(np.arange(_POINTS * (len(knots) - 1) + 1) / _POINTS, np.arange(len(knots)), knots)
        for _ in range(_HALVINGS):
            compliance = program.spline.matrices(np.sign(most) * torque)[1] @ program.coefficients(unknowns)
            steep = np.abs(np.diff(np.log(compliance))) > np.log(_RATIO)
            torque = np.sort(np.append(torque, 0.5 * (torque[:-1] + torque[1:])[steep]))
        matrices = program.spline.matrices(np.sign(most) * torque)
        deflection, compliance = (each @ program.coefficients(unknowns) for each in matrices[:2])
        tables.append(
            TabulatedTorque(
                angles=tuple(np.abs(deflection)), torques=tuple(torque), slopes=tuple(1.0 / compliance)
            )
        )
    return tables[0], tables[1]


def scan_gear_ratio(
    task: Task, drive: MotorAndGear, ratios: Sequence[float], problem: TaskProblem | None = None
) -> dict[float, TaskCurve | NlsError]:
    """Return the curve for each of some gear ratios; where none keeps the limits, the error that says why.

    Parameters
    ----------
    task, drive
        As for :func:`curve_for_task`.
    ratios
        Motor turns per turn of the output.
    problem
        As for :func:`curve_for_task`.
    """
    curves: dict[float, TaskCurve | NlsError] = {}
    for ratio in ratios:
        try:
            curves[ratio] = curve_for_task(task, drive.geared(ratio), problem)
        except InfeasibleError as error:  # the ratio is out of question, and the error says why
            curves[ratio] = error
    return curves
