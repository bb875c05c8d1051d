"""How much torque the drive can move how fast: inverse dynamics on a sine of the angle.

The angle is prescribed, not the torque: a cam without stiffness at zero angle would have to jump through
zero for a torque that is a sine, at any amplitude. With the angle a sine the motion is smooth, and the
largest torque of the cycle is what is shown. The inner states of the spring follow by the implicit midpoint
rule over two cycles, of which the second counts; the current follows from the balance of the driven body,
which is linear in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ArrangementError
from ....model.roles import measured_motion, series_spring
from ....model.transform import named
from ...analysis.rest import rate_state, rest_states
from ..loop.closed_loop import ClosedLoop

Array = NDArray[np.float64]

_STEPS = 160
_ANGLES = 40
_NEWTON = 3


@dataclass(frozen=True, eq=False)
class SaturationLine:
    """Largest torque of a sine of the angle over frequency.

    Parameters
    ----------
    frequency
        In Hz, shape (n,).
    torque
        Largest torque of the cycle in N·m, shape (n,); not a number where even the smallest motion that was
        looked at takes more than the limit.
    angle
        Amplitude of the spring's angle in rad, shape (n,).
    limited_by
        ``"current"``, ``"speed"`` or ``"angle"`` (the end of the range that was looked at), for each
        frequency.
    """

    frequency: Array
    torque: Array
    angle: Array
    limited_by: tuple[str, ...]


def saturation_line(
    loop: ClosedLoop,
    frequencies: Sequence[float] | Array,
    *,
    largest_angle: float = math.radians(50.0),
    speed_limit: float = math.inf,
) -> SaturationLine:
    """Return the largest torque at each frequency that the limits of current and speed allow.

    Parameters
    ----------
    loop
        Load fixed, or held by its inputs at zero.
    frequencies
        In Hz, shape (n,).
    largest_angle
        Of the spring, in rad: the end of the cam.
    speed_limit
        Of the driven body, in rad/s.

    Raises
    ------
    ArrangementError
        If more than one body moves freely.
    """
    plant = loop.plant
    if sum(not body.prescribed for body in plant.bodies) != 1:
        raise ArrangementError(
            f"plant '{plant.name}'", "needs one body that moves freely for its inverse dynamics",
            next_step="hold the load, as a Fixed or Driven body",
        )  # fmt: skip
    at = np.asarray(frequencies, dtype=float)
    angles = np.geomspace(0.02, 1.0, _ANGLES) * largest_angle
    f, size = (grid.ravel() for grid in np.meshgrid(at, angles, indexing="ij"))
    torque, current = _inverse(loop, f, size)
    shape = (len(at), len(angles))
    peak, needed = torque.reshape(shape), current.reshape(shape)
    speed = (2.0 * math.pi * f * size).reshape(shape)
    limit = loop.controller.outputs[0].maximum
    use = np.maximum(needed / limit, speed / speed_limit)
    lines = [_first(use[i], peak[i], angles) for i in range(len(at))]
    words = []
    for i, (_, _, end) in enumerate(lines):
        by_current = end < _ANGLES and needed[i, end] / limit >= speed[i, end] / speed_limit
        words.append("angle" if end == _ANGLES else "current" if by_current else "speed")
    return SaturationLine(
        at, np.array([t for t, _, _ in lines]), np.array([a for _, a, _ in lines]), tuple(words)
    )


def _first(use: Array, torque: Array, angles: Array) -> tuple[float, float, int]:
    """Return torque and angle at which the limits are reached first, and the number of the angle beyond."""
    over = np.flatnonzero(use > 1.0)
    if not len(over):
        return float(torque[-1]), float(angles[-1]), _ANGLES
    end = int(over[0])
    if end == 0:
        return math.nan, math.nan, 0
    share = (1.0 - use[end - 1]) / (use[end] - use[end - 1])
    result = [float((1.0 - share) * v[end - 1] + share * v[end]) for v in (torque, angles)]
    return result[0], result[1], end


def _inverse(loop: ClosedLoop, frequency: Array, size: Array) -> tuple[Array, Array]:
    """Return the largest torque and current of the second cycle of each sine of the angle."""
    plant = loop.plant
    motion = measured_motion(plant)
    rate = rate_state(plant, motion)
    names = [v.name for v in plant.states]
    inner = [i for i, name in enumerate(names) if name not in (motion, rate)]
    follow, balance = _functions(loop, (motion, rate), inner)
    state = np.tile(rest_states(plant, np.zeros(1)), (len(size), 1))
    u, p = plant.start(plant.inputs), plant.start(plant.parameters)
    omega = 2.0 * math.pi * frequency
    fixed = [np.tile(column[:, None], (1, len(size))) for column in (u, p)]
    steps, balances = (f.map(len(size)) for f in (follow, balance))
    zero = np.zeros((1, len(size)))
    largest = np.zeros((2, len(size)))
    place, of = names.index(motion), names.index(rate)
    for k in range(2 * _STEPS):
        middle, end = (2.0 * math.pi * (k + share) / _STEPS for share in (0.5, 1.0))
        state[:, place], state[:, of] = size * np.sin(middle), size * omega * np.cos(middle)
        if inner:
            step = 2.0 * math.pi / (omega * _STEPS)
            state[:, inner] = steps(zero, np.column_stack([state, step]).T, *fixed).full().T
        state[:, place], state[:, of] = size * np.sin(end), size * omega * np.cos(end)
        if k >= _STEPS:
            torque, free, slope = (r.full()[0] for r in balances(zero, state.T, *fixed))
            current = (-size * omega**2 * np.sin(end) - free) / slope
            largest = np.maximum(largest, np.abs([torque, current]))
    return largest[0], largest[1]


def _functions(
    loop: ClosedLoop, motion: tuple[str, str], inner: list[int]
) -> tuple[ca.Function, ca.Function]:
    plant = loop.plant
    s = plant.symbols()
    names = [v.name for v in plant.states]
    step = ca.SX.sym("step")
    begin = ca.vertcat(*[s.state[i] for i in inner]) if inner else ca.SX(0, 1)
    rates = ca.vertcat(*[s.derivative[i] for i in inner]) if inner else ca.SX(0, 1)
    z = ca.SX.sym("z", len(inner))
    residual = z - begin - step * ca.substitute(rates, begin, (begin + z) / 2)
    newton = ca.Function("newton", [z, s.state, step, s.input, s.parameter, s.time],
                         [z - ca.solve(ca.jacobian(residual, z), residual)] if inner else [z])  # fmt: skip
    result = begin
    for _ in range(_NEWTON):
        result = newton(result, s.state, step, s.input, s.parameter, s.time)
    follow = ca.Function(
        "follow", [s.time, ca.vertcat(s.state, step), s.input, s.parameter], [ca.densify(result)]
    )
    place = [v.name for v in plant.inputs].index(loop.names.current)
    acceleration = s.derivative[names.index(motion[1])]
    free = ca.substitute(acceleration, s.input[place], 0.0)
    slope = (ca.substitute(acceleration, s.input[place], 1e-3) - free) / 1e-3
    torque = named(plant, s)[series_spring(plant).effort]
    arguments = [s.time, s.state, s.input, s.parameter]
    balance = ca.Function("balance", arguments, [ca.densify(e) for e in (torque, free, slope)])
    return follow, balance
