"""Faults of sensors: each is a sensor in the chain, so any of them stands before or behind any other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.delay import delayed
from ..core.element import Scope
from ..core.part_numbers import parameter
from .sensors import Array, Numbers, Sensor


@dataclass(frozen=True, kw_only=True)
class TransportDelay(Sensor):
    """A bus or a filter chip that passes on everything τ later: reading(t) = value(t − τ).

    In the flat model as its (2,2) Padé approximation, see :func:`~nlsdesign.components.core.delay.delayed`.
    In records the delay is exact, by lines between samples; before the first sample the value stood still.
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
        return delayed(scope, value, unit)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return what was there τ before."""
        earlier: Array = np.interp(times - self.delay.number, times, values)
        return earlier


@dataclass(frozen=True, kw_only=True)
class Drift(Sensor):
    """A force whose zero wanders while the instrument warms up: reading = F + d·(t − t₀), linear in time.

    The drift so far is a state that starts at zero, so a model does not depend on the clock. Valid for runs
    that are short against the time of warming up. Source: data sheets, "temperature coefficient of zero".

    Examples
    --------
    >>> Drift(of="spring.force", drift=0.01).parameters()["drift"].unit
    'N/s'
    """

    units: ClassVar[tuple[str, ...]] = ("N",)

    drift: Quantity = parameter("N/s", "change of the zero", minimum=-1e4, maximum=1e4)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return F + drift so far."""
        drifted = scope.state("drifted", unit, f"drift of {scope.path} so far")
        scope.derive(drifted, scope.parameter("drift"))
        return value + drifted

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return F + drift so far."""
        line: Array = values + self.drift.number * (times - times[0])
        return line

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return reading − drift so far."""
        return reading - numbers.memory("drifted")


@dataclass(frozen=True, kw_only=True)
class Eccentricity(Sensor):
    """An encoder disc that sits off its shaft: it shows θ + a·sin(nθ) + b·(cos(nθ) − 1).

    n is the number of turns of the disc per turn of what is read: 1, or the gear ratio for a disc on the
    motor's shaft. The error vanishes at zero, where encoders are set to zero. An eccentricity e under a read
    head at radius R gives a² + b² = (e/R)². Valid while n·√(a² + b²) < 1, so that counts grow with the angle.
    Source: geometry; data sheets (of optical encoders, "eccentricity error").

    Examples
    --------
    >>> Eccentricity(of="motor.angle", sine=0.01, cosine=0.0).title()
    'Eccentricity(sine = 0.01 rad, cosine = 0 rad, order = 1)'
    """

    units: ClassVar[tuple[str, ...]] = ("rad",)

    sine: Quantity = parameter("rad", "amplitude of the error in sin(nθ)", minimum=-0.5, maximum=0.5)
    cosine: Quantity = parameter("rad", "amplitude of the error in cos(nθ)", minimum=-0.5, maximum=0.5)
    order: Quantity = parameter(
        "1", "turns of the disc per turn of what is read", minimum=1e-3, maximum=1e5, default=1.0
    )

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the angle with the error of the disc."""
        return value + _disc_error(scope.parameter, value)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the angles with the error of the disc."""
        phase = self.order.number * values
        error: Array = self.sine.number * np.sin(phase) + self.cosine.number * (np.cos(phase) - 1)
        return values + error

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the angle behind a reading: three rounds of θ ← reading − error(θ).

        Each round takes the remainder down by the factor n·√(a² + b²).
        """
        angle = reading
        for _ in range(3):
            angle = reading - _disc_error(numbers.parameter, angle)
        return angle


def _disc_error(number: Callable[[str], Expression], angle: Expression) -> Expression:
    phase = number("order") * angle
    return number("sine") * ca.sin(phase) + number("cosine") * (ca.cos(phase) - 1)
