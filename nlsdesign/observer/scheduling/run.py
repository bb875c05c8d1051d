"""Lets an observer watch a record."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import MeasurementError, ValueRangeError
from ...model import FlatModel
from ...simulation import Trace, simulate


def observe(
    observer: FlatModel,
    trace: Trace,
    *,
    readings: Mapping[str, str] | None = None,
    start: Mapping[str, float] | None = None,
) -> Trace:
    """Return what an observer makes of a simulated or measured record.

    Parameters
    ----------
    observer
        Discrete.
    trace
        Sampled at the observer's sample time.
    readings
        Input of the observer to signal of the trace where the names differ, for instance
        ``{"motor.angle": "motor_encoder.reading"}``.
    start
        Start values of the memory, for instance those of :meth:`ObserverDesign.start`.

    Returns
    -------
    Trace
        Inputs, memory and outputs of the observer.

    Raises
    ------
    ValueRangeError
        If the trace is not sampled at the sample time of the observer.
    MeasurementError
        If the trace does not have what the observer measures.
    """
    if observer.sample_time is None:
        raise ValueRangeError(f"model '{observer.name}'", "is not a discrete observer")
    if np.any(np.abs(np.diff(trace.time) / observer.sample_time - 1.0) > 1e-6):
        raise ValueRangeError(
            f"record '{trace.name}'", f"must be sampled every {observer.sample_time:g} s",
            next_step="resample it with Trace.at",
        )  # fmt: skip
    wires = {v.name: v.name for v in observer.inputs} | dict(readings or {})
    missing = [signal for signal in wires.values() if signal not in trace]
    if missing:
        raise MeasurementError(
            f"record '{trace.name}'", f"has no signal '{missing[0]}', which the observer needs"
        )
    inputs = {name: trace[signal] for name, signal in wires.items()}
    return simulate(observer, trace.time, inputs=inputs, start=start)
