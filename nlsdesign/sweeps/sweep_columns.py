"""Columns of a sweep: what was chosen, what was answered, how each point went.

They go between Python, NumPy and Arrow here, and so do the files of a sweep. Arrow's own conversions load
pandas where it is installed, 50 MB for nothing, and its reading ahead keeps memory of every file; a driver
that runs for days has neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from ..foundation.errors import missing_library

DONE: Final = "done"
FAILED: Final = "failed"
RESULTS_FILE: Final = "results.parquet"
SALTELLI: Final = "saltelli"
"""Kind of the axes of a Saltelli plan."""
Role = Literal["axis", "answer", "state"]


@dataclass(frozen=True)
class SweepColumn:
    """One column of a sweep.

    Parameters
    ----------
    name
        For an axis the full name of the number in the deck, or what else it changes.
    unit
        In SI; empty for words and counts.
    description
        A few words.
    role
        Whether it was chosen (``"axis"``), answered, or says how the point went (``"state"``).
    kind
        Of an axis: ``"grid"``, ``"sobol"``, ``"latin_hypercube"``, ``"list"``, ``"random"`` or that of a plan
        of one's own; else empty.
    lower, upper
        Range of an axis of numbers, in SI; ``None`` for one of words, and for answers and states.
    """

    name: str
    unit: str
    description: str
    role: Role
    kind: str = ""
    lower: float | None = None
    upper: float | None = None


STATE_COLUMNS: Final = (
    SweepColumn("point", "", "number of the point, from 0", "state"),
    SweepColumn("status", "", "done or failed", "state"),
    SweepColumn("reason", "", "why the point failed", "state"),
)


def libraries() -> tuple[Any, Any]:
    """Return the modules ``pyarrow`` and ``pyarrow.parquet``."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise missing_library("a sweep", "pyarrow", "scale") from None
    return pyarrow, parquet


def arrow_column(values: Sequence[Any] | NDArray[Any], kind: Any) -> Any:
    """Return a column as Arrow holds it."""
    pyarrow, _ = libraries()
    if kind != pyarrow.string():
        numbers = np.ascontiguousarray(values, dtype=np.int64 if kind == pyarrow.int64() else np.float64)
        return pyarrow.Array.from_buffers(kind, len(numbers), [None, pyarrow.py_buffer(numbers)])
    words = [text.encode("utf-8", errors="replace") for text in values]
    ends = np.zeros(len(words) + 1, dtype=np.int32)
    np.cumsum([len(each) for each in words], out=ends[1:])
    content = [None, pyarrow.py_buffer(ends), pyarrow.py_buffer(b"".join(words))]
    return pyarrow.Array.from_buffers(kind, len(words), content)


def numpy_column(column: Any) -> NDArray[Any]:
    """Return a column of Arrow as numbers, or as words of which equal ones are one object.

    ``column``: of a table; missing numbers become not a number, missing words empty.
    """
    pyarrow, _ = libraries()
    if pyarrow.types.is_integer(column.type) and not column.null_count:
        return _numbers(column, pyarrow.int64(), np.int64)
    if pyarrow.types.is_integer(column.type) or pyarrow.types.is_floating(column.type):
        return _numbers(column, pyarrow.float64(), np.float64)
    words = column.cast(pyarrow.string()).combine_chunks().dictionary_encode()
    words = words.combine_chunks() if isinstance(words, pyarrow.ChunkedArray) else words
    known = np.array([*words.dictionary.to_pylist(), ""], dtype=object)
    places = words.indices.fill_null(len(known) - 1) if words.indices.null_count else words.indices
    result: NDArray[Any] = known[_values(places, np.int32)]
    return result


def _numbers(column: Any, kind: Any, held: type) -> NDArray[Any]:
    column = column.cast(kind)
    if column.null_count:
        column = column.fill_null(np.nan)
    parts = [_values(chunk, held) for chunk in column.chunks]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=held)


def _values(array: Any, held: type) -> NDArray[Any]:
    """Return the numbers of an array without missing ones, in the memory of Arrow."""
    if not len(array):
        return np.zeros(0, dtype=held)
    return np.frombuffer(
        array.buffers()[1], dtype=held, count=len(array), offset=array.offset * held().itemsize
    )


def read_columns(path: Path, names: Sequence[str] | None = None) -> Any:
    """Return a Parquet file as a table, in this thread and without reading ahead.

    ``names``: of the columns; all by default.
    """
    _, parquet = libraries()
    with parquet.ParquetFile(path, memory_map=True) as file:
        return file.read(columns=None if names is None else list(names), use_threads=False)


def give_back() -> None:
    """Give memory that Arrow keeps for later back to the system, or it keeps a share of all it read."""
    pyarrow, _ = libraries()
    pyarrow.default_memory_pool().release_unused()
