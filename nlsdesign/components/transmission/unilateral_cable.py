"""A cable that only pulls, with true contact: what it pulls is free while the cable is slack."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, symbol
from ..core.element import TRANSLATION, Combination, Element, Scope, observed_effort
from .cam_drive import PullOnly
from .stretchy_cable import newton_root


@dataclass(frozen=True, kw_only=True)
class InextensibleCable(Combination):
    """A cable that does not stretch: 0 ≤ F ⟂ y − e ≥ 0, with y the extension of what it pulls.

    The elements inside have y = max(e, y₀), where ΣF(y₀) = 0 at their present memory: taut at y = e, or slack
    at the length at which they rest. So a piece that recovers slowly is met again where it has recovered to.
    Memory that is driven by the rate stands still while the cable is slack. Continuous, with a corner.
    Source: complementarity, e.g. Acary and Brogliato 2008.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.domain != TRANSLATION:
            raise ArrangementError("InextensibleCable", "acts on extension and force")
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
        forces = [observed_effort(m, scope.child(n), left, left_rate) for n, m in self.members]
        force = sum(forces[1:], start=forces[0])
        resting = newton_root(force, left, motion)
        place = ca.fmax(motion, resting)
        # While taut this is the positive force itself; while slack it must vanish.
        remainder = ca.fmin(ca.substitute(force, left, place), 0)
        scope.check(f"{scope.path}.left", remainder / (1 + ca.fabs(ca.substitute(force, left, motion))))
        scope.corner(motion - resting, above="becomes taut", below="goes slack")
        scope.define(left, place)
        scope.define(left_rate, ca.if_else(motion >= resting, rate, 0))
        return ca.fmax(ca.substitute(force, left, place), 0)

    def smooth(self, width: float = 0.1) -> Element:
        """Return :class:`PullOnly`, C∞; the force differs by at most width·ln 2 while nothing relaxes inside.

        Parameters
        ----------
        width
            Force over which the corner is rounded, in N.
        """
        rounded = Quantity(width, "N", "assumed: width of the smooth form")
        return PullOnly(width=rounded, members=self.members)
