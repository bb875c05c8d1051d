"""From the table of a file to signals on one uniform clock, with a note of every change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.arrays import Array, Mask
from ....foundation.errors import MeasurementError, nearest
from ....foundation.quantity import parse_unit, same_dimension
from ....simulation import Trace
from .clocks import Channel, Resolution, lag_between, on_one_clock, resolutions
from .mapping import Align, Column, ColumnMap
from .quality import Checked, Finding, Sampled, check_channels, check_columns, check_time
from .robot_logs import check_one_clock
from .sampling import SAMPLED
from .table_files import RecordTable

_LEAST_STEP, _SHORT_STEP, _LONG_STEP = 1e-8, 1e-5, 0.5
"""Steps in s below which a clock cannot be one of a bench, and outside which its unit is doubtful."""
_YEAR = 3.16e7
_SINCE_1970, _NO_TIME = 1e8, 1e11
"""A clock that begins later than this, in s, counts from 1970; beyond the second it has another unit."""


@dataclass(frozen=True, eq=False)
class Run:
    """Content of one file."""

    trace: Trace  # signals in SI by full name, on a uniform grid
    source: str  # file, and the changes made to its samples
    # resolution: resolution of the channels that were interpolated or filtered, by signal; see Resolution
    resolution: Mapping[str, Resolution]
    masked: Mapping[str, Mask]  # samples that were faulty and stand interpolated, by signal, shape (n,)
    # findings, remarks: what makes the file suspect; what was changed or is unusual
    findings: tuple[Finding, ...]
    remarks: tuple[Finding, ...]


def read_run(name: str, table: RecordTable, mapping: ColumnMap) -> Run:
    """Check a table and put its columns on one uniform clock."""
    if not mapping.align:
        clocks = [mapping.clock_of(column).name.partition(" [")[0] for column in mapping.columns]
        check_one_clock(table.file, table.behind, clocks)
    table, began = _from_zero(table, mapping)
    checked = _checked(table, mapping)
    clean = replace(table, given={**table.given, **checked.values})
    if mapping.resample is None:
        trace, note, resolution = _as_sampled(name, clean, mapping)
        times = dict.fromkeys(checked.masked, _seconds(table, mapping.time))
    else:
        trace, note, resolution, times = _on_new_clock(name, clean, mapping, mapping.resample)
    masked = {
        c.signal: _on_clock(checked.masked[c.name], times[c.name], trace.time)
        for c in mapping.columns
        if c.name in checked.masked
    }
    remarks = (*checked.remarks, *_odd_rate(table, mapping))
    return Run(trace, f"{table.file}{began}{note}", resolution, masked, checked.findings, remarks)


def _odd_rate(table: RecordTable, mapping: ColumnMap) -> tuple[Finding, ...]:
    """Return a remark on a clock whose samples lie so far apart, or so close, that its unit is doubtful."""
    step = float(np.median(np.diff(_seconds(table, mapping.time))))
    place = f"{table.file}: column '{mapping.time.name}'"
    if step < _LEAST_STEP:
        raise MeasurementError(
            place, f"its samples lie {step:.3g} s apart, which no instrument of a bench does",
            next_step="correct the unit of the time, in its head or in records.toml",
        )  # fmt: skip
    if _SHORT_STEP <= step <= _LONG_STEP:
        return ()
    unit = "milliseconds or microseconds" if step > _LONG_STEP else "seconds"
    text = f"its samples lie {step:.3g} s apart; if it counts {unit}, give it that unit ('t_ms', 't_s')"
    return (Finding(place, text),)


def _from_zero(table: RecordTable, mapping: ColumnMap) -> tuple[RecordTable, str]:
    """Return a table whose clocks do not count from 1970, and what was subtracted from them."""
    factor = parse_unit(mapping.time.unit).factor
    clocks = {mapping.clock_of(c).name for c in mapping.columns} | {a.time for a in mapping.align if a.time}
    clocks = {name for name in clocks if len(table.given.get(name, ())) and np.isfinite(table.given[name][0])}
    first = min((float(table.given[name][0]) for name in clocks), default=0.0)
    if abs(first) * factor > _NO_TIME:
        raise MeasurementError(
            f"{table.file}: column '{mapping.time.name}'",
            f"begins at {first:g} {mapping.time.unit}, {first * factor / _YEAR:.2g} years from zero",
            next_step="if it counts milliseconds, name it 't_ms', or give its unit in records.toml",
        )
    if first * factor < _SINCE_1970:
        return table, ""
    shifted = {name: table.given[name] - first for name in clocks}
    return replace(
        table, given={**table.given, **shifted}
    ), f" (time counted from {first:.15g} {mapping.time.unit})"


def _checked(table: RecordTable, mapping: ColumnMap) -> Checked:
    """Check every column with the others on its clock."""
    parts = []
    for clock in dict.fromkeys(mapping.clock_of(c) for c in mapping.columns):
        columns = [c for c in mapping.columns if mapping.clock_of(c) == clock]
        heads = [clock.name, *(c.name for c in columns)]
        _check_present(table, heads)
        raw = table.columns(heads)
        check_columns(table.file, raw, first_row=table.first_row)
        time = raw[clock.name] * parse_unit(clock.unit).factor
        bridged = 1.0 / mapping.resample if mapping.resample else 0.0
        check_time(table.file, clock.name, time, first_row=table.first_row, bridged=bridged)
        sampled = [_sampled(c, raw[c.name], mapping) for c in columns]
        parts.append(check_channels(table.file, time, sampled, first_row=table.first_row))
    return Checked(
        {head: values for part in parts for head, values in part.values.items()},
        {head: mask for part in parts for head, mask in part.masked.items()},
        tuple(finding for part in parts for finding in part.findings),
        tuple(remark for part in parts for remark in part.remarks),
    )


def _sampled(column: Column, values: Array, mapping: ColumnMap) -> Sampled:
    motion = any(same_dimension(column.unit, unit) for unit in ("rad", "m"))
    commanded = column.signal in mapping.inputs.commanded
    shown = commanded or column.signal in mapping.inputs.shown
    count = column.quantum / parse_unit(column.unit).factor
    return Sampled(column.name, column.unit, values, commanded, shown, motion, count)


def _seconds(table: RecordTable, clock: Column) -> Array:
    times: Array = table.given[clock.name] * parse_unit(clock.unit).factor
    return times


def _on_clock(mask: Mask, own: Array, time: Array) -> Mask:
    """Return the samples of a clock that lie within a step, of either clock, of a masked one."""
    if len(own) == len(time) and np.array_equal(own, time):
        return mask
    reach = (1.0 + 1e-6) * max(float(np.median(np.diff(own))), float(time[1] - time[0]))
    first = np.searchsorted(time, own[mask] - reach)
    behind = np.searchsorted(time, own[mask] + reach, side="right")
    count = np.zeros(len(time) + 1, dtype=int)
    np.add.at(count, first, 1)
    np.add.at(count, behind, -1)
    result: Mask = np.cumsum(count)[:-1] > 0
    return result


def _as_sampled(
    name: str, table: RecordTable, mapping: ColumnMap
) -> tuple[Trace, str, dict[str, Resolution]]:
    """Return the columns as sampled; where the steps vary they are interpolated linearly."""
    heads = [c.name for c in (mapping.time, *mapping.columns)]
    _check_present(table, heads)
    raw = table.columns(heads)
    check_columns(table.file, raw, first_row=table.first_row)
    time = raw[mapping.time.name] * parse_unit(mapping.time.unit).factor
    note = check_time(table.file, mapping.time.name, time, first_row=table.first_row)
    grid = np.linspace(time[0], time[-1], len(time))
    signals, resolution = {}, {}
    for column in mapping.columns:
        values = raw[column.name] * parse_unit(column.unit).factor
        signals[column.signal] = np.interp(grid, time, values) if note else values
        if note:
            resolution[column.signal] = Channel(column.name, time, values).resolution(quantum=column.quantum)
    return Trace(grid, signals, _units(mapping), name), note, resolution


def _on_new_clock(
    name: str, table: RecordTable, mapping: ColumnMap, rate: float
) -> tuple[Trace, str, dict[str, Resolution], dict[str, Array]]:
    """Return the columns on a new clock, the changes, and the times of the samples of each column."""
    channels = {c.signal: _channel(table, c, mapping.clock_of(c), 1.0 / rate) for c in mapping.columns}
    changes = []
    for each in mapping.align:
        channels, change = _aligned(table, mapping, each, channels)
        changes.append(change)
    heads = {channels[c.signal].name: c for c in mapping.columns}
    # What is held or averaged is resampled as the smooth signal with the same effect.
    ways = {c.signal: c.sampling or SAMPLED for c in mapping.columns}
    smooth = [replace(channels[n], values=way.at_samples(channels[n].values)) for n, way in ways.items()]
    resampling = on_one_clock(smooth, rate)
    signals = {heads[n].signal: v for n, v in resampling.values.items()}
    resolution = {}
    if changes or resampling.changes:
        resolution = resolutions(channels, 1.0 / rate, {c.signal: c.quantum for c in mapping.columns})
    summary = "; ".join([*changes, *(c.removeprefix(f"{table.file}: column ") for c in resampling.changes)])
    return (
        Trace(resampling.time, signals, _units(mapping), name),
        f" ({summary})" if summary else "",
        resolution,
        {c.name: channels[c.signal].time for c in mapping.columns},
    )


def _channel(table: RecordTable, column: Column, clock: Column, step: float) -> Channel:
    """Return a column in SI on its own clock, checked with the names and rows of the file."""
    _check_present(table, [column.name, clock.name])
    raw = table.columns([clock.name, column.name])
    check_columns(table.file, raw, first_row=table.first_row)
    time = raw[clock.name] * parse_unit(clock.unit).factor
    check_time(table.file, clock.name, time, first_row=table.first_row, bridged=step)
    values = raw[column.name] * parse_unit(column.unit).factor
    return Channel(f"{table.file}: column '{column.name}'", time, values)


def _aligned(
    table: RecordTable, mapping: ColumnMap, request: Align, channels: Mapping[str, Channel]
) -> tuple[dict[str, Channel], str]:
    """Return the channels with those of one clock moved, and the change."""
    mapped = {c.name: c for c in mapping.columns}
    requested = Column(request.column, "", "1", time=request.time), Column(request.to, "", "1")
    # A column that is not mapped has no signal, but mapped columns on its clock are moved with it.
    delayed, reference = (mapped.get(c.name, c) for c in requested)
    pair = [
        channels[c.signal] if c.signal else _channel(table, c, mapping.clock_of(c), 0.0)
        for c in (delayed, reference)
    ]
    lag = lag_between(pair[0], pair[1], longest=request.longest)
    moved = (
        [c for c in mapping.columns if c.time == delayed.time]
        if delayed.time
        else [c for c in [delayed] if c.signal]
    )
    if not moved:
        raise MeasurementError(
            f"align: column '{request.column}'",
            "moves nothing: it is neither mapped nor on the clock of a mapped column",
            next_step="add time = '<head of its clock>'",
        )
    result = {
        s: replace(c, time=c.time - lag.seconds) if s in {m.signal for m in moved} else c
        for s, c in channels.items()
    }
    change = (
        f"{', '.join(c.name for c in moved)} moved {1e3 * lag.seconds:.4g} ms "
        f"± {1e3 * lag.standard_error:.2g} ms earlier, by the correlation {lag.correlation:.3f} of "
        f"{request.column} with {request.to}"
    )
    return result, change


def _check_present(table: RecordTable, heads: list[str]) -> None:
    for head in heads:
        if head not in table.heads:
            raise MeasurementError(
                f"{table.file}: column '{head}'",
                "is missing",
                did_you_mean=nearest(head, table.heads),
                next_step="record it in every file, or map in records.toml the columns that every file has",
            )


def _units(mapping: ColumnMap) -> dict[str, str]:
    """Return the unit in SI of each signal; its own where that is none of the usual ones."""
    usual = ("rad", "rad/s", "m", "m/s", "A", "V", "N", "N*m", "Pa", "K", "1", "rad/s^2", "m/s^2")
    return {
        c.signal: next((name for name in usual if same_dimension(name, c.unit)), c.unit)
        for c in mapping.columns
    }
