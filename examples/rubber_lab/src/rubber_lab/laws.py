"""A law of material, and a law between two bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from nlsdesign import Quantity
from nlsdesign.components.core.domain import ROTATION, Domain
from nlsdesign.components.core.element import Scope
from nlsdesign.components.core.part import parameter
from nlsdesign.components.core.springs import Elastic
from nlsdesign.components.materials.hyperelastic import Hyperelastic
from nlsdesign.foundation.symbolic import Expression


@dataclass(frozen=True, kw_only=True)
class Gent(Hyperelastic):
    """Chains that come to an end: W = −μ·J/2·ln(1 − (λ² + 2/λ − 3)/J); E = 3·μ at small strain.

    Neo-Hookean while λ² + 2/λ − 3 is small against J, without bound where it comes near J. Source: Gent 1996,
    A new constitutive relation for rubber, Rubber Chemistry and Technology 69.
    """

    shear_modulus: Quantity = parameter("Pa", "shear modulus μ", minimum=1.0, maximum=1e12)
    limit: Quantity = parameter(
        "1", "J, the value of λ² + 2/λ − 3 at which the chains end", minimum=1.0, maximum=1e4
    )

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the energy per unstretched volume."""
        invariant = stretch**2 + 2 / stretch - 3
        modulus, limit = scope.parameter("shear_modulus"), scope.parameter("limit")
        return -modulus * limit / 2 * ca.log(1 - invariant / limit)


@dataclass(frozen=True, kw_only=True)
class WireBundle(Elastic):
    """Wires that lead through a joint and are bent by it: T = k·θ·(1 + (θ/θ_h)²), stiffer the further."""

    domain: ClassVar[Domain] = ROTATION
    phenomena: ClassVar[frozenset[str]] = frozenset({"wires"})

    stiffness: Quantity = parameter("N*m/rad", "stiffness k at angle zero", minimum=0.0, maximum=1e6)
    hardening_angle: Quantity = parameter(
        "rad", "angle θ_h at which they pull twice as hard as in proportion", minimum=1e-3, maximum=1e3
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the torque of the wires."""
        share = motion / scope.parameter("hardening_angle")
        return scope.parameter("stiffness") * motion * (1 + share * share)
