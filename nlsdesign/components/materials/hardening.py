"""A spring that grows stiffer without a corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.domain import MATERIAL, ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Elastic


@dataclass(frozen=True, kw_only=True)
class HardeningSpring(Elastic):
    """What a spring has beyond its proportional part: F = k·x₀·(sinh(x/x₀) − x/x₀), alike on both sides.

    The cubic k·x³/(6·x₀²) while x ≪ x₀, as the first term that Hooke's law leaves out of any spring without
    a preferred side, and exponential beyond, as tissue and rubber near the end of their chains. C∞.
    Sources: Fung 1967 (exponential law); Ogden 1972 (powers of the stretch).

    Examples
    --------
    >>> HardeningSpring(stiffness=2000.0, scale=0.01).domain.effort
    'force'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "strain stiffening"})

    domain: Domain = one_of(TRANSLATION, ROTATION, MATERIAL)
    stiffness: Quantity = parameter("{effort}/{motion}", "stiffness k", minimum=0.0, maximum=1e12)
    scale: Quantity = parameter("{motion}", "motion x₀ from which it grows fast", minimum=1e-9, maximum=1e4)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return k·x₀·(sinh(x/x₀) − x/x₀)."""
        size = scope.parameter("scale")
        return scope.parameter("stiffness") * (size * ca.sinh(motion / size) - motion)
