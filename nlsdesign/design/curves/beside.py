"""The spring beside the drive that serves a task best, and which place of a spring serves it better."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError, ValueRangeError
from ...foundation.quantity import with_unit
from .compliance import ComplianceSpline
from .motor_and_gear import MotorAndGear, MotorCycle, beside_cycle
from .numbers import plain
from .target import TabulatedTorque
from .task import MixedTask, Task
from .task_curve import TaskCurve, TaskGoal, TaskProblem, curve_for_task, rigid_motor, solved
from .task_program import BesideProgram, TaskOptimum

_ENGAGED = 2e-3
"""Share of its largest torque from which a side counts as engaged."""
_ROOM = 1.003
"""The stiffness is known a little beyond the sampled angles, which a finer sampling may pass."""
_POINTS = 4
"""Points of the table of a side for each piece of its stiffness."""
_ALIKE = 0.02
"""Share of the goal by which a place must be better to be called so."""


@dataclass(frozen=True, eq=False)
class EngagedSpring:
    """One side of a spring beside the drive: nothing up to an angle of the joint, then against the way on.

    Parameters
    ----------
    target
        Torque over the angle beyond the engagement, rising; what :func:`design_cam` takes.
    engaged
        Angle of the joint in rad at which it begins.
    way
        1 where it acts at larger angles (its torque is negative there), −1 at smaller ones.
    """

    target: TabulatedTorque
    engaged: float
    way: float

    def torque(self, angle: Array) -> Array:
        """Return the torque on the joint in N·m, of the same shape, positive along the angle.

        ``angle``: of the joint in rad, any shape; beyond the table the torque stays what it is there.
        """
        further = np.clip(self.way * (np.asarray(angle) - self.engaged), 0.0, self.target.last_angle)
        return np.asarray(-self.way * self.target.torque(further))

    def __str__(self) -> str:
        side = "above" if self.way > 0.0 else "below"
        return f"{side} {np.degrees(self.engaged):.3g}°, up to {self.target.largest:.3g} N·m"


@dataclass(frozen=True, eq=False)
class BesideCurve:
    """The spring beside the drive for a task, and what it is worth.

    Parameters
    ----------
    sides
        One, or two that act in opposite directions; none where a spring would not help.
    goal
        What was made small.
    best
        The motor over a period, with the curves as they stand in ``sides``.
    bound
        Below which no spring beside the drive with these sides gets, at this gear ratio, in the unit of the
        goal.
    """

    sides: tuple[EngagedSpring, ...]
    goal: TaskGoal
    best: MotorCycle
    bound: float | None


def curve_beside(
    task: Task | MixedTask,
    drive: MotorAndGear,
    problem: TaskProblem | None = None,
    *,
    both_ways: bool = False,
) -> BesideCurve:
    """Return the torque curve of the spring beside the drive, from joint to frame, that serves a task best.

    Unknown is the stiffness over the angle, from one end of the range of the joint on; it is nowhere
    negative, as under a cable, and where it begins is the angle of engagement. The motor's torque is affine
    in it and its speed does not depend on it, so least energy is a convex quadratic program, least peak power
    a linear one, and both are solved to the global optimum with a bound. Friction and the losses of the gear
    are not in it. Source: virtual work.

    Parameters
    ----------
    task, drive
        As for :func:`curve_for_task`.
    problem
        Goal, limits, pieces and range of the gear ratio; its symmetry is that of a series spring.
    both_ways
        Whether there is a curve of its own for either direction, as of a
        :class:`~nlsdesign.components.LopsidedCam` or two springs; else the better one of the two.

    Raises
    ------
    InfeasibleError
        If no spring keeps the limits, with the amounts.
    ValueRangeError
        If the joint does not move.
    """
    problem = problem or TaskProblem()
    options: list[tuple[BesideProgram, TaskOptimum]] = []
    errors: list[InfeasibleError] = []
    for ways in ((1.0, -1.0),) if both_ways else ((1.0,), (-1.0,)):
        try:
            options.append(solved(problem, beside_program(task, drive, problem, ways)))
        except InfeasibleError as error:
            errors.append(error)
    if not options:
        raise errors[0]
    program, optimum = min(options, key=lambda each: problem.goal.of(each[0].motor(each[1].unknowns)))
    sides = tuple(engaged_sides(program, program.coefficients(optimum.unknowns)))
    cycle = program.cycle
    spring = np.sum([side.torque(cycle.angle) for side in sides], axis=0) if sides else 0.0 * cycle.time
    return BesideCurve(sides, problem.goal, beside_cycle(cycle, program.drive, spring), optimum.bound)


def beside_program(
    task: Task | MixedTask, drive: MotorAndGear, problem: TaskProblem, ways: tuple[float, ...]
) -> BesideProgram:
    """Return the program for a spring with a side in each of some ways."""
    cycle, limits = task.sampled(), problem.limits
    span = float(np.ptp(cycle.angle))
    most = float(np.max(np.abs(cycle.torque)))
    if span < 1e-6 or most == 0.0:
        raise ValueRangeError(
            "task", "has no motion or no torque, so no spring beside the drive is needed",
            next_step="give angle and torque over one period",
        )  # fmt: skip
    spline = ComplianceSpline(0.0, _ROOM * span, problem.pieces)
    size = len(ways) * spline.size
    return BesideProgram(
        cycle, drive, spline, np.eye(size), np.zeros(size), 0.0, np.inf, plain(limits.motor_speed),
        ways=ways, largest_stiffness=1.0 / limits.floor(most),
    )  # fmt: skip


def engaged_sides(program: BesideProgram, coefficients: Array) -> list[EngagedSpring]:
    """Return each side of the torque of the spring, from where it engages or changes its sign, as a table."""
    low, high = (float(f(program.cycle.angle)) for f in (np.min, np.max))
    angles = np.linspace(low, high, _POINTS * program.spline.pieces + 1)
    torque, stiffness = (np.zeros_like(angles) for _ in range(2))
    for way, row in zip(program.ways, np.split(coefficients, len(program.ways)), strict=True):
        matrices = program.spline.matrices(program.beyond(angles, way))
        torque -= way * (matrices[0] @ row)
        stiffness += matrices[1] @ row
    sides = []
    for way in program.ways:
        order = slice(None) if way > 0.0 else slice(None, None, -1)
        at, against, slope = way * angles[order], -way * torque[order], stiffness[order]
        if against[-1] < _ENGAGED * float(np.max(np.abs(program.cycle.torque))):
            continue
        first = int(np.argmax(against > _ENGAGED * against[-1]))
        begin = at[first]
        if first > 0:  # where it changes its sign, or else the last point before it engages
            share = max(-against[first - 1], 0.0) / (against[first] - against[first - 1])
            begin = at[first - 1] + share * (at[first] - at[first - 1])
        rest = slice(first if begin < at[first] else first + 1, None)
        target = TabulatedTorque(
            angles=(0.0, *(at[rest] - begin)),
            torques=(0.0, *against[rest]),
            slopes=(float(np.interp(begin, at, slope)), *slope[rest]),
        )
        sides.append(EngagedSpring(target, way * begin, way))
    return sides


@dataclass(frozen=True, eq=False)
class SpringChoice:
    """A task with no spring, with one in series, and beside the drive, each at its own ratio if that is free.

    Parameters
    ----------
    goal
        What was made small.
    none
        The motor rigidly coupled; it need not keep the limits.
    series, beside, both_ways
        The curve in series, beside the drive in one direction, and in both; ``None`` where no such spring
        keeps the limits.
    """

    goal: TaskGoal
    none: MotorCycle
    series: TaskCurve | None
    beside: BesideCurve | None
    both_ways: BesideCurve | None

    @property
    def motors(self) -> dict[str, MotorCycle]:
        """The motor over a period by place of the spring, simpler places first."""
        springs = (("in series", self.series), ("beside the drive", self.beside),
                   ("beside the drive, both ways", self.both_ways))  # fmt: skip
        return {"no spring": self.none, **{name: each.best for name, each in springs if each}}

    @property
    def best(self) -> str:
        """The place with the least of the goal; the simpler one where a later one is less than 2 % better."""
        paid = {name: self.paid(motor) for name, motor in self.motors.items()}
        chosen = "no spring"
        for name, value in paid.items():
            if value < (1.0 - _ALIKE) * paid[chosen]:
                chosen = name
        return chosen

    def paid(self, motor: MotorCycle) -> float:
        """Return what is compared: the energy lost in the motor in a period in J, or the peak power in W.

        Parameters
        ----------
        motor
            Over a period.
        """
        work = motor.cycle.over_period(motor.cycle.torque * motor.cycle.speed)
        return motor.peak_power if self.goal.power else motor.energy - work

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Return a table: place, gear ratio, heat per period, peak power, peak current."""
        return [
            (
                name, f"{plain(motor.drive.gear_ratio):.4g}", with_unit(f"{motor.heat:.4g}", "J"),
                with_unit(f"{motor.peak_power:.4g}", "W"), with_unit(f"{motor.peaks['current']:.4g}", "A"),
            )
            for name, motor in self.motors.items()
        ]  # fmt: skip

    @property
    def reason(self) -> str:
        """Which place, by how much, and why, in two sentences."""
        what, unit = ("peak power", "W") if self.goal.power else ("loss in the motor", "J")
        motors, best = self.motors, self.best
        paid = {name: self.paid(motor) for name, motor in motors.items()}
        others = []
        for name, value in paid.items():
            share, how = 100.0 * (1.0 - paid[best] / value), "less" if paid[best] < value else "more"
            if name != best:
                others.append(f"{abs(share):.0f} % {how} than {name} ({value:.3g} {unit})")
        most = motors[best].peaks
        taken = []
        for spring, does in (
            (
                self.both_ways or self.beside,
                "A spring beside the drive gives what follows the angle of the joint",
            ),
            (self.series, "one in series changes only how the rotor moves"),
        ):
            if spring:
                with_it = spring.best
                alone = beside_cycle(self.none.cycle, with_it.drive, np.zeros_like(with_it.torque))
                share = 100.0 * (1.0 - float(np.mean(with_it.torque**2) / np.mean(alone.torque**2)))
                taken.append(f"{does}, here {share:.0f} % of the squared motor torque")
        return (
            f"{best[0].upper()}{best[1:]}: {paid[best]:.3g} {unit} of {what} a period, {', '.join(others)}. "
            f"{'; '.join(taken)}; the motor is left with {most['torque']:.3g} N·m at most, and with "
            f"{most['speed']:.3g} rad/s."
        )

    def __str__(self) -> str:
        lines = [
            f"{name}: gear ratio {ratio}, {heat} of heat, {power} and {current} at most"
            for name, ratio, heat, power, current in self.rows()
        ]
        sides = (
            [] if self.beside is None else [f"beside the drive it acts {each}" for each in self.beside.sides]
        )
        return "\n".join([*lines, *sides, self.reason])


