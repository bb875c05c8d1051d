"""Wrappers that shift or swallow motion: backlash, a slack cable, a turned cam."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.contacts import Rounded, Sharp, WithCorners
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Combination, Scope
from ..core.part_numbers import Reading, parameter, read_as


@dataclass(frozen=True, kw_only=True)
class Shifting(Combination):
    """Base of wrappers that change the motion of the elements inside; virtual work gives the effort outside.

    With inner motion m(x), the effort outside is m'(x)·Σ(efforts inside), so no energy comes from nowhere.
    """

    @abstractmethod
    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the inner motion and its derivative with respect to the outer one."""

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return m'(x)·Σ(efforts at m(x))."""
        inner, slope = self.shifted(scope, motion)
        return slope * self.inside(scope, inner, slope * rate)


@dataclass(frozen=True)
class Inertial(Reading):
    """Contact of backlash before a driven side with an inertia of its own, which flies through the gap.

    J·φ̈ = T − Σ(efforts at φ),  T = ⟨c·(p₊ + 2τ·ṗ₊)⟩ − ⟨c·(p₋ + 2τ·ṗ₋)⟩,  p± = ±(θ − φ) − g/2,  c = J/τ²

    A stop only pushes and does not rebound: τ, far below every other time, is how long contact takes to
    settle. Valid where the stops are stiffer than all else. Source: Nordin and Gutman 2002, sec. 2.

    Examples
    --------
    >>> Inertial(inertia=9e-4).contact_time.number
    0.0002
    """

    inertia: Quantity = parameter("{inertia}", "inertia behind the gap", minimum=1e-12, maximum=1e9)
    contact_time: Quantity = parameter(
        "s", "time in which contact settles", minimum=1e-6, maximum=0.1, default=2e-4
    )

    def effort(self, held: Combination, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T.

        Parameters
        ----------
        held
            The backlash, which holds what is driven.
        scope, motion, rate
            As for :meth:`Element.effort`.
        """
        domain = held.domain
        angle = scope.state(
            f"inner_{domain.motion}", domain.motion_unit, f"{domain.motion} behind the gap of {scope.path}"
        )
        speed = scope.state(
            f"inner_{domain.rate}", domain.rate_unit, f"{domain.rate} behind the gap of {scope.path}"
        )
        time, inertia = scope.parameter("contact_time"), scope.parameter("inertia")
        half = scope.parameter("gap") / 2
        apart, moving = motion - angle, 2 * time * (rate - speed)
        torque = ca.fmax(apart - half + moving, 0) - ca.fmax(-apart - half - moving, 0)
        torque *= inertia / time**2
        inside = held.inside(scope, angle, speed)
        scope.derive(angle, speed)
        scope.derive(speed, (torque - inside) / inertia)
        return torque


@dataclass(frozen=True, kw_only=True)
class Backlash(WithCorners, Shifting):
    """Backlash between drive and cam: the cam follows when half the gap g is used up.

    φ = ⟨θ − g/2⟩ − ⟨−θ − g/2⟩. With a sharp contact, ⟨v⟩ = max(v, 0), for what acts between two inertias:
    inside the gap the two sides are free and contact is located in simulation; with a damper inside, the
    torque jumps on contact, and pulls for a moment before contact ends. With a rounded contact C∞, a dead
    angle. With ``contact=Inertial(inertia=...)`` the driven side moves freely through the gap. Source: Nordin
    and Gutman 2002.

    Examples
    --------
    >>> from nlsdesign.components import Spring
    >>> inside = (("spring", Spring(stiffness=3.4, domain=ROTATION)),)
    >>> Backlash(gap=0.01, contact=Rounded(width=5e-4), members=inside).title()
    'Backlash(gap = 0.01 rad, width = 0.0005 rad)'
    """

    takes: ClassVar[tuple[Domain, ...]] = (ROTATION, TRANSLATION)
    phenomena: ClassVar[frozenset[str]] = frozenset({"backlash"})
    rounding: ClassVar[Mapping[Domain, float]] = {ROTATION: 5e-4, TRANSLATION: 1e-5}

    gap: Quantity = parameter("{motion}", "way from stop to stop", minimum=0.0, maximum=1.0)
    contact: Reading = read_as(Sharp, Rounded, Inertial, default=Sharp())

    @property
    def needs_rate(self) -> bool:
        """True if any element inside needs the rate, or contact damps."""
        return isinstance(self.contact, Inertial) or super().needs_rate

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        if isinstance(self.contact, Inertial):
            return self.contact.effort(self, scope, motion, rate)
        return super().effort(scope, motion, rate)

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the motion beyond the gap and its derivative."""
        half = scope.parameter("gap") / 2
        ahead, behind = (
            self.corner.positive_part(
                scope, value, (f"meets {name}", f"parts {name}"), name=name, jumps=self.needs_rate
            )
            for value, name in ((motion - half, "ahead"), (-motion - half, "behind"))
        )
        return ahead[0] - behind[0], ahead[1] + behind[1]


@dataclass(frozen=True, kw_only=True)
class Slack(WithCorners, Shifting):
    """A cable too long by s: the element inside is stretched by ⟨e − s⟩.

    Permanent set of the rubber looks the same. With a sharp contact simulation locates where it becomes
    taut or slack; with ``contact=Rounded(width=...)`` C∞. Source: geometry.

    Examples
    --------
    >>> from nlsdesign.components import Spring
    >>> Slack(length=1e-3, members=(("rope", Spring(stiffness=2500.0)),)).smooth().title()
    'Slack(length = 0.001 m, width = 1e-05 m)'
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    phenomena: ClassVar[frozenset[str]] = frozenset({"slack"})
    rounding: ClassVar[Mapping[Domain, float]] = {TRANSLATION: 1e-5}

    length: Quantity = parameter("m", "extension that stretches nothing", minimum=0.0, maximum=1.0)

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the extension left and its derivative."""
        left, words = motion - scope.parameter("length"), ("becomes taut", "goes slack")
        return self.corner.positive_part(scope, left, words, jumps=self.needs_rate)


@dataclass(frozen=True, kw_only=True)
class Turned(Shifting):
    """A cam that sits on its shaft turned by θ₀, or an encoder whose zero is off: φ = θ − θ₀.

    Source: geometry.
    """

    takes: ClassVar[tuple[Domain, ...]] = (ROTATION,)
    phenomena: ClassVar[frozenset[str]] = frozenset({"angle offset"})

    offset: Quantity = parameter(
        "rad", "angle at which the elements inside see zero", minimum=-6.3, maximum=6.3
    )

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the angle left and one."""
        return motion - scope.parameter("offset"), ca.SX(1)
