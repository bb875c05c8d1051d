"""Friction by bristles: before two surfaces slip, they bend each other's roughness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Viscous
from .friction import stribeck


@dataclass(frozen=True, kw_only=True)
class LuGreFriction(Viscous):
    """LuGre friction without drift: T = σ₀·z + σ₁·ż + b·ω, ż = ω·(1 − α·z/z_s), z_s = sgn(ω)·g(ω)/σ₀.

    g = T_c + ΔT·e^(−(ω/ω_St)²) is the torque at steady speed. α is 0 below the break-away deflection z_b =
    r·|z_s| and while the bristles unload, 1 beyond |z_s|, with half a sine between: so below break-away the
    bristles are a spring that returns, and a body that sticks does not creep. Continuous, with corners.
    Sources: Canudas de Wit et al. 1995; Dupont et al. 2002.
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"dry friction", "viscous friction"})

    domain: Domain = one_of(ROTATION, TRANSLATION)

    stiffness: Quantity = parameter(
        "{effort}/{motion}", "stiffness σ₀ of the bristles", minimum=1e-3, maximum=1e9
    )
    bristle_damping: Quantity = parameter(
        "{effort}*s/{motion}", "damping σ₁ of bristles", minimum=0.0, maximum=1e6
    )
    damping: Quantity = parameter("{effort}*s/{motion}", "viscous friction b", minimum=0.0, maximum=1e9)
    sliding_effort: Quantity = parameter("{effort}", "friction T_c while sliding", minimum=1e-9, maximum=1e6)
    breakaway: Quantity = parameter(
        "{effort}", "friction ΔT beyond sliding at low speed", minimum=0.0, maximum=1e6
    )
    stribeck_speed: Quantity = parameter(
        "{rate}", "speed ω_St at which 37 % of that is left", minimum=1e-6, maximum=1e4
    )
    elastic_share: Quantity = parameter(
        "1",
        "share r of the largest deflection that is elastic",
        minimum=0.0,
        maximum=0.99,
        default=0.7,
    )

    @property
    def dissipates(self) -> bool:
        """False: the bristles store."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        stiffness, share = scope.parameter("stiffness"), scope.parameter("elastic_share")
        deflection = scope.state(
            "deflection", self.domain.motion_unit, f"deflection of the bristles of {scope.path}"
        )
        fall = stribeck(rate, scope.parameter("stribeck_speed"))
        most = (scope.parameter("sliding_effort") + scope.parameter("breakaway") * fall) / stiffness
        # From 0 at the break-away deflection to 1 at the largest.
        place = ca.fmin(ca.fmax((ca.fabs(deflection) / most - share) / (1 - share), 0), 1)
        plastic = ca.if_else(deflection * rate > 0, (1 - ca.cos(ca.pi * place)) / 2, 0)
        bending = rate * (1 - plastic * ca.fabs(deflection) / most)
        scope.derive(deflection, bending)
        damping = scope.parameter("bristle_damping") * bending + scope.parameter("damping") * rate
        scope.loss(stiffness * deflection * (rate - bending) + damping * rate)
        return stiffness * deflection + damping
