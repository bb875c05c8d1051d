"""From the table of a file to signals on one uniform clock, with what was done to them on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import MeasurementError, nearest
from ...quantity import parse_unit, same_dimension
from ...simulation import Trace
from .clocks import Channel, Grain, grains, on_one_clock
from .lag import lag_between
from .mapping import Align, Column, ColumnMap
from .quality import Finding, check_columns, check_time, suspicions
from .table_files import Table

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Run:
    """What one file says.

    Parameters
    ----------
    trace
        Signals in SI by full name, on a uniform grid.
    source
        File, and what was done to the samples on the way in.
    grain
        Noise and count of the channels that were interpolated or filtered, by signal; see
        :class:`~nlsdesign.identification.records.clocks.Grain`.
    findings
        What makes the file suspect.
    """

    trace: Trace
    source: str
    grain: Mapping[str, Grain]
    findings: tuple[Finding, ...]


def read_run(name: str, table: Table, mapping: ColumnMap) -> Run:
    """Check a table and put its columns on one uniform clock.

    Parameters
    ----------
    name
        Of the record.
    table
        As read from the file.
    mapping
        Says what the columns are, and asks for a new clock or an alignment.

    Raises
    ------
    MeasurementError
        If a column is missing, is not finite, or its clock runs backwards or has a gap; naming file, column
        and rows.
    """
    if mapping.resample is None:
        trace, note, grain = _as_sampled(name, table, mapping)
    else:
        trace, note, grain = _on_new_clock(name, table, mapping, mapping.resample)
    found = [
        f
        for c in mapping.columns
        for f in suspicions(table.file, c.name, table.given[c.name], first_row=table.first_row)
    ]
    return Run(trace, f"{table.file}{note}", grain, tuple(found))


def _as_sampled(name: str, table: Table, mapping: ColumnMap) -> tuple[Trace, str, dict[str, Grain]]:
    """Return the columns as they stand; those of one clock whose steps vary are evened linearly."""
    heads = [c.name for c in (mapping.time, *mapping.columns)]
    _check_present(table, heads)
    raw = table.columns(heads)
    check_columns(table.file, raw, first_row=table.first_row)
    time = raw[mapping.time.name] * parse_unit(mapping.time.unit).factor
    note = check_time(table.file, mapping.time.name, time, first_row=table.first_row)
    grid = np.linspace(time[0], time[-1], len(time))
    signals, grain = {}, {}
    for column in mapping.columns:
        values = raw[column.name] * parse_unit(column.unit).factor
        signals[column.signal] = np.interp(grid, time, values) if note else values
        if note:
            grain[column.signal] = Channel(column.name, time, values).grain(quantum=column.quantum)
    return Trace(grid, signals, _units(mapping), name), note, grain


def _on_new_clock(
    name: str, table: Table, mapping: ColumnMap, rate: float
) -> tuple[Trace, str, dict[str, Grain]]:
    channels = {c.signal: _channel(table, c, mapping.clock_of(c), 1.0 / rate) for c in mapping.columns}
    told = []
    for each in mapping.align:
        channels, words = _aligned(table, mapping, each, channels)
        told.append(words)
    heads = {channels[c.signal].name: c for c in mapping.columns}
    found = on_one_clock(list(channels.values()), rate)
    signals = {heads[n].signal: v for n, v in found.values.items()}
    grain = {}
    if told or found.words:
        grain = grains(channels, 1.0 / rate, {c.signal: c.quantum for c in mapping.columns})
    words = "; ".join([*told, *(w.removeprefix(f"{table.file}: column ") for w in found.words)])
    return Trace(found.time, signals, _units(mapping), name), f" ({words})" if words else "", grain


def _channel(table: Table, column: Column, clock: Column, step: float) -> Channel:
    """Return a column in SI on its own clock, checked with the names and rows of the file."""
    _check_present(table, [column.name, clock.name])
    raw = table.columns([clock.name, column.name])
    check_columns(table.file, raw, first_row=table.first_row)
    time = raw[clock.name] * parse_unit(clock.unit).factor
    check_time(table.file, clock.name, time, first_row=table.first_row, bridged=step)
    values = raw[column.name] * parse_unit(column.unit).factor
    return Channel(f"{table.file}: column '{column.name}'", time, values)


def _aligned(
    table: Table, mapping: ColumnMap, asked: Align, channels: Mapping[str, Channel]
) -> tuple[dict[str, Channel], str]:
    """Return the channels with those of one clock moved, and what was done."""
    mapped = {c.name: c for c in mapping.columns}
    plain = Column(asked.column, "", "1", time=asked.time), Column(asked.to, "", "1")
    # A column that is not mapped has no signal; its clock may be that of mapped ones, which it moves.
    late, reference = (mapped.get(c.name, c) for c in plain)
    pair = [
        channels[c.signal] if c.signal else _channel(table, c, mapping.clock_of(c), 0.0)
        for c in (late, reference)
    ]
    lag = lag_between(pair[0], pair[1], longest=asked.longest)
    moved = (
        [c for c in mapping.columns if c.time == late.time] if late.time else [c for c in [late] if c.signal]
    )
    if not moved:
        raise MeasurementError(
            f"align: column '{asked.column}'",
            "moves nothing: it is neither mapped nor on the clock of a mapped column",
            next_step="add time = '<head of its clock>'",
        )
    result = {
        s: replace(c, time=c.time - lag.seconds) if s in {m.signal for m in moved} else c
        for s, c in channels.items()
    }
    told = (
        f"{', '.join(c.name for c in moved)} moved {1e3 * lag.seconds:.4g} ms "
        f"± {1e3 * lag.standard_error:.2g} ms earlier, by the correlation {lag.correlation:.3f} of "
        f"{asked.column} with {asked.to}"
    )
    return result, told


def _check_present(table: Table, heads: list[str]) -> None:
    for head in heads:
        if head not in table.heads:
            raise MeasurementError(
                f"{table.file}: column '{head}'", "is missing", did_you_mean=nearest(head, table.heads)
            )


def _units(mapping: ColumnMap) -> dict[str, str]:
    return {c.signal: _si(c.unit) for c in mapping.columns}


def _si(unit: str) -> str:
    known = ("rad", "rad/s", "m", "m/s", "A", "V", "N", "N*m", "Pa", "K", "1", "rad/s^2", "m/s^2")
    return next((name for name in known if same_dimension(name, unit)), unit)
