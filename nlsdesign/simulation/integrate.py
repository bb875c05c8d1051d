"""Simulation of a flat model over time.

Continuous models are integrated explicitly, and implicitly from where they are stiff; discrete ones are
stepped. Inputs are samples (linear between them) or functions of time.

Implicit integration for stiff models: CVODES, restarted at every sample.

Source: Hindmarsh et al. 2005 (SUNDIALS), through CasADi.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel
from .buffered import Buffered, Translate, as_it_is
from .events import Event
from .input_signals import Drive, Drives, drives_of
from .runge_kutta import TooStiffError, integrate_explicitly
from .trace import Trace, range_warnings

_PLACES = (1.0 - np.cos(np.pi * np.arange(6) / 5)) / 2
_TO_COEFFICIENTS = np.linalg.inv(np.vander(_PLACES, increasing=True))
_BETWEEN = np.array([0.17, 0.58, 0.83])
MOST_HALVINGS = 12
SMALLEST_TOLERANCE = 1e-11


def _pieces(
    drives: Drives, interval: int, begin: float, end: float, tolerance: float, halvings: int = 0
) -> Iterator[tuple[float, float, Array]]:
    """Yield begin, end and coefficients (inputs, 6) of polynomials that follow the inputs."""
    length = end - begin
    values = drives.at(interval, begin + length * _PLACES)
    coefficients = (_TO_COEFFICIENTS @ values).T
    if drives.functions and halvings < MOST_HALVINGS:
        exact = drives.at(interval, begin + length * _BETWEEN)
        fitted = np.vander(_BETWEEN, 6, increasing=True) @ coefficients.T
        if np.any(np.abs(exact - fitted) > tolerance * (1.0 + np.max(np.abs(values)))):
            middle = begin + length / 2
            yield from _pieces(drives, interval, begin, middle, tolerance, halvings + 1)
            yield from _pieces(drives, interval, middle, end, tolerance, halvings + 1)
            return
    yield begin, end, coefficients


def integrate_implicitly(model: FlatModel, drives: Drives, first: int, x0: Array, tolerance: float) -> Array:
    """Return the states at the sample times from number ``first`` on, shape (states, n − first).

    ``drives``: inputs; functions of time are approximated piecewise by polynomials of degree five.
    """
    times, parameters = drives.times.tolist(), model.start(model.parameters)
    nominal = np.array([v.nominal for v in model.states])
    # Errors of CVODES grow up to a hundredfold over the steps; below the smallest tolerance it fails.
    each = max(tolerance / 100, SMALLEST_TOLERANCE)
    options = {"reltol": each, "abstol": each, "max_num_steps": 1_000_000}
    # Called for each piece: with a grid of times CasADi would step across jumps of the inputs.
    solver = ca.integrator("solver", "cvodes", _problem(model), 0.0, 1.0, options)
    states = [np.asarray(x0, dtype=float)]
    for k in range(first, len(times) - 1):
        x = states[-1]
        for begin, end, coefficients in _pieces(drives, k, times[k], times[k + 1], 10 * tolerance):
            fixed = [*parameters, *coefficients.ravel(order="F"), begin, end - begin]
            try:
                x = np.array(solver(x0=x / nominal, p=fixed)["xf"]).ravel() * nominal
            except RuntimeError as error:
                reason = str(error).strip().splitlines()[-1][:200]
                raise ConvergenceError(
                    f"simulation of {model.name}",
                    f"the integrator stopped after t = {begin:g} s: {reason}",
                    next_step="check the inputs for jumps beyond the range of the laws",
                ) from error
        states.append(x)
    return np.array(states).T


def _problem(model: FlatModel) -> dict[str, ca.SX]:
    """Return one piece in scaled states and relative time, with inputs as polynomials."""
    s = model.symbols()
    coefficients = ca.SX.sym("coefficients", s.input.shape[0], 6)
    begin, length, share = ca.SX.sym("begin"), ca.SX.sym("length"), ca.SX.sym("share")
    running = ca.mtimes(coefficients, ca.vertcat(*[share**k for k in range(6)]))
    nominal, scaled = ca.DM([v.nominal for v in model.states]), ca.SX.sym("scaled", s.state.shape)
    symbols = ca.vertcat(s.time, s.state, s.input)
    values = ca.vertcat(begin + share * length, scaled * nominal, running)
    rate = ca.substitute(s.derivative, symbols, values) * length / nominal
    fixed = ca.vertcat(s.parameter, ca.vec(coefficients), begin, length)
    return {"x": scaled, "t": share, "p": fixed, "ode": rate}


RESIDUAL_LIMIT = 1e-6
"""Largest remainder of an implicit equation, relative to its terms and to 1 Pa, N or N·m."""


def simulate(
    model: FlatModel,
    times: Array,
    *,
    inputs: Mapping[str, Drive] | None = None,
    start: Mapping[str, float] | None = None,
    hold: bool = False,
    tolerance: float = 1e-9,
    translate: Translate = as_it_is,
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
        A function is evaluated at least twelve times between two times; a shorter pulse may be missed.
    start
        States at the first time, by name; others at their start value.
    hold
        Whether inputs are held from one sample to the next instead of running linearly between them.
    tolerance
        Error allowed per step, relative to the state and to its nominal size.
    translate
        Takes the function of one explicit step and returns a faster one with the same arguments and results,
        for instance ``nlsdesign.export.natively``.

    Returns
    -------
    Trace
        All states, inputs, outputs and signals at ``times``; ``events`` lists sticking, slipping,
        impacts and slack. Of a stiff model without jumps only until the implicit method takes over.

    Raises
    ------
    UnknownNameError
        If an input or state does not exist.
    ValueRangeError
        If the times do not ascend, or an input has no finite number at one of them.
    ConvergenceError
        If the integrator stops early, or an implicit equation was not solved.
    """
    times = checked_times(times)
    drives = drives_of(model, times, inputs or {}, hold=hold)
    names, x0 = [v.name for v in model.states], model.start(model.states)
    for name, value in (start or {}).items():
        if name not in names:
            raise unknown_name("state", name, names)
        x0[names.index(name)] = value
    events: list[Event] = []
    if model.sample_time is not None:
        samples = np.diff(times) / float(model.sample_time or 1.0)
        if np.any(np.abs(samples - 1.0) > 1e-6):
            raise ValueRangeError(
                "times", f"must lie {model.sample_time:g} s apart, the sample time of {model.name}"
            )
        x = np.zeros((len(x0), len(times)))
        x[:, 0] = x0
        given = [np.zeros(model.equations.size1_in(i)) for i in range(5)]
        given[3] = model.start(model.parameters)
        step = Buffered(model.equations, given)
        rows = np.array(model.equations.sparsity_out(0).row(), dtype=np.intp)  # the others stay zero
        for k in range(len(times) - 1):
            given[0][0], given[1][:], given[2][:] = times[k], x[:, k], drives.samples[:, k]
            given[4][:] = model.look_up(list(x[:, k]), list(drives.samples[:, k]))
            step.evaluate()
            x[rows, k + 1] = step.results[0]
    else:
        x, events = _integrated(model, drives, x0, tolerance, translate)
    return replace(_evaluated(model, times, x, drives.samples), events=tuple(events))


