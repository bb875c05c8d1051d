"""The convex programs for the spring of a task, in series and beside the drive.

In series the unknown is the compliance over the torque, beside the drive the stiffness over the angle. Motor
torque, current, voltage and speed are affine in it, so Joule heat and the work of the damping are convex
quadratic and the limits linear: a convex quadratic program, whose optimum is global and proved by its dual.
The peak power of a motor whose speed depends on the spring is a product of two affine functions and not
convex. Source: Bolívar et al. 2018, for the series spring.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError
from .compliance import ComplianceSpline
from .motor_and_gear import MotorAndGear, MotorCycle, beside_cycle, driven_cycle, motion_through
from .numbers import plain
from .task import TaskCycle

_BEFORE = 1e-3
THIN = 4
"""Limits stand at every fourth time: between them smooth motions change by less than a thousandth."""


@dataclass(frozen=True, eq=False)
class LimitRows:
    """Rows of one limit: offset + matrix·y lies between −largest and largest."""

    # name, unit: what is limited, for messages
    name: str
    unit: str
    # matrix, offset: shape (n, m) and (n,)
    matrix: Array
    offset: Array
    largest: float  # in unit; infinite for none


class Affine(NamedTuple):
    """A column over time that is matrix·y + offset; shapes (n, m) and (n,)."""

    matrix: Array
    offset: Array

    def with_factor(self, factor: float) -> Affine:
        """Return a multiple of it."""
        return Affine(factor * self.matrix, factor * self.offset)

    def plus(self, other: Affine) -> Affine:
        """Return the sum."""
        return Affine(self.matrix + other.matrix, self.offset + other.offset)


class MotorParts(NamedTuple):
    """What motor torque and speed are made of, whatever the gear ratio n: load/n + n·rotor, and n·speed."""

    load: Affine  # torque at the output that does not turn with the rotor, in N·m
    rotor: Affine  # torque of the rotor's inertia and damping per ratio, in N·m
    speed: Affine  # of the gear's output, in rad/s
    deflection: Affine  # of a series spring, in rad


@dataclass(frozen=True, eq=False)
class TaskProgram(ABC):
    """A task, a drive and a spring with unknowns y ≥ floor."""

    # cycle, drive: what is asked for and what drives
    cycle: TaskCycle
    drive: MotorAndGear
    spline: ComplianceSpline
    # freedom, offset: coefficients of the spline are offset + freedom·y
    freedom: Array
    offset: Array
    floor: float  # smallest compliance in rad/(N·m), or stiffness in N·m/rad
    # largest_deflection, largest_speed: in rad, and of the motor in rad/s; infinite for none
    largest_deflection: float
    largest_speed: float

    def coefficients(self, unknowns: Array) -> Array:
        """Return the coefficients of the spline."""
        return self.offset + self.freedom @ unknowns

    def geared(self, ratio: float) -> Self:
        """Return the same program behind another gear."""
        return replace(self, drive=self.drive.geared(ratio))

    @abstractmethod
    def linear(self) -> TaskProgram:
        """Return the program of a linear spring: one unknown."""

    @abstractmethod
    def motor(self, unknowns: Array) -> MotorCycle:
        """Return what the motor does with this spring."""

    @cached_property
    @abstractmethod
    def parts(self) -> MotorParts:
        """Load, rotor, speed and deflection as affine in y."""

    def affine(self) -> dict[str, Affine]:
        """Return deflection, motor speed and motor torque as affine in y."""
        ratio, parts = plain(self.drive.gear_ratio), self.parts
        torque = parts.load.with_factor(1.0 / ratio).plus(parts.rotor.with_factor(ratio))
        return {"deflection": parts.deflection, "speed": parts.speed.with_factor(ratio), "torque": torque}

    def own_limits(self) -> tuple[LimitRows, ...]:
        """Return the limits of the spring alone."""
        deflection = self.parts.deflection
        rows = deflection.matrix[::THIN], deflection.offset[::THIN]
        return (LimitRows("deflection", "rad", *rows, self.largest_deflection),)

    def limits(self) -> tuple[LimitRows, ...]:
        """Return the limits that are stated."""
        rows, drive = {name: (m[::THIN], o[::THIN]) for name, (m, o) in self.affine().items()}, self.drive
        constant = plain(drive.torque_constant)
        (a, b), (c, d) = rows["torque"], rows["speed"]
        current = a / constant, b / constant
        resistance = plain(drive.resistance)
        voltage = resistance * current[0] + constant * c, resistance * current[1] + constant * d
        stated = (
            LimitRows("motor current", "A", current[0], current[1], plain(drive.current_limit)),
            LimitRows("motor voltage", "V", voltage[0], voltage[1], plain(drive.voltage_limit)),
            LimitRows("motor speed", "rad/s", c, d, self.largest_speed),
            *self.own_limits(),
        )
        return tuple(each for each in stated if np.isfinite(each.largest))

    def quadratic(self) -> tuple[Array, Array, float]:
        """Return H, g and c of the energy per period ½·yᵀH·y + gᵀy + c in J."""
        rows, drive, cycle = self.affine(), self.drive, self.cycle
        step = cycle.period / len(cycle.time)
        heating = plain(drive.resistance) / plain(drive.torque_constant) ** 2
        constant = cycle.over_period(cycle.torque * cycle.speed)
        hessian, gradient = np.zeros((self.freedom.shape[1],) * 2), np.zeros(self.freedom.shape[1])
        for weight, (matrix, offset) in ((heating, rows["torque"]), (plain(drive.damping), rows["speed"])):
            hessian += 2.0 * weight * step * matrix.T @ matrix
            gradient += 2.0 * weight * step * matrix.T @ offset
            constant += weight * step * float(offset @ offset)
        return hessian, gradient, constant


@dataclass(frozen=True, eq=False)
class SeriesProgram(TaskProgram):
    """The spring between gear and joint: unknown is its compliance over the torque, in rad/(N·m)."""

    def linear(self) -> SeriesProgram:
        """Return the program of a linear spring: one unknown, its compliance."""
        return replace(self, freedom=self.freedom @ np.ones((self.freedom.shape[1], 1)))

    def motor(self, unknowns: Array) -> MotorCycle:
        """Return what the motor does with this spring."""
        deflection, slope, bend = (
            each @ self.coefficients(unknowns) for each in self.spline.matrices(self.cycle.torque)
        )
        return driven_cycle(self.cycle, self.drive, deflection, motion_through(self.cycle, slope, bend))

    @cached_property
    def parts(self) -> MotorParts:
        """Load, rotor, speed and deflection as affine in the compliances."""
        cycle, drive = self.cycle, self.drive
        deflection, slope, bend = self.spline.matrices(cycle.torque)
        speed = slope * cycle.torque_rate[:, None]
        inertial = slope * cycle.torque_acceleration[:, None] + bend * cycle.torque_rate[:, None] ** 2
        inertia, behind, damping = (
            plain(each) for each in (drive.inertia, drive.output_inertia, drive.damping)
        )
        rows = (
            (behind * inertial, cycle.torque + behind * cycle.acceleration),
            (inertia * inertial + damping * speed, inertia * cycle.acceleration + damping * cycle.speed),
            (speed, cycle.speed),
            (deflection, np.zeros_like(cycle.time)),
        )
        return MotorParts(*(Affine(m @ self.freedom, m @ self.offset + o) for m, o in rows))


@dataclass(frozen=True, eq=False)
class BesideProgram(TaskProgram):
    """A spring between joint and frame: unknown is its stiffness over the angle beyond an end, in N·m/rad.

    A side acts on the joint beyond an angle of engagement, against the way on: its torque is the integral of
    its stiffness from one end of the range of the angle, so that the stiffness says where it engages: where
    it begins.
    """

    ways: tuple[float, ...]  # 1 for a side that acts at large angles, −1 for one that acts at small ones
    largest_stiffness: float

    def linear(self) -> BesideProgram:
        """Return the program of springs that are linear from the end of the range on."""
        ones = np.asarray(np.kron(np.eye(len(self.ways)), np.ones((self.spline.size, 1))), dtype=float)
        return replace(self, freedom=ones)

    def motor(self, unknowns: Array) -> MotorCycle:
        """Return what the motor does beside this spring."""
        torque = self._torques @ self.coefficients(unknowns)
        return beside_cycle(self.cycle, self.drive, torque)

    @cached_property
    def _torques(self) -> Array:
        """What maps the coefficients to the torque of the spring on the joint, shape (n, sides·size)."""
        return np.hstack(
            [-way * self.spline.matrices(self.beyond(self.cycle.angle, way))[0] for way in self.ways]
        )

    def beyond(self, angle: Array, way: float) -> Array:
        """Return the angle from the end of its range at which a side begins, a thousandth of it before."""
        ends = way * np.min(self.cycle.angle), way * np.max(self.cycle.angle)
        return np.asarray(way * angle - min(ends) + _BEFORE * self.spline.high)

    @cached_property
    def parts(self) -> MotorParts:
        """Load, rotor, speed and deflection as affine in the stiffnesses; the load alone depends on them."""
        cycle, drive = self.cycle, self.drive
        inertia, behind, damping = (
            plain(each) for each in (drive.inertia, drive.output_inertia, drive.damping)
        )
        none = np.zeros((len(cycle.time), self.freedom.shape[1]))
        return MotorParts(
            Affine(-self._torques @ self.freedom, cycle.torque + behind * cycle.acceleration),
            Affine(none, inertia * cycle.acceleration + damping * cycle.speed),
            Affine(none, cycle.speed),
            Affine(none, np.zeros_like(cycle.time)),
        )

    def own_limits(self) -> tuple[LimitRows, ...]:
        """Return the limit of the stiffness; the spring has no other deflection than the joint."""
        rows = self.freedom, np.zeros(len(self.freedom))
        return (LimitRows("stiffness of the spring", "N·m/rad", *rows, self.largest_stiffness),)


@dataclass(frozen=True, eq=False)
class TaskOptimum:
    """Solution of a program."""

    unknowns: Array  # y, shape (m,)
    bound: float | None  # what no spring can go below, from the dual; None where the problem is not convex


def least_energy(program: TaskProgram) -> TaskOptimum:
    """Return the spring with the least motor energy per period, and the bound that proves it."""
    hessian, gradient, constant = program.quadratic()
    if not np.any(hessian):
        raise InfeasibleError(
            "motor energy",
            "does not depend on the spring: the drive has no inertia and no damping",
            next_step="give the inertia of the rotor",
        )
    limits, size = program.limits(), len(gradient)
    matrix = np.vstack([np.zeros((0, size)), *(each.matrix / each.largest for each in limits)])
    offset = np.concatenate([np.zeros(0), *(each.offset / each.largest for each in limits)])
    # Unknowns in units in which the diagonal of H is one, energy in units of its largest slope.
    diagonal = np.diag(hessian)
    unit = 1.0 / np.sqrt(np.maximum(diagonal, 1e-12 * np.max(diagonal)))
    scale = max(float(np.max(np.abs(gradient * unit))), 1e-300)
    scaled, slope = hessian * np.outer(unit, unit) / scale, gradient * unit / scale
    held = np.zeros(len(offset), dtype=bool)  # most limits are far away: a row comes in when it is passed
    while True:
        solution = _solved((scaled, slope), (matrix[held] * unit, offset[held]), program.floor / unit)
        if solution is None:
            raise conflict(program)
        unknowns = np.maximum(solution[0] * unit, program.floor)
        size_of_rows = np.abs(offset + matrix @ unknowns)
        peaks = (size_of_rows >= np.roll(size_of_rows, 1)) & (size_of_rows >= np.roll(size_of_rows, -1))
        passed = peaks & ~held & (size_of_rows > 1.0 + 1e-6)
        if not np.any(passed):
            break
        held |= passed
    prices = np.zeros(len(offset))
    prices[held] = solution[1] * scale
    paid = float(np.sum(np.abs(prices)) - prices @ offset)
    return TaskOptimum(
        unknowns, _lowest(hessian, gradient + matrix.T @ prices, program.floor) - paid + constant
    )


def _solved(
    quadratic: tuple[Array, Array], rows: tuple[Array, Array], floor: Array
) -> tuple[Array, Array] | None:
    """Return the optimum of ½·yᵀHy + gᵀy with y ≥ floor and rows between −1 and 1, and the rows' prices."""
    (hessian, gradient), (matrix, offset) = quadratic, rows
    y = ca.MX.sym("y", len(gradient))
    inside: Any = {
        "x": y,
        "f": 0.5 * ca.bilin(ca.DM(hessian), y, y) + ca.dot(ca.DM(gradient), y),
        "g": ca.DM(matrix) @ y + ca.DM(offset),
    }
    solver = ca.nlpsol("least_energy", "ipopt", inside, {**QUIET, **_QUADRATIC})
    solution = solver(x0=floor, lbx=floor, lbg=-1.0, ubg=1.0)
    if not solver.stats()["success"]:
        return None
    return np.array(solution["x"]).ravel(), np.array(solution["lam_g"]).ravel()


