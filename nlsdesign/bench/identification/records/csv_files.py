"""Tables from text: commas, semicolons or tabs between cells, decimal points or commas, comments on top.

The head of a column says whether it is the time, which signal it holds, and in which unit.
"""

from __future__ import annotations

import csv
import io
import itertools
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError, UnitError
from ....foundation.quantity import parse_unit, same_dimension, typeset_unit
from ....foundation.written_numbers import name_and_unit
from ....model import FlatModel
from ....model.readings import reading_of
from .mapping import Column, ColumnMap

_TIME_NAMES = ("t", "time")
_COMMENTS = ("#", "%", "//")
_SEPARATORS = (";", "\t", ",")
_MOST_HEAD_LINES = 1000
_LOOKED_AT = 20
"""Rows from which the separator and the decimal mark are seen."""


def times_among(heads: Sequence[str]) -> list[tuple[str, str]]:
    """Return heads that name a time, with their units."""
    named = [(head, *name_and_unit(head)) for head in heads]
    return [(h, u) for h, n, u in named if u and same_dimension(u, "s") and n.lower() in _TIME_NAMES]


def times_without_unit(heads: Sequence[str]) -> list[str]:
    """Return heads that are called like a time and give no unit of time."""
    names = (*_TIME_NAMES, "timestamp", "seconds", "ms")
    timed = {head for head, _ in times_among(heads)}
    return [head for head in heads if head.lower().strip("[]() ") in names and head not in timed]


def heads_with_units(file: str, heads: Sequence[str], units: Mapping[str, str]) -> list[str]:
    """Return heads with the units that stand beside them in the file."""
    result = []
    for head in heads:
        name, own = name_and_unit(head)
        unit = units.get(head)
        if unit and own and unit != own:
            raise MeasurementError(
                f"{file}: column '{head}'",
                f"is in {typeset_unit(own)} by its head and in {typeset_unit(unit)} by the row below",
                next_step="correct one of them",
            )
        result.append(f"{name} [{unit}]" if unit and not own else head)
    return result


def default_mapping(
    heads: Sequence[str], model: FlatModel, file: str, given: ColumnMap | None = None
) -> ColumnMap:
    """Return the mapping that follows from the heads of the columns.

    ``given``: where it maps columns, it is returned as it stands; else all but the columns are kept.
    """
    if given is not None and given.columns:
        return given
    split_heads = [(head, *name_and_unit(head)) for head in heads]
    timed = given is not None and given.time.name in heads
    times = [(given.time.name, given.time.unit)] if given is not None and timed else times_among(heads)
    if not times:
        raise MeasurementError(file, "has no column of time", next_step="name it 't_s' or 'time [s]'")
    columns = [
        Column(head, signal, str(unit), *_declared(model, signal), sampling=None)
        for head, name, unit in split_heads
        if head != times[0][0] and (signal := _signal(head, name, unit, model, file))
    ]
    for column in columns:
        if sum(other.signal == column.signal for other in columns) > 1:
            raise MeasurementError(
                f"{file}: column '{column.name}'",
                f"is not the only one that could be '{column.signal}'",
                next_step="write a records.toml that maps each column to its signal",
            )
    clock = Column(times[0][0], "time", times[0][1])
    return replace(given or ColumnMap(clock, ()), time=clock, columns=tuple(columns))


def _signal(head: str, name: str, unit: str | None, model: FlatModel, file: str) -> str | None:
    everything = {v.name: v for v in model.states + model.inputs + model.signals}
    if unit is None:
        raise MeasurementError(
            f"{file}: column '{head}'",
            "names no unit",
            next_step="write for instance 'force_N', or map it in records.toml",
        )
    if name in everything:
        return name
    for group in ([everything[r.signal] for r in model.readings], list(model.inputs)):
        fitting = _last_of_chains(model, [v.name for v in group if same_dimension(v.unit, unit)])
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            break
    raise MeasurementError(
        f"{file}: column '{head}'",
        f"could be {' or '.join(fitting)}"
        if fitting
        else f"no sensor of the model reads in {typeset_unit(unit)}",
        next_step="write a records.toml that maps each column to its signal"
        + ("" if fitting else ", or give the deck of the rig that was measured"),
    )


