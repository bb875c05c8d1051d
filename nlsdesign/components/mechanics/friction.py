"""Torques that depend on speed or angle in other ways than a bearing's: Stribeck friction, drag, ripple."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, smooth_sign
from ..core.dampers import CoulombFriction, Viscous
from ..core.element import ROTATION, Combination, Domain, Scope, observed_effort
from ..core.part import parameter
from ..core.springs import Elastic


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(CoulombFriction):
    """Dry friction that falls with speed: T = (T_c + ΔT·e^(−(ω/ω_St)²))·tanh(ω/ω_s).

    ΔT is what the friction near standstill has beyond sliding. Source: Stribeck 1902; this form in
    Armstrong-Hélouvry 1991.
    """

    breakaway: Quantity = parameter("N*m", "friction beyond sliding at low speed", minimum=0.0, maximum=1e6)
    stribeck_speed: Quantity = parameter(
        "rad/s", "speed at which 37 % of that is left", minimum=1e-6, maximum=1e4
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the friction torque."""
        fall = ca.exp(-((rate / scope.parameter("stribeck_speed")) ** 2))
        level = scope.parameter("sliding_torque") + scope.parameter("breakaway") * fall
        return level * smooth_sign(rate, scope.parameter("creep_speed"))


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Viscous):
    """Drag of a fan or of churned oil: T = c·ω·|ω|. Source: Newton 1687, book II."""

    picture: ClassVar[str] = "dashpot"

    drag: Quantity = parameter("N*m*s^2/rad^2", "drag coefficient", minimum=0.0, maximum=1e9)

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = c·ω·|ω|."""
        return scope.parameter("drag") * rate * ca.fabs(rate)


@dataclass(frozen=True, kw_only=True)
class TorqueRipple(Elastic):
    """Cogging and torque ripple, T = a·sin(nθ) + b·cos(nθ), locked to the angle.

    The order n is the number of periods per turn. It comes from the poles of the motor times
    the gear ratio, or from the teeth of a gear. Source: e.g. Hanselman 2003.
    """

    picture: ClassVar[str] = "box"

    sine: Quantity = parameter("N*m", "amplitude of the part in sin(nθ)", minimum=-1e6, maximum=1e6)
    cosine: Quantity = parameter("N*m", "amplitude of the part in cos(nθ)", minimum=-1e6, maximum=1e6)
    order: Quantity = parameter("1", "periods per turn", minimum=0.1, maximum=1e5)

    @property
    def restores(self) -> bool:
        """False: it has many places of rest."""
        return False

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the ripple torque."""
        phase = scope.parameter("order") * motion
        return scope.parameter("sine") * ca.sin(phase) + scope.parameter("cosine") * ca.cos(phase)


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Combination):
    """Friction of a gear or cable drive that grows with the load: T = T_in + µ·|T_in|·tanh(ω/ω_s).

    T_in is the torque of the elements inside, the drive's efficiency is about 1 − µ forward and 1/(1 − µ)
    backward. Source: Coulomb 1785 with the load as normal force; the usual model of gear losses.
    """

    ratio: Quantity = parameter("1", "friction torque per transmitted torque", minimum=0.0, maximum=0.99)
    creep_speed: Quantity = parameter(
        "rad/s", "speed at which 76 % of the friction acts", minimum=1e-6, maximum=10.0, default=0.02
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != ROTATION:
            raise ArrangementError("LoadFriction", "acts on angle and torque")

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T_in + µ·|T_in|·tanh(ω/ω_s)."""
        torques = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        inside = sum(torques[1:], start=torques[0])
        direction = smooth_sign(rate, scope.parameter("creep_speed"))
        return inside + scope.parameter("ratio") * ca.fabs(inside) * direction
