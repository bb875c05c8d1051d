"""Stress softening: rubber is softer below the hardest pull so far.

Memory of the largest value so far.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, positive_part
from ..core.domain import MATERIAL, Domain
from ..core.element import Combination, Scope
from ..core.part_numbers import Reading, parameter, read_as
from .hyperelastic import Hyperelastic


def rising(
    scope: Scope, state: tuple[str, str, str], value: Expression, rate: Expression, width: Expression
) -> tuple[Expression, Expression]:
    """Return the greatest value so far, a state that is driven by the rate, and its own rate.

    The state follows the value up, behind it by ``width``·ln(1 + value/width), whatever the speed.
    """
    greatest = scope.state(*state)
    growth = (1 + ca.tanh((value - greatest) / (2 * width))) / 2 * ca.fmax(rate, 0)
    scope.derive(greatest, growth)
    return greatest, growth


def following(scope: Scope, state: tuple[str, str, str], value: Expression, time: Expression) -> Expression:
    """Return the largest value so far, at least the present one: ṁ = ⟨x − m⟩/τ."""
    memory = scope.state(*state)
    scope.derive(memory, ca.fmax(value - memory, 0) / time)
    return ca.fmax(memory, value)


_LEAST_RATIO = 1e-3


@dataclass(frozen=True)
class SofteningCurve(Reading):
    """Base of the ways in which the share that is lost follows from the hardest pull so far."""

    @abstractmethod
    def softened(
        self, held: Combination, scope: Scope, motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the share that is left, and the effort of the elements inside as if nothing were lost.

        Parameters
        ----------
        held
            Holds the elements.
        scope, motion, rate
            As for :meth:`Element.effort`.
        """


