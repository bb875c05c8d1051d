"""What runs the samples of many columns: compiled code, NumPy, or CasADi one column after the other.

All compute the same operations in the same order. Compiled code and CasADi take their elementary functions
from one C library and give the same bits; NumPy has its own, whose last digit may differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Protocol, runtime_checkable

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..model import Table
from .buffered import Translate, as_it_is
from .column_graph import ColumnGraph, NotByColumnsError, column_graph
from .numpy_columns import NumpyColumns
from .sample_writer import SampledSystem, SampleWriter

CHUNK = 250
"""Samples that one call computes; between calls a run can be interrupted."""
MANY = 200
"""Columns from which on NumPy is quicker than CasADi."""


ColumnRun = Callable[[Array, Array, Array], tuple[Array, Array]]
"""Runs samples of many columns.

Takes states (states, columns), what is given (T, given, columns) and parameters (parameters, columns).
Returns the states after the last sample, (states, columns), and what is kept, (T, kept, columns).
"""


@runtime_checkable
class ByColumns(Protocol):
    """A translation that also computes many columns together."""

    def __call__(self, function: ca.Function) -> ca.Function:
        """Return a faster function with the same arguments and results."""
        ...

    def columns(self, graph: ColumnGraph) -> ColumnRun:
        """Return what runs a graph of one sample."""
        ...


def column_run(system: SampledSystem, keep: Sequence[str], *, translate: Translate, runs: int) -> ColumnRun:
    """Return what runs the samples of a system.

    ``translate``: one that computes by columns is asked for that; the unchanged function is evaluated with
    NumPy where there are many runs.
    """
    return _column_run(system, tuple(keep), translate, runs >= MANY)


@lru_cache(maxsize=16)
def _column_run(system: SampledSystem, keep: tuple[str, ...], translate: Translate, many: bool) -> ColumnRun:
    writer = SampleWriter(system)
    sample = writer.function(keep)
    together = _together(sample, writer.tables, translate, many)
    return together or _OneByOne(translate(_chunk(sample)))


def _together(
    sample: ca.Function, tables: Mapping[str, Table], translate: Translate, many: bool
) -> ColumnRun | None:
    """Return what computes many columns together, or None where that is not to be had or not worth it."""
    columns: Callable[[ColumnGraph], ColumnRun]
    if isinstance(translate, ByColumns):
        columns = translate.columns
    elif translate is as_it_is and many:
        columns = NumpyColumns
    else:
        return None
    try:
        return columns(column_graph(sample, fixed=[2], tables=tables))
    except NotByColumnsError:
        return None  # the same numbers, one column after the other


class ColumnEvaluator:
    """A function of matrices, evaluated for many columns of arguments.

    ``fixed``: number of the argument that holds the parameters.
    """

    def __init__(self, function: ca.Function, fixed: int, *, translate: Translate) -> None:
        self._function, self._fixed, self._translate = function, fixed, translate
        self._sizes = [function.numel_out(i) for i in range(function.n_out())]
        self._runs: dict[bool, ColumnRun | None] = {}

    def __call__(self, arguments: Sequence[Array]) -> list[Array]:
        """Return the results, each of shape (numbers, columns).

        ``arguments``: each of shape (numbers, columns); matrices column by column.
        """
        count = arguments[0].shape[1]
        many = count >= MANY
        if many not in self._runs:
            self._runs[many] = _together(self._flat(), {}, self._translate, many)
        run = self._runs[many]
        if run is None:
            return self._one_by_one(arguments, count)
        size = count
        if isinstance(run, NumpyColumns):  # it keeps arrays for every number of columns that it has seen
            size = min(1 << (count - 1).bit_length(), -(-count // 1024) * 1024)
        given = [_widened(each, size) for each in arguments]
        numbers = given.pop(self._fixed)
        _, kept = run(np.zeros((0, size)), np.concatenate(given)[None], numbers)
        return np.split(kept[0, :, :count], np.cumsum(self._sizes)[:-1])

    def _flat(self) -> ca.Function:
        """Return (nothing, all arguments but the parameters, parameters) -> (nothing, all results)."""
        function = self._function
        sizes = [function.numel_in(i) for i in range(function.n_in())]
        given = ca.MX.sym("given", sum(sizes) - sizes[self._fixed])
        numbers, parts, first = ca.MX.sym("parameter", sizes[self._fixed]), [], 0
        for i, size in enumerate(sizes):
            if i == self._fixed:
                parts.append(numbers)
                continue
            parts.append(ca.reshape(given[first : first + size], *function.size_in(i)))
            first += size
        results = ca.vertcat(*[ca.vec(each) for each in function.call(parts)])
        return ca.Function("flat", [ca.MX.sym("nothing", 0, 1), given, numbers], [ca.MX(0, 1), results])

    def _one_by_one(self, arguments: Sequence[Array], count: int) -> list[Array]:
        function = self._function
        wide = [
            each.reshape(*function.size_in(i)[::-1], count, order="C").transpose(1, 2, 0)
            .reshape(function.size1_in(i), -1) if function.size2_in(i) > 1 else each
            for i, each in enumerate(arguments)
        ]  # fmt: skip
        results = function.map(count).call(wide)
        return [
            np.array(each, dtype=float).reshape(size, count)
            for each, size in zip(results, self._sizes, strict=True)
        ]


def _widened(values: Array, size: int) -> Array:
    """Return the columns, the last one repeated until there are so many."""
    if values.shape[1] == size:
        return values
    return np.concatenate([values, np.repeat(values[:, -1:], size - values.shape[1], axis=1)], axis=1)


def _chunk(one: ca.Function) -> ca.Function:
    """Return (state, inputs of all samples, parameters) -> (states after each sample, what is kept)."""
    state, parameter = ca.MX.sym("state", one.size1_in(0)), ca.MX.sym("parameter", one.size1_in(2))
    given = ca.MX.sym("given", one.size1_in(1), CHUNK)
    many = one.mapaccum("samples", CHUNK, {"base": 10})
    return ca.Function(
        "chunk", [state, given, parameter], many.call([state, given, ca.repmat(parameter, 1, CHUNK)])
    )


class _OneByOne:
    """A function of a whole chunk of samples, evaluated column by column."""

    def __init__(self, chunk: ca.Function) -> None:
        self._chunk = chunk

    def __call__(self, state: Array, given: Array, parameter: Array) -> tuple[Array, Array]:
        length, rows, runs = given.shape
        many = self._chunk.map(runs) if runs > 1 else self._chunk
        kept = np.empty((length, self._chunk.size1_out(1), runs))
        for first in range(0, length, CHUNK):
            part = given[first : first + CHUNK]
            padded = np.zeros((runs, CHUNK, rows))
            padded[:, : len(part)] = part.transpose(2, 0, 1)
            states, shown = (m.full() for m in many(state, padded.reshape(runs * CHUNK, rows).T, parameter))
            shown = shown.reshape(-1, runs, CHUNK)[:, :, : len(part)]
            kept[first : first + len(part)] = shown.transpose(2, 0, 1)
            state = states.reshape(len(state), runs, CHUNK)[:, :, len(part) - 1]
        return state, kept