QUIET: dict[str, Any] = {
    "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "calc_lam_p": False, "no_nlp_grad": True,
}  # fmt: skip
_QUADRATIC: dict[str, Any] = {
    "ipopt.hessian_constant": "yes", "ipopt.jac_d_constant": "yes", "ipopt.tol": 1e-10,
    "ipopt.bound_relax_factor": 0.0,
}  # fmt: skip


def _lowest(hessian: Array, slope: Array, floor: float) -> float:
    """Return what ½·yᵀHy + slopeᵀy cannot go below for y ≥ floor: the dual function of the limits.

    At any point a the tangent lies below; where its slope r is not negative, it is least at the floor.
    """
    values, vectors = np.linalg.eigh(hessian)
    root = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
    # y = floor + z with z ≥ 0 is a non-negative least-squares problem in the root of H.
    target = -(vectors.T @ (slope + floor * hessian.sum(axis=1))) / root
    at = floor + scipy.optimize.nnls((vectors * root).T, target)[0]
    rest = hessian @ at + slope
    rest[np.abs(rest) < 1e-9 * np.max(np.abs(slope))] = 0.0
    if np.any(rest < 0.0):  # not an optimum: this point proves nothing
        return -float("inf")
    return float(0.5 * at @ hessian @ at + slope @ at - rest @ (at - floor))


