"""Records on another clock, with a lag removed, or joined with a second recording of the same run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...errors import MeasurementError, unknown_name
from ...simulation import Trace
from .clocks import Channel, Grain, on_one_clock
from .lag import Lag, lag_between
from .measurement import Record


def resampled(record: Record, rate: float) -> Record:
    """Return a record on another uniform clock; the rule is that of :mod:`.clocks`.

    Parameters
    ----------
    record
        Measured.
    rate
        In Hz.

    Returns
    -------
    Record
        Its ``source`` says what was done, its ``grain`` how fine the signals are.
    """
    return _put_together(record, [record], [0.0], (rate, ()))


def aligned(record: Record, late: str, reference: str, *, longest: float | None = None) -> tuple[Record, Lag]:
    """Return a record with one of its signals moved to where another shows the same motion.

    Parameters
    ----------
    record
        Measured. What the lag itself says, for instance the delay of a sensor, is gone from the result.
    late, reference
        Full names of two signals.
    longest
        As for :func:`~nlsdesign.identification.records.lag.lag_between`.

    Raises
    ------
    UnknownNameError
        If the record has no such signal.
    MeasurementError
        As for :func:`~nlsdesign.identification.records.lag.lag_between`.
    """
    lag = lag_between(_channel(record, late), _channel(record, reference), longest=longest)
    parts = [_only(record, [s for s in record.trace.signals if s != late]), _only(record, [late])]
    return _put_together(record, parts, [0.0, lag.seconds], (1.0 / record.step, (_told(lag),))), lag


def joined(
    record: Record, other: Record, by: tuple[str, str], *, rate: float, longest: float | None = None
) -> tuple[Record, Lag]:
    """Return two recordings of the same run as one record on one clock.

    Parameters
    ----------
    record, other
        Of two recorders that were not started together; the clock of the first is kept. Of a signal that both
        have the first is kept.
    by
        A signal of the first and one of the second that show the same motion.
    rate
        Of the common clock in Hz.
    longest
        As for :func:`~nlsdesign.identification.records.lag.lag_between`.

    Raises
    ------
    UnknownNameError
        If a record has no such signal.
    MeasurementError
        As for :func:`~nlsdesign.identification.records.lag.lag_between`, or if the second adds no signal.
    """
    lag = lag_between(_channel(other, by[1]), _channel(record, by[0]), longest=longest)
    new = [s for s in other.trace.signals if s not in record.trace.signals]
    if not new:
        raise MeasurementError(f"record '{other.name}'", f"has no signal that '{record.name}' lacks")
    told = f"joined with {other.source or other.name}; {_told(lag)}"
    return _put_together(record, [record, _only(other, new)], [0.0, lag.seconds], (rate, (told,))), lag


def _told(lag: Lag) -> str:
    return f"{lag}, which was removed"


def _channel(record: Record, signal: str) -> Channel:
    if signal not in record.trace.signals:
        raise unknown_name(f"signal of record '{record.name}'", signal, record.trace.signals)
    return Channel(signal, record.trace.time, record.trace[signal])


def _only(record: Record, signals: Sequence[str]) -> Record:
    trace = record.trace
    kept = {s: trace[s] for s in signals}
    return replace(record, trace=Trace(trace.time, kept, {s: trace.units[s] for s in signals}, trace.name))


def _put_together(
    record: Record, parts: Sequence[Record], lags: Sequence[float], how: tuple[float, tuple[str, ...]]
) -> Record:
    """Return signals of several records, each moved by a lag, under the name and role of the first."""
    rate, told = how
    channels, grain, units = [], {}, {}
    for part, lag in zip(parts, lags, strict=True):
        for signal, values in part.trace.signals.items():
            channels.append(Channel(signal, part.trace.time - lag, values))
            noise, quantum = part.grain_of(signal)
            share = (rate * part.step) ** 0.5
            grain[signal] = Grain(share * noise, share * quantum)
            units[signal] = part.trace.units[signal]
    found = on_one_clock(channels, rate)
    words = "; ".join([*told, *found.words])
    trace = Trace(found.time, found.values, units, record.name)
    source = f"{record.source or record.name} ({words})" if words else record.source
    return replace(record, trace=trace, source=source, grain=grain if words else record.grain)
