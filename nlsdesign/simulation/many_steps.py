"""Explicit Runge–Kutta integration of many columns of parameters, each with its own steps and events.

The steps, their control and the events are those of :mod:`.runge_kutta`, which does the same for one column:
a step of all columns is one call, and a column in whose step a mode ends goes through that step alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError
from ..model import FlatModel
from .buffered import Translate
from .column_runs import ColumnEvaluator
from .events import Event, Modes, branch_of
from .input_signals import Drives
from .runge_kutta import (
    LARGEST_ERROR,
    NODES,
    SMALLEST_STEP,
    STAGES,
    Stepper,
    limited_by_stability,
    step_function,
)

Array = NDArray[np.float64]
Places = NDArray[np.intp]


class ManySteps:
    """Integrates all columns from sample to sample.

    Parameters
    ----------
    model
        Continuous, with at least one state.
    drives
        Inputs, the same for all columns.
    columns
        Numbers and start values that differ, by name, each of shape (columns,).
    tolerance
        Error allowed per step, relative to the state and to its nominal size.
    translate
        Makes the function of a step a faster one.
    """

    def __init__(
        self, model: FlatModel, drives: Drives, *, columns: Mapping[str, Array], tolerance: float,
        translate: Translate,
    ) -> None:  # fmt: skip
        self._model, self._drives, self._columns = model, drives, columns
        self._tolerance, self._translate = tolerance, translate
        count = len(next(iter(columns.values())))
        self.numbers = np.array([columns.get(v.name, np.full(count, v.start)) for v in model.parameters])
        self.state = np.array([columns.get(v.name, np.full(count, v.start)) for v in model.states])
        self.numbers = self.numbers.reshape(-1, count)
        self._switching = model.switching
        self._modes = np.zeros((len(self._switching.switches) if self._switching else 0, count))
        self._step = ColumnEvaluator(
            step_function(branch_of(model.switching, model.equations)), 4, translate=translate
        )
        self._moments = np.append(NODES, 0.5)
        self._proposed = np.full(count, drives.times[1] - drives.times[0])
        self._budget, self._done = np.full(count, 40 * 20.0), np.zeros(count)
        self._singles: dict[int, tuple[Stepper, Modes]] = {}
        self.failures: dict[int, str] = {}
        self.stiff: set[int] = set()

    def run(self) -> Array:
        """Return the states at the sample times, shape (states, samples, columns)."""
        times = self._drives.times
        states = np.full((len(self.state), len(times), self.state.shape[1]), np.nan)
        self._begin()
        states[:, 0] = self.state
        for k in range(len(times) - 1):
            self._advance(k)
            self._budget += 40.0
            alive = self._alive()
            states[:, k + 1, alive] = self.state[:, alive]
        return states

    def events(self, column: int) -> tuple[Event, ...]:
        """Return the events of a column.

        Parameters
        ----------
        column
            Its number.
        """
        return tuple(self._singles[column][1].log.events) if column in self._singles else ()

    def _alive(self) -> Places:
        gone = {*self.failures, *self.stiff}
        return np.array([i for i in range(self.state.shape[1]) if i not in gone], dtype=np.intp)

    def _single(self, column: int) -> tuple[Stepper, Modes]:
        """Return what takes a column through events, with its state and modes of now."""
        if column not in self._singles:
            model = self._model_of(column)
            times = self._drives.times
            modes = Modes(model, float(times[-1] - times[0]))
            stepper = Stepper(model, self._drives, self._tolerance, modes.now, self._translate)
            self._singles[column] = stepper, modes
        stepper, modes = self._singles[column]
        stepper.state[:] = self.state[:, column]
        modes.now[:] = self._modes[:, column]
        modes.held = np.flatnonzero((modes.now == 0.0) & self._holds)
        return stepper, modes

    def _model_of(self, column: int) -> FlatModel:
        return self._model.with_values({name: float(v[column]) for name, v in self._columns.items()})

    @property
    def _holds(self) -> NDArray[np.bool_]:
        return np.array(self._switching.holds if self._switching else (), dtype=bool)

    def _begin(self) -> None:
        """Set the modes that belong to the states."""
        if self._switching is None:
            return
        inputs = self._drives.at(0, self._drives.times[:1])[0]
        for column in self._alive():
            stepper, modes = self._single(int(column))
            try:
                modes.begin(float(self._drives.times[0]), stepper.state, inputs)
            except ConvergenceError as error:
                self.failures[int(column)] = str(error)
            self.state[:, column], self._modes[:, column] = stepper.state, modes.now

    def _advance(self, k: int) -> None:
        """Advance all columns from one sample to the next."""
        end, now = float(self._drives.times[k + 1]), np.full(self.state.shape[1], self._drives.times[k])
        going = self._alive()
        while len(going):
            left = end - now[going]
            # A very short last step would cost as much as a full one.
            length = np.where(left <= 1.001 * self._proposed[going], left, self._proposed[going])
            after, error, _, least, rate = self._tried(k, going, now[going], length)
            ended = (error[0] < LARGEST_ERROR) & (least[0] < 0.0)
            for place in np.flatnonzero(ended):
                column = int(going[place])
                self._through_event(k, column, now, float(length[place]))
            smooth = ~ended
            self._taken(k, going[smooth], now, (length[smooth], left[smooth]), error[0, smooth])
            good = smooth & (error[0] <= 1.0)
            self.state[:, going[good]] = after[:, good]
            self._keep(k, going[good], now, rate[:, good])
            self._done[going] += 1
            self._checked(k, going[self._done[going] > self._budget[going]])
            going = np.array([i for i in going if now[i] < end and i not in self.stiff
                              and i not in self.failures], dtype=np.intp)  # fmt: skip

    def _tried(self, k: int, going: Places, now: Array, length: Array) -> list[Array]:
        """Return what a step of each column gives."""
        pairs, which = np.unique(np.stack([now, length]), axis=1, return_inverse=True)
        moments = pairs[0][:, None] + pairs[1][:, None] * self._moments
        inputs = self._drives.at(k, moments.ravel()).reshape(len(moments), -1)[which.ravel()].T
        count = len(going)
        nominal = np.array([v.nominal for v in self._model.states])
        return self._step(
            [
                now[None], length[None], self.state[:, going], inputs, self.numbers[:, going],
                np.full((1, count), self._tolerance), np.repeat(nominal[:, None], count, axis=1),
                self._modes[:, going],
            ]
        )  # fmt: skip

    def _taken(
        self, k: int, columns: Places, now: Array, lengths: tuple[Array, Array], error: Array
    ) -> None:
        """Move the time of the columns whose step is good enough; propose the next steps."""
        length, left = lengths
        with np.errstate(all="ignore"):
            good, whole = error <= 1.0, length == left
            longer = length * np.minimum(10.0, 0.9 * np.maximum(error, 1e-30) ** -0.125)
            shorter = length * np.where(error < np.inf, np.maximum(0.2, 0.9 * error**-0.125), 0.2)
            shorter = np.where(np.isnan(shorter), 0.2 * length, shorter)
        kept = np.where(whole, np.maximum(self._proposed[columns], longer), longer)
        self._proposed[columns] = np.where(good, kept, shorter)
        end, apart = self._drives.times[k + 1], self._drives.times[k + 1] - self._drives.times[k]
        smallest = SMALLEST_STEP * np.maximum(np.abs(now[columns]), apart)
        for column in columns[~good & (shorter < smallest)].tolist():
            self.failures[column] = f"no step is short enough at t = {now[column]:g} s"
        moved = columns[good]
        now[moved] = np.where(whole[good], end, now[moved] + length[good])

    def _keep(self, k: int, columns: Places, now: Array, rate: Array) -> None:
        """Project the rates that are held, where they have drifted."""
        if not np.any(self._holds):
            return
        held = (self._modes[:, columns] == 0.0) & self._holds[:, None] & (rate != 0.0)
        for column in columns[np.any(held, axis=0)].tolist():
            stepper, modes = self._single(column)
            inputs = self._drives.at(k, np.array([now[column]]))[0]
            try:
                modes.keep(float(now[column]), stepper.state, inputs)
            except ConvergenceError as error:
                self.failures[column] = str(error)
            self.state[:, column] = stepper.state

    def _through_event(self, k: int, column: int, now: Array, length: float) -> None:
        """Take one column to the moment at which a mode ends."""
        times = self._drives.times
        apart = float(times[k + 1] - times[k])
        stepper, modes = self._single(column)
        at = float(now[column])
        left = float(times[k + 1]) - at
        try:
            stepper.step(k, at, length)
            taken = stepper.shortened(k, length, apart)
            error = float(stepper.error[0])
            if error > 1.0:
                self._taken(k, np.array([column]), now, (np.array([taken]), np.array([left])), np.array([error]))
                return
            now[column] = times[k + 1] if taken == left else at + taken
            stepper.state[:] = stepper.after
            longer = taken * min(10.0, 0.9 * max(error, 1e-30) ** -0.125)
            self._proposed[column] = max(float(self._proposed[column]), longer)
            stepper.settle(modes, float(now[column]))
        except ConvergenceError as failed:
            self.failures[column] = str(failed)
        self.state[:, column], self._modes[:, column] = stepper.state, modes.now

    def _checked(self, k: int, columns: Places) -> None:
        """Note the columns whose steps stability limits, and give the others a larger budget."""
        jumps = self._switching is not None and bool(self._switching.jumps)
        for column in columns.tolist():
            length = float(self._proposed[column])
            model = self._model_of(column)
            if not jumps and limited_by_stability(model, self._drives, k, self.state[:, column], length):
                self.stiff.add(column)
            self._budget[column] *= 2.0
