"""Friction of a cable that is bent around a guide."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, smooth_sign
from ..core.domain import TRANSLATION, Domain
from ..core.element import Combination, Scope
from ..core.part_numbers import Reading, parameter, read_as


@dataclass(frozen=True)
class Wrap(Reading):
    """Base of the ways to say how a guide holds a cable."""

    @abstractmethod
    def exponent(self, scope: Scope) -> Expression:
        """Return µφ.

        Parameters
        ----------
        scope
            Of the element.
        """


@dataclass(frozen=True)
class Guide(Wrap):
    """A guide whose friction coefficient µ and angle of wrap φ are known apart.

    Examples
    --------
    >>> Guide(friction=0.1, wrap_angle=1.5).friction
    0.1
    """

    friction: Quantity = parameter("1", "friction coefficient of cable and guide", minimum=0.0, maximum=2.0)
    wrap_angle: Quantity = parameter("rad", "angle by which the guide bends the cable", maximum=100.0)

    def exponent(self, scope: Scope) -> Expression:
        """Return µ times φ."""
        return scope.parameter("friction") * scope.parameter("wrap_angle")


@dataclass(frozen=True)
class WrapProduct(Wrap):
    """A guide of which only the product µφ is known, as a fit gives it.

    Examples
    --------
    >>> WrapProduct(wrap=0.12).wrap
    0.12
    """

    wrap: Quantity = parameter("1", "friction times angle of wrap, µφ", minimum=0.0, maximum=10.0)

    def exponent(self, scope: Scope) -> Expression:
        """Return µφ."""
        return scope.parameter("wrap")


@dataclass(frozen=True, kw_only=True)
class CapstanFriction(Combination):
    """A cable bent by the angle φ around a guide: F = F_in·e^(µφ·tanh(ė/v_s)).

    F_in is the pull of the elements behind the guide: pulled in it takes e^(µφ) times as much, let out it
    holds back to e^(−µφ). The power lost, F_in·(e^(…) − 1)·ė, is never negative. A push, F_in < 0, passes
    unchanged, for no cable pushes. C∞ in the rate, with a corner at F_in = 0; at rest it creeps instead of
    sticking. Several guides multiply: their µφ add. Valid without bending stiffness and weight. Source: Euler
    1769, Eytelwein 1808.

    Examples
    --------
    >>> from nlsdesign.components import Spring
    >>> rope = (("rubber", Spring(stiffness=2500.0)),)
    >>> CapstanFriction(members=rope, guide=Guide(friction=0.1, wrap_angle=1.5)).needs_rate
    True
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    placing: ClassVar[str | None] = "put it behind the cam: through(cam, cable=CapstanFriction(...))"
    phenomena: ClassVar[frozenset[str]] = frozenset({"cable friction"})

    guide: Wrap = read_as(Guide, WrapProduct)
    creep_speed: Quantity = parameter(
        "m/s",
        "speed of the cable at which 76 % of the exponent acts",
        minimum=1e-9,
        maximum=1.0,
        default=1e-4,
    )

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = F_in·e^(µφ·tanh(ė/v_s)); a push passes unchanged."""
        pull = self.inside(scope, motion, rate)
        exponent = self.guide.exponent(scope) * smooth_sign(rate, scope.parameter("creep_speed"))
        return pull + ca.fmax(pull, 0) * (ca.exp(exponent) - 1)
