"""Equilibrium laws of rubber at large stretch; each says its strain energy, CasADi the stress.

All are for uniaxial tension of an incompressible piece: with the stretch λ = 1 + ε the other two principal
stretches are λ^(−1/2), and the nominal stress is σ = dW/dλ, with W the energy per volume of the unstretched
piece.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, symbol
from ..core.element import MATERIAL, Domain, Range, Scope
from ..core.part import parameter
from ..core.springs import FittedLaw

_SHARE_OF_LIMIT = 0.9
"""Part of the way to the end of the chains that still counts as the range of the extended tube."""


@dataclass(frozen=True, kw_only=True)
class Hyperelastic(FittedLaw):
    """Base of the laws that are given by their strain energy."""

    domain: ClassVar[Domain] = MATERIAL

    @abstractmethod
    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the energy per unstretched volume, in J/m³ = Pa.

        Parameters
        ----------
        scope
            Gives the parameters.
        stretch
            Present length over unstretched length.
        """

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return σ = dW/dλ at λ = 1 + ε."""
        stretch = symbol("stretch")
        stress = ca.jacobian(self.energy(scope, stretch), stretch)
        return ca.SX(ca.substitute(stress, stretch, 1 + motion))


@dataclass(frozen=True, kw_only=True)
class NeoHooke(Hyperelastic):
    """Network of Gaussian chains: W = μ/2·(λ² + 2/λ − 3), so σ = μ·(λ − λ⁻²); E = 3·μ at small strain.

    Unfilled rubber follows it to about 40 % strain; at a stretch of 3 it is 30 % too stiff, beyond 6 far too
    soft. Sources: Treloar 1943; Rivlin 1948.

    Examples
    --------
    >>> NeoHooke(shear_modulus=0.39e6).title()
    'NeoHooke(shear_modulus = 390000 Pa)'
    """

    shear_modulus: Quantity = parameter("Pa", "shear modulus μ", minimum=1.0, maximum=1e12)

    @property
    def range_of_form(self) -> Range:
        """Strain of −0.4 to 0.4."""
        return (-0.4, 0.4)

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return μ/2·(I₁ − 3)."""
        return scope.parameter("shear_modulus") / 2 * _first_invariant(stretch)


@dataclass(frozen=True, kw_only=True)
class Yeoh(Hyperelastic):
    """Cubic in the first invariant: W = C₁·I + C₂·I² + C₃·I³ with I = λ² + 2/λ − 3; E = 6·C₁ at small strain.

    C₂ < 0 gives the soft middle and C₃ > 0 the stiff end of filled rubber. Fits reach a strain of about 5; a
    fit made on less must not be used beyond it. Source: Yeoh 1993.

    Examples
    --------
    >>> Yeoh(c1=0.5e6, c2=-1e4, c3=1e3).title()
    'Yeoh(c1 = 500000 Pa, c2 = -10000 Pa, c3 = 1000 Pa)'
    """

    c1: Quantity = parameter("Pa", "half of the shear modulus", minimum=1.0, maximum=1e12)
    c2: Quantity = parameter("Pa", "coefficient of the square", minimum=-1e12, maximum=1e12)
    c3: Quantity = parameter("Pa", "coefficient of the cube", minimum=-1e12, maximum=1e12)

    @property
    def range_of_form(self) -> Range:
        """Strain of −0.5 to 5."""
        return (-0.5, 5.0)

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the cubic."""
        c1, c2, c3 = (scope.parameter(name) for name in ("c1", "c2", "c3"))
        invariant = _first_invariant(stretch)
        return invariant * (c1 + invariant * (c2 + invariant * c3))


@dataclass(frozen=True, kw_only=True)
class Ogden(Hyperelastic):
    """Powers of the stretches: W = Σ μₚ/αₚ·(λ^αₚ + 2·λ^(−αₚ/2) − 3); E = 3/2·Σ μₚ·αₚ at small strain.

    Each product μₚ·αₚ must be positive, which makes the stress rise with the strain. Three pairs follow
    unfilled rubber to a stretch of 7. Source: Ogden 1972.

    Raises
    ------
    ValueRangeError
        If a modulus has no exponent, or their product is not positive.

    Examples
    --------
    >>> Ogden(moduli=(0.618e6, 1.18e3, -9.81e3), exponents=(1.3, 5.0, -2.0)).title()
    'Ogden(moduli = (618000, 1180, -9810) Pa, exponents = (1.3, 5, -2))'
    """

    moduli: Quantity = parameter("Pa", "moduli μₚ", minimum=-1e12, maximum=1e12, row=True)
    exponents: Quantity = parameter("1", "exponents αₚ", minimum=-30.0, maximum=30.0, row=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        moduli = self.moduli.values
        exponents = self.exponents.values
        if len(moduli) != len(exponents):
            raise ValueRangeError(
                f"moduli ({len(moduli)}) and exponents ({len(exponents)})",
                "there must be one exponent per modulus",
            )
        for modulus, exponent in zip(moduli, exponents, strict=True):
            if not modulus * exponent > 0.0:
                raise ValueRangeError(
                    f"modulus {modulus:g} Pa with exponent {exponent:g}",
                    "their product must be positive, or the stress falls as the strain rises",
                    next_step="give both the same sign",
                )

    @property
    def range_of_form(self) -> Range:
        """Strain of −0.6 to 6."""
        return (-0.6, 6.0)

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the sum over the pairs."""
        pairs = zip(scope.row("moduli"), scope.row("exponents"), strict=True)
        terms = [m / a * (stretch**a + 2 * stretch ** (-a / 2) - 3) for m, a in pairs]
        return sum(terms[1:], start=terms[0])


