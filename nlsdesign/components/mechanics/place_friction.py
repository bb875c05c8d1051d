"""Dry friction that depends on the place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.contacts import WithFriction
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Viscous


@dataclass(frozen=True, kw_only=True)
class SpotFriction(WithFriction, Viscous):
    """Dry friction where something rubs: level T_s·e^(−((θ − θ_s)/w)²), zero elsewhere.

    Against the motion while it moves, at most the level while it rests, as :class:`CoulombFriction`. C∞ with
    ``contact=Regularised(creep_speed=...)``. Source: Coulomb 1785; Armstrong-Hélouvry 1991 (friction that
    depends on position).

    Examples
    --------
    >>> SpotFriction(sliding_effort=0.2, place=0.3, width=0.05).smooth().domain.effort
    'torque'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"friction of a place"})

    domain: Domain = one_of(ROTATION, TRANSLATION)
    sliding_effort: Quantity = parameter("{effort}", "friction T_s in the middle", minimum=0.0, maximum=1e9)
    place: Quantity = parameter("{motion}", "middle θ_s of the spot", minimum=-1e6, maximum=1e6)
    width: Quantity = parameter("{motion}", "width w of the spot", minimum=1e-9, maximum=1e6)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the friction."""
        off = (motion - scope.parameter("place")) / scope.parameter("width")
        level = scope.parameter("sliding_effort") * ca.exp(-off * off)
        return self.rubbing.against(scope, rate, lambda speed: level, level)


@dataclass(frozen=True, kw_only=True)
class WavyFriction(WithFriction, Viscous):
    """Dry friction that comes round with the angle: level ⟨T_c + a·sin(nθ) + b·cos(nθ)⟩.

    A shaft that is not true presses its bearing or seal once per turn, n = 1, a gear n times. Against the
    motion, never negative, so it is passive; else as :class:`CoulombFriction`. Source: Coulomb 1785;
    Armstrong-Hélouvry 1991 (friction that depends on position).

    Examples
    --------
    >>> WavyFriction(sliding_effort=0.2, sine=0.05, cosine=0.0).smooth().order.number
    1.0
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"dry friction", "friction of a place"})

    domain: ClassVar[Domain] = ROTATION
    sliding_effort: Quantity = parameter("N*m", "mean friction T_c while sliding", minimum=0.0, maximum=1e9)
    sine: Quantity = parameter("N*m", "part a in sin(nθ)", minimum=-1e9, maximum=1e9)
    cosine: Quantity = parameter("N*m", "part b in cos(nθ)", minimum=-1e9, maximum=1e9)
    order: Quantity = parameter("1", "periods n per turn", minimum=1e-3, maximum=1e5, default=1.0)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the friction."""
        phase = scope.parameter("order") * motion
        wave = scope.parameter("sine") * ca.sin(phase) + scope.parameter("cosine") * ca.cos(phase)
        level = ca.fmax(scope.parameter("sliding_effort") + wave, 0)
        return self.rubbing.against(scope, rate, lambda speed: level, level)
