"""Signals over time for the inputs of models and FMUs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..foundation.arrays import Array


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
        In the unit of the input.

    Examples
    --------
    >>> sine("plant.motor.current", 1.0, 2.0)["plant.motor.current"](0.125)
    1.0
    """
    return {name: Sine(amplitude, frequency, offset)}
