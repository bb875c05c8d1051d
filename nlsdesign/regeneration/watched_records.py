"""A record from the bench as an observer sees it, and the torque that it shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import casadi as ca
import numpy as np

from ..bench.discrepancy.block_prediction import shown_values
from ..bench.identification import Record
from ..feedback.observer import CorrectedDesign, ObserverDesign, observe
from ..foundation.arrays import Array
from ..foundation.errors import MeasurementError
from ..model import FlatModel
from ..model.readings import reading_of
from ..model.roles import measured_motion
from ..model.structure import SpringNames
from ..simulation import Trace


@dataclass(frozen=True)
class ObserverChoice:
    """What is to be estimated, from what, and how often.

    Parameters
    ----------
    sample_time
        In s.
    spring
        Path of the spring whose torque is estimated; decided from the structure if it is ``None``.
    measured
        State that is measured; decided from the structure if it is ``None``.
    """

    sample_time: float = 1e-3
    spring: str | None = None
    measured: str | None = None


@dataclass(frozen=True, eq=False)
class WatchedRecord:
    """A record at the sample time of the observers, with the torque that it shows."""

    record: Record
    trace: Trace
    torque: Array
    readings: Mapping[str, str]
    motion: str
    silent: tuple[str, ...]
    skipped: int = 0  # first samples that count in no error

    @classmethod
    def of(cls, model: FlatModel, spring: SpringNames, record: Record, choice: ObserverChoice) -> Self:
        """Return a record as an observer sees it, and the torque behind its readings."""
        motion = measured_motion(model, choice.measured)
        shown = {reading_of(model.readings, signal).measured: signal for signal in record.trace.signals}
        if motion not in shown:
            raise MeasurementError(f"record '{record.name}'", f"does not measure '{motion}'")
        torque = _shown_torque(model, spring, record, shown)
        time = np.arange(record.trace.time[0], record.trace.time[-1], choice.sample_time)
        silent = {v.name: np.full(len(record.trace), v.start) for v in model.inputs if v.name not in shown}
        trace = record.trace.with_signals({**silent, _TORQUE: torque}, dict.fromkeys([*silent, _TORQUE], "1"))
        even = trace.at(time)
        return cls(
            record, even, even[_TORQUE], {n: s for n, s in shown.items() if n != s}, motion, (*silent,)
        )

    @property
    def size(self) -> float:
        """Root mean square of the torque."""
        return float(np.sqrt(np.mean(self.torque**2)))

    def settled(self, time: float) -> Self:
        """Return the record whose errors count after a time in s, or after a quarter of it if that is sooner.

        Observers begin at rest; a record may begin in motion, and so does each that was cut in time.
        """
        first = int(np.searchsorted(self.trace.time, self.trace.time[0] + time))
        return replace(self, skipped=min(first, len(self.torque) // 4))

    def lacks(self, design: ObserverDesign | CorrectedDesign) -> list[str]:
        """Return inputs of an observer that the record does not measure."""
        return [v.name for v in design.model.inputs if v.name in self.silent]

    def inputs(self, design: ObserverDesign) -> Array:
        """Return what an observer reads of the record, shape (inputs, n)."""
        return np.array([self.trace[self.readings.get(v.name, v.name)] for v in design.model.inputs])

    def estimate(self, design: ObserverDesign | CorrectedDesign) -> Array:
        """Return what an observer makes of the record, begun at rest at its first angle."""
        inputs = {v.name for v in design.model.inputs}
        wires = {name: signal for name, signal in self.readings.items() if name in inputs}
        first = float(self.trace[self.readings.get(self.motion, self.motion)][0])
        run = observe(design.model, self.trace, readings=wires, start=design.start(first))
        return run[design.step.plant.estimate.name]

    def error(self, estimate: Array) -> float:
        """Return the root mean square error of an estimate."""
        return float(np.sqrt(np.mean((estimate - self.torque)[self.skipped :] ** 2)))


STAND_IN = "that of the declared model with the numbers of the better one"


def with_numbers(declared: FlatModel, values: Mapping[str, float]) -> FlatModel:
    """Return a model with those numbers of another that it has, there perhaps with one more part in the path.

    An effect that rubs inside a spring stands around what the spring was: ``spring.cam`` becomes
    ``spring.driven.cam``.
    """
    numbers: dict[str, float] = {}
    for name, value in values.items():
        parts = name.split(".")
        shorter = [".".join(parts[:k] + parts[k + 1 :]) for k in range(1, len(parts) - 1)]
        numbers |= {
            n: value for n in (name, *shorter) if n in declared.values and (n == name or n not in values)
        }
    return declared.with_values(numbers)


_TORQUE = "torque behind the readings"


def _shown_torque(model: FlatModel, spring: SpringNames, record: Record, shown: Mapping[str, str]) -> Array:
    """Return the torque that a record shows: as measured, or a measured force times the lever arm."""
    if spring.effort in shown:
        return shown_values(model, record, shown[spring.effort])
    for cam in spring.cams:
        force = next((n for n in shown if n == cam.force or n.startswith(f"{cam.element}.")), None)
        if force is not None and model.variable(force).unit == "N":
            arm = _along(model, record, shown, cam.lever_arm)
            elements = model.values[cam.elements]
            return elements * arm * shown_values(model, record, shown[force])
    raise MeasurementError(
        f"record '{record.name}'",
        f"measures neither the torque '{spring.effort}' nor a force behind its cam",
        next_step="measure one of them to know the error of the observer",
    )


def _along(model: FlatModel, record: Record, shown: Mapping[str, str], signal: str) -> Array:
    """Return a signal of the model along the measured states and inputs of a record."""
    s, count = model.symbols(), len(record.trace)
    groups = []
    for variables in (model.states, model.inputs):
        values = np.repeat(model.start(variables)[:, None], count, axis=1)
        for place, variable in enumerate(variables):
            if variable.name in shown:
                values[place] = shown_values(model, record, shown[variable.name])
        groups.append(values)
    place = next(i for i, v in enumerate(model.signals) if v.name == signal)
    wanted = ca.Function("wanted", [s.state, s.input, s.parameter, s.table], [s.signal[place]])
    states, inputs = groups
    result: Array = wanted.map(count)(states, inputs, model.start(model.parameters), np.zeros(0)).full()
    return result.ravel()
