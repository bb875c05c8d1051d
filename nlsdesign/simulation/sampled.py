"""Steps of flat models between samples, fast enough to run a closed loop in Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel
from ..model.transform import named

Array = NDArray[np.float64]


class _Buffered:
    """A casadi function evaluated in place: no copies, no allocation."""

    def __init__(self, function: ca.Function) -> None:
        self.arguments = [np.zeros(max(1, function.nnz_in(i))) for i in range(function.n_in())]
        self.results = [np.zeros(max(1, function.nnz_out(i))) for i in range(function.n_out())]
        buffer: Any
        buffer, self._run = function.buffer()
        self._keep = buffer
        for i, argument in enumerate(self.arguments):
            buffer.set_arg(i, argument.data)
        for i, result in enumerate(self.results):
            buffer.set_res(i, result.data)

    def __call__(self) -> None:
        self._run()


class DiscreteStepper:
    """A discrete flat model with its state, stepped one sample at a time.

    Parameters
    ----------
    model
        Discrete, for instance an observer or a controller.

    Raises
    ------
    ValueRangeError
        If the model is continuous.
    """

    def __init__(self, model: FlatModel) -> None:
        if model.sample_time is None:
            raise ValueRangeError(f"model '{model.name}'", "is continuous; only a discrete model is stepped")
        s = model.symbols()
        columns = [ca.densify(s.derivative), ca.densify(s.output)]
        function = ca.Function("step", [s.state, s.input, s.parameter, s.table], columns)
        self.model, self._step = model, _Buffered(function)
        self.state, self.inputs, parameters, self._row = self._step.arguments
        self.following, self.outputs = self._step.results
        self.state[: len(model.states)] = model.start(model.states)
        self.inputs[: len(model.inputs)] = model.start(model.inputs)
        parameters[: len(model.parameters)] = model.start(model.parameters)
        names = [v.name for v in model.states], [v.name for v in model.inputs]
        self._lookups = []
        for table in model.tables:
            of_state = table.argument in names[0]
            place = names[0 if of_state else 1].index(table.argument)
            self._lookups.append((table, self.state if of_state else self.inputs, place))

    def evaluate(self) -> None:
        """Compute outputs and following state from the present state and inputs, without moving on."""
        start = 0
        for table, source, place in self._lookups:
            columns = table.look_up(float(source[place]))
            self._row[start : start + len(columns)] = columns
            start += len(columns)
        self._step()

    def advance(self) -> None:
        """Make the following state the present one."""
        self.state[:] = self.following


class PlantStepper:
    """A continuous flat model with its state, integrated over one sample by fixed Runge–Kutta steps.

    Classical fourth order. Inputs run linearly from ``begin`` to ``end``; equal values hold them.

    Parameters
    ----------
    model
        Continuous.
    sample_time
        In s.
    substeps
        Steps per sample. The product of the fastest eigenvalue and the step should stay below about 0.3.
    seen
        Names of variables that are wanted at the samples.

    Raises
    ------
    ValueRangeError
        If the model is discrete.
    UnknownNameError
        If a name is no variable of the plant.
    """

    def __init__(self, model: FlatModel, sample_time: float, substeps: int, seen: Sequence[str]) -> None:
        if model.sample_time is not None:
            raise ValueRangeError(f"model '{model.name}'", "is discrete; the plant must be continuous")
        s = model.symbols()
        known = named(model, s)
        for name in seen:
            if name not in known:
                raise unknown_name("variable of the plant", name, known)
        fixed = model.start(model.parameters)
        rate = ca.Function("rate", [s.time, s.state, s.input, s.parameter], [s.derivative])
        self._read = _Buffered(
            ca.Function(
                "read", [s.time, s.state, s.input], [_folded([known[n] for n in seen], s.parameter, fixed)]
            )
        )
        step = sample_time / substeps
        t, x, u, slope = (
            ca.SX.sym("t"),
            ca.SX.sym("x", s.state.shape),
            ca.SX.sym("u", s.input.shape),
            ca.SX.sym("slope", s.input.shape),
        )
        k1 = rate(t, x, u, fixed)
        k2 = rate(t + step / 2, x + step / 2 * k1, u + step / 2 * slope, fixed)
        k3 = rate(t + step / 2, x + step / 2 * k2, u + step / 2 * slope, fixed)
        k4 = rate(t + step, x + step * k3, u + step * slope, fixed)
        after = ca.densify(x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        self._step = _Buffered(ca.Function("runge_kutta", [t, x, u, slope], [after]))
        self.model, self._length, self._substeps, self._sample = model, step, substeps, sample_time
        self.state = model.start(model.states)
        self.begin, self.end = model.start(model.inputs), model.start(model.inputs)

    def read(self, time: float) -> Array:
        """Return the wanted variables at the present state and the inputs ``begin``.

        Parameters
        ----------
        time
            In s.
        """
        clock, state, inputs = self._read.arguments
        clock[0], state[: len(self.state)], inputs[: len(self.begin)] = time, self.state, self.begin
        self._read()
        return self._read.results[0]

    def advance(self, time: float) -> None:
        """Integrate over one sample.

        Parameters
        ----------
        time
            At the beginning of the sample in s.

        Raises
        ------
        ConvergenceError
            If a state is not finite at the end.
        """
        clock, x, u, slope = self._step.arguments
        count = len(self.begin)
        x[: len(self.state)], slope[:count] = self.state, (self.end - self.begin) / self._sample
        for i in range(self._substeps):
            clock[0] = time + i * self._length
            u[:count] = self.begin + slope[:count] * (i * self._length)
            self._step()
            x[:] = self._step.results[0]
        self.state = x[: len(self.state)].copy()
        if not np.all(np.isfinite(self.state)):
            raise ConvergenceError(
                f"plant {self.model.name} at t = {time:g} s", "a state is not finite",
                next_step="use more substeps per sample, or check the gains of the loop",
            )  # fmt: skip


def _folded(items: Sequence[ca.SX], parameter: ca.SX, values: Array) -> ca.SX:
    """Return a dense column with the parameters replaced by their values."""
    column = ca.densify(ca.vertcat(*items)) if items else ca.SX(0, 1)
    return ca.densify(ca.substitute(column, parameter, ca.SX(ca.DM(values))))
