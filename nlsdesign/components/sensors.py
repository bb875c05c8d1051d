"""Sensors: what the bench and the controller see of a signal."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Protocol

import casadi as ca

from ..quantity import Quantity
from ..symbolic import Expression
from .element import Scope
from .part import Part, parameter


class Numbers(Protocol):
    """Gives the symbols of a part's own numbers."""

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one number."""
        ...


@dataclass(frozen=True, kw_only=True)
class Sensor(Part):
    """Base of everything that reads a signal.

    Parameters
    ----------
    of
        Full name of the signal that is read, for instance ``"motor.angle"``.
    """

    of: str

    @abstractmethod
    def read(self, scope: Scope, value: Expression) -> Expression:
        """Return the reading of a value, in the value's unit."""

    @property
    def late_by(self) -> str | None:
        """Name of the parameter that says by how much the reading is late, if there is one."""
        return None

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the value behind a reading: the inverse of :meth:`read`, but for rounding, noise and delay.

        Parameters
        ----------
        numbers
            Gives the sensor's own parameters.
        reading
            What the sensor gave, ``late_by`` later.
        """
        return reading


@dataclass(frozen=True, kw_only=True)
class Encoder(Sensor):
    """Incremental encoder: reading = q·round(θ/q). The reading has no derivative; use the angle for that."""

    quantum: Quantity = parameter("rad", "angle of one count", minimum=1e-9, maximum=1.0)

    def read(self, scope: Scope, value: Expression) -> Expression:
        """Return the angle rounded to whole counts."""
        quantum = scope.parameter("quantum")
        return quantum * ca.floor(value / quantum + 0.5)


@dataclass(frozen=True, kw_only=True)
class ForceSensor(Sensor):
    """Load cell: reading = gain·F + bias; ``noise`` is its standard deviation, for observers and fits."""

    gain: Quantity = parameter("1", "gain", minimum=0.01, maximum=100.0, default=1.0)
    bias: Quantity = parameter("N", "bias", minimum=-1e6, maximum=1e6, default=0.0)
    noise: Quantity = parameter("N", "standard deviation of the noise", maximum=1e6, default=0.0)

    def read(self, scope: Scope, value: Expression) -> Expression:
        """Return gain·F + bias."""
        return scope.parameter("gain") * value + scope.parameter("bias")

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return (reading − bias)/gain."""
        return (reading - numbers.parameter("bias")) / numbers.parameter("gain")


@dataclass(frozen=True, kw_only=True)
class CurrentSensor(Sensor):
    """Ammeter: reading = I + bias. Its gain is not told apart from the motor's torque constant."""

    bias: Quantity = parameter("A", "bias", minimum=-1e4, maximum=1e4, default=0.0)
    noise: Quantity = parameter("A", "standard deviation of the noise", maximum=1e4, default=0.0)

    def read(self, scope: Scope, value: Expression) -> Expression:
        """Return I + bias."""
        return value + scope.parameter("bias")

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return reading − bias."""
        return reading - numbers.parameter("bias")


@dataclass(frozen=True, kw_only=True)
class DelayedForceSensor(ForceSensor):
    """Load cell behind a transport delay τ, as its (2,2) Padé approximation.

    e^(−sτ) ≈ (1 − sτ/2 + s²τ²/12)/(1 + sτ/2 + s²τ²/12). Phase error below (ωτ)⁵/720: 4e-5 rad at ωτ = 0.5.
    The states are a, which rests at the value, and b = τ·ȧ; the delayed value is v − b.
    Source: Golub and Van Loan, Matrix Computations, Padé table of the exponential.
    """

    delay: Quantity = parameter("s", "transport delay", minimum=1e-6, maximum=10.0)

    @property
    def late_by(self) -> str | None:
        """The delay."""
        return "delay"

    def read(self, scope: Scope, value: Expression) -> Expression:
        """Return the delayed reading."""
        tau = scope.parameter("delay")
        lag = scope.state("lag", "N", f"lagging value inside the delay of {scope.path}")
        change = scope.state("lag_change", "N", f"its change over one delay, in {scope.path}")
        scope.derive(lag, change / tau)
        scope.derive(change, (12 * (value - lag) - 6 * change) / tau)
        return super().read(scope, value - change)
