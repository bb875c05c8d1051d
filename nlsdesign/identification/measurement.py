"""Measured records: CSV files and the mapping of their columns to signals with units."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import MeasurementError, UnitError, nearest, unknown_name
from ..model import FlatModel
from ..quantity import parse_unit, same_dimension
from ..simulation import Trace
from .quality import Finding, check_columns, check_time, read_table, suspicions

Array = NDArray[np.float64]
Role = Literal["fit", "selection", "held_out"]

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
    """Columns of a set of records, the time column, and which records are kept apart."""

    time: Column
    columns: tuple[Column, ...]
    held_out: tuple[str, ...] = ()
    selection: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Record:
    """One measured run on a uniform time grid.

    Parameters
    ----------
    name
        Name of the file without its ending.
    trace
        Signals in SI by full name.
    role
        ``fit``: parameters are fitted to it; ``selection``: hypotheses are compared on it; ``held_out``: only
        judged on, at the end.
    source
        File, and what was done to the samples on the way in.
    """

    name: str
    trace: Trace
    role: Role = "fit"
    source: str = ""

    @property
    def step(self) -> float:
        """Time between samples in s."""
        return float((self.trace.time[-1] - self.trace.time[0]) / (len(self.trace) - 1))


@dataclass(frozen=True, eq=False)
class RecordSet:
    """Records of one rig with the same signals.

    Parameters
    ----------
    records
        In order of name.
    columns
        What was measured.
    findings
        What makes the data suspect.
    """

    records: tuple[Record, ...]
    columns: tuple[Column, ...]
    findings: tuple[Finding, ...] = field(default=())

    @property
    def signals(self) -> tuple[str, ...]:
        """Full names of the measured signals."""
        return tuple(c.signal for c in self.columns)

    def of(self, *roles: Role) -> tuple[Record, ...]:
        """Return the records of some roles.

        Parameters
        ----------
        *roles
            For instance ``"fit"``.
        """
        return tuple(r for r in self.records if r.role in roles)

    def column(self, signal: str) -> Column:
        """Return the column that measures a signal.

        Parameters
        ----------
        signal
            Full name.
        """
        for each in self.columns:
            if each.signal == signal:
                return each
        raise unknown_name("measured signal", signal, self.signals)


def load_records(
    folder: Path,
    model: FlatModel,
    *,
    mapping: Path | None = None,
    hold_out: Sequence[str] = (),
) -> RecordSet:
    """Read all CSV files of a folder as records of one rig.

    Parameters
    ----------
    folder
        Holds ``*.csv``, one file per record, and perhaps ``records.toml``. Files without a column of time are
        not records and are left out.
    model
        Whose signals are measured.
    mapping
        TOML with ``[time] column, unit``, ``[columns.<head>] signal, unit, noise, quantum`` and the lists of
        globs ``held_out`` and ``selection``. By default ``records.toml`` in the folder; without it the heads
        must be names of signals, or name a unit that only one sensor of the model has.
    hold_out
        Globs on record names. Without any, here or in the mapping, every third record in order of name is
        held out, beginning with the second; a single record is cut after two thirds.

    Raises
    ------
    MeasurementError
        If a file cannot be used as it stands: file, column and rows are named.
    """
    folder = Path(folder)
    files = sorted(folder.glob("*.csv")) if folder.is_dir() else []
    if not files:
        raise MeasurementError(str(folder), "holds no CSV file", next_step="name the folder of the records")
    path = mapping or (folder / "records.toml" if (folder / "records.toml").exists() else None)
    given = read_mapping(path) if path else None
    tables = {file: read_table(file) for file in files}
    runs = {file: table for file, table in tables.items() if _is_run(table[0], given)}
    if not runs:
        raise MeasurementError(
            str(folder), "no CSV file has a column of time", next_step="name it 't_s' or 'time [s]'"
        )
    first = next(iter(runs))
    chosen = given or default_mapping(runs[first][0], model, first.name)
    _check_signals(first.name, chosen.columns, model)
    records, findings = [], []
    for file, (heads, table) in runs.items():
        record, found = _record(file, heads, table, chosen)
        records.append(record)
        findings += found
    held = tuple(hold_out) or chosen.held_out
    return RecordSet(split(records, held, chosen.selection), chosen.columns, tuple(findings))


def _is_run(heads: Sequence[str], mapping: ColumnMap | None) -> bool:
    """Tell whether a file is a record: tables without any of the columns may lie in the same folder."""
    if mapping is not None:
        return any(c.name in heads for c in (mapping.time, *mapping.columns))
    return bool(_times(heads))


def _times(heads: Sequence[str]) -> list[tuple[str, str]]:
    named = [(head, *_name_and_unit(head)) for head in heads]
    return [(h, u) for h, n, u in named if u and same_dimension(u, "s") and n.lower() in _TIME_NAMES]


def split(
    records: Sequence[Record], held_out: Sequence[str] = (), selection: Sequence[str] = ()
) -> tuple[Record, ...]:
    """Return the records with their roles.

    Parameters
    ----------
    records
        In order of name.
    held_out, selection
        Globs on names; see :func:`load_records` for what happens without ``held_out``.

    Raises
    ------
    MeasurementError
        If a glob matches nothing, or no record is left for fitting.
    """
    if not held_out and len(records) == 1:
        return _cut_in_time(records[0])
    names = [r.name for r in records]
    chosen = {n for g in held_out for n in fnmatch.filter(names, g)} if held_out else set(names[1::3])
    compared = {n for g in selection for n in fnmatch.filter(names, g)} - chosen
    for glob in (*held_out, *selection):
        if not fnmatch.filter(names, glob):
            raise MeasurementError(
                f"held-out records '{glob}'",
                "no record has such a name",
                did_you_mean=nearest(glob, names),
                next_step=f"records are: {', '.join(names)}",
            )
    roles: dict[str, Role] = dict.fromkeys(compared, "selection")
    roles.update(dict.fromkeys(chosen, "held_out"))
    if len(roles) == len(names):
        raise MeasurementError("records", "none is left for fitting", next_step="hold out fewer records")
    return tuple(replace(r, role=roles.get(r.name, "fit")) for r in records)


def _cut_in_time(record: Record) -> tuple[Record, ...]:
    cut, trace = 2 * len(record.trace) // 3, record.trace
    parts = [
        (f"{record.name} (first two thirds)", slice(None, cut), "fit"),
        (f"{record.name} (last third)", slice(cut, None), "held_out"),
    ]
    return tuple(
        replace(
            record,
            name=name,
            role=role,  # type: ignore[arg-type]
            trace=Trace(trace.time[part], {n: v[part] for n, v in trace.signals.items()}, trace.units, name),
        )
        for name, part, role in parts
    )


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
    known = ("time", "columns", "held_out", "selection")
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
    )


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
    times = _times(heads)
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


def _check_signals(file: str, columns: Sequence[Column], model: FlatModel) -> None:
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


def _record(
    file: Path, heads: Sequence[str], table: Array, mapping: ColumnMap
) -> tuple[Record, list[Finding]]:
    needed = [mapping.time, *mapping.columns]
    for column in needed:
        if column.name not in heads:
            raise MeasurementError(
                f"{file.name}: column '{column.name}'", "is missing", did_you_mean=nearest(column.name, heads)
            )
    raw = {c.name: table[:, list(heads).index(c.name)] for c in needed}
    check_columns(file.name, raw)
    time = raw[mapping.time.name] * parse_unit(mapping.time.unit).factor
    note = check_time(file.name, mapping.time.name, time)
    grid = np.linspace(time[0], time[-1], len(time))
    signals = {
        c.signal: np.interp(grid, time, raw[c.name]) * parse_unit(c.unit).factor for c in mapping.columns
    }
    if not note:
        signals = {c.signal: raw[c.name] * parse_unit(c.unit).factor for c in mapping.columns}
    units = {c.signal: _si(c.unit) for c in mapping.columns}
    found = [f for c in mapping.columns for f in suspicions(file.name, c.name, raw[c.name])]
    return Record(file.stem, Trace(grid, signals, units, file.stem), source=f"{file.name}{note}"), found


def _si(unit: str) -> str:
    known = ("rad", "rad/s", "m", "m/s", "A", "V", "N", "N*m", "Pa", "K", "1", "rad/s^2", "m/s^2")
    return next((name for name in known if same_dimension(name, unit)), unit)
