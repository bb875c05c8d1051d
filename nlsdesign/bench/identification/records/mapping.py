"""Mapping of the columns of a file to signals of a model, with units, as ``records.toml`` says it.

A field of the wrong kind is one message with file, field, rule and next step.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ....foundation.errors import MeasurementError, UnitError, nearest
from ....foundation.quantity import parse_unit, same_dimension, typeset_unit
from ....foundation.text_files import text_of
from ....model import FlatModel
from .sampling import FORMS, SAMPLED, Sampling

_FASTEST = 1e6
"""Highest rate in Hz of a common clock: beyond it a record of minutes does not fit into memory."""


def table_at(file: str, field: str, given: Any, next_step: str) -> Mapping[str, Any]:
    """Return a field that must be a table."""
    if not isinstance(given, dict):
        raise MeasurementError(f"{file}: {field}", f"{_shown(given)} is not a table", next_step=next_step)
    return given


def text_at(where: str, field: str, given: Any) -> str:
    """Return a field that must be a text."""
    if not isinstance(given, str):
        raise MeasurementError(
            f"{where}.{field}", f"{_shown(given)} is not a text", next_step=f'write {field} = "..."'
        )
    return given


def number_at(where: str, field: str, given: Any, next_step: str, between: str = ": ") -> float:
    """Return a field that must be a finite number."""
    if isinstance(given, int | float) and not isinstance(given, bool):
        try:
            number = float(given)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if math.isfinite(number):
            return number
    raise MeasurementError(
        f"{where}{between}{field}", f"{_shown(given)} is not a finite number", next_step=next_step
    )


def globs_at(file: str, field: str, given: Any) -> tuple[str, ...]:
    """Return a field that must be a list of names of records."""
    if not isinstance(given, list) or not all(isinstance(each, str) for each in given):
        raise MeasurementError(
            f"{file}: {field}",
            f"{_shown(given)} is not a list of names of records",
            next_step=f'write {field} = ["multisine*"]',
        )
    return tuple(given)


def _shown(given: Any) -> str:
    try:
        text = repr(given)
    except ValueError:  # whole numbers beyond the limit of digits
        text = "the number"
    return text if len(text) <= 40 else f"{text[:37]}..."


@dataclass(frozen=True)
class Column:
    """What a column of a file measures."""

    name: str  # head of the column in the file
    signal: str  # full name of the signal in the model
    unit: str  # unit in the file
    # noise, quantum: declared standard deviation of the noise and size of one count, in SI; 0 where nothing
    # is declared. The noise is also estimated from the records.
    noise: float = 0.0
    quantum: float = 0.0
    time: str = ""  # head of the clock of this column, in the unit of [time]; empty for the clock of [time]
    # sampling: how the signal runs between its samples; None where the records are to tell
    sampling: Sampling | None = SAMPLED
    declared: bool = True  # whether that is said: otherwise the channel may be shifted by up to half a sample


@dataclass(frozen=True)
class Align:
    """A lag to be estimated and removed."""

    # column, to: heads of two columns that show the same motion; the first may be delayed. They need not be
    # mapped.
    column: str
    to: str
    # time: head of the clock of column where that is not mapped. All columns of a clock of its own move
    # together; a column on the clock of [time] moves alone.
    time: str = ""
    longest: float | None = None  # largest lag in s; a quarter of the record where None


@dataclass(frozen=True)
class Inputs:
    """Which signals command the machine: they may rest at a limit, and jump."""

    # commanded: full names of inputs, and of what a controller in the model commands its drive with
    commanded: frozenset[str] = frozenset()
    # shown: full names of readings of one of them, and of what is left of it within the limits of its drive
    shown: frozenset[str] = frozenset()

    @staticmethod
    def of(model: FlatModel) -> Inputs:
        """Return what commands a model."""
        commanded = frozenset(v.name for v in model.inputs) | {c for b in model.bodies for c in b.commands}
        acting = frozenset(a for b in model.bodies for a in b.acting)
        readings = (r.signal for r in model.readings if r.measured in commanded | acting)
        return Inputs(commanded, frozenset(readings) | acting)


@dataclass(frozen=True)
class ColumnMap:
    """Columns of a set of records, the time column, and the records that are held out.

    Parameters
    ----------
    time, columns
        Heads, signals and units.
    held_out, selection
        Globs on the names of records.
    held_out_after
        Time in s after which every record is held out; ``None`` where records are held out as a whole.
    resample
        Rate in Hz of the common clock; ``None`` to keep the columns as sampled.
    align
        Lags to be removed before resampling; these need a rate.
    inputs
        Signals that are inputs of the model: what is odd in a reading may be right in a command.
    """

    time: Column
    columns: tuple[Column, ...]
    held_out: tuple[str, ...] = ()
    selection: tuple[str, ...] = ()
    held_out_after: float | None = None
    resample: float | None = None
    align: tuple[Align, ...] = ()
    inputs: Inputs = Inputs()

    def clock_of(self, column: Column) -> Column:
        """Return the column of times of a column.

        Parameters
        ----------
        column
            Of the file.
        """
        return replace(self.time, name=column.time) if column.time else self.time


def read_mapping(path: Path, joint: str | None = None) -> ColumnMap:
    """Read the mapping of columns to signals; ``{joint}`` in a head stands for the name of a joint.

    ``path``: TOML file. Where it has no table ``columns``, the heads of the records say what they are; where
    it has no ``time`` either, also which column holds the time, and the name of that column is empty here.
    """
    try:
        text = text_of(path, MeasurementError, next_step="name a records.toml")
        tables = tomllib.loads(text if joint is None else text.replace("{joint}", joint))
    except (ValueError, RecursionError) as error:
        raise MeasurementError(
            path.name,
            f"cannot be read as a mapping: {error}",
            next_step="correct it, or write it again as TOML",
        ) from None
    known = ("time", "columns", "held_out", "selection", "held_out_after", "resample_Hz", "align")
    _check_fields(path.name, tables, known)
    given = table_at(path.name, "columns", tables.get("columns", {}), 'write [columns.<head>] signal = "..."')
    columns = tuple(_mapped(path, head, table) for head, table in given.items())
    first: dict[str, str] = {}
    for column in columns:
        if column.signal in first:
            raise MeasurementError(
                f"{path.name}: columns.{column.name}",
                f"is mapped to '{column.signal}', as '{first[column.signal]}' is",
                next_step="map each column to a signal of its own",
            )
        first[column.signal] = column.name
    aligned = tables.get("align", [])
    if not isinstance(aligned, list) or not all(isinstance(each, dict) for each in aligned):
        raise MeasurementError(
            f"{path.name}: align",
            "is not a list of tables",
            next_step='write [[align]] column = "...", to = "..."',
        )
    mapping = ColumnMap(
        _time(path.name, tables["time"]) if "time" in tables else Column("", "time", "s"),
        columns,
        globs_at(path.name, "held_out", tables.get("held_out", [])),
        globs_at(path.name, "selection", tables.get("selection", [])),
        _seconds(f"{path.name}: held_out_after", tables.get("held_out_after")),
        _rate(path.name, tables.get("resample_Hz")),
        tuple(_align(f"{path.name}: align", table) for table in aligned),
    )
    _check_clock(path.name, mapping)
    return mapping


def _time(file: str, given: Any) -> Column:
    table = table_at(file, "time", given, 'write [time] column = "t_ms", unit = "ms"')
    _check_fields(f"{file}: time", table, ("column", "unit"), ".")
    head = text_at(f"{file}: time", "column", table.get("column", "t_s"))
    unit = text_at(f"{file}: time", "unit", table.get("unit", "s"))
    if not _is_time(unit):
        raise MeasurementError(
            f"{file}: time.unit", f"'{unit}' is no unit of time", next_step='write "s", "ms" or "min"'
        )
    return Column(head, "time", unit)


def _is_time(unit: str) -> bool:
    try:
        return same_dimension(unit, "s")
    except UnitError:
        return False


def _check_fields(where: str, given: Mapping[str, Any], known: Sequence[str], between: str = ": ") -> None:
    for key in given:
        if key not in known:
            raise MeasurementError(
                f"{where}{between}{key}", "no such field",
                did_you_mean=nearest(key, known), next_step=f"use one of: {', '.join(known)}",
            )  # fmt: skip


def _seconds(where: str, given: Any) -> float | None:
    if given is None:
        return None
    try:
        if not same_dimension(given["unit"], "s"):
            raise TypeError
        return number_at(where, "value", given["value"], "") * parse_unit(given["unit"]).factor
    except (KeyError, TypeError, ValueError, AttributeError, UnitError, MeasurementError):
        field = where.rpartition(" ")[2].rpartition(".")[2]
        raise MeasurementError(
            where, "is not a time", next_step=f'write {field} = {{value = 12.5, unit = "s"}}'
        ) from None


def _rate(file: str, given: Any) -> float | None:
    if given is None:
        return None
    rate = number_at(file, "resample_Hz", given, "write for instance resample_Hz = 500")
    if not 0.0 < rate <= _FASTEST:
        raise MeasurementError(
            f"{file}: resample_Hz",
            f"{given!r} is not a rate between 0 and {_FASTEST:g} Hz",
            next_step="write for instance resample_Hz = 500",
        )
    return rate


def _align(where: str, table: Mapping[str, Any]) -> Align:
    _check_fields(where, table, ("column", "to", "time", "longest"), ".")
    for key in ("column", "to"):
        if not isinstance(table.get(key), str):
            raise MeasurementError(where, f"has no {key}", next_step=f'add {key} = "<head of a column>"')
    own = text_at(where, "time", table.get("time", ""))
    longest = _seconds(f"{where}.longest", table.get("longest"))
    if longest is not None and longest <= 0.0:
        raise MeasurementError(f"{where}.longest", "must be above zero")
    return Align(table["column"], table["to"], own, longest)


def _check_clock(file: str, mapping: ColumnMap) -> None:
    """Check that a common rate is given where one is needed; nothing is resampled without it."""
    if mapping.resample is not None:
        return
    for column in mapping.columns:
        if column.time:
            raise _without_rate(f"{file}: columns.{column.name}.time", "is a clock of its own")
    if mapping.align:
        raise _without_rate(f"{file}: align", "moves a clock")


def _without_rate(where: str, what: str) -> MeasurementError:
    return MeasurementError(
        where, f"{what}, but no common rate is given", next_step="add resample_Hz = <rate in Hz> at the top"
    )


def _mapped(path: Path, head: str, given: Any) -> Column:
    where = f"{path.name}: columns.{head}"
    way_out = f'write [columns.{head}] signal = "...", unit = "..."'
    table = table_at(path.name, f"columns.{head}", given, way_out)
    for key in ("signal", "unit"):
        if key not in table:
            raise MeasurementError(where, f"has no {key}", next_step=f'add {key} = "..."')
    _check_fields(where, table, ("signal", "unit", "noise", "quantum", "time", "between_samples"), ".")
    unit = text_at(where, "unit", table["unit"])
    try:
        factor = parse_unit(unit).factor
    except UnitError as error:
        raise MeasurementError(
            where, f"{error.thing} {error.rule}", did_you_mean=error.did_you_mean
        ) from None
    noise, quantum = (_size(where, key, table.get(key, 0.0)) * factor for key in ("noise", "quantum"))
    signal, own = text_at(where, "signal", table["signal"]), text_at(where, "time", table.get("time", ""))
    return Column(head, signal, unit, noise, quantum, own, _sampling(where, table.get("between_samples")))


def _sampling(where: str, given: Any) -> Sampling | None:
    """Return how a signal runs between its samples, ``None`` where nothing is said."""
    if given is None:
        return None
    named = {form.name: form for form in FORMS}
    text = text_at(where, "between_samples", given)
    if text not in named:
        meanings = "; ".join(f'"{form.name}" {form.words}' for form in FORMS)
        raise MeasurementError(
            f"{where}.between_samples", f"'{text}' is no way to run between samples",
            did_you_mean=nearest(text, named), next_step=f"choose: {meanings}",
        )  # fmt: skip
    return named[text]


def _size(where: str, field: str, given: Any) -> float:
    way_out = f"write {field} = 0.01, in the unit of the file"
    size = number_at(where, field, given, way_out, ".")
    if size < 0.0:
        raise MeasurementError(f"{where}.{field}", f"{given!r} is negative", next_step=way_out)
    return size


def with_known_sampling(file: str, mapping: ColumnMap, model: FlatModel) -> ColumnMap:
    """Return the mapping in which only how inputs run between their samples is left to the records to tell.

    ``mapping``: its inputs are those of the model; a motion that is held is refused.
    """
    motions = {name for body in model.bodies for name in (body.motion, body.rate)}
    shown = {r.signal for r in model.readings if r.measured in motions} | motions
    driving = mapping.inputs.commanded | mapping.inputs.shown
    columns = []
    for column in mapping.columns:
        if column.sampling is not None and column.sampling.held_from is not None and column.signal in shown:
            raise MeasurementError(
                f"{file}: column '{column.name}'",
                f"is declared '{column.sampling.name}', but a motion moves on between its samples",
                next_step='write between_samples = "sampled", or leave it out',
            )
        if column.sampling is None:
            asked = column.signal in driving and column.signal not in shown
            column = replace(column, sampling=None if asked else SAMPLED, declared=False)
        columns.append(column)
    return replace(mapping, columns=tuple(columns))


def check_signals(file: str, columns: Sequence[Column], model: FlatModel) -> None:
    """Check that every column measures a signal of the model in a unit of its dimension."""
    everything = {v.name: v for v in model.states + model.inputs + model.signals}
    for column in columns:
        where = f"{file}: column '{column.name}'"
        if column.signal not in everything:
            raise MeasurementError(
                where,
                f"is mapped to '{column.signal}', which the model does not have",
                did_you_mean=nearest(column.signal, everything),
                next_step="map it to a signal of this deck, or give the deck of the rig that was measured",
            )
        variable = everything[column.signal]
        if not same_dimension(column.unit, variable.unit):
            given, expected = typeset_unit(column.unit), typeset_unit(variable.unit)
            raise MeasurementError(
                where,
                f"is in {given}, but {column.signal} is measured in {expected}",
                next_step="correct the unit or the mapping",
            )
