"""Many runs of one sampled system at once: a continuous plant and discrete blocks that are wired by name.

Time runs in samples. At t_k the plant is read, the blocks are evaluated in their order with what was read,
and the plant is integrated to t_{k+1} with the driven input held. What the last block computes at t_k acts
from t_{k+delay} on. A block that is told the driven input, as an observer is, gets the value that really acts
in the coming sample. The whole sample is one function of states, inputs and parameters, so that all runs are
computed together, parameters as columns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ..foundation.arrays import Array, Mask
from ..foundation.errors import ValueRangeError, unknown_name
from .buffered import Translate, as_it_is
from .column_runs import CHUNK, column_run
from .sample_writer import PLANT, SampledSystem, SampleWriter

Course = Callable[[float], float] | float | Array
"""An input: a function of time, a constant, or values at the samples, shape (T,) or (runs, T)."""

__all__ = ["PLANT", "BatchTrace", "SampledSystem", "run_batch"]


COLUMNS = 4096
"""Runs that one call computes, so that what it needs beside the results does not grow with their number."""


@dataclass(frozen=True, eq=False)
class BatchTrace:
    """What many runs gave at the samples.

    Parameters
    ----------
    time
        In s, shape (T,).
    signals
        By full name, shape (runs, T).
    final
        All states after the last sample, shape (runs, states).
    finite
        Whether all states of a run stayed finite, shape (runs,). Where not, its signals are not a number from
        there on.
    """

    time: Array
    signals: Mapping[str, Array]
    final: Array
    finite: Mask

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (runs, T)."""
        if name not in self.signals:
            raise unknown_name("signal of the batch", name, self.signals)
        return self.signals[name]


def run_batch(
    system: SampledSystem,
    stop: float,
    *,
    inputs: Mapping[str, Course],
    parameters: Mapping[str, Array | float] | None = None,
    start: Mapping[str, Array | float] | None = None,
    keep: Sequence[str],
    translate: Translate = as_it_is,
) -> BatchTrace:
    """Simulate many runs from zero.

    The number of runs is that of the longest array among parameters, start values and inputs; what has one
    value is the same for all.

    Parameters
    ----------
    system
        What is simulated.
    stop
        Last time in s.
    inputs
        Open inputs by full name. Those of blocks are held from sample to sample, those of the plant run
        linearly. What is left out stays at its start value.
    parameters
        Parameters by full name, ``plant.NAME`` or ``BLOCK.NAME``, numbers or shape (runs,).
    start
        Start values of states by full name, numbers or shape (runs,).
    keep
        Full names of variables that are kept: of the plant any, of blocks inputs, outputs and states.
    translate
        For instance :data:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    UnknownNameError
        If an input, parameter, state or variable does not exist.
    ValueRangeError
        If arrays have different numbers of runs.
    """
    step = system.sample_time
    count = round(stop / step) + 1
    time: Array = step * np.arange(count + 1.0)
    courses = _courses(system, inputs, time)
    values = _rows(system.parameters, _defaults(system, "parameters"), parameters or {}, "parameter")
    begin = _rows(system.states, _defaults(system, "states"), start or {}, "state of the loop")
    runs = _number_of_runs([*(c.shape[0] for c in courses), values.shape[0], begin.shape[0]])
    state = np.broadcast_to(begin, (runs, begin.shape[1])).T.copy()
    values = np.broadcast_to(values, (runs, values.shape[1])).T.copy()
    state = _begun(system, courses, state, values, set(start or {}))
    run = column_run(system, keep, translate=translate, runs=runs)
    kept = np.empty((runs, len(keep), count))
    for begun in range(0, runs, COLUMNS):
        part = slice(begun, min(begun + COLUMNS, runs))
        own = [course[part] if len(course) > 1 else course for course in courses]
        for first in range(0, count, CHUNK):
            last = min(first + CHUNK, count)
            given = _given(system, own, time, (first, last), part.stop - part.start)
            state[:, part], shown = run(state[:, part], given, values[:, part])
            kept[part, :, first:last] = shown.transpose(2, 1, 0)
    finite = np.all(np.isfinite(state), axis=0)
    signals = {name: np.ascontiguousarray(kept[:, i]) for i, name in enumerate(keep)}
    return BatchTrace(time[:-1], signals, state.T.copy(), finite)


