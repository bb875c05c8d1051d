"""Encoders with a fault of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from .sensors import Array, Encoder, Numbers


@dataclass(frozen=True, kw_only=True)
class EccentricEncoder(Encoder):
    """Encoder whose disc sits off its shaft: it counts θ + a·sin(nθ) + b·(cos(nθ) − 1).

    n is the number of turns of the disc per turn of what is read: 1, or the gear ratio for a disc on the
    motor's shaft. The error vanishes at zero, where encoders are set to zero. An eccentricity e under a read
    head at radius R gives a² + b² = (e/R)². Valid while n·√(a² + b²) < 1, so that counts grow with the angle.
    Source: geometry; data sheets (of optical encoders, "eccentricity error").
    """

    sine: Quantity = parameter("rad", "amplitude of the error in sin(nθ)", minimum=-0.5, maximum=0.5)
    cosine: Quantity = parameter("rad", "amplitude of the error in cos(nθ)", minimum=-0.5, maximum=0.5)
    order: Quantity = parameter(
        "1", "turns of the disc per turn of what is read", minimum=1e-3, maximum=1e5, default=1.0
    )

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the faulty angle rounded to whole counts."""
        return super().read(scope, value + _error(scope.parameter, value), unit)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the faulty angles rounded to whole counts."""
        phase = self.order.number * values
        error: Array = self.sine.number * np.sin(phase) + self.cosine.number * (np.cos(phase) - 1)
        return super().recorded(times, values + error, noise)

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the angle behind a reading: three rounds of θ ← reading − error(θ).

        Each round takes the remainder down by the factor n·√(a² + b²).
        """
        angle = reading
        for _ in range(3):
            angle = reading - _error(numbers.parameter, angle)
        return angle


def _error(number: Callable[[str], Expression], angle: Expression) -> Expression:
    phase = number("order") * angle
    return number("sine") * ca.sin(phase) + number("cosine") * (ca.cos(phase) - 1)
