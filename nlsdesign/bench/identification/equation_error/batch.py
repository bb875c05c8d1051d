"""Fast evaluation of a function over many samples, without conversion of arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import scipy.special

from ....foundation.arrays import Array

_CHUNK = 250
_COLUMNS = 4096
"""Columns that are computed at once: what an instruction works on then lies in the cache."""

_OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_LIFT: lambda a, b: a,
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_EXP: np.exp,
    ca.OP_LOG: np.log,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_SQRT: np.sqrt,
    ca.OP_SQ: np.square,
    ca.OP_TWICE: lambda a: np.add(a, a),
    ca.OP_INV: lambda a: np.divide(1.0, a),
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_ATAN: np.arctan,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_SINH: np.sinh,
    ca.OP_COSH: np.cosh,
    ca.OP_TANH: np.tanh,
    ca.OP_ASINH: np.arcsinh,
    ca.OP_ACOSH: np.arccosh,
    ca.OP_ATANH: np.arctanh,
    ca.OP_LOG1P: np.log1p,
    ca.OP_EXPM1: np.expm1,
    ca.OP_HYPOT: np.hypot,
    ca.OP_ERF: scipy.special.erf,
    ca.OP_ERFINV: scipy.special.erfinv,
    ca.OP_FLOOR: np.floor,
    ca.OP_CEIL: np.ceil,
    ca.OP_FMOD: np.fmod,
    ca.OP_REMAINDER: lambda a, b: a - b * np.rint(a / b),
    ca.OP_FABS: np.abs,
    ca.OP_SIGN: np.sign,
    ca.OP_COPYSIGN: np.copysign,
    ca.OP_FMIN: np.fmin,
    ca.OP_FMAX: np.fmax,
    # Truth is a number in CasADi, and sums of truths are counts.
    ca.OP_LT: lambda a, b: np.less(a, b) * 1.0,
    ca.OP_LE: lambda a, b: np.less_equal(a, b) * 1.0,
    ca.OP_EQ: lambda a, b: np.equal(a, b) * 1.0,
    ca.OP_NE: lambda a, b: np.not_equal(a, b) * 1.0,
    ca.OP_NOT: lambda a: np.equal(a, 0.0) * 1.0,
    ca.OP_AND: lambda a, b: np.logical_and(a, b) * 1.0,
    ca.OP_OR: lambda a, b: np.logical_or(a, b) * 1.0,
    ca.OP_IF_ELSE_ZERO: lambda a, b: np.where(a, b, 0.0),
}
"""The elementary operations of CasADi on arrays, by number."""


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
        self._rows, self._size = function.size1_out(0) * function.size2_out(0), function.sz_w()
        self._inputs: list[tuple[int, int]] = []
        self._constants: list[float] = []
        self._program: list[tuple[Callable[..., Any] | None, int, list[int]]] = []
        self._prepare(function)

    def _prepare(self, function: ca.Function) -> None:
        """Read the instructions; inputs and constants get places of their own, before and behind CasADi's."""
        place: dict[int, int] = {}
        for k in range(function.n_instructions()):
            operation, read = function.instruction_id(k), function.instruction_input(k)
            written = function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                self._program.append((None, written[1], [place[read[0]]]))
            elif operation == ca.OP_INPUT:
                self._inputs.append((read[0], read[1]))
                place[written[0]] = -len(self._inputs)
            elif operation == ca.OP_CONST:
                self._constants.append(float(function.instruction_constant(k)))
                place[written[0]] = self._size + len(self._constants) - 1
            else:
                self._program.append((_OPERATIONS[operation], written[0], [place[i] for i in read]))
                place[written[0]] = written[0]

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
        given = [arrays[i][row] for i, row in reversed(self._inputs)]
        value: list[Any] = [*[None] * self._size, *self._constants, *given]
        for operation, place, read in self._program:
            if operation is None:
                result[place] = value[read[0]]
            elif len(read) == 2:
                value[place] = operation(value[read[0]], value[read[1]])
            else:
                value[place] = operation(value[read[0]])


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
        With dense columns as inputs.
    """

    def __init__(self, function: ca.Function) -> None:
        self._buffer, self._trigger = function.buffer()
        self._given: list[Array] = [np.zeros(function.size1_in(i)) for i in range(function.n_in())]
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
            given[:] = array
        self._trigger()
        return [result.T.copy() for result in self._results]