def choose_spring(
    task: Task | MixedTask, drive: MotorAndGear, problem: TaskProblem | None = None
) -> SpringChoice:
    """Return what a task costs with no spring, one in series and one beside the drive, and which is better.

    Parameters
    ----------
    task, drive
        What is asked for and what drives.
    problem
        Goal, symmetry of the series spring, limits, and range of the gear ratio.

    Raises
    ------
    InfeasibleError
        If no spring in any place keeps the limits.
    ValueRangeError
        If the task has no torque or no motion.

    Examples
    --------
    >>> from nlsdesign.design import walking_task
    >>> motor = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=60.0)
    >>> choose_spring(walking_task("hip", body_mass=75.0).scaled(0.05), motor).best
    'beside the drive, both ways'
    """
    problem = problem or TaskProblem()
    errors: list[InfeasibleError] = []
    series: TaskCurve | None = None
    beside: list[BesideCurve | None] = []
    try:
        series = curve_for_task(task, drive, problem)
    except InfeasibleError as error:
        errors.append(error)
    for both_ways in (False, True):
        try:
            beside.append(curve_beside(task, drive, problem, both_ways=both_ways))
        except InfeasibleError as error:
            beside.append(None)
            errors.append(error)
    if len(errors) == 3:
        raise errors[-1]
    return SpringChoice(problem.goal, rigid_motor(problem, task, drive), series, *beside)
