"""Fast evaluation of a function over many samples, without conversion of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....model.graph import fold, read_graph
from ....simulation.numpy_columns import ON_COLUMNS

_CHUNK = 250
_COLUMNS = 4096
"""Columns that are computed at once: what an instruction works on then lies in the cache."""


def _on_columns(operation: int, operands: Sequence[Any]) -> Any:
    return ON_COLUMNS[operation](*operands)


class ColumnFunction:
    """A function over columns of arrays, each column by itself.

    CasADi would go through all instructions for one column after the other; here each instruction is done for
    many columns at once, which is several times as fast.

    Parameters
    ----------
    function
        SX function with one dense output.
    """

    def __init__(self, function: ca.Function) -> None:
        self._rows, self._graph = function.numel_out(0), read_graph(function)

    def __call__(self, count: int, arrays: Sequence[Array]) -> Array:
        """Return the outputs, shape (rows, count).

        ``arrays``: one for each input, shape (rows, count); a column, shape (rows,), is the same for all.
        """
        result = np.zeros((self._rows, count))
        pieces = max(1, -(-count // _COLUMNS))
        ends = [count * k // pieces for k in range(pieces + 1)]
        with np.errstate(all="ignore"):
            for begin, end in pairwise(ends):
                part = [array if array.ndim == 1 else array[:, begin:end] for array in arrays]
                self._compute(part, result[:, begin:end])
        return result

    def _compute(self, arrays: Sequence[Array], result: Array) -> None:
        values = fold(self._graph, lambda argument, row: arrays[argument][row], float, combined=_on_columns)
        for (_, row), value in values.items():
            result[row] = value


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

    Parameters
    ----------
    function
        With dense inputs: columns are given in shape (rows,), matrices in shape (rows, columns).
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
