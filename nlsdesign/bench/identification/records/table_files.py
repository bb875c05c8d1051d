"""Tables of numbers from files: CSV, Parquet, MAT, HDF5, logs, each through the library made for it.

The elements of a MAT file are looked at before SciPy reads them: its reader looks up the type of a column's
numbers without asking whether there is one, and follows arrays within arrays to any depth, so a code of no
type would end the whole process there. They are read here in the same order.
"""

from __future__ import annotations

import contextlib
import difflib
import importlib
import itertools
import math
import mmap
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....foundation.arrays import Array
from ....foundation.csv_tables import named_if_unreadable, read_csv
from ....foundation.errors import MeasurementError, missing_library, nearest
from ....foundation.text_files import is_there
from .robot_logs import LOG_ENDINGS, is_robot_log, of_joint, read_robot_log

_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))
"""Codes of the types of numbers and letters."""
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCTURE, _OBJECT, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 5, 16, 17
_HEADER = 128
_DEEPEST = 64
LEAST_ROWS = 50
"""Smallest number of rows of a record."""
_MOST_ROWS = 50_000_000
"""Largest number of rows of a record: 14 hours at 1 kHz."""
_ENDINGS = (".csv", ".parquet", ".mat", ".h5", ".hdf5", *LOG_ENDINGS)
_NOT_READ = (".dat", ".ods", ".tdms", ".tsv", ".txt", ".xls", ".xlsx")
"""Endings of other files that a bench may have left: one that is passed over is told."""


def check_mat(file: Path) -> None:
    """Look at every element of a MAT file of version 5; those of version 4 hold no types to look up."""
    with file.open("rb") as stream:
        head = stream.read(_HEADER)
        if len(head) < _HEADER or 0 in head[:4]:
            return
        order = "<" if head[126:128] == b"IM" else ">"
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
            place = _HEADER
            while place < len(content):
                kind, size = struct.unpack(order + "II", content[place : place + 8].ljust(8, b"\0"))
                whole = content[place : place + 8 + size]
                # What is cut off within a compressed element is met while its elements are read.
                plain = zlib.decompressobj().decompress(whole[8:]) if kind == _COMPRESSED else whole
                _Elements(file.name, plain, order).matrix(0)
                place += 8 + size


