"""Viscous laws: effort as a function of the rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...quantity import Quantity
from ...symbolic import Expression, smooth_sign
from .element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Scope
from .part import parameter


@dataclass(frozen=True, kw_only=True)
class Viscous(Element):
    """Base of the laws that need the rate."""

    picture: ClassVar[str] = "friction"

    @property
    def needs_rate(self) -> bool:
        """True: the effort depends directly on the rate."""
        return True

    @property
    def dissipates(self) -> bool:
        """True: nothing is stored."""
        return True


@dataclass(frozen=True, kw_only=True)
class Dashpot(Viscous):
    """Newton's law F = c·ė. Source: Newton 1687."""

    picture: ClassVar[str] = "dashpot"

    damping: Quantity = parameter("N*s/m", "damping", minimum=1e-9, maximum=1e12)

    @property
    def domain(self) -> Domain:
        """Extension and force."""
        return TRANSLATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = c·ė."""
        return scope.parameter("damping") * rate


@dataclass(frozen=True, kw_only=True)
class TorsionDashpot(Viscous):
    """Viscous friction T = b·ω of bearings and gears. Source: Newton 1687."""

    picture: ClassVar[str] = "dashpot"

    damping: Quantity = parameter("N*m*s/rad", "damping", minimum=0.0, maximum=1e9)

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = b·ω."""
        return scope.parameter("damping") * rate


@dataclass(frozen=True, kw_only=True)
class ViscousMaterial(Viscous):
    """Newton's law of a material, σ = η·ε̇. Source: Austin et al. 2015, eq. (1)."""

    picture: ClassVar[str] = "dashpot"

    viscosity: Quantity = parameter("Pa*s", "viscosity", minimum=1e-6, maximum=1e15)

    @property
    def domain(self) -> Domain:
        """Strain and stress."""
        return MATERIAL

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return σ = η·ε̇."""
        return scope.parameter("viscosity") * rate


@dataclass(frozen=True, kw_only=True)
class CoulombFriction(Viscous):
    """Dry friction T = T_c·tanh(ω/ω_s), C∞; at rest it creeps with ω_s·atanh(T/T_c) instead of sticking.

    Source: Coulomb 1785; the smooth form e.g. in Armstrong-Hélouvry 1991.
    """

    sliding_torque: Quantity = parameter("N*m", "friction torque while sliding", minimum=0.0, maximum=1e6)
    creep_speed: Quantity = parameter(
        "rad/s", "speed at which 76 % of the friction torque acts", minimum=1e-6, maximum=10.0, default=0.02
    )

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = T_c·tanh(ω/ω_s)."""
        return scope.parameter("sliding_torque") * smooth_sign(rate, scope.parameter("creep_speed"))