def conflict(program: TaskProgram) -> InfeasibleError:
    """Return the error for limits that no spring keeps, with the amount by which each alone is missed."""
    rows, floor = program.limits(), program.floor
    missed = []
    for each in rows:
        count, size = each.matrix.shape
        column = np.full((count, 1), -each.largest)
        solution = scipy.optimize.linprog(
            np.append(np.zeros(size), 1.0),
            A_ub=np.vstack([np.hstack([each.matrix, column]), np.hstack([-each.matrix, column])]),
            b_ub=np.concatenate([-each.offset, each.offset]),
            bounds=[(floor, None)] * size + [(0.0, None)],
        )
        if solution.status == 0 and solution.x[-1] > 1.0 + 1e-7:
            needed = f"{solution.x[-1] * each.largest:.4g}"
            missed.append(f"{each.name} {each.largest:.4g} {each.unit} would have to be {needed}")
    named = "; ".join(missed) or "each alone can be kept, together they cannot: " + ", ".join(
        r.name for r in rows
    )
    return InfeasibleError(
        "spring for the task", f"no spring keeps the limits: {named}",
        next_step="take another motor or gear ratio, or a share of the task: task.scaled(0.5)",
    )  # fmt: skip


def least_peak_power(program: TaskProgram) -> TaskOptimum:
    """Return a spring with small peak power at the motor shaft.

    Beside the drive a spring leaves the speed alone, so that is a linear program with its bound. In series it
    is a local optimum, as the problem is not convex. Without the inertia of the motor it is convex (linear).
    From that spring, from the one of least energy and from the linear one of least peak power a sequence of
    linear programs goes down, each within a region in which the tangents of the power proved to hold; the
    best end is taken.
    """
    if not np.any(program.parts.speed.matrix):
        known, ends = program.affine(), np.full(program.freedom.shape[1], np.inf)
        (torque, offset), speed = known["torque"], known["speed"].offset
        bounds = program.floor * np.ones_like(ends), ends
        solution = _least_largest(speed[:, None] * torque, speed * offset, program.limits(), bounds)
        if not np.all(np.isfinite(solution)):
            raise conflict(program)
        return TaskOptimum(solution, float(np.max(np.abs(speed * (torque @ solution + offset)))))
    energetic = least_energy(program).unknowns
    # The spring of least peak power of a motor without inertia: a linear program.
    light = replace(program, drive=replace(program.drive, inertia=0.0, output_inertia=0.0, damping=0.0))
    rows = light.affine()
    load, (matrix, offset) = rows["torque"][1][::THIN], rows["speed"]
    bounds = np.full(len(energetic), program.floor), np.full(len(energetic), np.inf)
    solution = _least_largest(load[:, None] * matrix[::THIN], load * offset[::THIN], light.limits(), bounds)
    without_inertia = solution if np.all(np.isfinite(solution)) else energetic
    starts = [energetic, without_inertia]
    if len(energetic) > 1:
        starts += [np.full(len(energetic), each) for each in _linear_of_least_peak_power(program)]
    limits = program.limits()
    starts = [
        start
        for start in starts
        if all(np.max(np.abs(e.offset + e.matrix @ start)) <= e.largest * (1.0 + 1e-6) for e in limits)
    ]
    tried = starts + [_descended(program, start) for start in starts]
    return TaskOptimum(min(tried, key=lambda each: program.motor(each).peak_power), None)


