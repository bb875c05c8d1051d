"""A rest length that grows with the largest motion so far."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, ROTATION, TRANSLATION
from ..core.element import Combination, Scope
from ..core.part_numbers import Reading, parameter, read_as
from .stress_softening import following, rising


@dataclass(frozen=True)
class Memory(Reading):
    """Base of the ways to keep the largest motion so far."""

    @abstractmethod
    def largest(
        self, scope: Scope, state: tuple[str, str, str], motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the largest motion so far, and its rate as the law takes it.

        Parameters
        ----------
        scope
            Of the law.
        state
            Name, unit and meaning.
        motion, rate
            At present.
        """


@dataclass(frozen=True)
class Rising(Memory):
    """A state that rises with the motion, driven by its rate; the switch is rounded over ``width``, C∞.

    Examples
    --------
    >>> Rising(width=1e-4).width
    0.0001
    """

    width: Quantity = parameter(
        "{motion}", "motion over which the corner is rounded",
        minimum={MATERIAL: 1e-7, TRANSLATION: 1e-9, ROTATION: 1e-9},
        maximum={MATERIAL: 0.1, TRANSLATION: 0.1, ROTATION: 0.1},
    )  # fmt: skip

    def largest(
        self, scope: Scope, state: tuple[str, str, str], motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the state and its rate, which is C⁰ at a reversal."""
        return rising(scope, state, motion, rate, scope.parameter("width"))


@dataclass(frozen=True)
class Following(Memory):
    """A state that follows a growing motion with a time constant, which must be short against the motion.

    It needs no rate and does no harm to a step of integration; the law inside sees the rate from outside.

    Examples
    --------
    >>> Following().following.number
    0.005
    """

    following: Quantity = parameter(
        "s", "time in which the memory follows the motion", minimum=1e-5, maximum=10.0, default=5e-3
    )

    def largest(
        self, scope: Scope, state: tuple[str, str, str], motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the state, at least the present motion, and no rate."""
        return following(scope, state, motion, scope.parameter("following")), ca.SX(0)


@dataclass(frozen=True, kw_only=True)
class PermanentSet(Combination):
    """A rest length that grows: the elements inside see x − s with s = c·x_m, x_m the largest motion so far.

    x_m is a state that never falls, kept by ``memory``. What is lost is F·ds/dt, never negative for laws
    whose memory fades. A set that is known and no longer grows is :class:`Slack`. Inside a cable that
    only pulls a piece goes slack on the way back. Valid for c up to a few tenths, as tension sets are
    measured. Sources: ISO 2285 (tension set as a part of the strain); Gent 2012.

    Examples
    --------
    >>> from nlsdesign.components import NeoHooke
    >>> gum = NeoHooke(shear_modulus=0.6e6)
    >>> PermanentSet(members=(("gum", gum),), share=0.05, memory=Rising(width=1e-4)).title()
    'PermanentSet(share = 0.05, width = 0.0001)'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"permanent set"})

    share: Quantity = parameter("1", "part c of the largest motion that stays", minimum=0.0, maximum=0.9)
    memory: Memory = read_as(Rising, Following, default=Following())

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the elements inside at what is left of the motion."""
        domain, share = self.domain, scope.parameter("share")
        state = ("largest", domain.motion_unit, f"largest {domain.motion} of {scope.path} so far")
        largest, growth = self.memory.largest(scope, state, motion, rate)
        scope.signal("set", share * largest, domain.motion_unit, f"rest {domain.motion} of {scope.path}")
        effort = self.inside(scope, motion - share * largest, rate - share * growth)
        scope.loss(effort * share * growth)
        return effort
