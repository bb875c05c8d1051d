"""Torque that repeats over the angle, or force that repeats over the way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from ..core.springs import Elastic


@dataclass(frozen=True, kw_only=True)
class TorqueRipple(Elastic):
    """Cogging and torque ripple, T = a·sin(nθ) + b·cos(nθ), locked to the angle, or to the place on a line.

    The order n is the number of periods per turn. It comes from the poles of the motor times
    the gear ratio, or from the teeth of a gear; along a line it is 2π over the pitch of the magnets, or over
    the lead of a screw. Source: Hanselman 2003.
    """

    picture: ClassVar[str] = "box"
    phenomena: ClassVar[frozenset[str]] = frozenset({"ripple"})

    domain: Domain = one_of(ROTATION, TRANSLATION)
    sine: Quantity = parameter("{effort}", "amplitude of the part in sin(nθ)", minimum=-1e6, maximum=1e6)
    cosine: Quantity = parameter("{effort}", "amplitude of the part in cos(nθ)", minimum=-1e6, maximum=1e6)
    order: Quantity = parameter(
        "rad/{motion}", "periods per turn, or 2π per period of a line", minimum=0.1, maximum=1e5
    )

    @property
    def restores(self) -> bool:
        """False: it has many places of rest."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the ripple torque."""
        phase = scope.parameter("order") * motion
        return scope.parameter("sine") * ca.sin(phase) + scope.parameter("cosine") * ca.cos(phase)
