"""Tables of measured numbers from files: CSV, Parquet, MAT and HDF5, each through the library made for it."""

from __future__ import annotations

import contextlib
import difflib
import importlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError, missing_library
from ....foundation.reading import is_there
from .csv_files import read_csv
from .mat_elements import check_mat

LEAST_ROWS = 50
"""Smallest number of rows of a record."""
_MOST_ROWS = 50_000_000
"""Largest number of rows of a record: 14 hours at 1 kHz."""
_ENDINGS = (".csv", ".parquet", ".mat", ".h5", ".hdf5")
_NOT_READ = (".dat", ".ods", ".tdms", ".tsv", ".txt", ".xls", ".xlsx")
"""Endings of other files that a bench may have left: one that is passed over is told."""


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
        Number of the first row in messages: 2 in a CSV file whose heads are row 1.
    units
        Units of columns, by head, where the file gives them beside the heads.
    """

    file: str
    given: Mapping[str, Array]
    first_row: int = 1
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads in the order of the file."""
        return tuple(self.given)

    def columns(self, heads: Sequence[str]) -> dict[str, Array]:
        """Return some columns of equal length."""
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
    """Return the files of a folder that may hold tables, in order of name, without hidden ones."""
    if not is_there(folder):
        # A folder without records is no advice, and neither is one whose name is hardly alike.
        near = difflib.get_close_matches(folder.name, _folders_of_records(folder.parent), n=1, cutoff=0.7)
        raise MeasurementError(
            str(folder),
            "there is no such folder",
            did_you_mean=next(iter(near), None),
            next_step="name the folder of the records",
        )
    files = sorted(f for f in folder.glob("[!.]*") if f.suffix.lower() in _ENDINGS)
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


def _folders_of_records(parent: Path) -> list[str]:
    return [
        folder.name
        for folder in parent.glob("*")
        if folder.is_dir() and any(f.suffix.lower() in _ENDINGS for f in folder.glob("[!.]*"))
    ]


def unread_tables(folder: Path) -> list[Path]:
    """Return the files of a folder that probably hold tables in a form that is not read, in order of name."""
    return sorted(f for f in folder.glob("[!.]*") if f.suffix.lower() in _NOT_READ)


def read_table(file: Path) -> RecordTable:
    """Read the columns of one file.

    A CSV file is read by :func:`~.csv_files.read_csv`. In a MAT file every numeric vector is a column,
    fields of a
    structure under ``structure.field``; in an HDF5 file every numeric vector under its path, ``group/name``.
    """
    reader = {".csv": _csv, ".parquet": _parquet, ".mat": _mat}.get(file.suffix.lower(), _hdf5)
    try:
        return reader(file)
    except UnicodeDecodeError as error:
        with file.open("rb") as stream:
            row = sum(1 for _ in itertools.takewhile(_is_utf8, stream)) + 1
        raise MeasurementError(
            f"{file.name}: row {row}",
            f"is no text in UTF-8: {error.reason}",
            next_step="save it as CSV in UTF-8; other kinds of file are told by their ending",
        ) from None
    except OSError as error:
        raise MeasurementError(
            file.name,
            f"cannot be read: {error.strerror or error}",
            next_step="put a file there that can be read, or take this one away",
        ) from None


def _is_utf8(line: bytes) -> bool:
    try:
        line.decode()
    except UnicodeDecodeError:
        return False
    return True


def _library(name: str, file: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise missing_library(f"reading {file.name}", name, "records") from None


def _csv(file: Path) -> RecordTable:
    table = read_csv(file)
    rows = max((len(column) for column in table.columns.values()), default=0)
    if rows < LEAST_ROWS:
        raise _too_short(file.name, rows)
    return RecordTable(file.name, table.columns, table.first_row, table.units)


def _parquet(file: Path) -> RecordTable:
    parquet = _library("pyarrow.parquet", file)
    with _damage_named(file):
        table = parquet.ParquetFile(file).read()
        names = table.column_names
        vectors = [column.to_numpy() for column in table.columns]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise MeasurementError(
                f"{file.name}: columns {names.index(name) + 1} and {place + 1}",
                f"have the same head '{name}'",
                next_step="give each column a head of its own",
            )
    return RecordTable(file.name, _numeric(dict(zip(names, vectors, strict=True))))


def _mat(file: Path) -> RecordTable:
    if _is_hdf5(file):
        return _hdf5(file)
    arrays: dict[str, Any] = {}
    library = _library("scipy.io", file)
    with _damage_named(file):
        check_mat(file)
        _gather(library.loadmat(file, squeeze_me=True), "", arrays)
        return RecordTable(file.name, _numeric(arrays))


@contextlib.contextmanager
def _damage_named(file: Path) -> Iterator[None]:
    """Turn whatever a library raises over a damaged file into one error of the project."""
    try:
        yield
    except MeasurementError:
        raise
    # Libraries answer damage with errors of any kind: of zlib, of indices, of memory, of types.
    except Exception as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise MeasurementError(
            file.name,
            f"cannot be read: {reason}",
            next_step="the file is damaged or of another format: copy or export it again",
        ) from None


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
        if isinstance(node, h5py.Dataset) and not name.startswith("#") and _is_vector(node):
            _check_dataset(f"{file.name}: '{name}'", node)
            arrays[name] = node[()]

    with _damage_named(file), h5py.File(file, "r") as stream:
        stream.visititems(visit)
        return RecordTable(file.name, _numeric(arrays))


def _is_vector(dataset: Any) -> bool:
    return dataset.dtype.kind in "fiub" and sum(length != 1 for length in dataset.shape) == 1


def _check_dataset(where: str, dataset: Any) -> None:
    """Refuse a column whose numbers stand in other files, or are more than a record can hold."""
    if dataset.external or dataset.is_virtual:
        raise MeasurementError(
            where, "takes its numbers from another file", next_step="write the numbers into this file"
        )
    if dataset.size > _MOST_ROWS:
        raise MeasurementError(
            where,
            f"declares {dataset.size:.3g} numbers; at most {_MOST_ROWS:.3g} are read",
            next_step="split the record",
        )


def _numeric(arrays: Mapping[str, Any]) -> dict[str, Array]:
    """Return the vectors of numbers among arrays."""
    vectors = {name: np.squeeze(np.asarray(values)) for name, values in arrays.items()}
    return {
        name: values.astype(float)
        for name, values in vectors.items()
        if values.ndim == 1 and values.dtype.kind in "fiub"
    }


def _too_short(file: str, rows: int) -> MeasurementError:
    return MeasurementError(
        file,
        f"has {rows} {'row' if rows == 1 else 'rows'} of numbers; at least {LEAST_ROWS} are needed",
        next_step="take the file away, or record for longer",
    )
