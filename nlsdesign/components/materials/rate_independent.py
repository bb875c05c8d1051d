"""Rate-independent hysteresis of filled rubber."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import MATERIAL, Domain, Element, Scope
from ..core.part import parameter

_MOST_OVERSHOOT = 1.2
_SHARES = (0.3, 0.6, 1.1, 2.0)
"""Yield stresses of the sliders relative to the mean one; their mean is one."""


@dataclass(frozen=True, kw_only=True)
class SlidingFillers(Element):
    """Springs with dry sliders in parallel: stress follows strain, whatever the rate, and lags at reversals.

    Each slider obeys ż = E·ε̇·(1 − (z/z_y)⁴·[z·ε̇ > 0]): elastic at a reversal, with the modulus E = Eₜ/4, and
    nearly ideally plastic at its yield stress z_y. Four sliders whose yield stresses spread by a factor of
    seven give the rounded loops of filled rubber. Sources: Iwan 1967 (many sliders); Bouc 1967, Wen 1976 (the
    smooth form of one).
    """

    domain: ClassVar[Domain] = MATERIAL
    phenomena: ClassVar[frozenset[str]] = frozenset({"hysteresis"})

    modulus: Quantity = parameter(
        "Pa", "modulus Eₜ of all sliders together from rest", minimum=0.0, maximum=1e12
    )
    yield_stress: Quantity = parameter(
        "Pa", "stress of all sliders together while sliding", minimum=1e-6, maximum=1e12
    )

    @property
    def needs_rate(self) -> bool:
        """False: the stress is a state; the rate only drives it."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum of the sliders' stresses."""
        modulus = scope.parameter("modulus") / len(_SHARES)
        limit = scope.parameter("yield_stress") / len(_SHARES)
        total = ca.SX(0)
        for number, share in enumerate(_SHARES, start=1):
            stress = scope.state(f"slider_{number}", "Pa", f"stress of slider {number} of {scope.path}")
            # The law keeps the ratio below one; a numerical step that overshoots must not run away.
            ratio = ca.fmin(ca.fabs(stress) / (share * limit), _MOST_OVERSHOOT)
            loading = ca.if_else(stress * rate > 0, ratio**4, 0)
            scope.derive(stress, modulus * rate * (1 - loading))
            scope.loss(stress * rate * loading)
            total += stress
        return total
