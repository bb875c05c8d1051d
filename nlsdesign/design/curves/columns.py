"""Small tables of a designer: CSV with names and units in the first row, read strictly."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import MeasurementError, UnitError, nearest
from ...foundation.quantity import parse_unit, same_dimension, typeset_unit
from ...foundation.text_files import text_of
from ...foundation.written_numbers import name_and_unit


@dataclass(frozen=True, eq=False)
class ReadColumns:
    """Columns of one table in SI.

    Parameters
    ----------
    file
        Name of the file, for messages.
    values
        By name, shape (n,).
    units
        As the heads give them, by name.
    lines
        Number of the line of each row.
    """

    file: str
    values: Mapping[str, Array]
    units: Mapping[str, str]
    lines: tuple[int, ...]

    def cell(self, row: int, name: str) -> str:
        """Return where a number stands: file, line and column."""
        return f"{self.file}, line {self.lines[row]}, column '{name}'"


def read_columns(
    path: Path | str, columns: Mapping[str, tuple[str, ...]], *, least_rows: int = 3
) -> ReadColumns:
    """Read the columns of a CSV file; empty lines and lines that begin with ``#`` are passed over.

    ``columns``: the names that it may have, each with a unit for every dimension that it may have. A column
    with the unit ``1`` needs none in its head.
    """
    file = Path(path)
    text = text_of(file, MeasurementError, next_step="name a CSV file in UTF-8")
    rows = [
        (number, next(csv.reader([line], skipinitialspace=True)))
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise MeasurementError(
            file.name, "is empty",
            next_step="begin with heads such as " + ", ".join(f"'{n} [{u[0]}]'" for n, u in columns.items()),
        )  # fmt: skip
    heads = _heads(file.name, rows[0], columns)
    if len(rows) - 1 < least_rows:
        raise MeasurementError(
            file.name, f"has {len(rows) - 1} rows of numbers and needs at least {least_rows}"
        )
    values = np.array([_numbers(file.name, line, cells, list(heads)) for line, cells in rows[1:]])
    in_si = {
        name: values[:, number] * parse_unit(unit).factor for number, (name, unit) in enumerate(heads.items())
    }
    return ReadColumns(file.name, in_si, heads, tuple(line for line, _ in rows[1:]))


def _heads(file: str, row: tuple[int, list[str]], columns: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return the unit of each column by its name, in the order of the file."""
    line, given = row
    for mark, called in ((";", "semicolons"), ("\t", "tabs")):
        if any(mark in head for head in given):
            raise MeasurementError(
                f"{file}, line {line}", f"separates its columns by {called}",
                next_step="separate the cells by commas, with a point in the numbers",
            )  # fmt: skip
    heads: dict[str, str] = {}
    for head in (each.strip() for each in given):
        name, unit = (head, None) if head in columns else name_and_unit(head)
        name, place = name.strip().lower(), f"{file}, line {line}, column '{head}'"
        if name not in columns:
            raise MeasurementError(
                place, "is none that is known here", did_you_mean=nearest(name, columns),
                next_step="the columns may be " + ", ".join(f"'{n} [{u[0]}]'" for n, u in columns.items()),
            )  # fmt: skip
        if name in heads:
            raise MeasurementError(place, "stands there twice", next_step="keep one of them")
        if unit is None and "1" not in columns[name]:
            raise UnitError(
                place, "names no unit", next_step=f"write for instance '{name} [{columns[name][0]}]'"
            )
        unit = unit or "1"
        if not any(same_dimension(unit, allowed) for allowed in columns[name]):
            raise UnitError(
                place, f"'{typeset_unit(unit)}' is no unit of it",
                next_step=f"give it in a unit like '{columns[name][0]}'",
            )  # fmt: skip
        heads[name] = unit
    return heads


def _numbers(file: str, line: int, cells: list[str], names: list[str]) -> list[float]:
    if len(cells) != len(names):
        raise MeasurementError(
            f"{file}, line {line}", f"has {len(cells)} cells, the heads are {len(names)}",
            next_step="separate the cells by commas, with a point in the numbers",
        )  # fmt: skip
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise MeasurementError(
                f"{file}, line {line}, column '{name}'", f"'{cell.strip()}' is no finite number",
                next_step="correct the cell, or take the row out",
            )  # fmt: skip
        numbers.append(number)
    return numbers
