"""Springs that grow stiffer without a corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Elastic

_SERIES = 0.1
"""Share of the scale below which the series stands for a difference that would cancel."""


@dataclass(frozen=True, kw_only=True)
class HardeningSpring(Elastic):
    """What a spring has beyond its proportional part: F = c·x³·S(x/x₀), S(u) = 6·(sinh(u) − u)/u³.

    The cubic c·x³ while x ≪ x₀, as the first term that Hooke's law leaves out of any spring without a
    preferred side, and exponential beyond x₀, as tissue and rubber near the end of their chains. Alike on
    both sides, C∞ but for 1e-13 of S at x₀/10, where its series ends. Sources: Fung 1967 (exponential law);
    Ogden 1972 (powers of the stretch).

    Examples
    --------
    >>> HardeningSpring(cubic=3e6, scale=0.01).domain.effort
    'force'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "strain stiffening"})

    domain: Domain = one_of(TRANSLATION, ROTATION, MATERIAL)
    cubic: Quantity = parameter("{effort}/{motion}^3", "cubic stiffness c", minimum=0.0, maximum=1e18)
    scale: Quantity = parameter("{motion}", "motion x₀ from which it grows fast", minimum=1e-9, maximum=1e4)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return c·x³·S(x/x₀)."""
        share = motion / scope.parameter("scale")
        near = ca.fabs(share) < _SERIES
        square, far = share * share, ca.if_else(near, _SERIES, share)
        series = 1 + square / 20 * (1 + square / 42 * (1 + square / 72))
        factor = ca.if_else(near, series, 6 * (ca.sinh(far) - far) / far**3)
        return scope.parameter("cubic") * motion**3 * factor


@dataclass(frozen=True, kw_only=True)
class SoftWindup(Elastic):
    """What a spring lacks around its rest: F = −c·w·tanh(x/w), a stiffness k becomes k − c/cosh²(x/w).

    Stands beside a spring that is stiffer than c: a strain wave gear, or a coupling, whose teeth carry one
    after the other. Beyond w only the constant effort c·w is missing, as behind a dead zone of 2·w where c is
    k. The tanh is a choice: sources give curves. Source: Tuttle 1992 (soft wind-up of a strain wave gear).

    Examples
    --------
    >>> SoftWindup(missing=2e3, width=1e-3, domain=ROTATION).domain.effort
    'torque'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "soft wind-up"})

    domain: Domain = one_of(TRANSLATION, ROTATION)
    missing: Quantity = parameter(
        "{effort}/{motion}", "stiffness c missing at rest", minimum=0.0, maximum=1e12
    )
    width: Quantity = parameter("{motion}", "motion w over which it is missing", minimum=1e-9, maximum=10.0)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return −c·w·tanh(x/w)."""
        width = scope.parameter("width")
        return -scope.parameter("missing") * width * ca.tanh(motion / width)
