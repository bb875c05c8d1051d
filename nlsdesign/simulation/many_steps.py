"""Explicit Runge–Kutta integration of many columns of parameters, each with its own steps and events.

The steps, their control and the events are those of :mod:`.runge_kutta`, which does the same for one column:
a step of all columns is one call, and a column in whose step a mode ends goes through that step alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ..foundation.arrays import Array, Indices
from ..foundation.errors import ConvergenceError
from ..model import FlatModel
from .buffered import Translate
from .column_runs import ColumnEvaluator
from .events import Event, EventLog, Modes, branch_of
from .input_signals import Drives
from .runge_kutta import (
    LARGEST_ERROR,
    SMALLEST_STEP,
    Stepper,
    limited_by_stability,
    nodes,
    step_function,
)


class _OneColumn:
    """Takes one column after the other through its events."""

    def __init__(self, model: FlatModel, drives: Drives, tolerance: float, translate: Translate) -> None:
        self._given = model, drives, tolerance, translate
        self.logs: dict[int, EventLog] = {}

    @cached_property
    def _made(self) -> tuple[Stepper, Modes]:
        model, drives, tolerance, translate = self._given
        modes = Modes(model, _span(drives))
        return Stepper(model, drives, tolerance, modes.now, translate), modes

    def at(self, column: int, numbers: Array, state: Array, modes: Array) -> tuple[Stepper, Modes]:
        """Return what steps a column and changes its modes, set to where it stands."""
        model, drives, *_ = self._given
        stepper, own = self._made
        assert model.switching is not None
        if column not in self.logs:
            self.logs[column] = EventLog(model.name, model.switching.switches, _span(drives))
        own.log = self.logs[column]
        stepper.numbers[:] = own.numbers[:] = numbers[:, column]
        stepper.state[:] = state[:, column]
        own.now[:] = modes[:, column]
        own.held = np.flatnonzero((own.now == 0.0) & np.array(model.switching.holds))
        return stepper, own


def _span(drives: Drives) -> float:
    return float(drives.times[-1] - drives.times[0])


def _inputs(drives: Drives, intervals: Indices, moments: Array) -> Array:
    """Return the inputs at moments in intervals between samples, shape (steps, moments, inputs)."""
    since = moments - drives.times[intervals][:, None]
    inputs = since[:, :, None] * drives.slopes.T[intervals][:, None] + drives.samples.T[intervals][:, None]
    if drives.functions:
        numbers = [number for _, number in drives.functions]
        inputs[:, :, numbers] = drives.at(0, moments.ravel()).reshape(inputs.shape)[:, :, numbers]
    return inputs


class ManySteps:
    """Integrates all columns from sample to sample.

    ``model``: continuous, with at least one state. ``drives``: inputs, the same for all columns. ``columns``:
    numbers and start values that differ, by name, each of shape (columns,). ``tolerance``: error allowed per
    step, relative to the state and to its nominal size. ``translate``: makes the function of a step a faster
    one.
    """

    def __init__(
        self, model: FlatModel, drives: Drives, *, columns: Mapping[str, Array], tolerance: float,
        translate: Translate,
    ) -> None:  # fmt: skip
        self._model, self._drives, self._columns = model, drives, columns
        self._tolerance = tolerance
        count = len(next(iter(columns.values())))
        self.numbers = np.array([columns.get(v.name, np.full(count, v.start)) for v in model.parameters])
        self.state = np.array([columns.get(v.name, np.full(count, v.start)) for v in model.states])
        self.numbers = self.numbers.reshape(-1, count)
        self._switching = model.switching
        self._modes = np.zeros((len(self._switching.switches) if self._switching else 0, count))
        self._step = ColumnEvaluator(
            step_function(branch_of(model.switching, model.equations)), 4, translate=translate
        )
        self._moments = nodes()
        self._nominal = np.array([[v.nominal] for v in model.states])
        self._proposed = np.full(count, drives.times[1] - drives.times[0])
        self._budget, self._done = np.full(count, 40 * 20.0), np.zeros(count)
        self._alone = _OneColumn(model, drives, tolerance, translate)
        self._holds = np.array(model.switching.holds if model.switching else (), dtype=bool)
        self._gone = np.zeros(count, dtype=bool)
        self._now, self._interval = np.full(count, drives.times[0]), np.zeros(count, dtype=np.intp)
        self.failures: dict[int, str] = {}
        self.stiff: set[int] = set()

    def run(self) -> Array:
        """Return the states at the sample times, (states, samples, columns); not a number where lost."""
        last = len(self._drives.times) - 1
        states = np.full((len(self.state), last + 1, self.state.shape[1]), np.nan)
        self._begin()
        states[:, 0] = self.state
        going = np.flatnonzero(~self._gone)
        while len(going):
            self._advance(going)
            ends = self._drives.times[self._interval[going] + 1]
            there = going[(self._now[going] == ends) & ~self._gone[going]]
            self._interval[there] += 1
            states[:, self._interval[there], there] = self.state[:, there]
            self._budget[there] += 40.0
            going = going[(self._interval[going] < last) & ~self._gone[going]]
        return states

    def events(self, column: int) -> tuple[Event, ...]:
        """Return the events of a column."""
        return tuple(self._alone.logs[column].events) if column in self._alone.logs else ()

    def _fail(self, column: int, reason: str) -> None:
        self.failures[column] = reason
        self._gone[column] = True

    def _begin(self) -> None:
        """Set the modes that belong to the states."""
        if self._switching is None:
            return
        inputs = self._drives.at(0, self._drives.times[:1])[0]
        for column in range(self.state.shape[1]):
            stepper, modes = self._alone.at(column, self.numbers, self.state, self._modes)
            try:
                modes.begin(float(self._drives.times[0]), stepper.state, inputs)
            except ConvergenceError as error:
                self._fail(column, str(error))
            self.state[:, column], self._modes[:, column] = stepper.state, modes.now

    def _advance(self, going: Indices) -> None:
        """Try one step of each column."""
        left = self._drives.times[self._interval[going] + 1] - self._now[going]
        # A very short last step would cost as much as a full one.
        length = np.where(left <= 1.001 * self._proposed[going], left, self._proposed[going])
        # What a step of each column gives.
        # Most columns stand at the same time, and a function of time need not be asked twice.
        steps = np.stack([self._now[going], length, self._interval[going]])
        steps, which = np.unique(steps, axis=1, return_inverse=True)
        moments = steps[0][:, None] + steps[1][:, None] * self._moments
        inputs = _inputs(self._drives, steps[2].astype(np.intp), moments)[which.ravel()]
        count = len(going)
        after, error, _, least, rate = self._step(
            [
                self._now[None, going],
                length[None],
                self.state[:, going],
                inputs.reshape(count, -1).T,
                self.numbers[:, going],
                np.full((1, count), self._tolerance),
                np.repeat(self._nominal, count, axis=1),
                self._modes[:, going],
            ]
        )
        ended = (error[0] < LARGEST_ERROR) & (least[0] < 0.0)
        self._done[going] += 1
        for place in np.flatnonzero(ended):
            self._through_event(int(going[place]), float(length[place]))
        good = ~ended & (error[0] <= 1.0)
        self.state[:, going[good]] = after[:, good]
        self._move(going[~ended], (length[~ended], left[~ended]), error[0, ~ended])
        self._keep(going[good], rate[:, good])
        columns = going[self._done[going] > self._budget[going]]
        jumps = self._switching is not None and bool(self._switching.jumps)
        for column in columns[~self._gone[columns]].tolist():
            proposed, k = float(self._proposed[column]), int(self._interval[column])
            values = {name: float(each[column]) for name, each in self._columns.items()}
            model, state = self._model.with_values(values), self.state[:, column]
            if not jumps and limited_by_stability(model, self._drives, k, state, proposed):
                self.stiff.add(column)
                self._gone[column] = True
            self._budget[column] *= 2.0

    def _move(self, columns: Indices, lengths: tuple[Array, Array], error: Array) -> None:
        """Move the time of the columns whose step is good enough; propose the next steps."""
        length, left = lengths
        with np.errstate(all="ignore"):
            good, whole = error <= 1.0, length == left
            longer = length * np.minimum(10.0, 0.9 * np.maximum(error, 1e-30) ** -0.125)
            shorter = length * np.where(error < np.inf, np.maximum(0.2, 0.9 * error**-0.125), 0.2)
        kept = np.where(whole, np.maximum(self._proposed[columns], longer), longer)
        self._proposed[columns] = np.where(good, kept, shorter)
        times, k = self._drives.times, self._interval[columns]
        smallest = SMALLEST_STEP * np.maximum(np.abs(self._now[columns]), times[k + 1] - times[k])
        for column in columns[~good & (shorter < smallest)].tolist():
            self._fail(column, f"no step is short enough at t = {self._now[column]:g} s")
        moved = columns[good]
        self._now[moved] = np.where(whole[good], times[k[good] + 1], self._now[moved] + length[good])

    def _keep(self, columns: Indices, rate: Array) -> None:
        """Project the rates that are held, where they have drifted."""
        if not np.any(self._holds):
            return
        held = (self._modes[:, columns] == 0.0) & self._holds[:, None] & (rate != 0.0)
        for column in columns[np.any(held, axis=0)].tolist():
            stepper, modes = self._alone.at(column, self.numbers, self.state, self._modes)
            now, k = float(self._now[column]), int(self._interval[column])
            inputs = _inputs(self._drives, np.array([k]), np.array([[now]]))[0, 0]
            try:
                modes.keep(now, stepper.state, inputs)
            except ConvergenceError as error:
                self._fail(column, str(error))
            self.state[:, column] = stepper.state

    def _through_event(self, column: int, length: float) -> None:
        """Take one column to the moment at which a mode ends."""
        times, k, at = self._drives.times, int(self._interval[column]), float(self._now[column])
        left = float(times[k + 1]) - at
        stepper, modes = self._alone.at(column, self.numbers, self.state, self._modes)
        try:
            stepper.step(k, at, length)
            taken = stepper.shortened(k, length, float(times[k + 1] - times[k]))
            error = float(stepper.error[0])
            if error > 1.0:
                self._move(np.array([column]), (np.array([taken]), np.array([left])), np.array([error]))
                return
            self._now[column] = times[k + 1] if taken == left else at + taken
            stepper.state[:] = stepper.after
            longer = taken * min(10.0, 0.9 * max(error, 1e-30) ** -0.125)
            self._proposed[column] = max(float(self._proposed[column]), longer)
            stepper.settle(modes, float(self._now[column]))
        except ConvergenceError as failed:
            self._fail(column, str(failed))
        self.state[:, column], self._modes[:, column] = stepper.state, modes.now
