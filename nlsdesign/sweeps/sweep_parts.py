"""Results on disk: parts that are written as answers come, and the one table that is made of them at the end.

A part is a Parquet file that appears whole or not at all, so a killed run leaves whole parts only. Its rows
stand in the order in which they came; the table is sorted by point, and the same to the byte whoever computed
it. Duration and place of each point stand in parts and in ``timings.parquet``, never in the table.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..foundation.arrays import Mask
from ..foundation.errors import ExportError, MeasurementError
from ..foundation.text_files import draft
from .sweep_columns import (
    DONE,
    RESULTS_FILE,
    SweepColumn,
    arrow_column,
    give_back,
    libraries,
    numpy_column,
    read_columns,
)

PARTS_FOLDER: Final = "parts"
TIMINGS_FILE: Final = "timings.parquet"
_ROWS_PER_GROUP: Final = 8192
_MOST_SMALL: Final = 24
"""Small parts beyond which they are written as one."""
_LARGE: Final = 16384
"""Rows from which on a part is not small."""
Row = Mapping[str, Any]


def _kind(pyarrow: Any, column: SweepColumn, words: bool) -> Any:
    if column.name == "point":
        return pyarrow.int64()
    return pyarrow.string() if words else pyarrow.float64()


def holds_words(column: SweepColumn) -> bool:
    """Tell whether a column holds words: states do, and axes without a range."""
    if column.role == "state":
        return column.name != "point"
    return column.role == "axis" and column.lower is None


def schema(columns: Sequence[SweepColumn], *, timed: bool = False) -> Any:
    """Return the schema of the table, or of its parts."""
    pyarrow, _ = libraries()
    fields = [(column.name, _kind(pyarrow, column, holds_words(column))) for column in columns]
    if timed:
        fields += [(_SECONDS, pyarrow.float64()), (_WORKER, pyarrow.string())]
    return pyarrow.schema(fields)


_SECONDS, _WORKER = "(seconds)", "(worker)"
"""In brackets, as no number of a deck is, so that no axis has the name."""


def part_files(folder: Path) -> list[Path]:
    """Return the parts of a sweep in the order in which they were written."""
    return sorted((folder / PARTS_FOLDER).glob("[0-9]*.parquet"))


class Parts:
    """The parts of one sweep."""

    def __init__(self, folder: Path, columns: Sequence[SweepColumn]) -> None:
        self._folder, self._columns = folder, tuple(columns)
        self._schema = schema(columns, timed=True)
        self._next = 1 + max(
            (int(path.stem) if path.stem.isdecimal() else 0 for path in part_files(folder)), default=0
        )
        self.damaged: list[str] = []
        """Names of parts that could not be read; their points are computed again."""
        _, parquet = libraries()
        for path in part_files(self._folder):
            try:
                whole = parquet.read_schema(path).equals(self._schema)
            except Exception:  # libraries answer damage with errors of any kind
                whole = False
            if not whole:
                self.damaged.append(path.name)
                with contextlib.suppress(OSError):
                    path.rename(path.with_suffix(".damaged"))

    def standing(self, count: int, *, with_failed: bool = True) -> Mask:
        """Return which points stand in the parts."""
        mask = np.zeros(count, dtype=bool)
        for path in part_files(self._folder):
            table = read_columns(path, ["point", "status"])
            points = numpy_column(table.column("point"))
            inside = (points >= 0) & (points < count)
            if not with_failed:
                inside &= numpy_column(table.column("status")) == DONE
            mask[points[inside]] = True
        return mask

    def write(self, rows: Sequence[Row]) -> None:
        """Write rows as one more part."""
        if not rows:
            return
        pyarrow, _ = libraries()
        columns = [arrow_column([row[field.name] for row in rows], field.type) for field in self._schema]
        self._write_table(pyarrow.Table.from_arrays(columns, schema=self._schema))
        self._merge_small()
        give_back()

    def _write_table(self, table: Any) -> None:
        _write(self._folder / PARTS_FOLDER / f"{self._next:08d}.parquet", [table], table.schema)
        self._next += 1

    def _merge_small(self) -> None:
        """Write many small parts as one; what an interrupt leaves twice counts once."""
        pyarrow, parquet = libraries()
        small = [path for path in part_files(self._folder) if parquet.read_metadata(path).num_rows < _LARGE]
        if len(small) <= _MOST_SMALL:
            return
        self._write_table(pyarrow.concat_tables([read_columns(path) for path in small]))
        for path in small:
            path.unlink(missing_ok=True)

    def replace_all(self, tables: Iterator[Any]) -> None:
        """Replace all parts by other tables; the old ones go when the new ones stand."""
        old = part_files(self._folder)
        for table in tables:
            self._write_table(table)
        for path in old:
            path.unlink(missing_ok=True)

    def finish(self) -> Path:
        """Write the table and the timings, both sorted by point, and return the path of the table."""
        order = _Order(self._folder, self._columns)
        target = self._folder / RESULTS_FILE
        pyarrow, _ = libraries()
        timings = (
            block.rename_columns(["point", "seconds", "worker"])
            for block in order.blocks(["point", _SECONDS, _WORKER])
        )
        _write(self._folder / TIMINGS_FILE, timings,
               pyarrow.schema([("point", pyarrow.int64()), ("seconds", pyarrow.float64()),
                               ("worker", pyarrow.string())]))  # fmt: skip
        names = [column.name for column in self._columns]
        _write(target, order.blocks(names), schema(self._columns))
        return target


class _Order:
    """Where the row of each point stands in the parts: the last one that is done, or else the last."""

    def __init__(self, folder: Path, columns: Sequence[SweepColumn]) -> None:
        self._files = part_files(folder)
        self._schema = schema(columns, timed=True)
        self._open: dict[int, Any] = {}
        points, parts, rows, done = [], [], [], []
        for number, path in enumerate(self._files):
            table = read_columns(path, ["point", "status"])
            points.append(numpy_column(table.column("point")))
            done.append(numpy_column(table.column("status")) == DONE)
            parts.append(np.full(table.num_rows, number, dtype=np.int32))
            rows.append(np.arange(table.num_rows, dtype=np.int32))
        if not self._files:
            self._part = self._row = np.zeros(0, dtype=np.int32)
            return
        point, part = np.concatenate(points), np.concatenate(parts)
        row, good = np.concatenate(rows), np.concatenate(done)
        order = np.lexsort((row, part, good, point))
        order = order[point[order] >= 0]
        sorted_points = point[order]
        last = (
            order[np.append(np.flatnonzero(np.diff(sorted_points)), len(order) - 1)] if len(order) else order
        )
        self._part, self._row = part[last], row[last]

    def blocks(self, names: list[str]) -> Iterator[Any]:
        """Yield the rows sorted by point, a bounded number at a time."""
        pyarrow, _ = libraries()
        for start in range(0, len(self._part), _ROWS_PER_GROUP):
            part = self._part[start : start + _ROWS_PER_GROUP]
            row = self._row[start : start + _ROWS_PER_GROUP]
            taken, places = [], []
            for each in np.unique(part):
                here = np.flatnonzero(part == each)
                number = int(each)
                if number not in self._open:  # the columns of four parts stay open
                    while len(self._open) >= 4:
                        self._open.pop(next(iter(self._open)))
                    self._open[number] = read_columns(self._files[number])
                taken.append(self._open[number].select(names).take(_places(row[here])))
                places.append(here)
            back = np.argsort(np.concatenate(places), kind="stable")
            yield pyarrow.concat_tables(taken).take(_places(back)).combine_chunks()
            give_back()


def _places(rows: NDArray[Any]) -> Any:
    pyarrow, _ = libraries()
    return arrow_column(rows, pyarrow.int64())


def rows_in_order(folder: Path, columns: Sequence[SweepColumn]) -> dict[str, NDArray[Any]]:
    """Return the columns of a sweep that is not finished, sorted by point."""
    pyarrow, _ = libraries()
    try:
        blocks = list(_Order(folder, columns).blocks([column.name for column in columns]))
    except (OSError, KeyError, pyarrow.ArrowException) as error:
        raise MeasurementError(
            str(folder / PARTS_FOLDER), f"a part cannot be read ({error})",
            next_step="run the same sweep again: it computes what is missing",
        ) from None  # fmt: skip
    table = pyarrow.concat_tables(blocks) if blocks else schema(columns).empty_table()
    return {c.name: numpy_column(table.column(c.name)) for c in columns}


def _write(path: Path, tables: Iterator[Any] | list[Any], kind: Any) -> None:
    """Write a Parquet file whole or not at all; the same rows give the same bytes."""
    pyarrow, parquet = libraries()
    try:
        with (
            draft(path) as name,
            parquet.ParquetWriter(name, kind, compression="zstd", store_schema=False) as writer,
        ):
            for table in tables:
                writer.write_table(table, row_group_size=_ROWS_PER_GROUP)
    except pyarrow.ArrowException as error:
        raise ExportError(
            str(path), f"cannot be written ({error})",
            next_step="make room or name another folder; what is written stays, and the next run resumes",
        ) from None  # fmt: skip