def _last_of_chains(model: FlatModel, signals: Sequence[str]) -> list[str]:
    """Leave out readings that another one of these signals passes on: a bench writes down the last."""
    readings = [r for r in model.readings if r.signal in signals]
    passed_on = {sensor for r in readings for sensor in r.sensors[1:]}
    return [s for s in signals if s not in {r.signal for r in readings if r.sensors[0] in passed_on}]


def _declared(model: FlatModel, signal: str) -> tuple[float, float]:
    """Return noise and count of a signal: the largest of the sensors that pass its value on."""
    noise = quantum = 0.0
    reading = reading_of(model.readings, signal)
    for sensor, law in zip(reading.sensors, reading.laws, strict=True):
        noise = max(noise, model.values.get(f"{sensor}.noise", 0.0))
        quantum = max(quantum, model.values.get(f"{sensor}.quantum", 0.0))
        if not law.shows_value:
            break
    return noise, quantum


@dataclass(frozen=True)
class CsvTable:
    """Columns of a text file.

    Parameters
    ----------
    heads
        In the order of the file; they differ.
    units
        Of the columns, by head, where a row below the heads gives them.
    columns
        Numbers by head, shape (n,); those that end early are shorter.
    first_row
        Row of the first number in the file, counted from 1.
    """

    heads: tuple[str, ...]
    units: dict[str, str]
    columns: dict[str, Array]
    first_row: int


def read_csv(file: Path) -> CsvTable:
    """Read a text file of numbers.

    Heads stand in the first row that is no comment (``#``, ``%``, ``//``), or in the last comment where
    numbers follow at once. Below them a row of units may stand. With semicolons or tabs between the cells,
    numbers may have decimal commas.
    """
    layout = _Layout.of(file)
    try:
        with file.open(encoding=layout.encoding, newline="") as stream:
            lines = (layout.point(line) for line in itertools.islice(stream, layout.skipped, None))
            some = range(len(layout.heads)) if layout.open_ended else None
            with warnings.catch_warnings(action="ignore", category=UserWarning):  # of a file without numbers
                numbers = np.loadtxt(
                    lines, delimiter=layout.separator, quotechar='"', comments=None, ndmin=2, usecols=some
                )
        if len(numbers) and numbers.shape[1] != len(layout.heads):
            raise _uneven(layout, layout.skipped + 1, numbers.shape[1])
        numbers = numbers if len(numbers) else np.zeros((0, len(layout.heads)))
        columns = {head: numbers[:, place] for place, head in enumerate(layout.heads)}
    except ValueError:
        columns = _cell_by_cell(file, layout)
    return CsvTable(layout.heads, layout.units, columns, layout.skipped + 1)


@dataclass(frozen=True)
class _Layout:
    """How a file is written: lines before the numbers, heads, units, separator and decimal mark."""

    file: str
    encoding: str
    separator: str
    decimal_comma: bool
    skipped: int
    heads: tuple[str, ...]
    units: dict[str, str]
    open_ended: bool

    @staticmethod
    def of(file: Path) -> _Layout:
        with file.open("rb") as binary:
            mark = binary.read(2)
        encoding = "utf-16" if mark in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        with file.open(encoding=encoding, newline="") as stream:
            lines = list(itertools.islice(stream, _MOST_HEAD_LINES))
        comments = list(itertools.takewhile(_is_comment, lines))
        at = len(comments)
        first = lines[at : at + _LOOKED_AT]
        if not first:
            return _Layout(file.name, encoding, ",", False, at, (), {}, False)
        separator = next((s for s in _SEPARATORS if s in first[0]), ",")
        cells = _cells(file.name, first[0], separator)
        comma = separator != "," and any("," in line for line in first[1:])
        named = [line.strip().lstrip("#%/").strip() for line in comments if not line.isspace()]
        if named and all(_is_number(c.replace(",", ".") if comma else c) for c in cells):
            heads = _cells(file.name, named[-1], separator)
        else:
            heads, at = cells, at + 1
        open_ended = len(heads) > 1 and not heads[-1]
        heads = heads[:-1] if open_ended else heads
        _check_heads(file.name, heads)
        units: dict[str, str] = {}
        if at < len(lines):
            below = _cells(file.name, lines[at], separator)
            texts = [cell for cell in below if cell and not _is_number(cell)]
            if texts and all(_is_unit(cell) or cell == "1" for cell in filter(None, below)):
                units = {h: c.strip("[]()") for h, c in zip(heads, below, strict=False) if c}
                at += 1
        return _Layout(file.name, encoding, separator, comma, at, tuple(heads), units, open_ended)

    def point(self, line: str) -> str:
        """Return a line with decimal points."""
        return line.replace(",", ".") if self.decimal_comma and "." not in line else line


