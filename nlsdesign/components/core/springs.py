"""Elastic laws: effort as a function of motion alone.

Viscous laws: effort as a function of the rate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, positive_part
from .contacts import WithCorners
from .domain import MATERIAL, ROTATION, TRANSLATION, Domain
from .element import UNBOUNDED, Element, Range, Scope
from .part_numbers import NotDeclared, Reading, one_of, parameter, read_as


@dataclass(frozen=True, kw_only=True)
class Elastic(Element):
    """Base of the laws without rate."""

    picture: ClassVar[str] = "spring"
    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity"})

    @property
    def needs_rate(self) -> bool:
        """False: an elastic law knows no rate."""
        return False

    @property
    def restores(self) -> bool:
        """True: it pulls back."""
        return True


@dataclass(frozen=True)
class FittedRange(Reading):
    """How far the data went that a law was fitted to; beyond, it is not stated to hold.

    Examples
    --------
    >>> FittedRange(fitted_strain=5.0).fitted_strain
    5.0
    """

    fitted_strain: Quantity = parameter(
        "1", "largest strain of the data that the law was fitted to", minimum=0.01, maximum=20.0
    )


@dataclass(frozen=True, kw_only=True)
class FittedLaw(Elastic):
    """Base of the laws of a material whose constants come from a measured curve."""

    data: Reading = read_as(NotDeclared, FittedRange, default=NotDeclared())

    @property
    def range_of_form(self) -> Range:
        """Least and greatest strain for which a law of this form may be fitted at all."""
        return UNBOUNDED

    @property
    def valid(self) -> Range:
        """Range of the form, and no further than the data."""
        low, high = self.range_of_form
        if isinstance(self.data, FittedRange):
            return low, min(high, self.data.fitted_strain.number)
        return low, high


@dataclass(frozen=True, kw_only=True)
class Hooke(Elastic):
    """Base of Hooke's law: effort = constant × motion."""

    constant: ClassVar[str] = "stiffness"
    """Name of the number."""

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return constant × motion."""
        return scope.parameter(self.constant) * motion


@dataclass(frozen=True, kw_only=True)
class Spring(Hooke):
    """Hooke's law F = k·e, or T = k·θ where the stiffness is in N·m/rad.

    Valid for small extensions of a metal spring, below the yield angle of one that is twisted. Source: Hooke
    1678.

    Examples
    --------
    >>> Spring(stiffness=2500.0).title()
    'Spring(stiffness = 2500 N/m)'
    >>> Spring(stiffness=Quantity(3.4, "N*m/rad")).domain.effort
    'torque'
    """

    domain: Domain = one_of(TRANSLATION, ROTATION)
    stiffness: Quantity = parameter(
        "{effort}/{motion}", "stiffness",
        minimum={TRANSLATION: 1e-6, ROTATION: 1e-9}, maximum={TRANSLATION: 1e12, ROTATION: 1e9},
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LinearElastic(Hooke):
    """Hooke's law of a material, σ = k·ε, with nominal stress and nominal strain.

    Rubber follows it to a few per cent strain. Source: Austin et al. 2015, eq. (1).
    """

    domain: ClassVar[Domain] = MATERIAL
    constant: ClassVar[str] = "modulus"

    modulus: Quantity = parameter("Pa", "modulus", minimum=1.0, maximum=1e12)


@dataclass(frozen=True, kw_only=True)
class StrainStiffening(WithCorners, FittedLaw):
    """Equilibrium law of the paper: σ = Σ kᵢ·(⟨ε − εᵢ⟩ − ⟨−εᵢ⟩), one modulus more from each knot εᵢ on.

    With a sharp contact it is piecewise linear, ⟨v⟩ = max(v, 0), valid for ε ≥ 0; the slope jumps at each
    knot, so a cam designed on it has a radius of curvature of −∞ there. With a rounded one it is C∞,
    σ(0) = 0, and differs by at most w·ln 2·Σkᵢ: design on that. A knot at zero is not rounded, for rubber in
    tension has no corner there. Source: Austin et al. 2015, eq. (1), Table I.

    Raises
    ------
    ValueRangeError
        If a modulus has no knot, or knots do not ascend.
    """

    domain: ClassVar[Domain] = MATERIAL
    rounding: ClassVar[Mapping[Domain, float]] = {MATERIAL: 0.01}
    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "strain stiffening"})

    modulus: Quantity = parameter(
        "Pa", "moduli that engage one after the other", minimum=0.0, maximum=1e12, row=True
    )
    knots: Quantity = parameter(
        "1", "strains at which the moduli engage", minimum=0.0, maximum=20.0, row=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        knots = self.knots
        if len(self.modulus.values) != len(knots.values):
            raise ValueRangeError(
                f"knots ({len(knots.values)}) and modulus ({len(self.modulus.values)})",
                "there must be one knot per modulus",
            )
        for left, right in zip(knots.values, knots.values[1:], strict=False):
            if right < left:
                raise ValueRangeError(
                    f"knots {left:g} and {right:g}",
                    "knots cross",
                    next_step="sort knots and moduli by strain",
                )

    @property
    def range_of_form(self) -> Range:
        """Tension where the contact is sharp: in compression the law then gives no stress at all."""
        return UNBOUNDED if self.is_smooth else (0.0, math.inf)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum over the engaged moduli."""
        rows = zip(scope.row("modulus"), scope.row("knots"), self.knots.values, strict=True)
        total = ca.SX(0)
        for number, (modulus, at, value) in enumerate(rows, start=1):
            total += modulus * self._engaged(scope, motion, at, (number, value))
        return total

    def _engaged(
        self, scope: Scope, motion: Expression, at: Expression, knot: tuple[int, float]
    ) -> Expression:
        number, value = knot
        if value == 0.0:
            return motion if self.is_smooth else ca.fmax(motion - at, 0)
        words = f"engages modulus {number}", f"leaves modulus {number}"
        engaged, _ = self.corner.positive_part(scope, motion - at, words, name=f"knot_{number}")
        return engaged - positive_part(-at, scope.parameter("width")) if self.is_smooth else engaged


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
class Newton(Viscous):
    """Base of Newton's law: effort = constant × rate."""

    picture: ClassVar[str] = "dashpot"
    constant: ClassVar[str] = "damping"
    """Name of the number."""

    phenomena: ClassVar[frozenset[str]] = frozenset({"viscous friction"})

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return constant × rate."""
        return scope.parameter(self.constant) * rate


@dataclass(frozen=True, kw_only=True)
class Dashpot(Newton):
    """Newton's law F = c·ė, or T = c·ω of bearings and gears where the damping is in N·m·s/rad.

    Source: Newton 1687.

    Examples
    --------
    >>> Dashpot(damping=1e-3, domain=ROTATION).title()
    'Dashpot(damping = 0.001 N·m·s/rad)'
    """

    domain: Domain = one_of(TRANSLATION, ROTATION)
    damping: Quantity = parameter(
        "{effort}*s/{motion}", "damping",
        minimum={TRANSLATION: 1e-9, ROTATION: 0.0}, maximum={TRANSLATION: 1e12, ROTATION: 1e9},
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ViscousMaterial(Newton):
    """Newton's law of a material, σ = η·ε̇. Source: Austin et al. 2015, eq. (1)."""

    domain: ClassVar[Domain] = MATERIAL
    constant: ClassVar[str] = "viscosity"

    viscosity: Quantity = parameter("Pa*s", "viscosity", minimum=1e-6, maximum=1e15)
