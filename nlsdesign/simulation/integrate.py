"""Simulation of a flat model over time.

Continuous models are integrated explicitly, and implicitly from where they are stiff; discrete ones are
stepped. Inputs are samples (linear between them) or functions of time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel
from .buffered import Buffered, Translate, as_it_is
from .events import Event
from .input_signals import Drive, Drives, drives_of
from .runge_kutta import TooStiffError, integrate_explicitly
from .stiff import integrate_implicitly
from .trace import Trace, range_warnings

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
