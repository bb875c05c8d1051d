"""Dry friction that truly sticks: while both sides rest on each other, the torque is what keeps them there.

Simulation locates where they stick and slip; optimisation and export take ``smooth()``.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression
from ..core.dampers import CoulombFriction, Viscous
from ..core.element import ROTATION, Combination, Domain, Element, Scope, observed_effort
from ..core.part import parameter
from ..core.switches import dry
from .friction import LoadFriction, StribeckFriction

CREEP = 0.02
"""Speed at which the smooth forms have 76 % of the torque unless another one is asked for, in rad/s."""


@dataclass(frozen=True, kw_only=True)
class DryFriction(Viscous):
    """Coulomb friction with sticking: T = T_c·sgn(ω) while ω ≠ 0, |T| ≤ T_c while ω = 0.

    At rest T is what keeps both sides together. Valid between two bodies, one of which has inertia. Viscous
    friction goes beside it as a TorsionDashpot. Source: Coulomb 1785; as a set-valued law Pfeiffer and
    Glocker 1996.
    """

    sliding_torque: Quantity = parameter("N*m", "friction torque while sliding", minimum=0.0, maximum=1e6)

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        level = scope.parameter("sliding_torque")
        return dry(scope, rate, lambda speed: level, level)

    def smooth(self, width: float = CREEP) -> Element:
        """Return T_c·tanh(ω/width), C∞, which differs by at most 2·T_c·e^(−2|ω|/width) while sliding.

        Parameters
        ----------
        width
            Speed at which 76 % of the torque acts, in rad/s; below it the sides creep instead of sticking.
        """
        return CoulombFriction(sliding_torque=self.sliding_torque, creep_speed=_creep(width))


@dataclass(frozen=True, kw_only=True)
class DryStribeckFriction(Viscous):
    """Friction with sticking that falls with speed: T = (T_c + ΔT·e^(−(ω/ω_St)²))·sgn(ω) while ω ≠ 0.

    |T| ≤ T_c + ΔT while ω = 0. Valid between two bodies, one of which has inertia. Source: Stribeck 1902;
    this form in Armstrong-Hélouvry 1991.
    """

    sliding_torque: Quantity = parameter("N*m", "friction torque while sliding", minimum=0.0, maximum=1e6)
    breakaway: Quantity = parameter("N*m", "friction beyond sliding at low speed", minimum=0.0, maximum=1e6)
    stribeck_speed: Quantity = parameter(
        "rad/s", "speed at which 37 % of that is left", minimum=1e-6, maximum=1e4
    )

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        sliding, more = scope.parameter("sliding_torque"), scope.parameter("breakaway")
        fast = scope.parameter("stribeck_speed")
        return dry(scope, rate, lambda speed: sliding + more * ca.exp(-((speed / fast) ** 2)), sliding + more)

    def smooth(self, width: float = CREEP) -> Element:
        """Return the same with tanh(ω/width) for the sign, C∞.

        Parameters
        ----------
        width
            Speed at which 76 % of the torque acts, in rad/s.
        """
        return StribeckFriction(
            sliding_torque=self.sliding_torque, breakaway=self.breakaway,
            stribeck_speed=self.stribeck_speed, creep_speed=_creep(width),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DryLoadFriction(Combination):
    """Friction of a gear that grows with the load, with sticking: T = T_in + µ·|T_in|·sgn(ω) while ω ≠ 0.

    While ω = 0 the friction is at most µ·|T_in|, so a loaded gear stays where it is. T_in is the torque of
    the elements inside; none of them may be dry friction itself. Source: Coulomb 1785 with the load as normal
    force; the usual model of gear losses.
    """

    ratio: Quantity = parameter("1", "friction torque per transmitted torque", minimum=0.0, maximum=0.99)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != ROTATION:
            raise ArrangementError("DryLoadFriction", "acts on angle and torque")

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T_in and the friction."""
        torques = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        inside = sum(torques[1:], start=torques[0])
        scope.corner(inside, above="is loaded forward", below="is loaded backward", name="load")
        level = scope.parameter("ratio") * ca.fabs(inside)
        friction = dry(scope, rate, lambda speed: level, level)
        scope.loss(friction * rate)
        return inside + friction

    def smooth(self, width: float = CREEP) -> Element:
        """Return the same with tanh(ω/width) for the sign, C∞ but for the corner of |T_in|.

        Parameters
        ----------
        width
            Speed at which 76 % of the friction acts, in rad/s.
        """
        return LoadFriction(ratio=self.ratio, creep_speed=_creep(width), members=self.members)


def _creep(width: float) -> Quantity:
    return Quantity(width, "rad/s", "assumed: width of the smooth form")
