"""A graph of elementary operations evaluated with NumPy, many columns in one call of each operation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from threading import Lock
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from ..foundation.arrays import Array, Mask
from ..model import Table
from .column_graph import CONDITIONS, Call, ColumnGraph, Operation, TableReading

_Task: TypeAlias = tuple[Callable[..., Any], tuple[Any, ...]]

AT_ONCE = 1024
"""Columns that are computed together, so that what is computed stays in the fast memory of the processor."""

_SIZES = 8
"""Numbers of columns for which arrays are kept."""

_FUNCTIONS: Mapping[int, Callable[..., Any]] = {
    ca.OP_ADD: np.add, ca.OP_SUB: np.subtract, ca.OP_MUL: np.multiply, ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative, ca.OP_SQRT: np.sqrt, ca.OP_EXP: np.exp, ca.OP_LOG: np.log,
    ca.OP_POW: np.power, ca.OP_CONSTPOW: np.power, ca.OP_LOG1P: np.log1p, ca.OP_EXPM1: np.expm1,
    ca.OP_HYPOT: np.hypot, ca.OP_SIN: np.sin, ca.OP_COS: np.cos, ca.OP_TAN: np.tan,
    ca.OP_ASIN: np.arcsin, ca.OP_ACOS: np.arccos, ca.OP_ATAN: np.arctan, ca.OP_ATAN2: np.arctan2,
    ca.OP_SINH: np.sinh, ca.OP_COSH: np.cosh, ca.OP_TANH: np.tanh, ca.OP_ASINH: np.arcsinh,
    ca.OP_ACOSH: np.arccosh, ca.OP_ATANH: np.arctanh, ca.OP_ERF: lambda *of: scipy.special.erf(*of),
    ca.OP_ERFINV: lambda *of: scipy.special.erfinv(*of), ca.OP_FLOOR: np.floor, ca.OP_CEIL: np.ceil,
    ca.OP_FMOD: np.fmod, ca.OP_FABS: np.abs, ca.OP_SIGN: np.sign, ca.OP_COPYSIGN: np.copysign,
    ca.OP_FMIN: np.fmin, ca.OP_FMAX: np.fmax, ca.OP_LT: np.less, ca.OP_LE: np.less_equal, ca.OP_EQ: np.equal,
    ca.OP_NE: np.not_equal, ca.OP_NOT: np.logical_not, ca.OP_AND: np.logical_and, ca.OP_OR: np.logical_or,
}  # fmt: skip
"""What an operation of CasADi is in NumPy; a last argument may be the array for the result."""


def _as_number(condition: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *operands: condition(*operands).astype(float)


ON_COLUMNS: Mapping[int, Callable[..., Any]] = {
    **_FUNCTIONS,
    # Truth is a number in CasADi, and sums of truths are counts.
    **{operation: _as_number(_FUNCTIONS[operation]) for operation in CONDITIONS},
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_LIFT: lambda a, b: a,
    ca.OP_SQ: lambda a: np.multiply(a, a),
    ca.OP_TWICE: lambda a: np.add(a, a),
    ca.OP_INV: lambda a: np.divide(1.0, a),
    ca.OP_REMAINDER: lambda a, b: a - b * np.rint(a / b),
    ca.OP_IF_ELSE_ZERO: lambda a, b: np.where(a, b, 0.0),
}
"""The same as functions of numbers or arrays that return new ones."""

_LOGICAL = frozenset([ca.OP_NOT, ca.OP_AND, ca.OP_OR])


class NumpyColumns:
    """Runs samples of many columns.

    ``graph``: (state, what is given, parameters) -> (state after the sample, what is kept), parameters fixed.
    """

    def __init__(self, graph: ColumnGraph) -> None:
        self._graph = graph
        self._made: dict[int, _Columns] = {}
        # The arrays are those of one call at a time.
        self._lock = Lock()

    def __call__(self, state: Array, given: Array, parameter: Array) -> tuple[Array, Array]:
        """Return the states after the last sample, (states, columns), and what is kept, (T, kept, columns).

        ``state``: shape (states, columns). ``given``: shape (T, given, columns). ``parameter``: shape
        (parameters, columns).
        """
        with self._lock:
            count = state.shape[1]
            after, kept = np.empty_like(state), np.empty((len(given), len(self._graph.results[1]), count))
            for first in range(0, count, AT_ONCE):
                part = slice(first, min(first + AT_ONCE, count))
                size = part.stop - part.start
                if size not in self._made:
                    if len(self._made) >= _SIZES:
                        self._made.clear()
                    self._made[size] = _Columns(self._graph, size)
                columns = self._made[size]
                with np.errstate(all="ignore"):
                    columns.begin(state[:, part], parameter[:, part])
                    for k in range(len(given)):
                        kept[k, :, part] = columns.sample(given[k, :, part])
                after[:, part] = columns.state
            return after, kept


class _Columns:
    """The samples of a graph for a number of columns, in fixed arrays."""

    def __init__(self, graph: ColumnGraph, size: int) -> None:
        state, given, parameter = graph.arguments
        top = _Program(graph, size, [*state, *given, *parameter])
        self._bodies = [
            _Program(graph.bodies[body], size, _arguments(graph.bodies[body])) for body, _ in graph.onces
        ]
        for step in graph.steps:
            if isinstance(step, Operation):
                top.add(step)
            elif isinstance(step, TableReading):
                top.read(step, graph.tables[step.table])
            else:
                top.call(step, self._bodies[step.once])
        for (_, operands), program in zip(graph.onces, self._bodies, strict=True):
            body = program.graph
            for step in body.steps:
                program.add(step)  # type: ignore[arg-type]
            fixed = [k for k in _arguments(body) if k in body.fixed]
            for own, value in zip(fixed, operands, strict=True):
                top.once.append((np.copyto, (program.values[own], top.values[value])))
            top.once.append((_perform, (program.once,)))
        self._top = top
        self._state, self._given, self._parameter = (
            [top.values[k] for k in group] for group in (state, given, parameter)
        )
        self._after, self._kept = ([top.values[k] for k in group] for group in graph.results)
        self.state = np.zeros((len(state), size))

    def begin(self, state: Array, parameter: Array) -> None:
        """Take states and parameters; compute what is fixed."""
        self.state[:] = state
        for place, value in zip(self._parameter, parameter, strict=True):
            place[:] = value
        _perform(self._top.once)

    def sample(self, given: Array) -> Array:
        """Advance by one sample; return what is kept, shape (kept, columns)."""
        for place, value in zip((*self._state, *self._given), (*self.state, *given), strict=True):
            place[:] = value
        _perform(self._top.tasks)
        self.state = np.array(self._after).reshape(self.state.shape)
        return np.array(self._kept)


class _Program:
    """Tasks on fixed arrays, one for each value of a graph."""

    def __init__(self, graph: ColumnGraph, size: int, given: Sequence[int]) -> None:
        self.graph, self._size = graph, size
        self.values: dict[int, Array] = {k: np.zeros(size) for k in given}
        self.values |= {k: np.full(size, value) for k, value in graph.constants.items()}
        self._truths: dict[int, Mask] = {}
        self.once: list[_Task] = []
        self.tasks: list[_Task] = []
        self._numbers = {k for step in graph.steps for k in _as_numbers(step)}
        self._numbers |= {k for result in graph.results for k in result}
        self._last = {k: i for i, step in enumerate(graph.steps) for k in step.operands}
        self._kept = {*given, *graph.constants, *graph.fixed} | {k for r in graph.results for k in r}
        self._free: list[Array] = []
        self._done = 0

    def _new(self, number: int) -> Array:
        # What is fixed is computed once, so no other value may have been in its array before.
        reused = self._free and number not in self.graph.fixed
        self.values[number] = self._free.pop() if reused else np.zeros(self._size)
        return self.values[number]

    def _release(self, operands: Sequence[int]) -> None:
        """Give the arrays of values that nothing needs any more to others."""
        for k in set(operands):
            if self._last[k] == self._done and k not in self._kept and k in self.values:
                self._free.append(self.values[k])
        self._done += 1

    def add(self, step: Operation) -> None:
        """Add an operation."""
        tasks = self.once if step.result in self.graph.fixed else self.tasks
        a, *others = (self._value(k, step.code) for k in step.operands)
        if step.result in self.graph.conditions:
            truth = self._truths[step.result] = np.zeros(self._size, dtype=bool)
            tasks.append((_FUNCTIONS[step.code], (a, *others, truth)))
            if step.result in self._numbers:
                tasks.append((np.copyto, (self._new(step.result), truth)))
        elif step.code == ca.OP_IF_ELSE_ZERO:
            if a.dtype != bool:
                truth = np.zeros(self._size, dtype=bool)
                tasks.append((np.not_equal, (a, 0.0, truth)))
                a = truth
            tasks.append((_selected, (a, *others, self._new(step.result))))
        elif step.code in (ca.OP_SQ, ca.OP_TWICE):
            tasks.append((np.multiply if step.code == ca.OP_SQ else np.add, (a, a, self._new(step.result))))
        elif step.code == ca.OP_INV:
            tasks.append((np.divide, (1.0, a, self._new(step.result))))
        else:
            tasks.append((_FUNCTIONS[step.code], (a, *others, self._new(step.result))))
        self._release(step.operands)

    def read(self, step: TableReading, table: Table) -> None:
        """Add the reading of a table."""
        results = [self._new(k) for k in step.results]
        self.tasks.append((_read, (table, self.values[step.at], results)))
        self._release(step.operands)

    def call(self, step: Call, body: _Program) -> None:
        """Add the call of another program."""
        own = _arguments(body.graph)
        for k, value in zip(own, step.operands, strict=True):
            if k not in body.graph.fixed:
                self.tasks.append((np.copyto, (body.values[k], self.values[value])))
        self.tasks.append((_perform, (body.tasks,)))
        results = [self._new(k) for k in step.results]
        self.tasks.append((_results, (body, results)))
        self._release(step.operands)

    def _value(self, number: int, code: int) -> NDArray[Any]:
        if number in self._truths and (code in _LOGICAL or code == ca.OP_IF_ELSE_ZERO):
            return self._truths[number]
        return self.values[number]


def _as_numbers(step: Operation | TableReading | Call) -> Sequence[int]:
    """Return the values that a step needs as numbers, not as truths."""
    if isinstance(step, Operation) and step.code in _LOGICAL:
        return ()
    if isinstance(step, Operation) and step.code == ca.OP_IF_ELSE_ZERO:
        return step.operands[1:]
    return step.operands


def _arguments(graph: ColumnGraph) -> list[int]:
    return [k for argument in graph.arguments for k in argument]


def _perform(tasks: Sequence[_Task]) -> None:
    for function, arguments in tasks:
        function(*arguments)


def _results(body: _Program, places: Sequence[Array]) -> None:
    numbers = (k for result in body.graph.results for k in result)
    for place, number in zip(places, numbers, strict=True):
        place[:] = body.values[number]


def _selected(truth: Mask, value: Array, result: Array) -> None:
    result.fill(0.0)
    np.copyto(result, value, where=truth)


def _read(table: Table, at: Array, results: Sequence[Array]) -> None:
    """Read a table as CasADi does: linear, in the span that holds the place."""
    grid, values = table.grid, table.values.reshape(len(table.grid), -1)
    last = len(grid) - 2
    if table.breakpoints is None:
        place = (at - grid[0]) * (len(grid) - 1) / (grid[-1] - grid[0])
        low = np.clip(np.nan_to_num(place, nan=0.0), 0, last).astype(np.intp)
    else:
        low = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, last)
    share = (at - grid[low]) / (grid[low + 1] - grid[low])
    for k, result in enumerate(results):
        result[:] = (1.0 - share) * values[low, k] + share * values[low + 1, k]
