"""The springpot: a law between spring and dashpot, whose loss hardly depends on the frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import MATERIAL, Domain, Element, Scope
from ..core.part import parameter

_CELLS = 10
_MARGIN = math.sqrt(10.0)
"""The branches reach half a decade beyond the band on either side."""
_SEEN = 400
"""Frequencies, evenly spaced in their logarithm, at which the error is looked for."""


@dataclass(frozen=True, kw_only=True)
class Springpot(Element):
    """Fractional law E*(iω) = E₁·(iω/ω₁)^α: the modulus is E₁ at ω₁ = 2π·f₁, tan δ = tan(α·π/2) everywhere.

    In time σ = c·d^α ε/dt^α with c = E₁/ω₁^α in Pa·s^α. Within the band the law is a Prony series of twelve
    Maxwell branches: the spectrum s^α = sin(απ)/π·∫ x^(α−1)·s/(s + x) dx by the midpoint rule in ln x, and
    one branch for each tail that has its first two moments. ``largest_error`` is its cost inside the band;
    below it the stress relaxes to nothing, above it the modulus is constant. Sources: Scott Blair 1947;
    Koeller 1984.

    Raises
    ------
    ValueRangeError
        If the band does not rise from its lower to its upper end.

    Examples
    --------
    >>> law = Springpot(modulus=1e6, reference=1.0, order=0.1, lower=0.01, upper=100.0)
    >>> law.title().partition("; ")[2]
    'largest error 0.36 % from 0.01 Hz to 100 Hz)'
    """

    domain: ClassVar[Domain] = MATERIAL
    phenomena: ClassVar[frozenset[str]] = frozenset({"relaxation"})

    modulus: Quantity = parameter(
        "Pa", "size E₁ of the complex modulus at the reference frequency", minimum=1.0, maximum=1e12
    )
    reference: Quantity = parameter("Hz", "reference frequency f₁", minimum=1e-9, maximum=1e9, default=1.0)
    order: Quantity = parameter("1", "order α, 0 for a spring, 1 for a dashpot", minimum=1e-3, maximum=0.999)
    lower: Quantity = parameter("Hz", "lower end of the band", minimum=1e-9, maximum=1e9)
    upper: Quantity = parameter("Hz", "upper end of the band", minimum=1e-9, maximum=1e9)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.lower.number < self.upper.number:
            raise ValueRangeError(
                f"lower = {self.lower}, upper = {self.upper}",
                "the band must rise from its lower to its upper end",
            )

    @property
    def needs_rate(self) -> bool:
        """False: each branch has its own state."""
        return False

    @property
    def largest_error(self) -> float:
        """Largest relative error |E*/E*_exact − 1| inside the band."""
        band = np.geomspace(self.lower.number, self.upper.number, _SEEN)
        exact = self.modulus.number * (1j * band / self.reference.number) ** self.order.number
        return float(np.max(np.abs(self.complex_modulus(band) / exact - 1.0)))

    def complex_modulus(self, frequency: Array) -> NDArray[np.complex128]:
        """Return the complex modulus of the branches in Pa.

        Parameters
        ----------
        frequency
            In Hz, shape (n,).
        """
        numbers = {name: quantity.number for name, quantity in self.parameters().items()}
        s = 2j * math.pi * frequency
        parts = [modulus * s / (s + rate) for modulus, rate in _branches(**numbers)]
        return np.add.reduce(parts, axis=0, dtype=np.complex128)

    def title(self) -> str:
        """Return one line that names the law, its numbers and what the approximation costs."""
        band = f"from {self.lower.number:g} Hz to {self.upper.number:g} Hz"
        return f"{super().title()[:-1]}; largest error {100 * self.largest_error:.2g} % {band})"

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum over the branches, each with the strain of its dashpot as a state."""
        total = ca.SX(0)
        symbols = {name: scope.parameter(name) for name in self.parameter_infos()}
        for number, (modulus, relaxation) in enumerate(_branches(**symbols), start=1):
            strain = scope.state(f"branch_{number}", "1", f"strain of dashpot {number} of {scope.path}")
            flow = relaxation * (motion - strain)
            scope.derive(strain, flow)
            stress = modulus * (motion - strain)
            scope.loss(stress * flow)
            total += stress
        return total


def _branches(modulus: Any, reference: Any, order: Any, lower: Any, upper: Any) -> list[tuple[Any, Any]]:
    """Return modulus in Pa and rate in 1/s of each Maxwell branch; numbers or expressions alike."""
    low, high = 2 * math.pi * lower / _MARGIN, 2 * math.pi * upper * _MARGIN
    scale = modulus / (2 * math.pi * reference) ** order * ca.sin(order * math.pi) / math.pi
    width = ca.log(high / low) / _CELLS
    rates = [low * ca.exp((cell + 0.5) * width) for cell in range(_CELLS)]
    inside = [(scale * width * rate**order, rate) for rate in rates]
    # ∫₀^low x^(α−1)·s/(s + x) dx to second order in low/s, and the rest from high on in s/high.
    slow = (scale * low**order / order, low * order / (order + 1))
    fastest = high * (2 - order) / (1 - order)
    fast = (scale * high ** (order - 1) / (1 - order) * fastest, fastest)
    return [slow, *inside, fast]
