"""Two readings of a law with a corner: sharp, for simulation that locates it, or smooth, for C and fits.

A law is written once with a contact; the contact says how a corner, or a change of direction, is read.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, positive_part, smooth_sign
from .domain import MATERIAL, ROTATION, TRANSLATION, Domain
from .element import Element, Scope, dry
from .part_numbers import Reading, parameter, read_as

Pair = tuple[Expression, Expression]
Level = Callable[[Expression], Expression]


@dataclass(frozen=True)
class CornerContact(Reading):
    """Base of contacts of laws that begin to act at a place."""

    @abstractmethod
    def positive_part(
        self, scope: Scope, value: Expression, words: tuple[str, str], *, name: str = "", jumps: bool = False
    ) -> Pair:
        """Return ⟨v⟩, which is v where it is positive and else zero, and its derivative.

        Parameters
        ----------
        scope
            Of the element.
        value
            v.
        words
            What has happened when v has become positive, and negative.
        name
            Of the corner, where the element has several.
        jumps
            Whether the effort itself jumps at the corner, and not only its derivative.
        """


@dataclass(frozen=True)
class FrictionContact(Reading):
    """Base of contacts of laws that act against the motion."""

    @abstractmethod
    def against(self, scope: Scope, rate: Expression, level: Level, sticking: Expression) -> Expression:
        """Return the effort of dry friction.

        Parameters
        ----------
        scope
            Of the element.
        rate
            Relative rate of the two sides.
        level
            Takes the size of the rate and returns that of the effort.
        sticking
            Largest effort at which the two sides stick.
        """

    @abstractmethod
    def sliding(self, scope: Scope, rate: Expression) -> Expression:
        """Return the square of the sign of a rate: the share of an effort that acts in both directions alike.

        Parameters
        ----------
        scope, rate
            As of :meth:`against`.
        """

    @abstractmethod
    def size(self, scope: Scope, value: Expression, words: tuple[str, str], name: str) -> Expression:
        """Return |v|, as :meth:`CornerContact.positive_part` returns ⟨v⟩."""


@dataclass(frozen=True)
class Sharp(CornerContact, FrictionContact):
    """Corners as they are, and friction that truly sticks; simulation locates where it changes."""

    def positive_part(
        self, scope: Scope, value: Expression, words: tuple[str, str], *, name: str = "", jumps: bool = False
    ) -> Pair:
        """Return max(v, 0) and its step."""
        if jumps:
            share = (1 + scope.jump(value, above=words[0], below=words[1], name=name)) / 2
            return share * value, share
        scope.kink(value, above=words[0], below=words[1], name=name)
        return ca.fmax(value, 0), ca.if_else(value > 0, 1, 0)

    def against(self, scope: Scope, rate: Expression, level: Level, sticking: Expression) -> Expression:
        """Return level·sgn(rate), or while the rate is zero what keeps it there."""
        return dry(scope, rate, level, sticking)

    def sliding(self, scope: Scope, rate: Expression) -> Expression:
        """Return one: where the sides stick, what they hold is shifted by the effort."""
        return ca.SX(1)

    def size(self, scope: Scope, value: Expression, words: tuple[str, str], name: str) -> Expression:
        """Return |v| with its corner."""
        scope.kink(value, above=words[0], below=words[1], name=name)
        return ca.fabs(value)


@dataclass(frozen=True)
class Rounded(CornerContact):
    """A corner rounded over a width w, C∞: ⟨v⟩ = w·ln(1 + e^(v/w)), at most w·ln 2 beyond the sharp one.

    Source: Dugas et al. 2001 (softplus).

    Examples
    --------
    >>> Rounded(width=1e-3).width
    0.001
    """

    width: Quantity = parameter(
        "{motion}",
        "width over which a corner is rounded",
        minimum={ROTATION: 1e-9, TRANSLATION: 1e-9, MATERIAL: 1e-6},
        maximum={ROTATION: 0.1, TRANSLATION: 1e-2, MATERIAL: 1.0},
    )

    def positive_part(
        self, scope: Scope, value: Expression, words: tuple[str, str], *, name: str = "", jumps: bool = False
    ) -> Pair:
        """Return the softplus and its derivative."""
        width = scope.parameter("width")
        return positive_part(value, width), (1 + ca.tanh(value / (2 * width))) / 2


@dataclass(frozen=True)
class Regularised(FrictionContact):
    """Friction with tanh(v/v_s) for the sign, C∞: at rest it creeps with v_s·atanh(F/level) and never sticks.

    While sliding it differs by at most 2·level·e^(−2|v|/v_s). Source: Armstrong-Hélouvry 1991.

    Examples
    --------
    >>> Regularised(creep_speed=0.02).creep_speed
    0.02
    """

    creep_speed: Quantity = parameter(
        "{rate}",
        "speed at which 76 % of the friction acts",
        minimum={ROTATION: 1e-6, TRANSLATION: 1e-9},
        maximum=10.0,
    )

    def against(self, scope: Scope, rate: Expression, level: Level, sticking: Expression) -> Expression:
        """Return level·tanh(v/v_s)."""
        return level(rate) * smooth_sign(rate, scope.parameter("creep_speed"))

    def sliding(self, scope: Scope, rate: Expression) -> Expression:
        """Return tanh²(v/v_s)."""
        return smooth_sign(rate, scope.parameter("creep_speed")) ** 2

    def size(self, scope: Scope, value: Expression, words: tuple[str, str], name: str) -> Expression:
        """Return |v|."""
        return ca.fabs(value)


@dataclass(frozen=True, kw_only=True)
class WithCorners(Element):
    """Base of laws that begin to act at a place, sharp or rounded."""

    rounding: ClassVar[Mapping[Domain, float]]
    """Width of the smooth form unless another one is asked for, in SI, by domain."""

    contact: Reading = read_as(Sharp, Rounded, default=Sharp())

    @property
    def corner(self) -> CornerContact:
        """The contact, as what reads corners."""
        assert isinstance(self.contact, CornerContact)
        return self.contact

    @property
    def is_smooth(self) -> bool:
        """False where the contact is sharp."""
        return not isinstance(self.contact, Sharp) and super().is_smooth

    def smooth(self, width: float | None = None) -> Element:
        """Return the law with rounded corners, C∞; each motion differs by at most width·ln 2.

        Parameters
        ----------
        width
            Of the rounding, in the unit of the motion; the law proposes one.
        """
        chosen = self.rounding[self.domain] if width is None else width
        return replace(self, contact=Rounded(_assumed(chosen, self.domain.motion_unit)))


@dataclass(frozen=True, kw_only=True)
class WithFriction(Element):
    """Base of laws with dry friction, which sticks or creeps."""

    rounding: ClassVar[Mapping[Domain, float]] = {ROTATION: 0.02, TRANSLATION: 1e-3}
    """Creep speed of the smooth form unless another one is asked for, in SI, by domain."""

    contact: Reading = read_as(Sharp, Regularised, default=Sharp())

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    @property
    def rubbing(self) -> FrictionContact:
        """The contact, as what reads the direction."""
        assert isinstance(self.contact, FrictionContact)
        return self.contact

    @property
    def is_smooth(self) -> bool:
        """False where the contact is sharp."""
        return not isinstance(self.contact, Sharp)

    def smooth(self, width: float | None = None) -> Element:
        """Return the law with tanh(v/width) for the sign, C∞.

        Parameters
        ----------
        width
            Speed at which 76 % of the friction acts, in SI; below it the sides creep instead of sticking.
        """
        chosen = self.rounding[self.domain] if width is None else width
        return replace(self, contact=Regularised(_assumed(chosen, self.domain.rate_unit)))


def _assumed(width: float, unit: str) -> Quantity:
    return Quantity(width, unit, "assumed: width of the smooth form")