def checked_times(times: Array) -> Array:
    """Return sample times as an array."""
    grid = np.asarray(times, dtype=float)
    if grid.ndim != 1 or len(grid) < 2 or np.any(np.diff(grid) <= 0.0) or not np.all(np.isfinite(grid)):
        raise ValueRangeError("times", "must be at least two strictly ascending finite numbers in s")
    return grid


def _integrated(
    model: FlatModel, drives: Drives, x0: Array, tolerance: float, translate: Translate
) -> tuple[Array, list[Event]]:
    if not model.states:
        return np.zeros((0, len(drives.times))), []
    try:
        x, events = integrate_explicitly(model, drives, x0, tolerance, translate)
    except TooStiffError as stiff:
        first, events = stiff.interval, stiff.events
        rest = integrate_implicitly(model, drives, first, stiff.states[:, -1], tolerance)
        x = np.hstack([stiff.states[:, :-1], rest])
    if not np.all(np.isfinite(x)):
        raise ConvergenceError(f"simulation of {model.name}", "a state is not finite")
    return x, events


def _evaluated(model: FlatModel, times: Array, x: Array, u: Array) -> Trace:
    w = np.zeros((0, len(times)))
    if model.tables:
        w = np.array([model.look_up(list(x[:, k]), list(u[:, k])) for k in range(len(times))]).T
    # With one column of parameters and many of the others CasADi maps over the columns.
    _, y, s, r = model.equations(times[None, :], x, u, model.start(model.parameters), w)
    residuals = np.array(r)
    if residuals.size and not np.max(np.abs(residuals)) <= RESIDUAL_LIMIT:
        worst = int(np.nanargmax(np.max(np.abs(residuals), axis=0)))
        raise ConvergenceError(
            f"simulation of {model.name}",
            f"an implicit equation was not solved at t = {times[worst]:g} s",
            next_step="check for an element in series whose effort saturates",
        )
    signals: dict[str, Array] = {}
    for group, rows in ((model.signals, s), (model.outputs, y), (model.inputs, u), (model.states, x)):
        values = np.array(rows)
        signals |= {v.name: values[i] for i, v in enumerate(group)}
    everything = model.signals + model.outputs + model.inputs + model.states
    warnings = range_warnings(model.signals + model.states, times, signals)
    return Trace(times, signals, {v.name: v.unit for v in everything}, model.name, warnings)
