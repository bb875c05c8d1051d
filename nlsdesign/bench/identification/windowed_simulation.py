"""Simulation of records in windows, with exact derivatives of everything with respect to where they begin.

A :class:`Wiring` says which inputs of a model a record drives, and with which signals it is compared.

Each window begins at a state of its own; a Runge–Kutta step of fourth order carries the state and its
derivatives with respect to that beginning and to the parameters from sample to sample. The derivative of the
step is that of the same arithmetic, so sums of squares and gradients agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, MeasurementError, unknown_name
from ...foundation.symbolic import Expression
from ...model import FlatModel
from ...model.structure import body_moved_by
from .equation_error.batch import ColumnFunction, PointFunction
from .equation_error.block import Drive
from .equation_error.block_noise import rate_span
from .filters import derivative
from .records.measurement import Record


@dataclass(frozen=True)
class Wiring:
    """Wires between the measured signals of records and a model."""

    # inputs: how each driven input of the model follows from a measured signal, by name of the input. Others
    # rest at their start value.
    inputs: Mapping[str, Drive]
    # outputs: signal or state of the model that predicts each measured signal, by name of the measured one
    outputs: Mapping[str, str]
    # late_by: name of a parameter of the fit that says by how many seconds a measured signal comes late, by
    # name of the measured one
    late_by: Mapping[str, str] = field(default_factory=dict)


def wired(model: FlatModel, measured: Sequence[str], late_by: Mapping[str, str] | None = None) -> Wiring:
    """Wire measured signals to the inputs and signals of a model that have their names.

    An input that is the speed of a measured motion is driven by its smoothed rate.
    """
    names = {v.name for v in model.inputs}
    known = names | {v.name for v in model.states + model.signals}
    inputs, outputs = {}, {}
    for signal in measured:
        if signal not in known:
            raise unknown_name("signal of the model", signal, known)
        if signal not in names:
            outputs[signal] = signal
            continue
        inputs[signal] = Drive(signal)
        body = body_moved_by(model.bodies, signal)
        if body and body.rate in names - set(measured):
            inputs[body.rate] = Drive(signal, 1)
    if not outputs:
        raise MeasurementError(
            "records",
            "measure inputs of the model alone, so there is nothing to compare",
            next_step=f"measure one of: {', '.join(sorted(known - names))}",
        )
    return Wiring(inputs, outputs, late_by or {})


class Shot(NamedTuple):
    """What the windows of one record predict."""

    output: Array  # shape (outputs, samples)
    # by_start: derivatives with respect to the beginning of the own window, shape (outputs, states, samples)
    by_start: Array
    by_parameter: Array  # shape (outputs, parameters, samples)
    end: Array  # state at the end of each window, shape (windows, states)
    # end_by_start, end_by_parameter: shapes (windows, states, states) and (windows, states, parameters)
    end_by_start: Array
    end_by_parameter: Array


class Windows:
    """The windows of one record, ready for evaluation."""

    def __init__(self, record: Record, model: FlatModel, wiring: Wiring, count: int) -> None:
        self.record, self.count = record, min(count, len(record.trace) - 1)
        n = len(record.trace)
        self.number = -(-(n - 1) // self.count)
        self.places = np.arange(self.number) * self.count
        inputs = np.repeat(model.start(model.inputs)[:, None], n, axis=1)
        ends = np.stack([inputs[:, :-1], inputs[:, 1:]])
        for i, variable in enumerate(model.inputs):
            if variable.name in wiring.inputs:
                drive = wiring.inputs[variable.name]
                span = rate_span([record], drive.signal) if drive.order else 0.0
                values = record.at_samples(drive.signal)
                inputs[i] = derivative(values, record.step, order=drive.order, span=span)
                ends[:, i] = inputs[i, :-1], inputs[i, 1:]
                if not drive.order:
                    ends[:, i] = record.sampling_of(drive.signal).over_steps(record.trace[drive.signal])
        # Steps behind the last sample fill up the last window; nothing is read there.
        padded = np.minimum(np.arange(self.number * self.count), n - 2)
        self.ends: Array = np.vstack([ends[0][:, padded], ends[1][:, padded]])
        self.inputs = inputs
        self.measured = np.array([record.as_computed(name) for name in wiring.outputs])
        # Motion and speed that are measured tell where a window begins.
        seen = {}
        names = [v.name for v in model.states]
        for signal, output in wiring.outputs.items():
            if output in names:
                seen[names.index(output)] = record.trace[signal]
                body = body_moved_by(model.bodies, output)
                if body and body.rate in names and body.rate not in wiring.outputs.values():
                    time_span = rate_span([record], signal)
                    rate = derivative(record.trace[signal], record.step, order=1, span=time_span)
                    seen[names.index(body.rate)] = rate
        self.seen = seen

    @classmethod
    def only(cls, whole: Windows, number: int) -> Windows:
        """Return one window of a record alone."""
        one = object.__new__(cls)
        first, behind = number * whole.count, (number + 1) * whole.count
        n = min(behind + 1, len(whole.record.trace))
        one.record, one.count, one.number = whole.record, whole.count, 1
        one.places = np.array([0])
        one.ends, one.inputs = whole.ends[:, first:behind], whole.inputs[:, first:n]
        one.measured = whole.measured[:, first:n]
        one.seen = {i: row[first:n] for i, row in whole.seen.items()}
        return one

    def measured_start(self, guess: Array) -> Array:
        """Return states at the windows' beginnings as far as they are measured, shape (windows, states).

        ``guess``: the others, shape (windows, states).
        """
        start = guess.copy()
        for i, values in self.seen.items():
            start[:, i] = values[self.places]
        return start


class Shooter:
    """A model as it is shot through windows of records.

    ``free``: names of the parameters with respect to which derivatives are taken. ``substeps``: integration
    steps from sample to sample. ``slopes``: whether derivatives are wanted; without them their arrays have no
    columns.
    """

    def __init__(
        self, model: FlatModel, free: Sequence[str], wiring: Wiring, *, substeps: int = 1, slopes: bool = True
    ) -> None:
        names = [v.name for v in model.parameters]
        for name in free:
            if name not in names:
                raise unknown_name("parameter", name, names)
        self.model, self.free, self._substeps, self._slopes = model, tuple(free), substeps, slopes
        s = model.symbols()
        place = [names.index(n) for n in free]
        rest = [i for i in range(len(names)) if i not in place]
        p = ca.vertcat(*[s.parameter[i] for i in place]) if place else ca.SX(0, 1)
        rows = ca.vertcat(
            s.derivative, ca.vertcat(*[_expression(model, s, n) for n in wiring.outputs.values()])
        )
        if rest:
            fixed = ca.vertcat(*[s.parameter[i] for i in rest])
            rows = ca.substitute(rows, fixed, ca.DM(model.start(model.parameters)[rest]))
        nx = len(model.states)
        self.size = nx
        self._rate = ca.Function("rate", [s.state, s.input, p], [ca.reshape(rows[:nx], nx, 1)])
        see = ca.Function("see", [s.state, s.input, p], [rows[nx:]])
        self._see = ColumnFunction(_observed(see, self._columns))
        self._walks: dict[tuple[int, int, float], PointFunction] = {}

    @property
    def _columns(self) -> int:
        return self.size + len(self.free) if self._slopes else 0

    def shoot(self, windows: Windows, start: Array, values: Mapping[str, float]) -> Shot:
        """Simulate all windows of a record.

        ``start``: state at the beginning of each window, shape (windows, states).
        """
        nx, columns, w, m = self.size, self._columns, windows.number, windows.count
        p = np.array([values[n] for n in self.free])
        whole = nx * (1 + columns)
        first = np.zeros((whole, w))
        first[:nx] = start.T
        if columns:
            first[nx : nx + nx * nx] = np.eye(nx).ravel(order="F")[:, None]
        walked = self._walk(m, w, windows.record.step)(first, windows.ends, p)[0]
        path = np.empty((whole, w * m + 1))
        # A window's own beginning stands where it begins; the end of the one before is kept apart.
        ends = walked[:, m - 1 :: m].copy()
        path[:, 1:] = walked
        path[:, : w * m : m] = first
        n = windows.measured.shape[1]
        if n == w * m + 1:
            path[:, -1] = walked[:, -1]
        rows = self._see(n, [path[:, :n], windows.inputs, p])
        if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(ends))):
            raise ConvergenceError(
                f"simulation of record '{windows.record.name}'",
                "is not finite",
                next_step="take more substeps, shorter windows or narrower bounds",
            )
        ny = rows.shape[0] // (1 + columns)
        slopes = rows[ny:].reshape(columns, ny, n).transpose(1, 0, 2)
        state, by = ends[:nx].T, ends[nx:].reshape(columns, nx, w).transpose(2, 1, 0)
        return Shot(rows[:ny], slopes[:, :nx], slopes[:, nx:], state, by[:, :, :nx], by[:, :, nx:])

    def _walk(self, count: int, windows: int, step: float) -> PointFunction:
        key = count, windows, step
        if key not in self._walks:
            nx, nu = self.size, len(self.model.inputs)
            one = _stepped(self._rate, (nx, nu, self._columns), step / self._substeps, self._substeps)
            all_windows = one.mapaccum("window", count).map("windows", "serial", windows, [2], [])
            self._walks[key] = PointFunction(all_windows)
        return self._walks[key]


def _expression(model: FlatModel, s: object, name: str) -> Expression:
    for group, rows in ((model.states, "state"), (model.signals, "signal"), (model.outputs, "output")):
        for i, variable in enumerate(group):
            if variable.name == name:
                return ca.SX(getattr(s, rows)[i])
    raise unknown_name("signal", name, [v.name for v in model.states + model.signals + model.outputs])


def _observed(see: ca.Function, columns: int) -> ca.Function:
    """Return outputs and their derivatives from state and its derivatives."""
    nx, np_ = see.size1_in(0), see.size1_in(2)
    whole, u, p = ca.SX.sym("whole", nx * (1 + columns)), ca.SX.sym("u", see.size1_in(1)), ca.SX.sym("p", np_)
    x, y = whole[:nx], see(whole[:nx], u, p)
    if not columns:
        return ca.Function("observed", [whole, u, p], [ca.densify(y)])
    slope = ca.jacobian(y, x) @ ca.reshape(whole[nx:], nx, columns)
    slope[:, nx:] += ca.jacobian(y, p)
    return ca.Function("observed", [whole, u, p], [ca.densify(ca.vertcat(y, ca.vec(slope)))])


def _stepped(rate: ca.Function, sizes: tuple[int, int, int], h: float, substeps: int) -> ca.Function:
    """Return state and derivatives one sample later."""
    nx, nu, columns = sizes
    part = _runge_kutta(rate, h)
    p = ca.SX.sym("p", rate.size1_in(2))
    whole, u = ca.SX.sym("whole", nx * (1 + columns)), ca.SX.sym("u", 2 * nu)
    at, by = whole[:nx], ca.reshape(whole[nx:], nx, columns)
    left, right = u[:nu], u[nu:]
    for k in range(substeps):
        corners = [left + (right - left) * (j / substeps) for j in (k, k + 1)]
        at, by_x, by_p = part(at, *corners, p)
        if columns:
            by = by_x @ by
            by[:, nx:] += by_p
    return ca.Function("step", [whole, u, p], [ca.densify(ca.vertcat(at, ca.vec(by)))])


def _runge_kutta(rate: ca.Function, h: float) -> ca.Function:
    x, p = ca.SX.sym("x", rate.size1_in(0)), ca.SX.sym("p", rate.size1_in(2))
    begin, end = ca.SX.sym("begin", rate.size1_in(1)), ca.SX.sym("end", rate.size1_in(1))
    middle = (begin + end) / 2
    k1 = rate(x, begin, p)
    k2 = rate(x + h / 2 * k1, middle, p)
    k3 = rate(x + h / 2 * k2, middle, p)
    k4 = rate(x + h * k3, end, p)
    new = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    slopes = [ca.densify(ca.jacobian(new, x)), ca.densify(ca.jacobian(new, p))]
    return ca.Function("part", [x, begin, end, p], [new, *slopes])
