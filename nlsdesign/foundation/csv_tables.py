"""Tables of numbers from text, as benches, spreadsheets and designers write them; the one reader of all.

Commas, semicolons or tabs stand between the cells; numbers have decimal points or commas; a row of units may
stand below the heads. The encoding is UTF-8, UTF-16 with its mark, or Windows-1252, which Excel writes.

Columns with units as data frames of pandas and data sets of xarray; both are optional libraries.
"""

from __future__ import annotations

import codecs
import contextlib
import csv
import io
import itertools
import warnings
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .arrays import Array
from .errors import MeasurementError, UnitError, missing_library
from .quantity import parse_unit, typeset_unit
from .written_numbers import name_and_unit, unit_as_written

_COMMENTS = ("#", "%", "//")
_SEPARATORS = (";", "\t", ",")
_MOST_HEAD_LINES = 1000
_LOOKED_AT = 20
"""Rows from which the separator and the decimal mark are seen."""
_WINDOWS = "cp1252"
_BLOCK = 1 << 20


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


@dataclass(frozen=True)
class CsvTable:
    """Columns of a text file."""

    heads: tuple[str, ...]  # in the order of the file; they differ
    units: dict[str, str]  # of the columns, by head, where a row below the heads gives them
    columns: dict[str, Array]  # numbers by head, shape (n,); those that end early are shorter
    lines: Sequence[int]  # number of the line of each row, counted from 1
    remarks: tuple[str, ...] = ()  # what was assumed about the file


@contextlib.contextmanager
def named_if_unreadable(file: Path) -> Iterator[None]:
    """Turn what the system says of a file that cannot be read into an error that names it."""
    try:
        yield
    except OSError as error:
        raise MeasurementError(
            file.name,
            f"cannot be read: {error.strerror or error}",
            next_step="put a file there that can be read, or take this one away",
        ) from None


def read_csv(file: Path) -> CsvTable:
    """Read a text file of numbers.

    Heads stand in the first row that is no comment (``#``, ``%``, ``//``), or in the last comment where
    numbers follow at once. Below them a row of units may stand. With semicolons or tabs between the cells,
    numbers may have decimal commas. Comments and empty lines are passed over.
    """
    lines = array("q")
    with named_if_unreadable(file):
        layout = _Layout.of(file)
        try:
            # The columns of a file in which every row has a number in every cell.
            some = range(len(layout.heads)) if layout.open_ended else None
            with warnings.catch_warnings(action="ignore", category=UserWarning):  # of a file without numbers
                numbers = np.loadtxt(
                    layout.rows(file, lines), delimiter=layout.separator, quotechar='"', comments=None,
                    ndmin=2, usecols=some,
                )  # fmt: skip
            if len(numbers) and numbers.shape[1] != len(layout.heads):
                raise _uneven(layout, lines[0], numbers.shape[1])
            numbers = numbers if len(numbers) else np.zeros((0, len(layout.heads)))
            columns = {head: numbers[:, place] for place, head in enumerate(layout.heads)}
        except ValueError:
            del lines[:]
            columns = _cell_by_cell(file, layout, lines)
    remarks = [f"is no UTF-8 and was read as {_WINDOWS}"] if layout.encoding == _WINDOWS else []
    if len(lines) and lines[-1] - lines[0] + 1 > len(lines):
        remarks.append("has comments or empty lines between its rows, which messages do not count")
    return CsvTable(layout.heads, layout.units, columns, lines, tuple(remarks))


def _encoding(file: Path) -> str:
    """Return the encoding of a text file; the first one in which every byte has a meaning."""
    with file.open("rb") as stream:
        mark = stream.read(2)
    possible = ("utf-16",) if mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else ("utf-8-sig", _WINDOWS)
    for encoding in possible:
        decoder = codecs.getincrementaldecoder(encoding)()
        try:
            with file.open("rb") as stream:
                for block in iter(lambda: stream.read(_BLOCK), b""):
                    if "\0" in decoder.decode(block):
                        raise ValueError
                decoder.decode(b"", final=True)
        except ValueError:
            continue
        return encoding
    raise MeasurementError(
        file.name,
        "cannot be read: it is no text in UTF-8, UTF-16 with its mark, or Windows-1252",
        next_step="save it as CSV in UTF-8; the ending of a file says what other kind it is",
    )


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
        encoding = _encoding(file)
        with file.open(encoding=encoding, newline="") as stream:
            lines = list(itertools.islice(stream, _MOST_HEAD_LINES))
        comments = list(itertools.takewhile(_is_comment, lines))
        at = len(comments) + titles_before(lines[len(comments) :])
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
        for place, head in enumerate(heads):
            if head in heads[:place]:
                raise MeasurementError(
                    f"{file.name}: columns {heads.index(head) + 1} and {place + 1}",
                    f"have the same head '{head}'" if head else "have no head",
                    next_step="give each column a head of its own",
                )
        units: dict[str, str] = {}
        if at < len(lines):
            below = _cells(file.name, lines[at], separator)
            texts = [cell for cell in below if cell and not _is_number(cell)]
            if texts and all(_is_unit(cell) or cell == "1" for cell in filter(None, below)):
                units = {h: unit_as_written(c.strip("[]()")) for h, c in zip(heads, below, strict=False) if c}
                at += 1
        return _Layout(file.name, encoding, separator, comma, at, tuple(heads), units, open_ended)

    def rows(self, file: Path, lines: array[int]) -> Iterator[str]:
        """Yield the rows of numbers with decimal points, and append the number of the line of each."""
        with file.open(encoding=self.encoding, newline="") as stream:
            for number, line in enumerate(itertools.islice(stream, self.skipped, None), self.skipped + 1):
                if not _is_comment(line):
                    lines.append(number)
                    yield line.replace(",", ".") if self.decimal_comma and "." not in line else line


