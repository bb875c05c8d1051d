"""Sensors that sample: sample and hold, tachometer.

Samples are taken at t₀ + k/f, from the first time of a run on, and held until the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from .sensors import Numbers, Sensor

_SLIP = 1e-6
"""Part of a sample by which times that were computed may miss it."""


def _instants(kind: str, times: Array, rate: float) -> Array:
    step = float(np.max(np.diff(times), initial=0.0))
    if step * rate > 1.0 + _SLIP:
        raise ValueRangeError(
            f"{kind}: sample_rate = {rate:g} Hz",
            f"is faster than the run, whose times lie up to {step:g} s apart",
            next_step=f"simulate at times at most {1.0 / rate:g} s apart",
        )
    count = math.floor((times[-1] - times[0]) * rate + _SLIP) + 1
    instants: Array = times[0] + np.arange(count) / rate
    return instants


def _held(times: Array, rate: float, samples: Array) -> Array:
    since = np.floor((times - times[0]) * rate + _SLIP).astype(int)
    held: Array = samples[np.clip(since, 0, len(samples) - 1)]
    return held


@dataclass(frozen=True, kw_only=True)
class SampleAndHold(Sensor):
    """Latches any signal f times a second: reading = value(t_k) for t_k ≤ t < t_k + 1/f.

    What it latches is the last value that stands in the run, so a count stays a count. An encoder that is
    read f times a second is an :class:`Encoder` with this before or behind it. In the flat model the value
    passes unchanged; on average a held reading is half a sample late.

    Examples
    --------
    >>> SampleAndHold(of="load_cell.reading", sample_rate=1e3).title()
    'SampleAndHold(sample_rate = 1000 Hz)'
    """

    sample_rate: Quantity = parameter("Hz", "samples per second", minimum=1e-3, maximum=1e9)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the value."""
        return value

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the samples, held."""
        rate = self.sample_rate.number
        at = _instants(type(self).__name__, times, rate)
        last = np.searchsorted(times, at + _SLIP / rate, side="right") - 1
        return _held(times, rate, values[last])


@dataclass(frozen=True, kw_only=True)
class Tachometer(Sensor):
    """Speed by filtered difference of an angle or of the reading of an encoder.

    In the flat model y = 2πf_c·(θ − θ_f) with θ̇_f = y: a differentiator with a first-order roll-off at f_c,
    as smooth as what it reads. In records the same filter acts on differences of samples,
    y_k = a·y_(k−1) + (1 − a)·(θ_k − θ_(k−1))·f_s with a = e^(−2πf_c/f_s), from rest. One count of an encoder
    shows as a step of (1 − a)·q·f_s. Source: Oppenheim and Schafer 2010 (exact for held input).

    Examples
    --------
    >>> Tachometer(of="motor_encoder.reading", bandwidth=60.0, sample_rate=1e3).title()
    'Tachometer(bandwidth = 60 Hz, sample_rate = 1000 Hz)'
    """

    units: ClassVar[tuple[str, ...]] = ("rad", "m")
    shows_value: ClassVar[bool] = False

    bandwidth: Quantity = parameter(
        "Hz", "frequency at which 71 % of the speed is seen", minimum=1e-3, maximum=1e6
    )
    sample_rate: Quantity = parameter("Hz", "differences per second", minimum=1e-3, maximum=1e9)

    def reading_unit(self, unit: str) -> str:
        """Return the unit of the speed."""
        return f"{unit}/s"

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the filtered derivative."""
        followed = scope.state("followed", unit, f"value that {scope.path} follows")
        speed = 2 * math.pi * scope.parameter("bandwidth") * (value - followed)
        scope.derive(followed, speed)
        return speed

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the filtered differences of the samples, held."""
        rate = self.sample_rate.number
        samples = np.interp(_instants(type(self).__name__, times, rate), times, values)
        keep = math.exp(-2 * math.pi * self.bandwidth.number / rate)
        speeds = np.zeros(len(samples))
        for k in range(1, len(samples)):
            speeds[k] = keep * speeds[k - 1] + (1 - keep) * (samples[k] - samples[k - 1]) * rate
        return _held(times, rate, speeds)

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Refuse: a speed does not tell the angle.

        Raises
        ------
        ArrangementError
            Always.
        """
        raise ArrangementError(
            f"tachometer of '{self.of}'",
            "gives a speed, from which what it reads cannot be inferred",
            next_step="leave its column out of the mapping, or measure the angle",
        )
