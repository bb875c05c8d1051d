"""Which column of a file measures which signal of a model, and in what unit."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import MeasurementError, UnitError, nearest
from ..model import FlatModel
from ..quantity import parse_unit, same_dimension

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]+)\]$")
_TIME_NAMES = ("t", "time")


@dataclass(frozen=True)
class Column:
    """What a column of a file measures.

    Parameters
    ----------
    name
        Head of the column in the file.
    signal
        Full name of the signal in the model.
    unit
        Unit in the file.
    noise, quantum
        Declared standard deviation of the noise and size of one count, in SI; 0 where nothing is declared.
        Declared numbers are a claim: the noise is also estimated from the records.
    """

    name: str
    signal: str
    unit: str
    noise: float = 0.0
    quantum: float = 0.0


@dataclass(frozen=True)
class ColumnMap:
    """Columns of a set of records, the time column, and what is kept apart.

    Parameters
    ----------
    time, columns
        Heads, signals and units.
    held_out, selection
        Globs on the names of records.
    held_out_after
        Time in s after which every record is held out; ``None`` where records are held out as a whole.
    """

    time: Column
    columns: tuple[Column, ...]
    held_out: tuple[str, ...] = ()
    selection: tuple[str, ...] = ()
    held_out_after: float | None = None


def times_among(heads: Sequence[str]) -> list[tuple[str, str]]:
    """Return heads that name a time, with their units.

    Parameters
    ----------
    heads
        Of a table.
    """
    named = [(head, *_name_and_unit(head)) for head in heads]
    return [(h, u) for h, n, u in named if u and same_dimension(u, "s") and n.lower() in _TIME_NAMES]


def read_mapping(path: Path) -> ColumnMap:
    """Read the mapping of columns to signals.

    Parameters
    ----------
    path
        TOML file.

    Raises
    ------
    MeasurementError
        If it is not valid or a column lacks signal or unit.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise MeasurementError(path.name, f"cannot be read as a mapping: {error}") from None
    known = ("time", "columns", "held_out", "selection", "held_out_after")
    for key in tables:
        if key not in known:
            raise MeasurementError(f"{path.name}: {key}", "no such field", did_you_mean=nearest(key, known))
    columns = tuple(_mapped(path, head, table) for head, table in tables.get("columns", {}).items())
    time = tables.get("time", {"column": "t_s"})
    if not columns:
        raise MeasurementError(
            path.name, "maps no column", next_step='add [columns.<head>] signal = "...", unit = "..."'
        )
    return ColumnMap(
        Column(str(time.get("column", "t_s")), "time", str(time.get("unit", "s"))),
        columns,
        tuple(tables.get("held_out", ())),
        tuple(tables.get("selection", ())),
        _seconds(path, tables.get("held_out_after")),
    )


def _seconds(path: Path, given: Any) -> float | None:
    if given is None:
        return None
    try:
        return float(given["value"]) * parse_unit(given["unit"]).factor
    except (KeyError, TypeError, ValueError, UnitError):
        raise MeasurementError(
            f"{path.name}: held_out_after",
            "is not a time",
            next_step='write held_out_after = {value = 12.5, unit = "s"}',
        ) from None


def _mapped(path: Path, head: str, table: Mapping[str, Any]) -> Column:
    where = f"{path.name}: columns.{head}"
    for key in ("signal", "unit"):
        if key not in table:
            raise MeasurementError(where, f"has no {key}", next_step=f'add {key} = "..."')
    valid = ("signal", "unit", "noise", "quantum")
    for key in table:
        if key not in valid:
            raise MeasurementError(f"{where}.{key}", "no such field", did_you_mean=nearest(key, valid))
    try:
        factor = parse_unit(table["unit"]).factor
    except UnitError as error:
        raise MeasurementError(
            where, f"{error.thing} {error.rule}", did_you_mean=error.did_you_mean
        ) from None
    noise, quantum = float(table.get("noise", 0.0)) * factor, float(table.get("quantum", 0.0)) * factor
    return Column(head, str(table["signal"]), str(table["unit"]), noise, quantum)


def default_mapping(heads: Sequence[str], model: FlatModel, file: str) -> ColumnMap:
    """Return the mapping that the heads of the columns speak for themselves.

    Parameters
    ----------
    heads
        ``name [unit]`` or ``name_unit``.
    model
        Its signals, and the readings of its sensors.
    file
        For messages.

    Raises
    ------
    MeasurementError
        If there is no time, or a column could be several signals or none.
    """
    split_heads = [(head, *_name_and_unit(head)) for head in heads]
    times = times_among(heads)
    if not times:
        raise MeasurementError(file, "has no column of time", next_step="name it 't_s' or 'time [s]'")
    columns = [
        Column(head, signal, str(unit), *_declared(model, signal))
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
    return ColumnMap(Column(times[0][0], "time", times[0][1]), tuple(columns))


def _name_and_unit(head: str) -> tuple[str, str | None]:
    match = _BRACKETED.match(head)
    name, unit = (
        (match["name"], match["unit"]) if match else (head.rpartition("_")[0], head.rpartition("_")[2])
    )
    try:
        parse_unit(unit)
    except UnitError:
        return head, None
    return name, unit


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
    for group in ([v for v in everything.values() if v.name.endswith(".reading")], list(model.inputs)):
        fitting = [v.name for v in group if same_dimension(v.unit, unit)]
        if len(fitting) == 1:
            return fitting[0]
        if fitting:
            break
    raise MeasurementError(
        f"{file}: column '{head}'",
        f"could be {' or '.join(fitting)}" if fitting else f"no sensor of the model reads in {unit}",
        next_step="write a records.toml that maps each column to its signal",
    )


def _declared(model: FlatModel, signal: str) -> tuple[float, float]:
    owner = signal.rpartition(".")[0]
    values = model.values
    return values.get(f"{owner}.noise", 0.0), values.get(f"{owner}.quantum", 0.0)


def check_signals(file: str, columns: Sequence[Column], model: FlatModel) -> None:
    """Check that every column measures something that the model has, in a unit that fits.

    Parameters
    ----------
    file
        For messages.
    columns
        Mapped.
    model
        Whose signals are measured.

    Raises
    ------
    MeasurementError
        Naming the column, the signal and both units.
    """
    everything = {v.name: v for v in model.states + model.inputs + model.signals}
    for column in columns:
        where = f"{file}: column '{column.name}'"
        if column.signal not in everything:
            raise MeasurementError(
                where,
                f"is mapped to '{column.signal}', which the model does not have",
                did_you_mean=nearest(column.signal, everything),
            )
        variable = everything[column.signal]
        if not same_dimension(column.unit, variable.unit):
            raise MeasurementError(
                where,
                f"is in {column.unit}, but {column.signal} is measured in {variable.unit}",
                next_step="mend the unit or the mapping",
            )