def titles_before(lines: Sequence[str]) -> int:
    """Return how many lines of words stand before the heads: they have other cells than the rows."""
    for separator in _SEPARATORS:
        cells = [line.strip().split(separator) for line in lines]
        for row, numbers in enumerate(cells):
            if len(numbers) > 1 and all(_is_number(cell.strip().replace(",", ".")) for cell in numbers):
                first = row
                while first and len(cells[first - 1]) == len(numbers):
                    first -= 1
                return first if first < row else 0
    return 0


def _is_comment(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith(_COMMENTS)


def _cells(file: str, line: str, separator: str) -> list[str]:
    try:
        (row,) = csv.reader(io.StringIO(line.strip("\r\n")), delimiter=separator, skipinitialspace=True)
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


def _since_1970(cell: str) -> float:
    """Return date and time of day in s since 1970, in UTC where no zone is stated; zero where it is none."""
    with contextlib.suppress(ValueError, OverflowError):  # no date, but a number or a word
        stamp = datetime.fromisoformat(cell)
        if ":" in cell:
            return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    return 0.0


def _is_unit(cell: str) -> bool:
    try:
        parse_unit(unit_as_written(cell.strip("[]()")))
    except UnitError:
        return False
    return not _is_number(cell)


def _uneven(layout: _Layout, row: int, cells: int) -> MeasurementError:
    comma = layout.separator == "," and cells == 2 * len(layout.heads)
    return MeasurementError(
        f"{layout.file}: row {row}",
        f"has {cells} cells, the heads are {len(layout.heads)}",
        next_step="separate the cells by semicolons where numbers have decimal commas"
        if comma
        else "give each row one cell for each head",
    )


def _cell_by_cell(file: Path, layout: _Layout, lines: array[int]) -> dict[str, Array]:
    """Return columns that may end early, as two clocks side by side do, or name the cell that is odd."""
    columns: dict[str, list[float]] = {head: [] for head in layout.heads}
    ended: dict[str, int] = {}
    for row, cells in _cells_of_rows(file, layout, lines):
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
            elif stamp := _since_1970(cell):
                layout.units.setdefault(head, "s")
                columns[head].append(stamp)
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


def _cells_of_rows(file: Path, layout: _Layout, lines: array[int]) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of the line and the cells of each row."""
    try:
        for cells in csv.reader(layout.rows(file, lines), delimiter=layout.separator):
            yield lines[-1], [cell.strip() for cell in cells]
    except csv.Error as error:
        raise MeasurementError(
            f"{layout.file}: row {lines[-1]}",
            f"cannot be read: {error}",
            next_step="check that the file is a table of numbers, and write it again",
        ) from None


_EXTRA = "tables"


class Axis(NamedTuple):
    """What rows are numbered by."""

    # name, unit: for instance "time" and "s"; no unit for words
    name: str
    unit: str
    values: Any  # one for each row


def data_frame(
    columns: Mapping[str, Any], *, units: Mapping[str, str] | None = None, index: Axis | None = None
) -> Any:
    """Return a ``pandas.DataFrame`` whose ``attrs["units"]`` holds the units by name.

    ``index``: what the rows are numbered by; by their number where none is given.
    """
    try:
        import pandas
    except ModuleNotFoundError:
        raise missing_library("a data frame", "pandas", _EXTRA) from None
    rows = None if index is None else pandas.Index(index.values, name=index.name)
    frame = pandas.DataFrame(dict(columns), index=rows)
    named = {index.name: index.unit} if index is not None and index.unit else {}
    frame.attrs["units"] = named | dict(units or {})
    return frame


def data_set(
    variables: Mapping[str, tuple[Sequence[str], Any]], *, axes: Sequence[Axis], units: Mapping[str, str]
) -> Any:
    """Return an ``xarray.Dataset`` whose variables and coordinates have their unit in ``attrs["units"]``."""
    try:
        import xarray
    except ModuleNotFoundError:
        raise missing_library("a data set", "xarray", _EXTRA) from None
    data = {n: (tuple(of), v, {"units": units[n]} if n in units else {}) for n, (of, v) in variables.items()}
    coordinates = {a.name: ((a.name,), a.values, {"units": a.unit} if a.unit else {}) for a in axes}
    return xarray.Dataset(data, coords=coordinates)
