"""A cam whose profile deviates from its drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, uniform_spline, uniform_spline_integral
from ..core.element import Scope
from ..core.part import parameter
from .cam import TwoSidedCam, side_of


@dataclass(frozen=True, kw_only=True)
class CamWithProfileError(TwoSidedCam):
    """Two-sided cam with an error of its contour: h(θ) = (H(q) + E(q))·dq/dθ, δ(θ) = ∫₀^q (H + E).

    E is a uniform cubic B-spline on [0, ``last_angle``], so the error is smooth, the same on both sides, and
    h ≡ dδ/dθ holds with it: lever arm and extension are wrong together. Beyond the contour's end E stays what
    it was there. Valid while H + E > 0. Source: virtual work, as for the cam.

    Raises
    ------
    ValueRangeError
        If there are fewer than four control values.
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"profile error"})

    error: Quantity = parameter(
        "m", "control values of the error of the lever arm", minimum=-0.05, maximum=0.05, row=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.error.values) < 4:
            raise ValueRangeError(
                f"error with {len(self.error.values)} control values", "a cubic spline needs at least 4"
            )

    def _error(self, scope: Scope, angle: Expression) -> tuple[Expression, Expression]:
        """Return E at an angle, and its integral from zero."""
        on_side, _ = side_of(angle, scope.parameter("changeover"))
        last = scope.parameter("last_angle")
        on_contour = ca.fmin(on_side, last)
        row, step = scope.row("error"), last / (len(self.error.values) - 3)
        value = uniform_spline(row, 0.0, step, on_contour)
        return value, uniform_spline_integral(row, 0.0, step, on_contour) + value * (on_side - on_contour)

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = ∫₀^q (H + E)."""
        return super().extension(scope, angle) + self._error(scope, angle)[1]

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        slope = side_of(angle, scope.parameter("changeover"))[1]
        return super().lever_arm_at(scope, angle) + self._error(scope, angle)[0] * slope
