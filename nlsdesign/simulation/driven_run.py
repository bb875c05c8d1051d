"""What drives a run from outside: times, steps, prescribed speeds; and how large its signals are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError
from ..model import FlatModel
from .input_signals import Sine
from .trace import Trace

_MOST_ROWS = 2_000_000
_ROWS_OF_A_PERIOD = 4
_ROUNDING = 1e-13
"""Share of the largest value of a signal that is no more than the rounding of its numbers, and shown as 0."""


@dataclass(frozen=True)
class StepAt:
    """Zero, and from a time on a constant."""

    size: float  # in the unit of the input
    begin: float  # in s

    def __call__(self, time: float) -> float:
        """Return the value at a time."""
        return self.size if time >= self.begin else 0.0


def even_times(stop: float, step: float) -> Array:
    """Return times from zero to an end in equal steps no longer than one that is given, all in s."""
    if step > stop:
        raise ValueRangeError(
            f"--step {step:g} s", f"is longer than the run, {stop:g} s", next_step="take a shorter --step"
        )
    count = max(1, math.ceil(stop / step * (1.0 - 1e-12)))
    if count > _MOST_ROWS:
        raise ValueRangeError(
            f"--stop {stop:g} s in steps of {step:g} s",
            f"are {count} rows, at most {_MOST_ROWS} are written",
            next_step="take a longer --step",
        )  # fmt: skip
    return np.linspace(0.0, stop, count + 1)


def require_visible(inputs: Mapping[str, Any], times: Array) -> None:
    """Refuse sines that the rows of a run cannot show, and steps that come after its end.

    The machine is driven by the sine itself, but table, picture and sizes know the rows alone: with fewer
    than four to a period they show another signal.

    ``inputs``: by name; what is neither sine nor step is passed over. ``times``: in s, in equal steps.
    """
    stop, step = float(times[-1]), float(times[1] - times[0])
    for name, signal in inputs.items():
        if isinstance(signal, Sine) and step * abs(signal.frequency) > (1.0 + 1e-9) / _ROWS_OF_A_PERIOD:
            raise ValueRangeError(
                f"--input {name}: {signal.frequency:g} Hz",
                f"has {1.0 / (step * abs(signal.frequency)):.2g} rows to a period, at least "
                f"{_ROWS_OF_A_PERIOD} are needed",
                next_step=f"write --step '{50.0 / abs(signal.frequency):.2g} ms'",
            )
        if isinstance(signal, StepAt) and signal.begin >= stop:
            raise ValueRangeError(
                f"--input {name}: step at {signal.begin:g} s",
                f"comes after the run, which ends at {stop:g} s",
                next_step="give a longer --stop, or an earlier step",
            )  # fmt: skip


def with_prescribed_speeds(model: FlatModel, inputs: Mapping[str, Sine | StepAt]) -> dict[str, Sine | StepAt]:
    """Return inputs with the speeds of bodies whose motion is prescribed, where only that is given."""
    driven = dict(inputs)
    names = {v.name for v in model.inputs}
    for body in model.bodies:
        motion = inputs.get(body.motion)
        if motion is None or body.rate not in names or body.rate in inputs:
            continue
        if isinstance(motion, StepAt):
            raise ValueRangeError(
                f"--input {body.motion}",
                "is a prescribed motion, which cannot jump",
                next_step=f"give a sine or a constant, or {body.motion} and {body.rate} in a file",
            )
        speed = 2.0 * math.pi * motion.frequency * motion.amplitude
        driven[body.rate] = Sine(speed, motion.frequency, phase=math.pi / 2.0)
    return driven


def signal_names(model: FlatModel) -> list[str]:
    """Return the names of all that a run shows: states, inputs, outputs, signals."""
    everything = model.states + model.inputs + model.outputs + model.signals
    return list(dict.fromkeys(v.name for v in everything))


def main_signals(model: FlatModel, run: Trace) -> list[str]:
    """Return what is looked at first: inputs, motions, torques and forces of springs, strains."""
    names = [v.name for v in model.inputs]
    names += [name for body in model.bodies for name in (body.motion, body.rate)]
    for spring in model.springs:
        names += [spring.effort, *(piece.strain for cam in spring.cams for piece in cam.specimens)]
    return [name for name in dict.fromkeys(names) if name in run]


def only(run: Trace, names: Sequence[str]) -> Trace:
    """Return a run with some of its signals."""
    return replace(run, signals={name: run[name] for name in names}, units={n: run.units[n] for n in names})


def as_recorded(readings: Trace, model: FlatModel, run: Trace) -> Trace:
    """Return the readings, and the inputs that no sensor reads, as a bench would record them."""
    seen = {reading.measured for reading in model.readings}
    names = [v.name for v in model.inputs if v.name not in seen]
    return readings.with_signals({n: run[n] for n in names}, {n: run.units[n] for n in names})


def signal_sizes(values: Array) -> dict[str, float]:
    """Return smallest, largest, rms and last value of a signal, with zero for what is only rounding."""
    sizes = {
        "smallest": values.min(),
        "largest": values.max(),
        "rms": np.sqrt(np.mean(values**2)),
        "last": values[-1],
    }
    least = _ROUNDING * float(np.max(np.abs(values)))
    return {name: float(size) if abs(size) > least else 0.0 for name, size in sizes.items()}


def rms_against(measured: Trace, predicted: Trace) -> dict[str, float]:
    """Return the rms error of each predicted signal; one that is not measured should be zero."""
    errors = {n: v - measured[n] if n in measured else v for n, v in predicted.signals.items()}
    return {name: float(np.sqrt(np.mean(error**2))) for name, error in errors.items()}
