"""Elastic laws: effort as a function of motion alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...errors import ValueRangeError
from ...quantity import Quantity
from ...symbolic import Expression, positive_part
from .element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Range, Scope
from .part import parameter


@dataclass(frozen=True, kw_only=True)
class Elastic(Element):
    """Base of the laws without rate."""

    picture: ClassVar[str] = "spring"

    @property
    def needs_rate(self) -> bool:
        """False: an elastic law knows no rate."""
        return False

    @property
    def restores(self) -> bool:
        """True: it pulls back."""
        return True


@dataclass(frozen=True, kw_only=True)
class Spring(Elastic):
    """Hooke's law F = k·e.

    Valid for small extensions of a metal spring. Source: Hooke 1678.

    Examples
    --------
    >>> Spring(stiffness=2500.0).title()
    'Spring(stiffness = 2500 N/m)'
    """

    stiffness: Quantity = parameter("N/m", "stiffness", minimum=1e-6, maximum=1e12)

    @property
    def domain(self) -> Domain:
        """Extension and force."""
        return TRANSLATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = k·e."""
        return scope.parameter("stiffness") * motion


@dataclass(frozen=True, kw_only=True)
class TorsionSpring(Elastic):
    """Hooke's law T = k·θ.

    Valid below the yield angle of the spring. Source: Hooke 1678.
    """

    stiffness: Quantity = parameter("N*m/rad", "stiffness", minimum=1e-9, maximum=1e9)

    @property
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = k·θ."""
        return scope.parameter("stiffness") * motion


@dataclass(frozen=True, kw_only=True)
class LinearElastic(Elastic):
    """Hooke's law of a material, σ = k·ε, with nominal stress and nominal strain.

    Rubber follows it to a few per cent strain. Source: Austin et al. 2015, eq. (1).
    """

    modulus: Quantity = parameter("Pa", "modulus", minimum=1.0, maximum=1e12)

    @property
    def domain(self) -> Domain:
        """Strain and stress."""
        return MATERIAL

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return σ = k·ε."""
        return scope.parameter("modulus") * motion


@dataclass(frozen=True, kw_only=True)
class StrainStiffening(Elastic):
    """Equilibrium law of the paper: σ = Σ kᵢ·H(ε − εᵢ)·(ε − εᵢ), piecewise linear.

    Valid for ε ≥ 0; the slope jumps at each knot, so a cam designed on it has a radius of curvature of
    −∞ there: design on :class:`SmoothStrainStiffening`. Source: Austin et al. 2015, eq. (1), Table I.
    """

    modulus: Quantity = parameter(
        "Pa", "moduli that engage one after the other", minimum=0.0, maximum=1e12, row=True
    )
    knots: Quantity = parameter(
        "1", "strains at which the moduli engage", minimum=0.0, maximum=20.0, row=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_knots(self.modulus, self.knots)

    @property
    def domain(self) -> Domain:
        """Strain and stress."""
        return MATERIAL

    @property
    def valid(self) -> Range:
        """Tension: in compression the law gives no stress at all."""
        return (0.0, math.inf)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum over the engaged moduli."""
        knots = zip(scope.row("knots"), self.knots.values, strict=True)
        for number, (at, value) in enumerate(knots, start=1):
            # Rubber in tension has no corner at zero.
            if value > 0.0:
                words = f"engages modulus {number}", f"leaves modulus {number}"
                scope.corner(motion - at, above=words[0], below=words[1], name=f"knot_{number}")
        pairs = zip(scope.row("modulus"), scope.row("knots"), strict=True)
        return sum((k * ca.fmax(motion - at, 0) for k, at in pairs), start=ca.SX(0))

    def smooth(self, width: float = 0.01) -> Element:
        """Return the law with rounded knots, C∞; the stress differs by at most width·ln 2·Σkᵢ.

        Parameters
        ----------
        width
            Strain over which a knot is rounded.
        """
        return SmoothStrainStiffening(
            modulus=self.modulus, knots=self.knots,
            width=Quantity(width, "1", "assumed: width of the smooth form"),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SmoothStrainStiffening(Elastic):
    """The law of :class:`StrainStiffening` with rounded knots, C∞.

    σ = Σ kᵢ·(s(ε − εᵢ) − s(−εᵢ)) with s(v) = w·ln(1 + e^(v/w)); σ(0) = 0, and σ differs from the sharp law
    by at most w·ln 2·Σkᵢ. A knot at zero is not rounded: rubber in tension has no corner there.
    Source: the law of Austin et al. 2015, eq. (1); softplus of Dugas et al. 2001.
    """

    modulus: Quantity = parameter(
        "Pa", "moduli that engage one after the other", minimum=0.0, maximum=1e12, row=True
    )
    knots: Quantity = parameter(
        "1", "strains at which the moduli engage", minimum=0.0, maximum=20.0, row=True
    )
    width: Quantity = parameter("1", "strain over which a knot is rounded", minimum=1e-6, maximum=1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_knots(self.modulus, self.knots)

    @property
    def domain(self) -> Domain:
        """Strain and stress."""
        return MATERIAL

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum over the softly engaged moduli."""
        width = scope.parameter("width")
        rows = zip(scope.row("modulus"), scope.row("knots"), self.knots.values, strict=True)
        return sum(
            (
                k * motion
                if number == 0.0
                else k * (positive_part(motion - at, width) - positive_part(-at, width))
                for k, at, number in rows
            ),
            start=ca.SX(0),
        )


def check_knots(modulus: Quantity, knots: Quantity) -> None:
    """Check that there is one knot per modulus, in ascending order.

    Parameters
    ----------
    modulus, knots
        Rows of numbers.

    Raises
    ------
    ValueRangeError
        If the rows differ in length or knots cross.
    """
    if len(modulus.values) != len(knots.values):
        raise ValueRangeError(
            f"knots ({len(knots.values)}) and modulus ({len(modulus.values)})",
            "there must be one knot per modulus",
        )
    for left, right in zip(knots.values, knots.values[1:], strict=False):
        if right < left:
            raise ValueRangeError(
                f"knots {left:g} and {right:g}", "knots cross", next_step="sort knots and moduli by strain"
            )
