"""Relaxation of rubber at large stretch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import MATERIAL, Domain, Element, Scope
from ..core.part import parameter

_SMALLEST_STRETCH = 0.05


@dataclass(frozen=True, kw_only=True)
class FlowingChains(Element):
    """Maxwell branch at large stretch: λ = λₑ·λᵥ, a neo-Hookean spring in series with a flow of true stress.

    σ = µ·(λₑ − λₑ⁻²)/λᵥ is the nominal stress, µ·(λₑ² − 1/λₑ) the true one, and d(ln λᵥ)/dt is the true
    stress over 3η. At small strain it is ``series(spring, dashpot)`` with E = 3µ and 3η, so τ = η/µ. For
    uniaxial tension of an incompressible piece. Sources: Green and Tobolsky 1946 (chains that break and form
    again); Reese and Govindjee 1998 (this form, with one relaxation time).

    Examples
    --------
    >>> FlowingChains(shear_modulus=0.1e6, viscosity=0.3e6).title()
    'FlowingChains(shear_modulus = 100000 Pa, viscosity = 300000 Pa·s)'
    """

    domain: ClassVar[Domain] = MATERIAL
    phenomena: ClassVar[frozenset[str]] = frozenset({"relaxation"})

    shear_modulus: Quantity = parameter("Pa", "shear modulus µ of the chains", minimum=1.0, maximum=1e12)
    viscosity: Quantity = parameter("Pa*s", "shear viscosity η of the flow", minimum=1e-6, maximum=1e15)

    @property
    def needs_rate(self) -> bool:
        """False: the flow is a state, led by the stress."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the nominal stress at λ = 1 + ε."""
        flow = scope.state("flow", "1", f"logarithm of the stretch that has flown in {scope.path}")
        modulus = scope.parameter("shear_modulus")
        # No piece is pressed to nothing; the floor keeps the law finite for whatever a solver tries.
        stretch = ca.fmax(1 + motion, _SMALLEST_STRETCH)
        elastic = stretch * ca.exp(-flow)
        true_stress = modulus * (elastic**2 - 1 / elastic)
        flow_rate = true_stress / (3 * scope.parameter("viscosity"))
        scope.derive(flow, flow_rate)
        scope.loss(true_stress * flow_rate)
        return modulus * (elastic - elastic**-2) * ca.exp(-flow)