def _given(
    system: SampledSystem, courses: Sequence[Array], time: Array, span: tuple[int, int], runs: int
) -> Array:
    """Return time, inputs, and inputs of the plant one sample later, shape (T, given, runs)."""
    first, last = span
    ramped = sum(name.startswith(f"{PLANT}.") for name in system.open_inputs)
    given = np.empty((last - first, 1 + len(courses) + ramped, runs))
    given[:, 0] = time[first:last, None]
    for i, course in enumerate(courses):
        given[:, 1 + i] = course[:, first:last].T
    for i, course in enumerate(courses[:ramped]):
        given[:, 1 + len(courses) + i] = course[:, first + 1 : last + 1].T
    return given


def _begun(
    system: SampledSystem, courses: Sequence[Array], state: Array, values: Array, given: set[str]
) -> Array:
    """Return the states, those of blocks from their first readings where none was given, (states, runs)."""
    begins = tuple(
        name
        for name, block in system.blocks.items()
        if block.begin is not None and not any(f"{name}.{v.name}" in given for v in block.states)
    )
    if not begins:
        return state
    runs = state.shape[1]
    ramped = sum(name.startswith(f"{PLANT}.") for name in system.open_inputs)
    rows = [np.zeros(runs), *(np.broadcast_to(course[:, 0], runs) for course in courses)]
    rows += [np.zeros(runs)] * ramped
    result: Array = _begin(system, begins).map(runs)(state, np.array(rows), values).full()
    return result


@lru_cache(maxsize=16)
def _begin(system: SampledSystem, begins: tuple[str, ...]) -> ca.Function:
    return SampleWriter(system).begun(begins)


def _defaults(system: SampledSystem, group: str) -> list[float]:
    values = [v.start for model in system.owners.values() for v in getattr(model, group)]
    if group == "states" and system.driven is not None:
        values += [system.plant.variable(system.driven).start] * system.delay
    return values


def _rows(
    names: Sequence[str], defaults: Sequence[float], given: Mapping[str, Array | float], kind: str
) -> Array:
    """Return the default values with those given in their places, shape (runs or 1, names)."""
    for name in given:
        if name not in names:
            raise unknown_name(kind, name, names)
    runs = _number_of_runs([np.size(value) for value in given.values()])
    rows = np.tile(np.array(defaults, dtype=float), (runs, 1))
    places = {name: i for i, name in enumerate(names)}
    for name, value in given.items():
        rows[:, places[name]] = value
    return rows


def _courses(system: SampledSystem, inputs: Mapping[str, Course], time: Array) -> list[Array]:
    """Return each open input at the samples and one sample beyond, shape (runs or 1, T + 1)."""
    for name in inputs:
        if name not in system.open_inputs:
            raise unknown_name("input of the loop", name, system.open_inputs)
    courses = []
    for name in system.open_inputs:
        owner, _, own = name.partition(".")
        course = inputs.get(name, system.owners[owner].variable(own).start)
        if callable(course):
            values = np.array([course(t) for t in time])
        else:
            values = np.asarray(course, dtype=float)
            if values.ndim == 0:
                values = np.full(len(time), float(values))
        values = np.atleast_2d(values)
        if values.shape[1] == len(time) - 1:
            # What comes after the last sample acts on nothing that is shown.
            values = np.concatenate([values, values[:, -1:]], axis=1)
        if values.shape[1] != len(time):
            raise ValueRangeError(
                f"input '{name}' with {values.shape[1]} values", f"the run has {len(time) - 1} samples"
            )
        courses.append(values)
    return courses


def _number_of_runs(sizes: Sequence[int]) -> int:
    several = sorted({size for size in sizes if size != 1})
    if len(several) > 1:
        raise ValueRangeError(f"arrays of {several} values", "all runs of a batch need as many values")
    return several[0] if several else 1
