"""Records resampled, aligned (a lag removed), or joined with a second recording of the same run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ....foundation.errors import MeasurementError, unknown_name
from ....simulation import Trace
from .clocks import Channel, Lag, Resolution, lag_between, on_one_clock
from .measurement import Record


def resampled(record: Record, rate: float) -> Record:
    """Return a record resampled to another uniform clock by the rule of :mod:`.clocks`."""
    return _merged(record, [record], [0.0], (rate, ()))


def aligned(
    record: Record, delayed: str, reference: str, *, longest: float | None = None
) -> tuple[Record, Lag]:
    """Return a record in which the lag between two of its signals is removed.

    ``record``: measured. The result no longer contains the lag, for instance the delay of a sensor.
    ``delayed``, ``reference``: full names of two signals that show the same motion; the first is moved.
    """
    lag = lag_between(_channel(record, delayed), _channel(record, reference), longest=longest)
    parts = [_only(record, [s for s in record.trace.signals if s != delayed]), _only(record, [delayed])]
    return _merged(record, parts, [0.0, lag.seconds], (1.0 / record.step, (_removed(lag),))), lag


def joined(
    record: Record, other: Record, by: tuple[str, str], *, rate: float, longest: float | None = None
) -> tuple[Record, Lag]:
    """Return two recordings of the same run as one record on one clock.

    ``record``, ``other``: from two recorders with different start times. The clock of the first is kept, and
    its version of a signal that both have.
    """
    lag = lag_between(_channel(other, by[1]), _channel(record, by[0]), longest=longest)
    new = [s for s in other.trace.signals if s not in record.trace.signals]
    if not new:
        raise MeasurementError(f"record '{other.name}'", f"has no signal that '{record.name}' lacks")
    change = f"joined with {other.source or other.name}; {_removed(lag)}"
    return _merged(record, [record, _only(other, new)], [0.0, lag.seconds], (rate, (change,))), lag


def _removed(lag: Lag) -> str:
    return f"{lag}, which was removed"


def _channel(record: Record, signal: str) -> Channel:
    if signal not in record.trace.signals:
        raise unknown_name(f"signal of record '{record.name}'", signal, record.trace.signals)
    return Channel(signal, record.trace.time, record.trace[signal])


def _only(record: Record, signals: Sequence[str]) -> Record:
    trace = record.trace
    kept = {s: trace[s] for s in signals}
    return replace(record, trace=Trace(trace.time, kept, {s: trace.units[s] for s in signals}, trace.name))


def _merged(
    record: Record, parts: Sequence[Record], lags: Sequence[float], how: tuple[float, tuple[str, ...]]
) -> Record:
    """Return signals of several records, each moved by a lag, under the name and role of the first."""
    rate, changes = how
    channels, resolution, units = [], {}, {}
    for part, lag in zip(parts, lags, strict=True):
        for signal, values in part.trace.signals.items():
            channels.append(Channel(signal, part.trace.time - lag, values))
            noise, quantum = part.resolution_of(signal)
            share = (rate * part.step) ** 0.5
            resolution[signal] = Resolution(share * noise, share * quantum)
            units[signal] = part.trace.units[signal]
    resampling = on_one_clock(channels, rate)
    summary = "; ".join([*changes, *resampling.changes])
    trace = Trace(resampling.time, resampling.values, units, record.name)
    source = f"{record.source or record.name} ({summary})" if summary else record.source
    return replace(
        record, trace=trace, source=source, resolution=resolution if summary else record.resolution
    )
