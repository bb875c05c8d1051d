"""The convex program for the spring of a task: unknown is the compliance over the torque.

Motor torque, current, voltage and speed are affine in the compliance, so Joule heat and the work of the
damping are convex quadratic and the limits linear: a convex quadratic program, whose optimum is global and
proved by its dual. The peak power is a product of two affine functions and not convex.
Source: Bolívar et al. 2018.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import linprog, nnls

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError
from .compliance import ComplianceSpline
from .motor_and_gear import MotorAndGear, MotorCycle, driven_cycle, motion_through
from .numbers import plain
from .task import TaskCycle

_THIN = 4
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


@dataclass(frozen=True, eq=False)
class TaskProgram:
    """A task, a drive and a spring with unknown compliances y ≥ floor."""

    # cycle, drive: what is asked for and what drives
    cycle: TaskCycle
    drive: MotorAndGear
    spline: ComplianceSpline  # compliance over torque
    # freedom, offset: coefficients of the spline are offset + freedom·y
    freedom: Array
    offset: Array
    floor: float  # smallest compliance in rad/(N·m)
    # largest_deflection, largest_speed: in rad, and of the motor in rad/s; infinite for none
    largest_deflection: float
    largest_speed: float

    def linear(self) -> TaskProgram:
        """Return the program of a linear spring: one unknown, its compliance."""
        return replace(self, freedom=self.freedom @ np.ones((self.freedom.shape[1], 1)))

    def coefficients(self, unknowns: Array) -> Array:
        """Return the coefficients of the spline."""
        return self.offset + self.freedom @ unknowns

    def motor(self, unknowns: Array) -> MotorCycle:
        """Return what the motor does with this spring."""
        deflection, slope, bend = (
            each @ self.coefficients(unknowns) for each in self.spline.matrices(self.cycle.torque)
        )
        return driven_cycle(self.cycle, self.drive, deflection, motion_through(self.cycle, slope, bend))

    def affine(self) -> dict[str, tuple[Array, Array]]:
        """Return matrix and offset of deflection, motor speed and motor torque, as affine in y."""
        cycle, drive = self.cycle, self.drive
        deflection, slope, bend = self.spline.matrices(cycle.torque)
        ratio, damping = plain(drive.gear_ratio), plain(drive.damping)
        speed = ratio * slope * cycle.torque_rate[:, None]
        inertial = slope * cycle.torque_acceleration[:, None] + bend * cycle.torque_rate[:, None] ** 2
        torque = drive.reflected_inertia / ratio * inertial + damping * speed
        rigid_speed = ratio * cycle.speed
        rigid_torque = (cycle.torque + drive.reflected_inertia * cycle.acceleration) / ratio
        rows = {
            "deflection": (deflection, np.zeros_like(cycle.time)),
            "speed": (speed, rigid_speed),
            "torque": (torque, rigid_torque + damping * rigid_speed),
        }
        return {
            name: (matrix @ self.freedom, matrix @ self.offset + offset)
            for name, (matrix, offset) in rows.items()
        }

    def limits(self) -> tuple[LimitRows, ...]:
        """Return the limits that are stated."""
        rows, drive = {name: (m[::_THIN], o[::_THIN]) for name, (m, o) in self.affine().items()}, self.drive
        constant = plain(drive.torque_constant)
        (a, b), (c, d) = rows["torque"], rows["speed"]
        current = a / constant, b / constant
        resistance = plain(drive.resistance)
        voltage = resistance * current[0] + constant * c, resistance * current[1] + constant * d
        deflection = rows["deflection"]
        stated = (
            LimitRows("motor current", "A", current[0], current[1], plain(drive.current_limit)),
            LimitRows("motor voltage", "V", voltage[0], voltage[1], plain(drive.voltage_limit)),
            LimitRows("motor speed", "rad/s", c, d, self.largest_speed),
            LimitRows("deflection", "rad", deflection[0], deflection[1], self.largest_deflection),
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
    solver = ca.nlpsol("least_energy", "ipopt", inside, {**_QUIET, **_QUADRATIC})
    solution = solver(x0=floor, lbx=floor, lbg=-1.0, ubg=1.0)
    if not solver.stats()["success"]:
        return None
    return np.array(solution["x"]).ravel(), np.array(solution["lam_g"]).ravel()


_QUIET: dict[str, Any] = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
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
    at = floor + nnls((vectors * root).T, -(vectors.T @ (slope + floor * hessian.sum(axis=1))) / root)[0]
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
        solution = linprog(
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
    """Return a spring with small peak power at the motor shaft; a local optimum, the problem is not convex.

    Without the inertia of the motor it is convex (linear). From that spring, from the one of least energy and
    from the linear one of least peak power a sequence of linear programs goes down, each within a region in
    which the tangents of the power proved to hold; the best end is taken.
    """
    energetic = least_energy(program).unknowns
    # The spring of least peak power of a motor without inertia: a linear program.
    light = replace(program, drive=replace(program.drive, inertia=0.0, output_inertia=0.0, damping=0.0))
    rows = light.affine()
    torque, (matrix, offset) = rows["torque"][1][::_THIN], rows["speed"]
    bounds = np.full(len(energetic), program.floor), np.full(len(energetic), np.inf)
    solution = _least_largest(
        torque[:, None] * matrix[::_THIN], torque * offset[::_THIN], light.limits(), bounds
    )
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
    solution = linprog(
        np.append(np.zeros(matrix.shape[1]), 1.0),
        A_ub=np.vstack([np.column_stack([sign * m, np.full(len(o), p)]) for sign, (m, o, p, _) in sides]),
        b_ub=np.concatenate([room - sign * o for sign, (_, o, _, room) in sides]),
        bounds=[*zip(*inside, strict=True), (0.0, None)],
    )
    return np.asarray(solution.x[:-1]) if solution.status == 0 else 0.5 * (inside[0] + inside[1])
