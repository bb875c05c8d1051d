"""What a law says of the places where it is not smooth, so that simulation can find them.

Three kinds. At a *kink* the effort is continuous and only its derivative jumps. At a *jump* the effort itself
jumps, so the law is written with a symbol that is 1 on one side and −1 on the other. A *stiction constraint*
keeps a rate at zero by an effort that follows from the motion of everything else: dry friction that sticks, a
body at rest against a stop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import casadi as ca

from ...foundation.symbolic import Expression, symbol


@dataclass(frozen=True)
class Kink:
    """A place at which an effort has a kink."""

    name: str  # full name, for messages and events
    value: Expression  # vanishes at the kink
    # above, below: what has happened when the value has become positive, or negative
    above: str
    below: str


@dataclass(frozen=True)
class Jump(Kink):
    """A place at which an effort jumps."""

    mode: Expression  # symbol that is 1 where the value is positive and −1 where it is negative


@dataclass(frozen=True)
class StictionConstraint:
    """An effort that keeps a rate at zero, and what acts while it does not."""

    name: str  # full name, for messages and events
    effort: Expression  # symbol of the effort against the rate
    mode: Expression  # symbol that is 0 while the rate is held, otherwise 1 or −1
    rate: Expression  # what is held at zero
    moving: Expression  # effort while the rate is not held
    stays: Expression  # not negative as long as the effort can hold
    lands: Expression  # not negative as long as the rate stays free
    leads: Expression  # mode that follows when the effort cannot hold any longer
    rebound: Expression  # rate after landing; zero where it is held from then on
    first: Expression  # mode before anything is known of the effort: 0 where it might hold
    # words: what has happened when a mode begins: pairs of mode and text; the text of a rebound is at 2
    words: tuple[tuple[int, str], ...]
    # level: largest effort of dry friction while it holds; several on one rate share the load in this ratio
    level: Expression | None = None


class Switches(Protocol):
    """Takes what laws say of the places where they are not smooth."""

    path: str

    def kink(self, value: Expression, *, above: str, below: str, name: str = "") -> None:
        """Declare that the effort has a kink where a value vanishes."""
        ...

    def jump(self, value: Expression, *, above: str, below: str, name: str = "") -> Expression:
        """Return a symbol that is 1 where a value is positive and −1 where it is negative."""
        ...

    def stiction(self, constraint: StictionConstraint) -> Expression:
        """Take an effort that holds a rate at zero, and return it."""
        ...


def dry(
    scope: Switches, rate: Expression, slipping: Callable[[Expression], Expression], sticking: Expression
) -> Expression:
    """Return the effort of dry friction with true sticking."""
    mode, effort = symbol(f"{scope.path}.mode"), symbol(f"{scope.path}.holding")
    return scope.stiction(
        StictionConstraint(
            scope.path, effort, mode, rate,
            moving=mode * slipping(mode * rate),
            stays=sticking - ca.fabs(effort),
            lands=mode * rate,
            leads=ca.if_else(effort >= 0, 1, -1),
            rebound=ca.SX(0),
            first=ca.sign(rate),
            words=((0, "sticks"), (1, "slips forward"), (-1, "slips backward")),
            level=sticking,
        )
    )  # fmt: skip
