"""Rate-independent hysteresis with one state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, ROTATION, TRANSLATION, Domain
from ..core.element import Element, Scope
from ..core.part_numbers import one_of, parameter

_MOST_OVERSHOOT = 1.2


@dataclass(frozen=True, kw_only=True)
class BoucWen(Element):
    """Hysteresis that knows no rate: ż = k·ẋ·(1 − |z/z_y|ⁿ·[z·ẋ > 0]), F = z.

    Elastic with the stiffness k at each reversal, and sliding at z_y; a small n makes the way from one to the
    other long and round, a large one makes it a spring with a dry slider. Loss z·ẋ·|z/z_y|ⁿ while loading.
    Sources: Bouc 1967; Wen 1976.

    Examples
    --------
    >>> BoucWen(stiffness=400.0, yield_effort=3.0, exponent=1.0).domain.motion
    'extension'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"hysteresis"})

    domain: Domain = one_of(TRANSLATION, ROTATION, MATERIAL)
    stiffness: Quantity = parameter(
        "{effort}/{motion}", "stiffness k at a reversal", minimum=0.0, maximum=1e12
    )
    yield_effort: Quantity = parameter("{effort}", "effort z_y while sliding", minimum=1e-9, maximum=1e12)
    exponent: Quantity = parameter(
        "1", "exponent n of the way from one to the other", minimum=0.1, maximum=20.0
    )

    @property
    def needs_rate(self) -> bool:
        """False: the effort is a state; the rate only drives it."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return z."""
        domain = self.domain
        sliding = scope.state("sliding", domain.effort_unit, f"hysteretic {domain.effort} of {scope.path}")
        # The law keeps the ratio below one; a numerical step that overshoots must not run away.
        ratio = ca.fmin(ca.fabs(sliding) / scope.parameter("yield_effort"), _MOST_OVERSHOOT)
        power = ca.exp(scope.parameter("exponent") * ca.log(ca.fmax(ratio, 1e-9)))
        loading = ca.if_else(sliding * rate > 0, power, 0)
        scope.derive(sliding, scope.parameter("stiffness") * rate * (1 - loading))
        scope.loss(sliding * rate * loading)
        return sliding
