"""Signals over time, by name and with units."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeasurementError, unknown_name

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trace:
    """Signals sampled at common times; what simulation gives and measurement brings.

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
    """

    time: Array
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    name: str = ""

    def __post_init__(self) -> None:
        for signal, values in self.signals.items():
            if values.shape != self.time.shape:
                raise MeasurementError(
                    f"signal '{signal}' of '{self.name}'",
                    f"has {values.shape} samples, time has {self.time.shape}",
                )

    def __getitem__(self, name: str) -> Array:
        """Return one signal.

        Parameters
        ----------
        name
            Full name.
        """
        if name not in self.signals:
            raise unknown_name("signal", name, self.signals)
        return self.signals[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a signal of that name."""
        return name in self.signals

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)

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
        """Return a ``pandas.DataFrame`` indexed by time; needs pandas."""
        import pandas as pd

        return pd.DataFrame(dict(self.signals), index=pd.Index(self.time, name="time_s"))

    def write_csv(self, path: Path) -> None:
        """Write ``time [s]`` and ``name [unit]`` columns; nothing is left behind if writing fails.

        Parameters
        ----------
        path
            File to write.
        """
        header = ["time [s]", *(f"{name} [{self.units[name]}]" for name in self.signals)]
        columns = np.column_stack([self.time, *self.signals.values()])
        draft = path.with_name(path.name + ".part")
        try:
            with draft.open("w", newline="", encoding="utf8") as stream:
                writer = csv.writer(stream)
                writer.writerow(header)
                writer.writerows([[repr(float(v)) for v in row] for row in columns])
            os.replace(draft, path)
        finally:
            draft.unlink(missing_ok=True)
