"""Wrappers that remember how far and how hard the elements inside were stretched: softening, set, heat."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import MATERIAL, TRANSLATION, Combination, Scope, observed_effort
from ..core.part import parameter

_LEAST_RATIO = 1e-3


@dataclass(frozen=True, kw_only=True)
class Ageing(Combination):
    """Base of wrappers with a memory of their own around elements that share the motion."""

    @property
    def needs_rate(self) -> bool:
        """True if any element inside needs the rate; the memory itself is only driven by it."""
        return any(member.needs_rate for _, member in self.members)

    def _inside(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        efforts = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        return sum(efforts[1:], start=efforts[0])

    def _largest(self, scope: Scope, motion: Expression) -> Expression:
        """Return the largest motion so far, at least the present one: ṁ = ⟨x − m⟩/τ."""
        unit, name = self.domain.motion_unit, self.domain.motion
        memory = scope.state("largest", unit, f"largest {name} of {scope.path} so far")
        scope.derive(memory, ca.fmax(motion - memory, 0) / scope.parameter("following"))
        return ca.fmax(memory, motion)


@dataclass(frozen=True, kw_only=True)
class StressSoftening(Ageing):
    """Mullins effect: F = F_in·(1 − s·(1 − (x/x_max)^p)), softer below the largest motion x_max so far.

    Virgin rubber, and rubber stretched beyond x_max, is not softened; at small motion the share s is lost.
    p = 1 makes the loss fall linearly with the motion. The memory starts at the first motion and follows a
    growing motion with the time constant ``following``, which must be short against the motion; it never
    heals. Valid for one sense of loading from zero. Sources: Mullins 1969 (the effect); Ogden and Roxburgh
    1999 (one factor on the virgin effort, kept from the largest load).
    """

    softening: Quantity = parameter("1", "share s that is lost at small motion", minimum=0.0, maximum=0.99)
    exponent: Quantity = parameter(
        "1", "exponent p of the return to virgin rubber", minimum=0.1, maximum=20.0, default=1.0
    )
    following: Quantity = parameter(
        "s", "time in which the memory follows the motion", minimum=1e-5, maximum=10.0, default=5e-3
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the softened effort."""
        largest = self._largest(scope, motion)
        ratio = ca.fmin(ca.fmax(motion / ca.fmax(largest, 1e-12), _LEAST_RATIO), 1)
        lost = scope.parameter("softening") * (1 - ratio ** scope.parameter("exponent"))
        scope.signal("softness", 1 - lost, "1", f"share of the virgin effort that {scope.path} has")
        return (1 - lost) * self._inside(scope, motion, rate)


@dataclass(frozen=True, kw_only=True)
class TensionSet(Ageing):
    """Set of rubber: F = F_in(x − s·x_max), the rest length has grown by a share s of the largest motion.

    The memory follows a growing motion with the time constant ``following`` and never recovers. Inside a
    cable that only pulls the piece goes slack on the way back. Source: Gent 2012 (tension set).
    """

    share: Quantity = parameter("1", "share of the largest motion that stays", minimum=0.0, maximum=0.9)
    following: Quantity = parameter(
        "s", "time in which the memory follows the motion", minimum=1e-5, maximum=10.0, default=5e-3
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort at the motion that is left."""
        stays = scope.parameter("share") * self._largest(scope, motion)
        scope.signal("set", stays, self.domain.motion_unit, f"rest {self.domain.motion} of {scope.path}")
        return self._inside(scope, motion - stays, rate)


@dataclass(frozen=True, kw_only=True)
class WorkHeating(Ageing):
    """Heat of working makes soft: F = F_in/(1 + ϑ), dϑ/dt = |F_in·ẋ|/E − ϑ/τ.

    ϑ is the relative loss of stiffness, zero when cold. A fixed share of all work becomes heat; E is the work
    after which, uncooled, half of the stiffness is left. Valid for ϑ below about 0.5. Source: first law with
    a constant loss factor; Medalia 1991 (heat build-up).
    """

    halving_work: Quantity = parameter("J", "work E after which ϑ = 1", minimum=1e-6, maximum=1e12)
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=1e-3, maximum=1e6)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner == MATERIAL:
            raise ArrangementError(
                "WorkHeating", "needs work in J; stress times strain rate is work per volume",
                next_step="put it around the specimen",
            )  # fmt: skip

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the warm elements."""
        inside = self._inside(scope, motion, rate)
        heat = scope.state("heat", "1", f"relative loss of stiffness of {scope.path} by heat")
        heating = ca.fabs(inside * rate) / scope.parameter("halving_work")
        scope.derive(heat, heating - heat / scope.parameter("cooling_time"))
        return inside / (1 + heat)


@dataclass(frozen=True, kw_only=True)
class ViscousHeating(Ageing):
    """Heat of viscous loss makes soft: F = F_in/(1 + ϑ), dϑ/dt = ((ẋ/v)² − ϑ)/τ.

    ϑ is the relative loss of stiffness, zero when cold. The loss is that of a dashpot, so a slow motion makes
    no heat; v is the steady speed at which half of the stiffness would be left. Valid for ϑ below about 0.5
    and motions slower than the relaxation of the branch that makes the loss. Source: first law with the loss
    c·ẋ² of a dashpot; Medalia 1991 (heat build-up).
    """

    halving_speed: Quantity = parameter("m/s", "steady speed v with ϑ = 1", minimum=1e-9, maximum=1e6)
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=1e-3, maximum=1e6)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != TRANSLATION:
            raise ArrangementError("ViscousHeating", "acts on extension and force")

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the warm elements."""
        heat = scope.state("heat", "1", f"relative loss of stiffness of {scope.path} by heat")
        share = rate / scope.parameter("halving_speed")
        scope.derive(heat, (share * share - heat) / scope.parameter("cooling_time"))
        return self._inside(scope, motion, rate) / (1 + heat)
