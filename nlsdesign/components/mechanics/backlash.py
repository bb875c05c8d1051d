"""Wrappers that shift or swallow motion: backlash, a slack cable, a turned cam."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, positive_part
from ..core.element import ROTATION, TRANSLATION, Combination, Domain, Element, Scope, observed_effort
from ..core.part import parameter


@dataclass(frozen=True, kw_only=True)
class Shifting(Combination):
    """Base of wrappers that change the motion of the elements inside; virtual work gives the effort outside.

    With inner motion m(x), the effort outside is m'(x)·Σ(efforts inside), so no energy comes from nowhere.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != self._wanted:
            raise ArrangementError(
                type(self).__name__, f"acts on {self._wanted.motion} and {self._wanted.effort}"
            )

    @property
    def _wanted(self) -> Domain:
        return ROTATION

    @property
    def needs_rate(self) -> bool:
        """True if any element inside needs the rate."""
        return any(member.needs_rate for _, member in self.members)

    @abstractmethod
    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the inner motion and its derivative with respect to the outer one."""

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return m'(x)·Σ(efforts at m(x))."""
        inner, slope = self.shifted(scope, motion)
        efforts = [observed_effort(m, scope.child(n), inner, slope * rate) for n, m in self.members]
        return slope * sum(efforts[1:], start=efforts[0])


@dataclass(frozen=True, kw_only=True)
class Backlash(Shifting):
    """Play between drive and cam: the cam follows when half the gap g is used up.

    φ = ⟨θ − g/2⟩ − ⟨−θ − g/2⟩ with rounded corners of width w. The cam side has no inertia here: its spring
    keeps it in contact, so the play shows as a dead angle. Source: e.g. Nordin and Gutman 2002.
    """

    gap: Quantity = parameter("rad", "angle from stop to stop", minimum=0.0, maximum=1.0)
    width: Quantity = parameter(
        "rad", "angle over which a stop is rounded", minimum=1e-7, maximum=0.1, default=5e-4
    )

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the cam's angle and its derivative."""
        half, width = scope.parameter("gap") / 2, scope.parameter("width")
        inner = positive_part(motion - half, width) - positive_part(-motion - half, width)
        return inner, _step(motion - half, width) + _step(-motion - half, width)