@dataclass(frozen=True, kw_only=True)
class ExtendedTube(Hyperelastic):
    """Chains in tubes, cross-links and entanglements apart, with an end of the chains at I₁ − 3 = 1/δ².

    W = G_c/2·[(1 − δ²)·I/(1 − δ²·I) + ln(1 − δ²·I)] + 2·G_e/β²·Σ(λᵢ^(−β) − 1) with I = I₁ − 3;
    E = 3·(G_c·(1 − 2δ²) + G_e) at small strain. The range ends where I is 90 % of its end; beyond the end
    there is no stress.
    Source: Kaliske and Heinrich 1999.

    Examples
    --------
    >>> round(ExtendedTube(crosslinks=0.19e6, entanglements=0.22e6, release=0.2, end=0.097).valid[1], 2)
    8.92
    """

    crosslinks: Quantity = parameter("Pa", "modulus G_c of the cross-links", minimum=0.0, maximum=1e12)
    entanglements: Quantity = parameter("Pa", "modulus G_e of the entanglements", minimum=0.0, maximum=1e12)
    release: Quantity = parameter(
        "1", "exponent β, 1 where tubes follow the stretch", minimum=1e-3, maximum=1.0
    )
    end: Quantity = parameter(
        "1", "inextensibility δ; chains end at I₁ − 3 = 1/δ²", minimum=1e-4, maximum=0.7
    )

    @property
    def range_of_form(self) -> Range:
        """Strain of −0.6, or of what is nearer, to where I₁ − 3 is 90 % of its end."""
        most = _SHARE_OF_LIMIT / self.end.number**2
        roots = np.roots([1.0, 0.0, -(3.0 + most), 2.0]).real
        low, high = sorted(root for root in roots if root > 0.0)
        return max(float(low) - 1.0, -0.6), float(high) - 1.0

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the energy of the cross-links and of the entanglements."""
        beta, square = scope.parameter("release"), scope.parameter("end") ** 2
        invariant = _first_invariant(stretch)
        left = 1 - square * invariant
        chains = (1 - square) * invariant / left + ca.log(left)
        tubes = stretch**-beta + 2 * stretch ** (beta / 2) - 3
        crosslinks, entanglements = scope.parameter("crosslinks"), scope.parameter("entanglements")
        return crosslinks / 2 * chains + 2 * entanglements / beta**2 * tubes


def _first_invariant(stretch: Expression) -> Expression:
    """Return I₁ − 3."""
    return stretch**2 + 2 / stretch - 3
