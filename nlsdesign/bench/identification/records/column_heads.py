"""What the head of a column says: whether it is the time, which signal it holds, and in which unit.

Columns of a file that drive a machine: its inputs over time, in SI.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ....foundation.arrays import Array
from ....foundation.csv_tables import heads_with_units, read_csv
from ....foundation.errors import MeasurementError
from ....foundation.quantity import parse_unit, same_dimension, typeset_unit
from ....foundation.written_numbers import name_and_unit
from ....model import FlatModel
from ....model.readings import reading_of
from .mapping import Column, ColumnMap

_TIME_NAMES = ("t", "time")
_TIME_WORDS = (
    "timestamp", "seconds", "ms", "elapsed time", "zeit", "zeitstempel", "temps", "tiempo", "tempo", "tid",
    "tijd", "czas", "aika", "idő", "dauer", "durée", "время", "时间", "時間",
)  # fmt: skip
"""Further names of a time: of instruments, and in languages of benches."""
_LOADS = frozenset({
    "load", "loads", "external", "ext", "outside", "applied", "disturbance", "contact", "hand", "last",
    "charge",
})  # fmt: skip
"""Words in the head of a torque or force that acts from outside."""


def times_among(heads: Sequence[str]) -> list[tuple[str, str]]:
    """Return heads that name a time, with their units; 't' and 'time' come before further words."""
    named = [(head, *name_and_unit(head)) for head in heads]
    # A log has a clock for each topic, an HDF5 file for each group: topic/time.
    timed = [
        (head, name.lower().rpartition("/")[2], unit)
        for head, name, unit in named
        if unit and same_dimension(unit, "s")
    ]
    plain = [(head, unit) for head, name, unit in timed if name in _TIME_NAMES]
    return plain or [(head, unit) for head, name, unit in timed if name in _TIME_WORDS]


def times_without_unit(heads: Sequence[str]) -> list[str]:
    """Return heads that are called like a time and give no unit of time."""
    names = (*_TIME_NAMES, *_TIME_WORDS)
    timed = {head for head, _ in times_among(heads)}
    return [head for head in heads if head.lower().strip("[]() ") in names and head not in timed]


def default_mapping(
    heads: Sequence[str], model: FlatModel, file: str, given: ColumnMap | None = None, *, joint: bool = False
) -> ColumnMap:
    """Return the mapping that follows from the heads of the columns.

    ``given``: where it maps columns, they are kept, and the time that it names; else all but the columns.
    ``joint``: the heads are those of one joint in a log, of which a deck need not read everything.
    """
    if given is not None and given.columns and given.time.name:
        return given
    split_heads = [(head, *name_and_unit(head)) for head in heads]
    timed = given is not None and given.time.name in heads
    times = [(given.time.name, given.time.unit)] if given is not None and timed else times_among(heads)
    if not times:
        raise MeasurementError(file, "has no column of time", next_step="name it 't_s' or 'time [s]'")
    if given is not None and given.columns:
        return replace(given, time=Column(times[0][0], "time", times[0][1]))
    if joint:
        clocks = [head for head, _ in times]
        split_heads = [
            (head, name, unit)
            for head, name, unit in split_heads
            if head not in clocks and unit and len(signals_for(name, unit, model)) == 1
        ]
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
    if unit is None:
        raise MeasurementError(
            f"{file}: column '{head}'",
            "names no unit",
            next_step="write for instance 'force_N', or map it in records.toml",
        )
    fitting = signals_for(name, unit, model)
    doubt = torque_in_doubt(name, fitting, model)
    if len(fitting) == 1 and not doubt:
        return fitting[0]
    raise MeasurementError(
        f"{file}: column '{head}'",
        f"could be {' or '.join(fitting)}{doubt}"
        if fitting
        else f"no sensor of the model reads in {typeset_unit(unit)}",
        next_step="write a records.toml that maps each column to its signal, see 'nlsdesign records'"
        + ("" if fitting else ", or give the deck of the rig that was measured"),
    )


def signals_for(name: str, unit: str, model: FlatModel) -> tuple[str, ...]:
    """Return the signals that a column may hold: that of its name, else readings, else inputs in its unit."""
    everything = {v.name: v for v in model.states + model.inputs + model.signals}
    if name in everything:
        return (name,)
    for group in ([everything[r.signal] for r in model.readings], list(model.inputs)):
        # Leave out readings that another one of these signals passes on: a bench writes down the last.
        signals = [v.name for v in group if same_dimension(v.unit, unit)]
        readings = [r for r in model.readings if r.signal in signals]
        passed_on = {sensor for r in readings for sensor in r.sensors[1:]}
        fitting = [s for s in signals if s not in {r.signal for r in readings if r.sensors[0] in passed_on}]
        if fitting:
            return tuple(fitting)
    return ()


def torque_in_doubt(name: str, signals: Sequence[str], model: FlatModel) -> str:
    """Return what else a column of torque or force may be that only fits a load; empty where it is a load.

    ``name``: of the head, without its unit. Beside a drive most logs hold what the motor gives, no load.
    """
    inputs = {v.name: v.unit for v in model.inputs}
    effort = [s for s in signals if any(same_dimension(inputs.get(s, "1"), unit) for unit in ("N*m", "N"))]
    drives = [command for body in model.bodies for command in body.commands]
    if name in signals or set(effort) <= set(drives) or not drives:
        return ""
    if not _LOADS.isdisjoint(piece.lower() for piece in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)):
        return ""
    return (
        f", a load from outside, or what the motor gives: divide that by torque constant and gear ratio, "
        f"give it the unit A and map it to '{drives[0]}'"
    )


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


def read_input_columns(file: Path, model: FlatModel) -> tuple[Array, dict[str, Array]]:
    """Return the times of a file in s, from zero, and the inputs among its columns in SI.

    Heads are ``time [s]`` and ``name [unit]``, as a simulation writes them; other columns are passed over.
    """
    table = read_csv(file)
    heads = dict(zip(heads_with_units(file.name, table.heads, table.units), table.heads, strict=True))
    times = times_among(list(heads))
    if not times:
        raise MeasurementError(file.name, "has no column of time", next_step="name it 'time [s]'")
    head, unit = times[0]
    time = table.columns[heads[head]] * parse_unit(unit).factor
    if len(time) < 2 or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise MeasurementError(
            f"{file.name}: column '{heads[head]}'", "needs at least two times that ascend",
            next_step="sort the rows, and leave out those that are double",
        )  # fmt: skip
    units = {v.name: v.unit for v in model.inputs}
    columns: dict[str, Array] = {}
    for head, in_file in heads.items():
        name, given = name_and_unit(head)
        if name not in units:
            continue
        where, values = f"{file.name}: column '{in_file}'", table.columns[in_file]
        if given is None or not same_dimension(given, units[name]):
            raise MeasurementError(
                where, f"is not in a unit like {typeset_unit(units[name]) or '1'}",
                next_step=f"write [{units[name]}] behind it",
            )  # fmt: skip
        if len(values) != len(time) or not np.all(np.isfinite(values)):
            raise MeasurementError(where, "is not a number in every row", next_step="fill the cells")
        columns[name] = values * parse_unit(given).factor
    if not columns:
        example = next((f"{v.name} [{v.unit}]" for v in model.inputs), "input [unit]")
        raise MeasurementError(
            file.name, f"has no column of an input of {model.name}", next_step=f"name a column '{example}'"
        )
    return time - time[0], columns