@dataclass(frozen=True, kw_only=True)
class InertialBacklash(Combination):
    """Play before a driven side that has an inertia of its own, so that it coasts through the gap.

    J·φ̈ = T − Σ(efforts at φ),  T = ⟨c·(p₊ + 2τ·ṗ₊)⟩ − ⟨c·(p₋ + 2τ·ṗ₋)⟩,  p± = ±(θ − φ) − g/2,  c = J/τ²

    A stop only pushes and does not rebound: τ, far below every other time, is how long contact takes to
    settle. Valid where the stops are stiffer than all else. Source: Nordin and Gutman 2002, sec. 2.
    """

    gap: Quantity = parameter("rad", "angle from stop to stop", minimum=0.0, maximum=1.0)
    inertia: Quantity = parameter("kg*m^2", "moment of inertia behind the play", minimum=1e-12, maximum=1e6)
    contact_time: Quantity = parameter(
        "s", "time in which contact settles", minimum=1e-6, maximum=0.1, default=2e-4
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != ROTATION:
            raise ArrangementError(type(self).__name__, "acts on angle and torque")

    @property
    def needs_rate(self) -> bool:
        """True: contact damps."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        angle = scope.state("inner_angle", "rad", f"angle behind the play of {scope.path}")
        speed = scope.state("inner_speed", "rad/s", f"speed behind the play of {scope.path}")
        time, inertia = scope.parameter("contact_time"), scope.parameter("inertia")
        half = scope.parameter("gap") / 2
        apart, moving = motion - angle, 2 * time * (rate - speed)
        torque = ca.fmax(apart - half + moving, 0) - ca.fmax(-apart - half - moving, 0)
        torque *= inertia / time**2
        efforts = [observed_effort(m, scope.child(n), angle, speed) for n, m in self.members]
        scope.derive(angle, speed)
        scope.derive(speed, (torque - sum(efforts[1:], start=efforts[0])) / inertia)
        return torque


@dataclass(frozen=True, kw_only=True)
class Slack(Shifting):
    """A cable too long by s: the element inside is stretched by ⟨e − s⟩, rounded over w.

    Permanent set of the rubber looks the same. Source: geometry.
    """

    length: Quantity = parameter("m", "extension that stretches nothing", minimum=0.0, maximum=1.0)
    width: Quantity = parameter(
        "m", "extension over which the corner is rounded", minimum=1e-8, maximum=1e-2, default=1e-5
    )

    @property
    def _wanted(self) -> Domain:
        return TRANSLATION

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the extension left and its derivative."""
        left, width = motion - scope.parameter("length"), scope.parameter("width")
        return positive_part(left, width), _step(left, width)


@dataclass(frozen=True, kw_only=True)
class Play(Shifting):
    """Play with sharp contact: φ = max(θ − g/2, 0) − max(−θ − g/2, 0), for what acts between two inertias.

    Inside the gap the two sides are free; contact is located in simulation. With a damper inside, the torque
    jumps on contact, and pulls for a moment before contact ends. Source: e.g. Nordin and Gutman 2002.
    """

    gap: Quantity = parameter("rad", "angle from stop to stop", minimum=0.0, maximum=1.0)

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the angle beyond the gap and its derivative."""
        half = scope.parameter("gap") / 2
        ahead, behind = (
            _beyond(scope, self, value, name, words)
            for value, name, words in (
                (motion - half, "ahead", ("meets ahead", "parts ahead")),
                (-motion - half, "behind", ("meets behind", "parts behind")),
            )
        )
        return ahead[0] - behind[0], ahead[1] + behind[1]

    def smooth(self, width: float = 5e-4) -> Element:
        """Return :class:`Backlash`, C∞; φ differs by at most width·ln 2.

        Parameters
        ----------
        width
            Angle over which a corner is rounded, in rad.
        """
        rounded = Quantity(width, "rad", "assumed: width of the smooth form")
        return Backlash(gap=self.gap, width=rounded, members=self.members)


@dataclass(frozen=True, kw_only=True)
class LooseCable(Shifting):
    """A cable too long by s, sharp: the element inside is stretched by max(e − s, 0).

    Where it becomes taut or slack is located in simulation. Source: geometry.
    """

    length: Quantity = parameter("m", "extension that stretches nothing", minimum=0.0, maximum=1.0)

    @property
    def _wanted(self) -> Domain:
        return TRANSLATION

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the extension left and its derivative."""
        left = motion - scope.parameter("length")
        return _beyond(scope, self, left, "", ("becomes taut", "goes slack"))

    def smooth(self, width: float = 1e-5) -> Element:
        """Return :class:`Slack`, C∞; the extension inside differs by at most width·ln 2.

        Parameters
        ----------
        width
            Extension over which the corner is rounded, in m.
        """
        rounded = Quantity(width, "m", "assumed: width of the smooth form")
        return Slack(length=self.length, width=rounded, members=self.members)


@dataclass(frozen=True, kw_only=True)
class Turned(Shifting):
    """A cam that sits on its shaft turned by θ₀, or an encoder whose zero is off: φ = θ − θ₀.

    Source: geometry.
    """

    offset: Quantity = parameter(
        "rad", "angle at which the elements inside see zero", minimum=-6.3, maximum=6.3
    )

    def shifted(self, scope: Scope, motion: Expression) -> tuple[Expression, Expression]:
        """Return the angle left and one."""
        return motion - scope.parameter("offset"), ca.SX(1)


def _step(value: Expression, width: Expression) -> Expression:
    """Return the derivative of the smooth positive part."""
    return (1 + ca.tanh(value / (2 * width))) / 2


def _beyond(
    scope: Scope, owner: Shifting, value: Expression, name: str, words: tuple[str, str]
) -> tuple[Expression, Expression]:
    """Return the positive part of a value and its derivative, and say where its corner is."""
    if owner.needs_rate:
        # The rate inside jumps, and with it the effort.
        share = (1 + scope.side(value, above=words[0], below=words[1], name=name)) / 2
        return share * value, share
    scope.corner(value, above=words[0], below=words[1], name=name)
    return ca.fmax(value, 0), ca.if_else(value > 0, 1, 0)
