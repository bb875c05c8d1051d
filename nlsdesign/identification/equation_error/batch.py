"""Fast evaluation of a function over many samples, without conversion of arrays."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CHUNK = 250


class Batch:
    """A function over columns of arrays: each column by itself, or a chain of steps.

    CasADi converts NumPy arrays number by number, which takes ten times as long as the arithmetic here; its
    buffers read and write them in place.

    Parameters
    ----------
    function
        With one dense output.
    chained
        Whether the first input is what the call before gave out.
    """

    def __init__(self, function: ca.Function, *, chained: bool = False) -> None:
        self._function, self._chained = function, chained
        whole = function.mapaccum("chain", _CHUNK, {"base": -1}) if chained else function.map(_CHUNK)
        self._buffer, self._trigger = whole.buffer()

    def __call__(self, count: int, arrays: Sequence[Array]) -> Array:
        """Return the outputs, shape (rows, count).

        Parameters
        ----------
        count
            Number of columns or steps.
        arrays
            One for each input, shape (rows, count); a column, shape (rows,), is the same for all. For a chain
            the first is the start.
        """
        f = self._function
        result = np.zeros((-(-count // _CHUNK) * _CHUNK, f.size1_out(0)))
        # Columns lie one behind the other in CasADi, as rows do in NumPy; the last chunk is filled up.
        given = [np.zeros((_CHUNK, f.size1_in(i))) for i in range(f.n_in())]
        for i, array in enumerate(arrays):
            if array.ndim == 1:
                given[i][:] = array
        if self._chained:
            given[0] = np.array(arrays[0], dtype=float)
        for i, rows in enumerate(given):
            if rows.size:
                self._buffer.set_arg(i, memoryview(rows))  # type: ignore[arg-type, call-arg]
        for begin in range(0, count, _CHUNK):
            size = min(_CHUNK, count - begin)
            for i, array in enumerate(arrays):
                if array.ndim == 2:
                    given[i][:size] = array[:, begin : begin + size].T
                    given[i][size:] = given[i][size - 1]
            chunk = result[begin : begin + _CHUNK]
            self._buffer.set_res(0, memoryview(chunk))  # type: ignore[arg-type, call-arg]
            self._trigger()
            if self._chained:
                given[0][:] = chunk[-1]
        columns: Array = result[:count].T
        return columns
