"""Stops: what a body runs against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, symbol
from ..core.contacts import WithCorners
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Element, Scope, StictionConstraint
from ..core.part_numbers import one_of, parameter
from ..core.springs import Elastic, Viscous


def _check_order(lower: Quantity, upper: Quantity) -> None:
    if not lower.number < upper.number:
        raise ValueRangeError(
            f"lower = {lower} and upper = {upper}", "the lower stop must lie below the upper one"
        )


@dataclass(frozen=True, kw_only=True)
class EndStop(WithCorners, Viscous):
    """Elastic stops at both ends of the way: T = k·p·⟨1 + d·ṗ⟩ beyond a stop, p the penetration; else 0.

    The loss grows with the penetration, so the torque does not jump on contact and the stop never pulls;
    an impact at the speed v rebounds with e ≈ 1 − 2·d·v/3 as long as d·v is small. The torque has a corner at
    each stop; with ``contact=Rounded(width=...)`` it is C∞ in the motion and differs by at most k·w·ln 2 at
    rest. The factor ⟨1 + d·ṗ⟩ keeps its corner where a body leaves faster than 1/d. Source: Hunt and Crossley
    1975, with the exponent 1.
    """

    picture: ClassVar[str] = "box"
    phenomena: ClassVar[frozenset[str]] = frozenset({"stops"})
    rounding: ClassVar[Mapping[Domain, float]] = {ROTATION: 1e-3, TRANSLATION: 1e-5}

    domain: Domain = one_of(ROTATION, TRANSLATION)
    lower: Quantity = parameter("{motion}", "place of the lower stop", minimum=-1e3, maximum=1e3)
    upper: Quantity = parameter("{motion}", "place of the upper stop", minimum=-1e3, maximum=1e3)
    stiffness: Quantity = parameter("{effort}/{motion}", "stiffness of a stop", minimum=1e-6, maximum=1e12)
    damping: Quantity = parameter(
        "s/{motion}", "share of the effort lost per speed of penetration", minimum=0.0, maximum=1e3
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_order(self.lower, self.upper)

    @property
    def dissipates(self) -> bool:
        """False: a stop stores, and loses what its effort is beyond k·p."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        over, under = motion - scope.parameter("upper"), scope.parameter("lower") - motion
        over, under = (
            self.corner.positive_part(scope, value, (f"meets the {stop}", f"leaves the {stop}"), name=name)[0]
            for value, stop, name in (
                (over, "upper stop", "upper_stop"), (under, "lower stop", "lower_stop"),
            )
        )  # fmt: skip
        return _hunt_crossley(scope, over, rate) - _hunt_crossley(scope, under, -rate)


def _hunt_crossley(scope: Scope, depth: Expression, rate: Expression) -> Expression:
    elastic = scope.parameter("stiffness") * depth
    torque = elastic * ca.fmax(1 + scope.parameter("damping") * rate, 0)
    scope.loss((torque - elastic) * rate)
    return torque


@dataclass(frozen=True, kw_only=True)
class RigidStop(Elastic):
    """Rigid stops at both ends of the way, with restitution: ω⁺ = −e·ω⁻ on impact, θ_l ≤ θ ≤ θ_u.

    Below the resting speed an impact ends at the stop, which then holds the body as long as it is pushed
    against it, 0 ≤ T ⟂ acceleration ≥ 0. The impulse is shared by inertia, so no momentum is lost between two
    bodies. Valid where the impact is short against all other motion. Sources: Newton 1687 (restitution);
    Pfeiffer and Glocker 1996.
    """

    domain: ClassVar[Domain] = ROTATION

    picture: ClassVar[str] = "box"
    phenomena: ClassVar[frozenset[str]] = frozenset({"stops"})

    lower: Quantity = parameter("rad", "angle of the lower stop", minimum=-1e3, maximum=1e3)
    upper: Quantity = parameter("rad", "angle of the upper stop", minimum=-1e3, maximum=1e3)
    restitution: Quantity = parameter("1", "speed after over speed before impact", minimum=0.0, maximum=1.0)
    resting_speed: Quantity = parameter(
        "rad/s", "speed of impact below which it does not rebound", minimum=0.0, maximum=10.0, default=1e-3
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_order(self.lower, self.upper)

    @property
    def restores(self) -> bool:
        """False: it leaves the body free between the stops."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return what holds the body at a stop."""
        mode, effort = symbol(f"{scope.path}.mode"), symbol(f"{scope.path}.holding")
        upper, lower = scope.parameter("upper"), scope.parameter("lower")
        at_upper = motion > (upper + lower) / 2
        # Beyond a stop only what moves on into it has landed; what comes out of it is free.
        gap = ca.fmin(ca.fmax(upper - motion, -rate), ca.fmax(motion - lower, rate))
        inside = ca.logic_and(motion < upper, motion > lower)
        slow = ca.fabs(rate) <= scope.parameter("resting_speed")
        return scope.stiction(
            StictionConstraint(
                scope.path, effort, mode, rate,
                moving=ca.SX(0),
                stays=ca.if_else(at_upper, effort, -effort),
                lands=gap,
                leads=ca.SX(1),
                rebound=ca.if_else(slow, 0, -scope.parameter("restitution") * rate),
                first=ca.if_else(ca.logic_or(inside, rate != 0), 1, 0),
                words=((0, "rests at a stop"), (1, "leaves the stop"), (2, "rebounds")),
            )
        )  # fmt: skip

    @property
    def is_smooth(self) -> bool:
        """False: an impact is located."""
        return False

    def smooth(self, width: float | None = None, stiffness: float = 1e3, speed: float = 1.0) -> Element:
        """Return an elastic stop with rounded corners that rebounds alike at one speed of impact.

        Parameters
        ----------
        width
            Angle over which a corner is rounded, in rad.
        stiffness
            Of the stop, in N·m/rad; a rigid one is the limit.
        speed
            Speed of impact at which d = 3·(1 − e)/(2·v) gives about the same restitution, in rad/s.
        """
        why = "assumed: smooth form of a rigid stop"
        damping = 1.5 * (1.0 - self.restitution.number) / speed
        stop = EndStop(
            lower=self.lower, upper=self.upper, stiffness=Quantity(stiffness, "N*m/rad", why),
            damping=Quantity(damping, "s/rad", why),
        )  # fmt: skip
        return stop.smooth(width)
