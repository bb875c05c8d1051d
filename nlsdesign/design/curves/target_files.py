"""Target curves, bands and other small tables of a designer from CSV files with units in their heads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.csv_tables import heads_with_units, read_csv
from ...foundation.errors import MeasurementError, UnitError, ValueRangeError, nearest
from ...foundation.quantity import parse_unit, same_dimension, typeset_unit
from ...foundation.written_numbers import name_and_unit
from .target import EXACT, TabulatedStiffness, TabulatedTorque, Target, TorqueBand


@dataclass(frozen=True, eq=False)
class ReadColumns:
    """Columns of one table in SI."""

    file: str  # name of the file, for messages
    values: Mapping[str, Array]  # by name, shape (n,)
    units: Mapping[str, str]  # as the heads give them, by name
    lines: tuple[int, ...]  # number of the line of each row

    def cell(self, row: int, name: str) -> str:
        """Return where a number stands: file, line and column."""
        return f"{self.file}, line {self.lines[row]}, column '{name}'"


def read_columns(
    path: Path | str, columns: Mapping[str, tuple[str, ...]], *, least_rows: int = 3
) -> ReadColumns:
    """Read the columns of a CSV file, written in any way that records may be written in.

    ``columns``: the names that it may have, each with a unit for every dimension that it may have. A column
    with the unit ``1`` needs none in its head.
    """
    file = Path(path)
    table = read_csv(file)
    if not table.heads:
        raise MeasurementError(
            file.name, "is empty",
            next_step="begin with heads such as " + ", ".join(f"'{n} [{u[0]}]'" for n, u in columns.items()),
        )  # fmt: skip
    heads = _heads(file.name, heads_with_units(file.name, table.heads, table.units), columns)
    if len(table.lines) < least_rows:
        raise MeasurementError(
            file.name, f"has {len(table.lines)} rows of numbers and needs at least {least_rows}"
        )
    in_si = {}
    for (name, unit), numbers in zip(heads.items(), table.columns.values(), strict=True):
        padded = np.append(numbers, np.full(len(table.lines) - len(numbers), np.nan))
        if not np.all(np.isfinite(padded)):
            line = table.lines[int(np.argmin(np.isfinite(padded)))]
            raise MeasurementError(
                f"{file.name}, line {line}, column '{name}'", "is no finite number",
                next_step="correct the cell, or take the row out",
            )  # fmt: skip
        in_si[name] = padded * parse_unit(unit).factor
    return ReadColumns(file.name, in_si, heads, tuple(table.lines))


_NAMES = {
    "winkel": "angle", "drehmoment": "torque", "moment": "torque", "steifigkeit": "stiffness",
    "gewicht": "weight", "couple": "torque", "raideur": "stiffness", "poids": "weight",
    "rigidez": "stiffness", "momento": "torque", "coppia": "torque", "zeit": "time", "temps": "time",
    "tiempo": "time", "tempo": "time",
}  # fmt: skip
"""Names of the columns in languages of workshops."""


def _heads(file: str, given: Sequence[str], columns: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return the unit of each column by its name, in the order of the file."""
    heads: dict[str, str] = {}
    for head in given:
        name, unit = (head, None) if head in columns else name_and_unit(head)
        name, place = name.strip().lower(), f"{file}: column '{head}'"
        name = name if name in columns else _NAMES.get(name, name)
        if name not in columns:
            raise MeasurementError(
                place, "is not a column that is read here", did_you_mean=nearest(name, columns),
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


_COLUMNS = {
    "angle": ("rad",),
    "torque": ("N*m",),
    "stiffness": ("N*m/rad",),
    "weight": ("1",),
    "lower": ("N*m",),
    "upper": ("N*m",),
}


def read_target(path: Path | str) -> Target:
    """Read a target curve from a CSV file.

    The first row names the columns with their units, ``angle [deg]`` or ``angle_deg``: the angle with the
    torque, or with the stiffness. A column ``weight`` weighs the error; columns ``lower`` and ``upper`` are
    the band that :func:`read_band` reads. Lines that begin with ``#`` are comments.

    Parameters
    ----------
    path
        Of the file.

    Returns
    -------
    Target
        A :class:`TabulatedTorque`, or a :class:`TabulatedStiffness`.

    Raises
    ------
    MeasurementError
        If the file cannot be read, or a column or a cell is missing, unknown or no number.
    UnitError
        If a unit is missing or of another dimension.
    ValueRangeError
        If the angles do not ascend from zero, a stiffness or weight is negative, or a torque gives more work
        than it has taken up.
    """
    table = read_columns(path, _COLUMNS)
    kinds = [name for name in ("torque", "stiffness") if name in table.values]
    _require(table, "angle")
    if len(kinds) != 1:
        raise MeasurementError(
            table.file,
            "has a column of torque and one of stiffness" if kinds else "has no column 'torque'",
            next_step="keep one of them" if kinds else "name it 'torque [N*m]', or read a band by read_band",
        )
    _ascending_from_zero(table)
    work = scipy.integrate.cumulative_trapezoid(table.values[kinds[0]], table.values["angle"])
    given = np.flatnonzero(work < -EXACT * np.max(np.abs(work)))
    if kinds == ["stiffness"]:
        _nowhere_negative(table, "stiffness")
    elif len(given):
        row = int(given[0]) + 1
        raise ValueRangeError(
            f"{table.cell(row, 'torque')} = {table.values['torque'][row]:g}",
            "must be nowhere negative before the spring has taken up as much work",
            next_step="torque resists a positive angle: turn the sign of the column, or of the angle",
        )
    angles, values = tuple(table.values["angle"]), tuple(table.values[kinds[0]])
    if kinds == ["stiffness"]:
        if "weight" in table.values:
            raise MeasurementError(
                f"{table.file}, column 'weight'", "belongs to a torque, not to a stiffness",
                next_step="give 'torque [N*m]' in the place of the stiffness",
            )  # fmt: skip
        return TabulatedStiffness(angles=angles, stiffnesses=values)
    if values[0] != 0.0:
        raise ValueRangeError(
            f"{table.cell(0, 'torque')} = {values[0]:g} N·m", "the curve must start at zero torque",
            next_step="a spring has no torque at angle zero; a band may be wider there, see read_band",
        )  # fmt: skip
    weights: tuple[float, ...] = ()
    if "weight" in table.values:
        _nowhere_negative(table, "weight")
        weights = tuple(table.values["weight"])
    return TabulatedTorque(angles=angles, torques=values, weights=weights)


def read_band(path: Path | str) -> TorqueBand:
    """Read a band of torques from a CSV file with the columns ``angle``, ``lower`` and ``upper``.

    Heads and errors are those of :func:`read_target`; the lower torque must lie below the upper.
    """
    table = read_columns(path, _COLUMNS)
    for name in ("angle", "lower", "upper"):
        _require(table, name)
    _ascending_from_zero(table)
    lower, upper = table.values["lower"], table.values["upper"]
    crossed = upper <= lower
    crossed[0] = upper[0] < lower[0]
    if np.any(crossed):
        row = int(np.argmax(crossed))
        raise ValueRangeError(
            table.cell(row, "upper"),
            f"the upper torque {upper[row]:g} must be above the lower {lower[row]:g} N·m",
            next_step="exchange the columns, or widen the band there",
        )
    return TorqueBand(angles=tuple(table.values["angle"]), lower=tuple(lower), upper=tuple(upper))


def _require(table: ReadColumns, name: str) -> None:
    if name not in table.values:
        raise MeasurementError(
            table.file, f"has no column '{name}'", next_step=f"name it '{name} [{_COLUMNS[name][0]}]'"
        )


def _ascending_from_zero(table: ReadColumns) -> None:
    angles = table.values["angle"]
    if angles[0] < 0.0:
        raise ValueRangeError(
            f"{table.cell(0, 'angle')}", "rows begin at angle zero, a curve holds no negative angles",
            next_step="take the rows of negative angles out, and begin with angle zero",
        )  # fmt: skip
    if angles[0] != 0.0:
        raise ValueRangeError(
            f"{table.cell(0, 'angle')}", "the first angle must be zero",
            next_step="add a row for angle zero",
        )  # fmt: skip
    backward = np.diff(angles) <= 0.0
    if np.any(backward):
        raise ValueRangeError(
            table.cell(int(np.argmax(backward)) + 1, "angle"), "angles must ascend",
            next_step="sort the rows by angle and keep one of equal ones",
        )  # fmt: skip
    if angles[-1] > 6.3:
        raise ValueRangeError(
            f"{table.cell(len(angles) - 1, 'angle')} = {angles[-1]:g} rad", "is more than one turn",
            next_step="were degrees meant? name the column 'angle [deg]'",
        )  # fmt: skip


def _nowhere_negative(table: ReadColumns, name: str) -> None:
    negative = table.values[name] < 0.0
    if np.any(negative):
        row = int(np.argmax(negative))
        raise ValueRangeError(
            f"{table.cell(row, name)} = {table.values[name][row]:g}", "must be nowhere negative",
            next_step="turn the sign of the column, or of the angle",
        )  # fmt: skip
