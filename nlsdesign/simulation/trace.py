"""Signals over time, by name and with units."""

from __future__ import annotations

from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..foundation.arrays import Array
from ..foundation.csv_tables import Axis, data_frame, data_set
from ..foundation.errors import MeasurementError, unknown_name
from ..foundation.quantity import parse_unit, with_unit
from ..foundation.text_files import write_table
from ..model import Variable
from .events import Event

_ROUNDING = 1e-9
"""Excess over a range that is rounding, relative to the nominal size."""


class RangeWarning(NamedTuple):
    """A signal that left the stated range of its law.

    Parameters
    ----------
    name, unit
        Of the signal.
    time
        Of the first sample outside, in s.
    furthest
        Value furthest outside.
    minimum, maximum
        The range.
    """

    name: str
    unit: str
    time: float
    furthest: float
    minimum: float
    maximum: float

    def __str__(self) -> str:
        limits = with_unit(f"[{self.minimum:g}, {self.maximum:g}]", self.unit)
        furthest = with_unit(f"{self.furthest:g}", self.unit)
        return (
            f"{self.name} leaves {limits}, where its law is stated to hold, at t = {self.time:g} s "
            f"and reaches {furthest}"
        )


def range_warnings(
    variables: Iterable[Variable], time: Array, signals: Mapping[str, Array], prefix: str = ""
) -> tuple[RangeWarning, ...]:
    """Return a warning for each variable that leaves its stated range."""
    warnings = []
    for v in variables:
        values = signals.get(prefix + v.name)
        if values is None or not v.bounded:
            continue
        over = np.maximum(v.minimum - values, values - v.maximum)
        # Ignore excesses that are rounding errors, for instance of a strain that should be zero.
        outside = np.flatnonzero(over > _ROUNDING * v.nominal)
        if outside.size:
            first, worst = int(outside[0]), int(np.argmax(over))
            warnings.append(
                RangeWarning(
                    prefix + v.name, v.unit, float(time[first]), float(values[worst]), v.minimum, v.maximum
                )
            )
    return tuple(warnings)


def _si_unit(name: str, units: Mapping[str, str]) -> str:
    unit = units.get(name, "")
    if not unit:
        raise MeasurementError(f"column '{name}'", "has no unit", next_step=f"give units={{'{name}': 'rad'}}")
    if parse_unit(unit).factor != 1.0:
        raise MeasurementError(
            f"column '{name}'", f"is in '{unit}', a trace holds SI", next_step="convert it with nls.quantity"
        )
    return unit


class _NamedSignals:
    """What a mapping from name to signal has but a length, which a trace has in samples."""

    signals: Mapping[str, Array]

    def __getitem__(self, name: str) -> Array:
        """Return one signal."""
        if name not in self.signals:
            raise unknown_name("signal", name, self.signals)
        return self.signals[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a signal of that name."""
        return name in self.signals

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the signals."""
        return iter(self.signals)

    def keys(self) -> KeysView[str]:
        """Return the names of the signals."""
        return self.signals.keys()

    def items(self) -> ItemsView[str, Array]:
        """Return the names of the signals, each with its values."""
        return self.signals.items()


@dataclass(frozen=True, eq=False)
class Trace(_NamedSignals):
    """Signals sampled at common times, simulated or measured, by name; the length is that of the time.

    Parameters
    ----------
    time
        Strictly ascending, in s, shape (n,).
    signals
        Arrays of shape (n,) in SI by full name.
    units
        SI unit of each signal by name.
    name
        For messages and legends.
    warnings
        Signals that left the stated range of their law.
    events
        Changes of mode, in order of time.

    Raises
    ------
    MeasurementError
        If a signal has another number of samples than time.
    """

    time: Array
    # Frozen, so that here it can only be read.
    signals: Mapping[str, Array]  # pyrefly: ignore[bad-override]
    units: Mapping[str, str]
    name: str = ""
    warnings: tuple[RangeWarning, ...] = ()
    events: tuple[Event, ...] = ()

    def __post_init__(self) -> None:
        for signal, values in self.signals.items():
            if values.shape != self.time.shape:
                raise MeasurementError(
                    f"signal '{signal}' of '{self.name}'",
                    f"has {values.shape} samples, time has {self.time.shape}",
                )

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    def __str__(self) -> str:
        head = (
            f"Trace {self.name}: {len(self.signals)} signals, {len(self)} samples "
            f"from {self.time[0]:g} s to {self.time[-1]:g} s"
        )
        events = [f"  {len(self.events)} events, the first at {self.events[0]}"] if self.events else []
        return "\n".join([head, *events, *(f"  warning: {each}" for each in self.warnings)])

    def with_signals(self, signals: Mapping[str, Array], units: Mapping[str, str]) -> Trace:
        """Return a copy with more (or other) signals.

        Parameters
        ----------
        signals, units
            By full name.
        """
        return replace(self, signals={**self.signals, **signals}, units={**self.units, **units})

    def at(self, times: Array) -> Trace:
        """Return the trace at other times by linear interpolation; held at the ends.

        Parameters
        ----------
        times
            Shape (m,), in s.
        """
        return replace(
            self, time=times, signals={n: np.interp(times, self.time, v) for n, v in self.signals.items()}
        )

    def to_frame(self) -> Any:
        """Return a ``pandas.DataFrame`` indexed by ``time_s``; units are in its ``attrs``; needs pandas."""
        return data_frame(self.signals, units=self.units, index=Axis("time_s", "s", self.time))

    @staticmethod
    def from_frame(frame: Any, *, units: Mapping[str, str] | None = None, name: str = "") -> Trace:
        """Return the trace in a ``pandas.DataFrame`` that is indexed by time in s.

        Parameters
        ----------
        frame
            One column for each signal, in SI.
        units
            SI units by name of the column; by default those in ``frame.attrs["units"]``.
        name
            For messages and legends.

        Raises
        ------
        MeasurementError
            If a column has no unit, or one that is not SI.
        """
        known = dict(frame.attrs.get("units", {})) | dict(units or {})
        signals = {str(each): np.asarray(frame[each], dtype=float) for each in frame.columns}
        time = np.asarray(frame.index, dtype=float)
        return Trace(time, signals, {each: _si_unit(each, known) for each in signals}, name)

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset`` over ``time``, each variable with its unit; needs xarray."""
        signals = {name: (("time",), values) for name, values in self.signals.items()}
        data = data_set(signals, axes=[Axis("time", "s", self.time)], units=self.units)
        return data.assign_attrs(name=self.name)

    @staticmethod
    def from_xarray(data: Any) -> Trace:
        """Return the trace in an ``xarray.Dataset`` over ``time`` in s.

        Parameters
        ----------
        data
            Variables in SI, each with its unit in ``attrs["units"]``.

        Raises
        ------
        MeasurementError
            If a variable has no unit, or one that is not SI.
        """
        known = {str(each): str(data[each].attrs.get("units", "")) for each in data.data_vars}
        signals = {each: np.asarray(data[each].values, dtype=float) for each in known}
        units = {each: _si_unit(each, known) for each in known}
        name = str(data.attrs.get("name", ""))
        return Trace(np.asarray(data["time"].values, dtype=float), signals, units, name)

    def write_csv(self, path: Path) -> None:
        """Write ``time [s]`` and ``name [unit]`` columns; nothing is left behind if writing fails.

        Parameters
        ----------
        path
            File to write.
        """
        header = ["time [s]", *(f"{name} [{self.units[name]}]" for name in self.signals)]
        columns = np.column_stack([self.time, *self.signals.values()])
        write_table(path, [header, *([repr(float(v)) for v in row] for row in columns)])