def _is_comment(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith(_COMMENTS)


def _cells(file: str, line: str, separator: str) -> list[str]:
    try:
        (row,) = csv.reader(io.StringIO(line.strip("\r\n")), delimiter=separator)
    except (csv.Error, ValueError) as error:
        raise MeasurementError(
            file, f"its heads cannot be read: {error}", next_step="write the file again"
        ) from None
    return [cell.strip() for cell in row]


def _is_number(cell: str) -> bool:
    if "_" in cell or not cell.isascii():
        return False
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _is_unit(cell: str) -> bool:
    try:
        parse_unit(cell.strip("[]()"))
    except UnitError:
        return False
    return not _is_number(cell)


def _check_heads(file: str, heads: Sequence[str]) -> None:
    for place, head in enumerate(heads):
        if head in heads[:place]:
            raise MeasurementError(
                f"{file}: columns {heads.index(head) + 1} and {place + 1}",
                f"have the same head '{head}'" if head else "have no head",
                next_step="give each column a head of its own",
            )


def _uneven(layout: _Layout, row: int, cells: int) -> MeasurementError:
    comma = layout.separator == "," and cells == 2 * len(layout.heads)
    return MeasurementError(
        f"{layout.file}: row {row}",
        f"has {cells} cells, the heads are {len(layout.heads)}",
        next_step="separate the cells by semicolons where numbers have decimal commas"
        if comma
        else "give each row one cell for each head; comments may stand above the heads only",
    )


def _cell_by_cell(file: Path, layout: _Layout) -> dict[str, Array]:
    """Return columns that may end early, as two clocks side by side do, or name the cell that is odd."""
    columns: dict[str, list[float]] = {head: [] for head in layout.heads}
    ended: dict[str, int] = {}
    for row, cells in _rows(file, layout):
        if layout.open_ended and len(cells) == len(layout.heads) + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) != len(layout.heads):
            raise _uneven(layout, row, len(cells))
        for head, cell in zip(layout.heads, cells, strict=True):
            if not cell:
                ended.setdefault(head, row)
            elif head in ended:
                raise _no_number(layout, head, ended[head], "")
            elif _is_number(cell):
                columns[head].append(float(cell))
            else:
                raise _no_number(layout, head, row, cell)
    return {head: np.array(column) for head, column in columns.items()}


def _no_number(layout: _Layout, head: str, row: int, cell: str) -> MeasurementError:
    both = "," in cell and "." in cell
    return MeasurementError(
        f"{layout.file}: column '{head}', row {row}",
        f"'{cell[:40]}' is not a number",
        next_step="write numbers without separators of thousands"
        if both or "_" in cell
        else "correct the cell, or cut the record before or after this row",
    )


def _rows(file: Path, layout: _Layout) -> Iterator[tuple[int, list[str]]]:
    with file.open(encoding=layout.encoding, newline="") as stream:
        lines = (layout.point(line) for line in itertools.islice(stream, layout.skipped, None))
        reader = csv.reader(lines, delimiter=layout.separator)
        try:
            for cells in reader:
                if cells:
                    yield layout.skipped + reader.line_num, [cell.strip() for cell in cells]
        except csv.Error as error:
            raise MeasurementError(
                f"{layout.file}: row {layout.skipped + reader.line_num}",
                f"cannot be read: {error}",
                next_step="check that the file is a table of numbers, and write it again",
            ) from None
