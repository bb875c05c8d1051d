"""Fast evaluation of a function over many samples, without conversion of arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....model.graph import read_graph
from ....simulation.numpy_columns import ON_COLUMNS

_CHUNK = 250
_COLUMNS = 4096
"""Columns that are computed at once: what an instruction works on then lies in the cache."""


class ColumnFunction:
    """A function over columns of arrays, each column by itself.

    CasADi would go through all instructions for one column after the other; here each instruction is done for
    many columns at once, which is several times as fast.

    ``function``: SX function with one dense output.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function, self._rows = function, function.numel_out(0)
        self._results: list[tuple[int, int]] = []
        self._constants: list[float] = []
        self._inputs: list[tuple[int, int, int]] = []
        self._operations: list[tuple[int, Callable[..., Any], tuple[int, ...]]] = []

    def _read(self) -> None:
        """Read the instructions, which costs more than many a function is ever asked for."""
        graph = read_graph(self._function)
        # A place is taken again after the last use of what stands there; inputs and constants keep theirs.
        places: dict[int, int] = {}
        for number, (operation, operands, extra) in enumerate(graph.steps):
            if not operands:
                places[number] = len(self._constants)
                if operation == ca.OP_INPUT:
                    self._inputs.append((places[number], *extra))
                self._constants.append(0.0 if operation == ca.OP_INPUT else float(extra))
        kept, free, many = set(places.values()), [], len(self._constants)
        for number, (operation, operands, _) in enumerate(graph.steps):
            if operands:
                into = tuple(places[i] for i in operands)
                free += [places[i] for i in graph.last_uses[number] if places[i] not in kept]
                if free:
                    places[number] = free.pop()
                else:
                    places[number], many = many, many + 1
                self._operations.append((places[number], ON_COLUMNS[operation], into))
        self._constants += [0.0] * (many - len(self._constants))
        self._results += [(row, places[number]) for (_, row), number in graph.results.items()]

    def __call__(self, count: int, arrays: Sequence[Array]) -> Array:
        """Return the outputs, shape (rows, count).

        ``arrays``: one for each input, shape (rows, count); a column, shape (rows,), is the same for all.
        """
        if not self._results:
            self._read()
        result = np.zeros((self._rows, count))
        pieces = max(1, -(-count // _COLUMNS))
        ends = [count * k // pieces for k in range(pieces + 1)]
        with np.errstate(all="ignore"):
            for begin, end in pairwise(ends):
                part = [array if array.ndim == 1 else array[:, begin:end] for array in arrays]
                self._compute(part, result[:, begin:end])
        return result

    def _compute(self, arrays: Sequence[Array], result: Array) -> None:
        values: list[Any] = self._constants.copy()
        for place, argument, row in self._inputs:
            values[place] = arrays[argument][row]
        for place, operation, operands in self._operations:
            values[place] = operation(*[values[i] for i in operands])
        for row, place in self._results:
            result[row] = values[place]


class ChainFunction:
    """A function over columns of arrays in a chain of steps: its first input is what the step before gave.

    CasADi converts NumPy arrays number by number, which takes ten times as long as the arithmetic here; its
    buffers read and write them in place.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._buffer, self._trigger = function.mapaccum("chain", _CHUNK, {"base": -1}).buffer()

    def __call__(self, count: int, arrays: Sequence[Array]) -> Array:
        """Return the outputs, shape (rows, count).

        ``arrays``: the start, shape (rows,), and one for each further input, shape (rows, count); a column,
        shape (rows,), is the same for all.
        """
        f = self._function
        result = np.zeros((-(-count // _CHUNK) * _CHUNK, f.size1_out(0)))
        # Columns lie one behind the other in CasADi, as rows do in NumPy; the last chunk is filled up.
        given = [np.array(arrays[0], dtype=float)]
        given += [np.zeros((_CHUNK, f.size1_in(i))) for i in range(1, f.n_in())]
        for rows, array in zip(given[1:], arrays[1:], strict=True):
            if array.ndim == 1:
                rows[:] = array
        for i, rows in enumerate(given):
            if rows.size:
                self._buffer.set_arg(i, memoryview(rows))  # type: ignore[arg-type, call-arg]
        for begin in range(0, count, _CHUNK):
            size = min(_CHUNK, count - begin)
            for rows, array in zip(given[1:], arrays[1:], strict=True):
                if array.ndim == 2:
                    rows[:size] = array[:, begin : begin + size].T
                    rows[size:] = rows[size - 1]
            chunk = result[begin : begin + _CHUNK]
            self._buffer.set_res(0, memoryview(chunk))  # type: ignore[arg-type, call-arg]
            self._trigger()
            given[0][:] = chunk[-1]
        columns: Array = result[:count].T
        return columns


class PointFunction:
    """A function at one point at a time.

    ``function``: with dense inputs: columns are given in shape (rows,), matrices in shape (rows, columns).
    """

    def __init__(self, function: ca.Function) -> None:
        self._buffer, self._trigger = function.buffer()
        # Columns lie one behind the other in CasADi, as rows do in NumPy.
        self._given: list[Array] = [
            np.zeros((function.size2_in(i), function.size1_in(i))) for i in range(function.n_in())
        ]
        self._results: list[Array] = [
            np.zeros((function.size2_out(i), function.size1_out(i))) for i in range(function.n_out())
        ]
        for i, array in enumerate(self._given):
            if array.size:
                self._buffer.set_arg(i, memoryview(array))  # type: ignore[arg-type, call-arg]
        for i, result in enumerate(self._results):
            if result.size:
                self._buffer.set_res(i, memoryview(result))  # type: ignore[arg-type, call-arg]

    def __call__(self, *arrays: Array | float) -> list[Array]:
        """Return all outputs, shape (rows, columns) each."""
        for given, array in zip(self._given, arrays, strict=True):
            given[:] = np.asarray(array).T
        self._trigger()
        return [result.T.copy() for result in self._results]
