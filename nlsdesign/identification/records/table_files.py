"""Tables of measured numbers from files: CSV, Parquet, MAT and HDF5, each through the library made for it."""

from __future__ import annotations

import csv
import importlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import MeasurementError, missing_library

Array = NDArray[np.float64]

LEAST_ROWS = 50
"""Smallest number of rows of a record."""
_FIRST_ROW = 2
_ENDINGS = (".csv", ".parquet", ".mat", ".h5", ".hdf5")


@dataclass(frozen=True, eq=False)
class RecordTable:
    """Columns of one file.

    Parameters
    ----------
    file
        Name of the file, for messages.
    given
        Columns by head, shape (n,); in binary files they may differ in length.
    first_row
        Number of the first row in messages: 2 in a CSV file, whose heads are row 1.
    """

    file: str
    given: Mapping[str, Array]
    first_row: int = 1

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads in the order of the file."""
        return tuple(self.given)

    def columns(self, heads: Sequence[str]) -> dict[str, Array]:
        """Return some columns of equal length.

        Parameters
        ----------
        heads
            Each must exist.

        Raises
        ------
        MeasurementError
            If they differ in length, or are too short.
        """
        columns = {head: self.given[head] for head in heads}
        lengths = {head: len(values) for head, values in columns.items()}
        if len(set(lengths.values())) > 1:
            shown = ", ".join(f"'{head}' {length}" for head, length in lengths.items())
            raise MeasurementError(
                self.file,
                f"its columns differ in length: {shown}",
                next_step="ask for one clock in records.toml: resample_Hz = <rate>, and in the table of each "
                "column of another clock time = '<head of that clock>'",
            )
        if min(lengths.values()) < LEAST_ROWS:
            raise _too_short(self.file, min(lengths.values()))
        return columns


def table_files(folder: Path) -> list[Path]:
    """Return the files of a folder that may hold tables, in order of name.

    Parameters
    ----------
    folder
        Of records.

    Raises
    ------
    MeasurementError
        If there is none, or two files differ only in the ending.
    """
    files = sorted(f for f in folder.glob("*") if f.suffix.lower() in _ENDINGS) if folder.is_dir() else []
    if not files:
        raise MeasurementError(
            str(folder),
            f"holds no CSV file and no {', '.join(e[1:] for e in _ENDINGS[1:])} file",
            next_step="name the folder of the records",
        )
    for one, other in itertools.pairwise(files):
        if one.stem == other.stem:
            raise MeasurementError(
                f"{one.name} and {other.name}",
                "would be two records of the same name",
                next_step="rename or remove one",
            )
    return files


def read_table(file: Path) -> RecordTable:
    """Read the columns of one file.

    A CSV file has commas and one row of heads. In a MAT file every numeric vector is a column, fields of a
    structure under ``structure.field``; in an HDF5 file every numeric vector under its path, ``group/name``.

    Parameters
    ----------
    file
        ``.csv``, ``.parquet``, ``.mat``, ``.h5`` or ``.hdf5``.

    Raises
    ------
    MeasurementError
        If the file cannot be read, a row is too short or too long, or a cell is not a number.
    MissingLibraryError
        If the library that reads it is not installed.
    """
    reader = {".csv": _csv, ".parquet": _parquet, ".mat": _mat}.get(file.suffix.lower(), _hdf5)
    try:
        return reader(file)
    except (OSError, UnicodeDecodeError) as error:
        raise MeasurementError(file.name, f"cannot be read: {error}") from None


def _library(name: str, file: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise missing_library(f"reading {file.name}", name, "records") from None


def _csv(file: Path) -> RecordTable:
    with file.open(newline="", encoding="utf8") as stream:
        rows = [row for row in csv.reader(stream) if row]
    if len(rows) < 1 + LEAST_ROWS:
        raise _too_short(file.name, max(len(rows) - 1, 0))
    heads = [head.strip() for head in rows[0]]
    try:
        numbers = np.array(rows[1:], dtype=float)
    except ValueError:
        return RecordTable(file.name, _ending_early(file.name, heads, rows[1:]), _FIRST_ROW)
    return RecordTable(file.name, {h: numbers[:, i] for i, h in enumerate(heads)}, _FIRST_ROW)


def _ending_early(file: str, heads: list[str], rows: list[list[str]]) -> dict[str, Array]:
    """Return columns of different length, as two clocks side by side give them."""
    if any(len(row) != len(heads) for row in rows):
        raise _bad_cell(file, heads, rows)
    columns = {}
    for place, head in enumerate(heads):
        cells = [row[place].strip() for row in rows]
        while cells and not cells[-1]:
            cells.pop()
        try:
            columns[head] = np.array(cells, dtype=float)
        except ValueError:
            raise _bad_cell(file, heads, rows) from None
    return columns


def _bad_cell(file: str, heads: list[str], rows: list[list[str]]) -> MeasurementError:
    for number, row in enumerate(rows, start=_FIRST_ROW):
        if len(row) != len(heads):
            return MeasurementError(
                f"{file}: row {number}", f"has {len(row)} cells, the heads are {len(heads)}"
            )
        for head, cell in zip(heads, row, strict=True):
            try:
                float(cell)
            except ValueError:
                if not cell.strip() and not any(r[heads.index(head)].strip() for r in rows[number - 1 :]):
                    continue  # the column has ended
                return MeasurementError(f"{file}: column '{head}', row {number}", f"'{cell}' is not a number")
    return MeasurementError(file, "cannot be read as a table of numbers")


def _parquet(file: Path) -> RecordTable:
    pyarrow = _library("pyarrow", file)
    parquet = _library("pyarrow.parquet", file)
    try:
        table = parquet.read_table(file)
    except pyarrow.ArrowInvalid as error:
        raise MeasurementError(file.name, f"cannot be read: {error}") from None
    return RecordTable(file.name, _numeric({n: table.column(n).to_numpy() for n in table.column_names}))


def _mat(file: Path) -> RecordTable:
    if _is_hdf5(file):
        return _hdf5(file)
    arrays: dict[str, Any] = {}
    try:
        _gather(_library("scipy.io", file).loadmat(file, squeeze_me=True), "", arrays)
    # SciPy raises the second for versions of the format that it cannot read.
    except (ValueError, NotImplementedError) as error:
        raise MeasurementError(file.name, f"cannot be read: {error}") from None
    return RecordTable(file.name, _numeric(arrays))


def _gather(values: Any, prefix: str, arrays: dict[str, Any]) -> None:
    names = values.dtype.names if isinstance(values, np.ndarray) else None
    for name in names or values:
        if name.startswith("__"):
            continue
        value = values[name]
        inner = (
            value.item()
            if isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 0
            else value
        )
        if isinstance(inner, np.ndarray) and inner.dtype.names:
            _gather(inner, f"{prefix}{name}.", arrays)
        else:
            arrays[prefix + name] = inner


def _is_hdf5(file: Path) -> bool:
    with file.open("rb") as stream:
        # MATLAB 7.3 writes HDF5 behind a header of its own.
        return b"\x89HDF\r\n\x1a\n" in stream.read(1024)


def _hdf5(file: Path) -> RecordTable:
    h5py = _library("h5py", file)
    arrays: dict[str, Any] = {}

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            arrays[name] = node[()]

    with h5py.File(file, "r") as stream:
        stream.visititems(visit)
    return RecordTable(file.name, _numeric(arrays))


def _numeric(arrays: Mapping[str, Any]) -> dict[str, Array]:
    """Return the vectors of numbers among arrays."""
    vectors = {name: np.squeeze(np.asarray(values)) for name, values in arrays.items()}
    return {
        name: values.astype(float)
        for name, values in vectors.items()
        if values.ndim == 1 and values.dtype.kind in "fiub"
    }


def _too_short(file: str, rows: int) -> MeasurementError:
    return MeasurementError(file, f"has {rows} rows of numbers; at least {LEAST_ROWS} are needed")