class _Elements:
    """The elements of one variable, one after the other.

    ``content``: from the head of the variable.
    """

    def __init__(self, name: str, content: bytes, order: str) -> None:
        self._name, self._content, self._order, self._place = name, content, order, 0

    def matrix(self, depth: int) -> None:
        """Pass one array with all that it holds."""
        if depth > _DEEPEST:
            raise self._refusal(f"an array is nested more than {_DEEPEST} deep")
        kind, size = self._integers(2)
        if kind != _MATRIX:
            raise self._refusal(f"an element of type {kind} stands where an array belongs")
        if size == 0:
            return
        _, _, flags, _ = self._integers(4)
        kind, is_complex, count = flags & 0xFF, bool(flags & 0x800), 0
        if kind != _OPAQUE:
            dimensions = self._data()
            count = math.prod(struct.unpack(f"{self._order}{len(dimensions) // 4}i", dimensions))
            self._data()
        self._values(kind, 2 if is_complex else 1, count, depth)

    def _values(self, kind: int, parts: int, count: int, depth: int) -> None:
        arrays = {_CELL: count, _FUNCTION: 1, _OPAQUE: 1}.get(kind, 0)
        if kind in (_STRUCTURE, _OBJECT):
            if kind == _OBJECT:
                self._data()
            (length,) = struct.unpack(self._order + "i", self._data()[:4].ljust(4, b"\0"))
            arrays = count * (len(self._data()) // length if length > 0 else 0)
        elif kind not in (_CELL, _FUNCTION):
            for _ in range({_SPARSE: 2 + parts, _OPAQUE: 3}.get(kind, parts)):
                self._data()
        for _ in range(arrays):
            self.matrix(depth + 1)

    def _data(self) -> bytes:
        """Return the bytes of an element of numbers or letters; one of up to four stands within its head."""
        (kind,) = self._integers(1)
        size, kind = kind >> 16, kind & 0xFFFF if kind >> 16 else kind
        if kind not in _NUMBERS:
            raise self._refusal(f"{kind} is the code of no type of numbers")
        within = size > 0
        if not within:
            (size,) = self._integers(1)
        start = self._place
        if start + size > len(self._content):
            raise self._refusal("an array is cut off")
        self._place += 4 if within else -(-size // 8) * 8
        return self._content[start : start + size]

    def _integers(self, count: int) -> tuple[int, ...]:
        start, self._place = self._place, self._place + 4 * count
        if self._place > len(self._content):
            raise self._refusal("an array is cut off")
        return struct.unpack(f"{self._order}{count}I", self._content[start : self._place])

    def _refusal(self, reason: str) -> MeasurementError:
        return MeasurementError(
            self._name,
            f"cannot be read: {reason}",
            next_step="the file is damaged or of another format: copy or export it again",
        )


@dataclass(frozen=True, eq=False)
class RecordTable:
    """Columns of one file."""

    file: str  # name of the file, for messages
    given: Mapping[str, Array]  # columns by head, shape (n,); in binary files they may differ in length
    first_row: int = 1  # number of the first row in messages: 2 in a CSV file whose heads are row 1
    # units: units of columns, by head, where the file gives them beside the heads
    units: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()  # what was assumed about the file
    # behind: usual time in s by which the clocks of a log, by head, lie behind its writing; empty for a table
    behind: Mapping[str, float] = field(default_factory=dict)

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads in the order of the file."""
        return tuple(self.given)

    def of_joint(self, joint: str) -> RecordTable:
        """Return the columns of a joint, whose name stands between slashes in a head, with their clocks."""
        if not self.behind:
            raise MeasurementError(
                f"{self.file}: joint '{joint}'",
                "is asked of a table; heads name joints in logs of messages only",
                next_step="write a records.toml that maps the columns of this joint ('nlsdesign records "
                "describe FOLDER --deck DECK', without --joint)",
            )
        of = [head for head in self.given if of_joint(head, joint) and head not in self.behind]
        if not of:
            parts = {part for head in self.given for part in head.split("/")[1:] if head not in self.behind}
            raise MeasurementError(
                f"{self.file}: joint '{joint}'", "is not the end or a part of any head",
                did_you_mean=nearest(joint, sorted(parts)),
                next_step="name a joint as the messages do, or leave --joint out",
            )  # fmt: skip
        clocks = {
            clock for head in of for clock in self.behind if head.startswith(clock.removesuffix("time"))
        }
        kept = {head: values for head, values in self.given.items() if head in clocks or head in of}
        return replace(self, given=kept)

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
    if folder.is_file():
        raise MeasurementError(
            str(folder), "is a file, no folder", next_step=f"name the folder of the records: {folder.parent}"
        )
    files = sorted(f for f in folder.glob("[!.]*") if _is_record(f))
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
        if folder.is_dir() and any(_is_record(f) for f in folder.glob("[!.]*"))
    ]


def _is_record(path: Path) -> bool:
    """Tell whether a path may hold a record: a table by its ending, or a log."""
    return path.suffix.lower() in _ENDINGS or is_robot_log(path)


def unread_tables(folder: Path) -> list[Path]:
    """Return the files of a folder that probably hold tables in a form that is not read, in order of name."""
    return sorted(f for f in folder.glob("[!.]*") if f.suffix.lower() in _NOT_READ)


def read_table(file: Path) -> RecordTable:
    """Read the columns of one file.

    A CSV file is read by :func:`~nlsdesign.foundation.csv_tables.read_csv`. In a MAT file every numeric
    vector is a column, fields of a structure under ``structure.field``; in an HDF5 file every numeric
    vector under its path, ``group/name``. A log gives ``topic/field``, see :mod:`~.robot_logs`.
    """
    if is_robot_log(file):
        rosbags, mcap = (_library(name, file, "robots") for name in ("rosbags.highlevel", "mcap.reader"))
        with _damage_named(file):
            log = read_robot_log(file, rosbags, mcap)
        return RecordTable(file.name, log.columns, units=log.units, remarks=log.remarks, behind=log.behind)
    reader = {".csv": _csv, ".parquet": _parquet, ".mat": _mat}.get(file.suffix.lower(), _hdf5)
    with named_if_unreadable(file):
        return reader(file)


def _library(name: str, file: Path, extra: str = "records") -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise missing_library(f"reading {file.name}", name, extra) from None


def _csv(file: Path) -> RecordTable:
    table = read_csv(file)
    if len(table.lines) < LEAST_ROWS:
        raise _too_short(file.name, len(table.lines))
    return RecordTable(file.name, table.columns, table.lines[0], table.units, table.remarks)


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
        if not isinstance(node, h5py.Dataset) or name.startswith("#"):
            return
        if node.dtype.kind in "fiub" and sum(length != 1 for length in node.shape) == 1:
            # Refuse a column whose numbers stand in other files, or are more than a record can hold.
            where = f"{file.name}: '{name}'"
            if node.external or node.is_virtual:
                raise MeasurementError(
                    where, "takes its numbers from another file", next_step="write the numbers into this file"
                )
            if node.size > _MOST_ROWS:
                raise MeasurementError(
                    where,
                    f"declares {node.size:.3g} numbers; at most {_MOST_ROWS:.3g} are read",
                    next_step="split the record",
                )
            arrays[name] = node[()]

    with _damage_named(file), h5py.File(file, "r") as stream:
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
    return MeasurementError(
        file,
        f"has {rows} {'row' if rows == 1 else 'rows'} of numbers; at least {LEAST_ROWS} are needed",
        next_step="take the file away, or record for longer",
    )
