"""Simulation of a flat model over time.

Continuous models go through CVODES (variable order, variable step, analytic Jacobian from CasADi);
discrete ones are stepped. Inputs are traces (linear between samples) or functions of time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel, Variable
from .trace import Trace

Array = NDArray[np.float64]
Drive: TypeAlias = Callable[[float], float] | Array | float

RESIDUAL_LIMIT = 1e-6
"""Largest remainder of an implicit equation, relative to the typical size of its terms."""


def simulate(
    model: FlatModel,
    times: Array,
    *,
    inputs: Mapping[str, Drive] | None = None,
    start: Mapping[str, float] | None = None,
    hold: bool = False,
    tolerance: float = 1e-9,
) -> Trace:
    """Simulate a flat model.

    Parameters
    ----------
    model
        Continuous or discrete.
    times
        Strictly ascending sample times in s, shape (n,). A discrete model needs multiples of its sample time.
    inputs
        By name: a function of time, samples of shape (n,), or a constant. Others rest at their start value.
    start
        States at the first time, by name; others at their start value.
    hold
        Whether inputs are held from one sample to the next instead of running linearly between them.
    tolerance
        Relative tolerance of the integrator; the absolute one is that times the nominal size.

    Returns
    -------
    Trace
        All states, inputs, outputs and signals at ``times``.

    Raises
    ------
    UnknownNameError
        If an input or state does not exist.
    ConvergenceError
        If the integrator stops early, or an implicit equation was not solved.
    """
    times = _checked_times(times)
    u = _input_samples(model, times, inputs or {})
    x0 = _start(model, start or {})
    if model.sample_time is not None:
        x = _stepped(model, times, u, x0)
    else:
        x = _integrated(model, times, u, x0, hold=hold, tolerance=tolerance)
    return _evaluated(model, times, x, u)


def _checked_times(times: Array) -> Array:
    grid = np.asarray(times, dtype=float)
    if grid.ndim != 1 or len(grid) < 2 or np.any(np.diff(grid) <= 0.0) or not np.all(np.isfinite(grid)):
        raise ValueRangeError("times", "must be at least two strictly ascending finite numbers in s")
    return grid


def _start(model: FlatModel, start: Mapping[str, float]) -> Array:
    names = [v.name for v in model.states]
    x = model.start(model.states)
    for name, value in start.items():
        if name not in names:
            raise unknown_name("state", name, names)
        x[names.index(name)] = value
    return x


def _input_samples(model: FlatModel, times: Array, drives: Mapping[str, Drive]) -> Array:
    names = [v.name for v in model.inputs]
    for name in drives:
        if name not in names:
            raise unknown_name("input", name, names)
    rows = [_samples(v, times, drives.get(v.name, v.start)) for v in model.inputs]
    return np.array(rows).reshape(len(names), len(times))


def _samples(variable: Variable, times: Array, drive: Drive) -> Array:
    if callable(drive):
        row = np.array([float(drive(float(t))) for t in times])
    else:
        row = np.broadcast_to(np.asarray(drive, dtype=float), times.shape).copy()
    if not np.all(np.isfinite(row)):
        raise ValueRangeError(
            f"input '{variable.name}'", f"is not finite at t = {times[~np.isfinite(row)][0]:g} s"
        )
    return row


def _integrated(
    model: FlatModel, times: Array, u: Array, x0: Array, *, hold: bool, tolerance: float
) -> Array:
    if not model.states:
        return np.zeros((0, len(times)))
    s = model.symbols()
    slope, begin = ca.SX.sym("slope", s.input.shape), ca.SX.sym("begin")
    running = s.input + slope * (s.time - begin)
    scale = ca.DM([v.nominal for v in model.states])
    scaled = ca.SX.sym("scaled", s.state.shape)
    points = ca.vertcat(s.state, s.input)
    rate = ca.substitute(s.derivative, points, ca.vertcat(scaled * scale, running)) / scale
    dae = {"x": scaled, "t": s.time, "p": s.parameter, "u": ca.vertcat(s.input, slope, begin), "ode": rate}
    options = {"reltol": tolerance, "abstol": tolerance, "max_num_steps": 200_000}
    steps = np.diff(times)
    slopes = np.zeros_like(u[:, :-1]) if hold else np.diff(u, axis=1) / steps
    driven = np.vstack([u[:, :-1], slopes, times[None, :-1]])
    try:
        solver = ca.integrator("solver", "cvodes", dae, float(times[0]), times[1:].tolist(), options)
        found = solver(x0=x0 / np.array(scale).ravel(), p=model.start(model.parameters), u=driven)["xf"]
    except RuntimeError as error:
        raise ConvergenceError(
            f"simulation of {model.name}",
            f"the integrator stopped: {str(error).strip().splitlines()[-1][:200]}",
            next_step="check the inputs for jumps beyond the range of the laws, or start nearer to rest",
        ) from error
    x: Array = np.hstack([x0[:, None], np.array(found) * np.array(scale)])
    if not np.all(np.isfinite(x)):
        raise ConvergenceError(f"simulation of {model.name}", "a state is not finite")
    return x


def _stepped(model: FlatModel, times: Array, u: Array, x0: Array) -> Array:
    samples = np.diff(times) / float(model.sample_time or 1.0)
    if np.any(np.abs(samples - 1.0) > 1e-6):
        raise ValueRangeError(
            "times", f"must lie {model.sample_time:g} s apart, the sample time of {model.name}"
        )
    p, x = model.start(model.parameters), np.zeros((len(x0), len(times)))
    x[:, 0] = x0
    for k in range(len(times) - 1):
        w = model.look_up(list(x[:, k]), list(u[:, k]))
        x[:, k + 1] = np.array(model.equations(times[k], x[:, k], u[:, k], p, w)[0]).ravel()
    return x


def _evaluated(model: FlatModel, times: Array, x: Array, u: Array) -> Trace:
    w = np.zeros((0, len(times)))
    if model.tables:
        w = np.array([model.look_up(list(x[:, k]), list(u[:, k])) for k in range(len(times))]).T
    p = np.repeat(model.start(model.parameters)[:, None], len(times), axis=1)
    _, y, s, r = model.equations.map(len(times))(times[None, :], x, u, p, w)
    _check_residuals(model, times, np.array(r))
    signals: dict[str, Array] = {}
    for group, rows in ((model.signals, s), (model.outputs, y), (model.inputs, u), (model.states, x)):
        values = np.array(rows)
        signals |= {v.name: values[i] for i, v in enumerate(group)}
    everything = model.signals + model.outputs + model.inputs + model.states
    return Trace(times, signals, {v.name: v.unit for v in everything}, model.name)


def _check_residuals(model: FlatModel, times: Array, residuals: Array) -> None:
    if residuals.size and not np.max(np.abs(residuals)) <= RESIDUAL_LIMIT:
        worst = int(np.nanargmax(np.max(np.abs(residuals), axis=0)))
        raise ConvergenceError(
            f"simulation of {model.name}",
            f"an implicit equation was not solved at t = {times[worst]:g} s",
            next_step="check for an element in series whose effort saturates",
        )
