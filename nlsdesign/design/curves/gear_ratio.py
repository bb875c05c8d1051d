"""The gear ratio as one more unknown of the program for the spring of a task.

With u = n² motor torque and speed are τ = (L + u·R)/n and ω = n·S, where L is what acts at the output, R what
the rotor takes and S the speed of the output. Beside the drive L alone depends on the unknowns y, linearly;
in series R and S do, so that with w = u·y the terms L + u·R and u·S are linear in (w, u). Either way τ² = (L
+ u·R)²/u is the square of something linear over something linear, which is convex, and so is ω²; |L + u·R| ≤
τ_max·√u is a convex limit, as the root is concave, and those of current, voltage and speed are such limits.
So the least energy over y and n together has no local optimum besides the global one. Two cases are only
locally best: an inertia between gear and series spring, and the peak power of a series spring.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError
from .numbers import plain
from .task_program import QUIET, THIN, Affine, TaskProgram, conflict


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
