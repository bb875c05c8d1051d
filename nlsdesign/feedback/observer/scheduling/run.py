"""Lets an observer watch a record."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....foundation.errors import MeasurementError, ValueRangeError
from ....model import FlatModel
from ....simulation import Trace, simulate


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
        Start values of the memory, for instance those of :meth:`ObserverDesign.start`; by default those of a
        machine that rests at the first readings.

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
    begun = start if start is not None else _begun(observer, {n: float(v[0]) for n, v in inputs.items()})
    return simulate(observer, trace.time, inputs=inputs, start=begun)


def _begun(observer: FlatModel, first: Mapping[str, float]) -> dict[str, float]:
    """Return the states with which an observer begins at its first readings, as generated code does."""
    if observer.begin is None:
        return {}
    x, u = observer.start(observer.states), [first[v.name] for v in observer.inputs]
    w = observer.look_up(x.tolist(), u)
    begun = np.array(observer.begin(x, u, observer.start(observer.parameters), w)[0], dtype=float).ravel()
    return {v.name: float(value) for v, value in zip(observer.states, begun, strict=True)}