def _linear_of_least_peak_power(program: TaskProgram) -> list[float]:
    try:
        return [float(least_peak_power(program.linear()).unknowns[0])]
    except InfeasibleError:  # no linear spring keeps the limits, so it is no start
        return []


_STEPS = 60
"""Largest number of linear programs from one start."""


def _descended(program: TaskProgram, start: Array) -> Array:
    """Return where linear programs lead from a start: nowhere is the peak power larger than before."""
    rows, limits = program.affine(), program.limits()
    (a, b), (c, d) = ((m[::2], o[::2]) for m, o in (rows["torque"], rows["speed"]))
    best, reach = start, 0.5 * float(np.max(start))
    for _ in range(_STEPS):
        torque, speed = a @ best + b, c @ best + d
        peak = float(np.max(np.abs(torque * speed)))
        slope = a * speed[:, None] + c * torque[:, None]
        inside = np.maximum(best - reach, program.floor), best + reach
        solution = _least_largest(slope, torque * speed - slope @ best, limits, inside)
        promised = peak - float(np.max(np.abs(torque * speed + slope @ (solution - best))))
        if promised <= 1e-6 * peak or reach < 1e-9 * float(np.max(start)):
            break
        gained = peak - float(np.max(np.abs((a @ solution + b) * (c @ solution + d))))
        best = solution if gained > 0.0 else best
        reach *= 2.0 if gained > 0.75 * promised else 0.5 if gained < 0.25 * promised else 1.0
    return best


def _least_largest(
    matrix: Array, offset: Array, limits: tuple[LimitRows, ...], inside: tuple[Array, Array]
) -> Array:
    """Return y with the least maximum of abs(matrix·y + offset) in limits and bounds; else their middle."""
    blocks = [(matrix, offset, -1.0, 0.0), *((e.matrix, e.offset, 0.0, e.largest) for e in limits)]
    sides = [(sign, block) for sign in (1.0, -1.0) for block in blocks]
    solution = scipy.optimize.linprog(
        np.append(np.zeros(matrix.shape[1]), 1.0),
        A_ub=np.vstack([np.column_stack([sign * m, np.full(len(o), p)]) for sign, (m, o, p, _) in sides]),
        b_ub=np.concatenate([room - sign * o for sign, (_, o, _, room) in sides]),
        bounds=[*zip(*inside, strict=True), (0.0, None)],
    )
    return np.asarray(solution.x[:-1]) if solution.status == 0 else 0.5 * (inside[0] + inside[1])
