"""Input signals of models and FMUs: samples, functions of time, constants, sines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError, unknown_name
from ..model import FlatModel

Drive: TypeAlias = Callable[[float], float] | Array | float


@dataclass(frozen=True)
class Sine:
    """offset + amplitude·sin(2π·frequency·t + phase).

    Parameters
    ----------
    amplitude
        In the unit of the input.
    frequency
        In Hz.
    offset
        In the unit of the input.
    phase
        In rad.
    """

    amplitude: float
    frequency: float
    offset: float = 0.0
    phase: float = 0.0

    def __call__(self, time: float) -> float:
        """Return the value at a time."""
        return self.offset + self.amplitude * math.sin(2.0 * math.pi * self.frequency * time + self.phase)

    def at(self, times: Array) -> Array:
        """Return the values at many times at once.

        Parameters
        ----------
        times
            In s, any shape.
        """
        phase = 2.0 * math.pi * self.frequency * times + self.phase
        return self.offset + self.amplitude * np.sin(phase)


def sine(name: str, amplitude: float, frequency: float, *, offset: float = 0.0) -> dict[str, Sine]:
    """Return a sine for one input, as ``simulate`` and ``cosimulate`` take it.

    Parameters
    ----------
    name
        Full name of the input.
    amplitude
        In the unit of the input.
    frequency
        In Hz.
    offset
        About which it swings, in the same unit.

    Examples
    --------
    >>> sine("plant.motor.current", 1.0, 2.0)["plant.motor.current"](0.125)
    1.0
    """
    return {name: Sine(amplitude, frequency, offset)}


@dataclass(frozen=True, eq=False)
class Drives:
    """Inputs over time: linear between samples, or functions of time."""

    times: Array  # sample times, shape (n,)
    samples: Array  # all inputs at the sample times, shape (inputs, n)
    slopes: Array  # their slopes from each sample to the next, shape (inputs, n − 1)
    # functions: functions of time by the name and number of the input
    functions: Mapping[tuple[str, int], Callable[[float], float]]

    def at(self, interval: int, moments: Array, out: Array | None = None) -> Array:
        """Return all inputs at moments within one interval between samples.

        ``out``: where to write, shape (m, inputs); a new array otherwise.
        """
        inputs = np.empty((len(moments), len(self.samples))) if out is None else out
        if len(self.functions) < len(self.samples):
            since = moments - self.times[interval]
            np.multiply(since[:, None], self.slopes[:, interval], out=inputs)
            inputs += self.samples[:, interval]
        for (name, number), function in self.functions.items():
            if isinstance(function, Sine):
                inputs[:, number] = function.at(moments)
                continue
            values = [float(function(t)) for t in moments.tolist()]
            if not math.isfinite(sum(values)):
                raise _not_finite(name, moments, np.array(values))
            inputs[:, number] = values
        return inputs


def drives_of(model: FlatModel, times: Array, given: Mapping[str, Drive], *, hold: bool) -> Drives:
    """Return the inputs of a model over time."""
    names = [v.name for v in model.inputs]
    for name in given:
        if name not in names:
            raise unknown_name("input", name, names)
    rows = [_samples(v.name, times, given.get(v.name, v.start)) for v in model.inputs]
    samples = np.array(rows, dtype=float).reshape(len(names), len(times))
    slopes = np.zeros_like(samples[:, 1:]) if hold else np.diff(samples, axis=1) / np.diff(times)
    functions = {(n, names.index(n)): drive for n, drive in given.items() if callable(drive) and not hold}
    return Drives(times, samples, slopes, functions)


def _samples(name: str, times: Array, drive: Drive) -> Array:
    if callable(drive):
        row = np.array([float(drive(float(t))) for t in times])
    else:
        given = np.asarray(drive, dtype=float)
        if given.ndim and given.shape != times.shape:
            raise ValueRangeError(
                f"input '{name}'", f"has samples of shape {given.shape}, times are {len(times)}"
            )
        row = np.broadcast_to(given, times.shape).copy()
    if not np.all(np.isfinite(row)):
        raise _not_finite(name, times, row)
    return row


def _not_finite(name: str, times: Array, values: Array) -> ValueRangeError:
    return ValueRangeError(f"input '{name}'", f"is not finite at t = {times[~np.isfinite(values)][0]:g} s")
