"""What runs the samples of many columns: compiled code, NumPy, or CasADi one column after the other.

All compute the same operations in the same order. Compiled code and CasADi take their elementary functions
from one C library and give the same bits; NumPy has its own, whose last digit may differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .buffered import Translate, as_it_is
from .column_graph import ColumnGraph, NotByColumnsError, column_graph
from .numpy_columns import NumpyColumns
from .sample_writer import SampleWriter
from .sampled_system import SampledSystem

Array = NDArray[np.float64]

CHUNK = 250
"""Samples that one call computes; between calls a run can be interrupted."""
MANY = 200
"""Columns from which on NumPy is quicker than CasADi."""


class ColumnRun(Protocol):
    """Runs samples of many columns."""

    def __call__(self, state: Array, given: Array, parameter: Array) -> tuple[Array, Array]:
        """Return the states after the last sample, (states, columns), and what is kept, (T, kept, columns).

        Parameters
        ----------
        state
            Shape (states, columns).
        given
            Shape (T, given, columns).
        parameter
            Shape (parameters, columns).
        """
        ...


@runtime_checkable
class ByColumns(Protocol):
    """A translation that also computes many columns together."""

    def columns(self, graph: ColumnGraph) -> ColumnRun:
        """Return what runs a graph of one sample.

        Parameters
        ----------
        graph
            (state, what is given, parameters) -> (state after the sample, what is kept), parameters fixed.
        """
        ...


def column_run(system: SampledSystem, keep: Sequence[str], *, translate: Translate, runs: int) -> ColumnRun:
    """Return what runs the samples of a system.

    Parameters
    ----------
    system
        The system.
    keep
        Full names of variables that are kept.
    translate
        One that computes by columns is asked for that; the unchanged function is evaluated with NumPy where
        there are many runs.
    runs
        How many.
    """
    return _column_run(system, tuple(keep), translate, runs >= MANY)


@lru_cache(maxsize=16)
def _column_run(system: SampledSystem, keep: tuple[str, ...], translate: Translate, many: bool) -> ColumnRun:
    writer = SampleWriter(system)
    sample = writer.function(keep)
    try:
        if isinstance(translate, ByColumns):
            return translate.columns(column_graph(sample, fixed=[2], tables=writer.tables))
        if translate is as_it_is and many:
            return NumpyColumns(column_graph(sample, fixed=[2], tables=writer.tables))
    except NotByColumnsError:
        pass  # the same numbers, one column after the other
    return _OneByOne(translate(_chunk(sample)))


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
