"""Elements of these tests only: laws whose state is fed by the rate, and a spring that hardens.

They ask the algebra of elements for what the laws of the package hardly do: in series with other elements
the rate of an algebraic share is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from nlsdesign.components.core.element import TRANSLATION, Domain, Element, Scope
from nlsdesign.components.core.part import parameter
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.foundation.symbolic import Expression


@dataclass(frozen=True, kw_only=True)
class OneDimensional(Element):
    """Base: extension and force, no direct dependence on the rate."""

    @property
    def domain(self) -> Domain:
        return TRANSLATION

    @property
    def needs_rate(self) -> bool:
        return False


@dataclass(frozen=True, kw_only=True)
class FedSolid(OneDimensional):
    """Standard linear solid in force form: F = k₀·e + z, ż = k·ė − (k/c)·z."""

    still: Quantity = parameter("N/m", "stiffness at rest", minimum=0.0)
    stiffness: Quantity = parameter("N/m", "stiffness of the branch", minimum=1e-9)
    damping: Quantity = parameter("N*s/m", "damping of the branch", minimum=1e-9)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        force = scope.state("branch_force", "N", "force of the branch")
        stiffness = scope.parameter("stiffness")
        scope.derive(force, stiffness * rate - stiffness / scope.parameter("damping") * force)
        return scope.parameter("still") * motion + force


@dataclass(frozen=True, kw_only=True)
class BoucWen(OneDimensional):
    """Rate-independent hysteresis: F = k₀·e + f·z, ż = (ė − ½·|ė|·z − ½·ė·|z|)/e_y."""

    still: Quantity = parameter("N/m", "stiffness at rest", minimum=0.0)
    level: Quantity = parameter("N", "sliding force", minimum=0.0)
    yields_at: Quantity = parameter("m", "extension at which it slides", minimum=1e-9)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        z = scope.state("share_sliding", "1", "share of the sliding force")
        feed = rate - 0.5 * ca.fabs(rate) * z - 0.5 * rate * ca.fabs(z)
        scope.derive(z, feed / scope.parameter("yields_at"))
        return scope.parameter("still") * motion + scope.parameter("level") * z


@dataclass(frozen=True, kw_only=True)
class Hardening(OneDimensional):
    """F = k·e + c·e³."""

    stiffness: Quantity = parameter("N/m", "stiffness at rest", minimum=0.0)
    hardening: Quantity = parameter("N/m^3", "hardening", minimum=0.0)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        return scope.parameter("stiffness") * motion + scope.parameter("hardening") * motion**3
