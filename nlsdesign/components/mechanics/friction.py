"""Efforts against the motion: dry friction, friction that falls with speed or grows with load, drag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.contacts import WithFriction
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Combination, Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Viscous


def stribeck(rate: Expression, speed: Expression) -> Expression:
    """Return e^(−(v/v_St)²), the share of the friction beyond sliding that is left at a speed."""
    return ca.exp(-((rate / speed) ** 2))


@dataclass(frozen=True, kw_only=True)
class CoulombFriction(WithFriction, Viscous):
    """Dry friction T = T_c·sgn(ω) while ω ≠ 0, |T| ≤ T_c while ω = 0; or F and v along a line.

    At rest T is what keeps both sides together: valid between two bodies, one of which has inertia. With
    ``contact=Regularised(creep_speed=...)`` it is T_c·tanh(ω/ω_s), C∞, and creeps at rest. Viscous friction
    goes beside it as a :class:`Dashpot`. Sources: Coulomb 1785; Pfeiffer and Glocker 1996 (as a set-valued
    law); Armstrong-Hélouvry 1991 (the smooth form).

    Examples
    --------
    >>> CoulombFriction(sliding_effort=0.05).smooth(0.01).title()
    'CoulombFriction(sliding_effort = 0.05 N·m, creep_speed = 0.01 rad/s)'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"dry friction"})

    domain: Domain = one_of(ROTATION, TRANSLATION)
    sliding_effort: Quantity = parameter("{effort}", "friction while sliding", minimum=0.0, maximum=1e9)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        level = scope.parameter("sliding_effort")
        return self.rubbing.against(scope, rate, lambda speed: level, level)


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(CoulombFriction):
    """Dry friction that falls with speed: T = (T_c + ΔT·e^(−(ω/ω_St)²))·sgn(ω) while ω ≠ 0.

    |T| ≤ T_c + ΔT while ω = 0; ΔT is what the friction near standstill has beyond sliding. With
    ``contact=Regularised(creep_speed=...)`` tanh(ω/ω_s) stands for the sign. Valid as
    :class:`CoulombFriction`. Sources: Stribeck 1902; Armstrong-Hélouvry 1991 (this form).
    """

    breakaway: Quantity = parameter(
        "{effort}", "friction beyond sliding at low speed", minimum=0.0, maximum=1e9
    )
    stribeck_speed: Quantity = parameter(
        "{rate}", "speed at which 37 % of that is left", minimum=1e-6, maximum=1e4
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        sliding, more = scope.parameter("sliding_effort"), scope.parameter("breakaway")
        fast = scope.parameter("stribeck_speed")
        return self.rubbing.against(
            scope, rate, lambda speed: sliding + more * stribeck(speed, fast), sliding + more
        )


@dataclass(frozen=True, kw_only=True)
class AsymmetricFriction(CoulombFriction):
    """Dry friction that differs between the directions: T = T_c·(sgn(ω) + a) while ω ≠ 0.

    Forward it is T_c·(1 + a), backward T_c·(1 − a), at rest anything between −T_c·(1 − a) and T_c·(1 + a).
    With ``contact=Regularised(creep_speed=...)`` it is T_c·(s + a·s²) with s = tanh(ω/ω_s), C∞, and creeps
    at rest. In motion it cannot be told from a constant load a·T_c beside even friction. Valid as
    :class:`CoulombFriction`. Sources: Coulomb 1785; Armstrong-Hélouvry 1991 (levels by direction).

    Examples
    --------
    >>> AsymmetricFriction(sliding_effort=0.2, asymmetry=0.1).title()
    'AsymmetricFriction(sliding_effort = 0.2 N·m, asymmetry = 0.1)'
    """

    asymmetry: Quantity = parameter(
        "1", "half the difference between the directions over the mean", minimum=-1.0, maximum=1.0
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        uneven = scope.parameter("asymmetry") * scope.parameter("sliding_effort")
        return super().effort(scope, motion, rate) + uneven * self.rubbing.sliding(scope, rate)


@dataclass(frozen=True, kw_only=True)
class LoadFriction(WithFriction, Combination):
    """Friction of a gear or cable drive that grows with the load: T = T_in + µ·|T_in|·sgn(ω) while ω ≠ 0.

    T_in is the effort of the elements inside; the drive's efficiency is about 1 − µ forward and 1/(1 − µ)
    backward. While ω = 0 the friction is at most µ·|T_in|, so a loaded gear stays where it is, and none of
    the elements inside may be sharp dry friction itself. With ``contact=Regularised(creep_speed=...)``
    tanh(ω/ω_s) stands for the sign: C∞ but for the corner of |T_in|. Sources: Coulomb 1785 with the load as
    normal force; Niemann and Winter 2003 (losses of gears).
    """

    takes: ClassVar[tuple[Domain, ...]] = (ROTATION, TRANSLATION)
    phenomena: ClassVar[frozenset[str]] = frozenset({"load friction"})

    ratio: Quantity = parameter("1", "friction per transmitted effort", minimum=0.0, maximum=0.99)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T_in and the friction."""
        inside = self.inside(scope, motion, rate)
        return inside + self.under_load(scope, inside, rate)

    def under_load(self, scope: Scope, effort: Expression, rate: Expression) -> Expression:
        """Return the friction under an effort that is carried."""
        load = self.rubbing.size(scope, effort, ("is loaded forward", "is loaded backward"), "load")
        level = scope.parameter("ratio") * load
        friction = self.rubbing.against(scope, rate, lambda speed: level, level)
        scope.loss(friction * rate)
        return friction


@dataclass(frozen=True, kw_only=True)
class GearFriction(LoadFriction):
    """Friction of a gear that grows with what it carries: T_f = µ·|T_in|·sgn(ω₁), on the first body alone.

    T_in is the effort of the elements inside, which acts between both bodies as it does alone; ω₁ is the
    speed of the first body. At rest as :class:`LoadFriction`, which takes the rate between both bodies and
    rubs on both. Sources: Coulomb 1785 with the load as normal force; Niemann and Winter 2003.

    Examples
    --------
    >>> from nlsdesign.components import ROTATION, Spring
    >>> members = (("spring", Spring(stiffness=60.0, domain=ROTATION)),)
    >>> GearFriction(ratio=0.1, members=members).smooth(0.01).title()
    'GearFriction(ratio = 0.1, creep_speed = 0.01 rad/s)'
    """

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T_in."""
        return self.inside(scope, motion, rate)

    def at_first_end(self, scope: Scope, effort: Expression, rate: Expression) -> Expression:
        """Return the friction."""
        return self.under_load(scope, effort, rate)


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Viscous):
    """Drag of a fan or of churned oil: T = c·ω·|ω|, or F = c·v·|v|. Source: Newton 1687, book II."""

    picture: ClassVar[str] = "dashpot"
    phenomena: ClassVar[frozenset[str]] = frozenset({"drag"})

    domain: Domain = one_of(ROTATION, TRANSLATION)
    drag: Quantity = parameter("{effort}*s^2/{motion}^2", "drag coefficient", minimum=0.0, maximum=1e9)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = c·ω·|ω|."""
        return scope.parameter("drag") * rate * ca.fabs(rate)
