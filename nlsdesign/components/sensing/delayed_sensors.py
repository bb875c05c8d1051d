"""Sensors that remember: transport delay and drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from .sensors import Array, ForceSensor, Numbers, Sensor


def _delayed(scope: Scope, value: Expression, unit: str) -> Expression:
    """Return a value behind the delay of a sensor, as its (2,2) Padé approximation."""
    tau = scope.parameter("delay")
    lag = scope.state("lag", unit, f"lagging value inside the delay of {scope.path}")
    change = scope.state("lag_change", unit, f"its change over one delay, in {scope.path}")
    scope.derive(lag, change / tau)
    scope.derive(change, (12 * (value - lag) - 6 * change) / tau)
    return value - change


def _earlier(times: Array, values: Array, delay: float) -> Array:
    """Return values a time before, by lines between samples; before the first, the first."""
    found: Array = np.interp(times - delay, times, values)
    return found


@dataclass(frozen=True, kw_only=True)
class TransportDelay(Sensor):
    """A bus or a filter chip that passes on everything τ later: reading(t) = value(t − τ).

    In the flat model as its (2,2) Padé approximation, C∞:
    e^(−sτ) ≈ (1 − sτ/2 + s²τ²/12)/(1 + sτ/2 + s²τ²/12). Phase error below (ωτ)⁵/720: 4e-5 rad at ωτ = 0.5.
    The states are a, which rests at the value, and b = τ·ȧ; the delayed value is v − b.
    In records the delay is exact; before the first sample the value stood still.
    Source: Golub and Van Loan 2013 (Padé table of the exponential).

    Examples
    --------
    >>> TransportDelay(of="load_cell.reading", delay=1e-3).title()
    'TransportDelay(delay = 0.001 s)'
    """

    delay: Quantity = parameter("s", "transport delay", minimum=1e-6, maximum=10.0)

    @property
    def late_by(self) -> str | None:
        """The delay."""
        return "delay"

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the delayed value."""
        return _delayed(scope, value, unit)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return what was there τ before."""
        return _earlier(times, values, self.delay.number)


@dataclass(frozen=True, kw_only=True)
class DelayedForceSensor(ForceSensor):
    """Load cell behind a transport delay τ: reading(t) = gain·F(t − τ) + bias.

    In the flat model a (2,2) Padé approximation, in records exact; see :class:`TransportDelay`.
    """

    delay: Quantity = parameter("s", "transport delay", minimum=1e-6, maximum=10.0)

    @property
    def late_by(self) -> str | None:
        """The delay."""
        return "delay"

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the delayed reading."""
        return super().read(scope, _delayed(scope, value, unit), unit)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return gain·F(t − τ) + bias + noise."""
        return super().recorded(times, _earlier(times, values, self.delay.number), noise)


@dataclass(frozen=True, kw_only=True)
class DriftingForceSensor(ForceSensor):
    """Load cell whose zero wanders as it warms up: reading = gain·F + bias + d·(t − t₀), linear.

    The drift so far is a state that starts at zero, so a model does not depend on the clock. Valid for runs
    that are short against the time of warming up. Source: data sheets, "temperature coefficient of zero".

    Examples
    --------
    >>> DriftingForceSensor(of="spring.force", drift=0.01).parameters()["drift"].unit
    'N/s'
    """

    drift: Quantity = parameter("N/s", "change of the bias", minimum=-1e4, maximum=1e4)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return gain·F + bias + drift so far."""
        drifted = scope.state("drifted", "N", f"drift of {scope.path} so far")
        scope.derive(drifted, scope.parameter("drift"))
        return super().read(scope, value, unit) + drifted

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return (reading − bias − drift so far)/gain."""
        return super().infer(numbers, reading - numbers.memory("drifted"))

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return gain·F + bias + drift so far + noise."""
        line: Array = super().recorded(times, values, noise) + self.drift.number * (times - times[0])
        return line