@dataclass(frozen=True)
class OgdenRoxburgh(SofteningCurve):
    """Softening by energy: η = 1 − erf((W_m − W)/m)/r, for laws that say their strain energy.

    W is the energy of the laws inside and W_m the greatest so far, a state that rises with W and never falls.
    η is 1 on first loading and again where W reaches W_m. The sharp law has a corner there; here W_m − W and
    the switch of the state are rounded over ``width``·m: σ is C∞ in strain and state, the rate of W_m C⁰ at a
    reversal, and W_m lags by about seven widths, so η is off by about ten times ``width``/r. What softens is
    lost: (erf(W_m/m) − erf((W_m − W)/m))/r per rise of W_m. Source: Ogden and Roxburgh 1999.

    Examples
    --------
    >>> OgdenRoxburgh(strength=1.8, scale=0.12e6).width.number
    0.001
    """

    takes: ClassVar[tuple[Domain, ...]] = (MATERIAL,)
    placing: ClassVar[str | None] = "put it inside a specimen"

    strength: Quantity = parameter(
        "1", "r: the stress never falls below 1 − 1/r of that of first loading", minimum=1.0, maximum=1e6
    )
    scale: Quantity = parameter("Pa", "energy m over which the softening sets in", minimum=1e-3, maximum=1e12)
    width: Quantity = parameter(
        "1", "part of m over which corners are rounded", minimum=1e-6, maximum=0.1, default=1e-3
    )

    def softened(
        self, held: Combination, scope: Scope, motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return η and the stress inside."""
        scale, strength = scope.parameter("scale"), scope.parameter("strength")
        width = scope.parameter("width") * scale
        stress = held.inside(scope, motion, rate)
        laws = [(n, m) for n, m in held.members if isinstance(m, Hyperelastic)]
        energy = sum((m.energy(scope.child(n), 1 + motion) for n, m in laws), start=ca.SX(0))
        state = ("greatest_energy", "Pa", f"greatest strain energy of {scope.path} so far")
        greatest, growth = rising(scope, state, energy, stress * rate, width)

        def lost(below: Expression) -> Expression:
            return ca.erf(positive_part(below, width) / scale) / strength

        share = lost(greatest - energy)
        scope.loss((lost(greatest) - share) * growth)
        return 1 - share, stress


@dataclass(frozen=True)
class LargestMotion(SofteningCurve):
    """Softening by motion: 1 − s·(1 − (x/x_max)^p), for any element, with x_max the largest motion so far.

    At small motion the share s is lost; p = 1 makes the loss fall linearly with the motion. x is the size of
    the motion, alike on both sides. The memory starts at the first motion and follows a growing one with the
    time constant ``following``, which must be short against the motion; it never heals. Sources: Mullins 1969
    (the effect); Ogden and Roxburgh 1999 (one factor on the virgin effort, kept from the largest load).

    Examples
    --------
    >>> LargestMotion(softening=0.2).exponent.number
    1.0
    """

    softening: Quantity = parameter("1", "share s that is lost at small motion", minimum=0.0, maximum=0.99)
    exponent: Quantity = parameter(
        "1", "exponent p of the return to virgin rubber", minimum=0.1, maximum=20.0, default=1.0
    )
    following: Quantity = parameter(
        "s", "time in which the memory follows the motion", minimum=1e-5, maximum=10.0, default=5e-3
    )

    def softened(
        self, held: Combination, scope: Scope, motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the share and the effort inside."""
        size = ca.fabs(motion)
        largest = _largest_so_far(held, scope, size)
        ratio = ca.fmin(ca.fmax(size / ca.fmax(largest, 1e-12), _LEAST_RATIO), 1)
        lost = scope.parameter("softening") * (1 - ratio ** scope.parameter("exponent"))
        return 1 - lost, held.inside(scope, motion, rate)


@dataclass(frozen=True)
class DamageByMotion(SofteningCurve):
    """Softening by damage: 1 − d·(1 − e^(−x_max/x_d)), the same at every motion, x_max the largest so far.

    Bonds that break at their largest stretch carry nothing any more, at no later stretch either: the first
    pull bends over, the later ones are all softer alike. x is the size of the motion; the memory follows it
    as in :class:`LargestMotion` and never heals. Sources: Mullins 1969; Simo 1987 (this factor).

    Examples
    --------
    >>> DamageByMotion(damage=0.3, damage_motion=5e-3).following.number
    0.005
    """

    damage: Quantity = parameter("1", "share d that is lost in the end", minimum=0.0, maximum=0.99)
    damage_motion: Quantity = parameter(
        "{motion}", "largest motion x_d at which 63 % of that is lost", minimum=1e-9, maximum=1e4
    )
    following: Quantity = parameter(
        "s", "time in which the memory follows the motion", minimum=1e-5, maximum=10.0, default=5e-3
    )

    def softened(
        self, held: Combination, scope: Scope, motion: Expression, rate: Expression
    ) -> tuple[Expression, Expression]:
        """Return the share and the effort inside."""
        largest = _largest_so_far(held, scope, ca.fabs(motion))
        broken = -ca.expm1(-largest / scope.parameter("damage_motion"))
        return 1 - scope.parameter("damage") * broken, held.inside(scope, motion, rate)


@dataclass(frozen=True, kw_only=True)
class StressSoftening(Combination):
    """Stress softening (Mullins effect): F = η·F_in, softer below the hardest pull so far.

    Virgin rubber, and rubber pulled harder than ever before, is not softened. How η follows is ``curve``:
    :class:`OgdenRoxburgh` where the laws say their strain energy, :class:`LargestMotion` and
    :class:`DamageByMotion` around any element, such as a piece whose section and length are not known.
    Valid for what the first pull does; there is no recovery, no set and no loss on reloading.
    Sources: Mullins 1969; Ogden and Roxburgh 1999.

    Raises
    ------
    ArrangementError
        If the curve needs the strain energy and a member does not say it.

    Examples
    --------
    >>> from nlsdesign.components import NeoHooke
    >>> gum = (("gum", NeoHooke(shear_modulus=0.6e6)),)
    >>> StressSoftening(members=gum, curve=OgdenRoxburgh(strength=1.8, scale=0.12e6)).domain.motion
    'strain'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"stress softening"})

    curve: SofteningCurve = read_as(OgdenRoxburgh, LargestMotion, DamageByMotion)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, member in self.members:
            if isinstance(self.curve, OgdenRoxburgh) and not isinstance(member, Hyperelastic):
                raise ArrangementError(
                    f"StressSoftening member '{name}'",
                    f"is a {type(member).__name__}, which does not say its strain energy",
                    next_step="use a law such as NeoHooke, Yeoh or Ogden; dashpots belong beside it",
                )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the softened effort."""
        share, effort = self.curve.softened(self, scope, motion, rate)
        scope.signal("softness", share, "1", f"share of the virgin effort that {scope.path} has")
        return share * effort


def _largest_so_far(held: Combination, scope: Scope, size: Expression) -> Expression:
    """Return the state that follows the size of the motion upwards, in the time ``following``."""
    domain = held.domain
    state = ("largest", domain.motion_unit, f"largest {domain.motion} of {scope.path} so far")
    return following(scope, state, size, scope.parameter("following"))
