"""Cables that only pull, and pieces that buckle: the force cut off smoothly, or true contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, positive_part, symbol
from ..core.domain import TRANSLATION, Domain
from ..core.element import Combination, Element, Scope
from ..core.part_numbers import parameter
from .stretchy_cable import newton_root


@dataclass(frozen=True, kw_only=True)
class PullOnly(Combination):
    """A cable that only pulls: F = max(F inside, 0), rounded over ``width``, C∞.

    A law of its own beside :class:`InextensibleCable`, not another reading of it: this one cuts the force of
    a piece that goes on moving, the other frees the piece, so they differ where the piece remembers.
    While the cable is slack the element inside is still led by the extension, so its memory is that of a
    rod, not of a free piece: good for short slack times, see the known gaps.
    Source: Signorini 1933 (unilateral contact); Dugas et al. 2001 (softplus, this rounding).
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    placing: ClassVar[str | None] = "put it behind the cam: through(cam, cable=...)"
    phenomena: ClassVar[frozenset[str]] = frozenset({"unilateral contact"})

    width: Quantity = parameter(
        "N", "force over which the corner is rounded", minimum=1e-6, maximum=1e3, default=0.1
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the smooth positive part of the sum of forces."""
        return positive_part(self.inside(scope, motion, rate), scope.parameter("width"))


@dataclass(frozen=True, kw_only=True)
class Buckling(Combination):
    """A piece that gives way where it should push: F = F⁺ − (1 − s)·F⁻, rounded over ``width``, C∞.

    F⁺ is what the piece would pull, F⁻ what it would push. The share s of a push that it does not carry is 0
    for a rod and 1 for a thin band, whose load of buckling is nothing beside its pull; beyond 1 it snaps
    through. The memory of the piece is that of a rod, as in :class:`PullOnly`.
    Source: Signorini 1933 (unilateral contact); Dugas et al. 2001 (softplus, this rounding).

    Examples
    --------
    >>> from nlsdesign.components import Spring
    >>> Buckling(share=0.9, members=(("band", Spring(stiffness=2500.0)),)).title()
    'Buckling(share = 0.9, width = 0.0001 N)'
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    placing: ClassVar[str | None] = PullOnly.placing
    phenomena: ClassVar[frozenset[str]] = frozenset({"unilateral contact"})

    share: Quantity = parameter("1", "share of a push that is not carried", minimum=-2.0, maximum=3.0)
    width: Quantity = parameter(
        "N", "force over which the corner is rounded", minimum=1e-6, maximum=1e3, default=1e-4
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum of forces without that share of a push."""
        force, share = self.inside(scope, motion, rate), scope.parameter("share")
        return (1 - share) * force + share * positive_part(force, scope.parameter("width"))


@dataclass(frozen=True, kw_only=True)
class InextensibleCable(Combination):
    """A cable that does not stretch: 0 ≤ F ⟂ y − e ≥ 0, with y the extension of what it pulls.

    The elements inside have y = max(e, y₀), where ΣF(y₀) = 0 at their present memory: taut at y = e, or slack
    at the length at which they rest. So a piece that recovers slowly is met again where it has recovered to.
    Memory that is driven by the rate stands still while the cable is slack. Continuous, with a corner.
    Source: Acary and Brogliato 2008 (complementarity).

    Raises
    ------
    ArrangementError
        If the force of a member depends directly on the rate, so that its slack length is not defined.
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    placing: ClassVar[str | None] = "put it behind the cam: through(cam, cable=...)"
    phenomena: ClassVar[frozenset[str]] = frozenset({"unilateral contact"})

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, member in self.members:
            if member.needs_rate:
                raise ArrangementError(
                    f"InextensibleCable member '{name}'",
                    "its force depends directly on the rate, so its slack length is not defined",
                    next_step="use pull_only(...) for it",
                )

    @property
    def needs_rate(self) -> bool:
        """False: the cable follows."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return ΣF(max(e, y₀))."""
        left, left_rate = symbol(f"{scope.path}.left"), symbol(f"{scope.path}.left_rate")
        force = self.inside(scope, left, left_rate)
        resting = newton_root(force, left, motion)
        place = ca.fmax(motion, resting)
        # While taut this is the positive force itself; while slack it must vanish.
        remainder = ca.fmin(ca.substitute(force, left, place), 0)
        scope.check(f"{scope.path}.left", remainder / (1 + ca.fabs(ca.substitute(force, left, motion))))
        scope.kink(motion - resting, above="becomes taut", below="goes slack")
        scope.define(left, place)
        scope.define(left_rate, ca.if_else(motion >= resting, rate, 0))
        return ca.fmax(ca.substitute(force, left, place), 0)

    @property
    def is_smooth(self) -> bool:
        """False: where it becomes taut is located."""
        return False

    def smooth(self, width: float | None = None) -> Element:
        """Return :class:`PullOnly`, C∞; the force differs by at most width·ln 2 while nothing relaxes inside.

        Parameters
        ----------
        width
            Force over which the corner is rounded, in N.
        """
        rounded = Quantity(0.1 if width is None else width, "N", "assumed: width of the smooth form")
        return PullOnly(width=rounded, members=self.members)


def pull_only(**elements: Element) -> PullOnly:
    """Let elements in parallel only pull.

    Parameters
    ----------
    **elements
        Elements of extension and force by name.
    """
    return PullOnly(members=tuple(elements.items()))
