"""A cam with a roller follower: its contour may be hollow, so the lever arm may fall and change its sign."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from ..core.part_numbers import NotDeclared, Reading, read_as
from .cam_shapes import MirroredCam


@dataclass(frozen=True)
class SlidingGuide(Reading):
    """Dry friction of the guide that takes the side force of a follower: F·tan α of the pressure angle α.

    ``guide_friction`` is the coefficient of friction, times 1 + 2·overhang/length where the roller stands out
    of the guide. Source: Norton 2009, ch. 7.

    Examples
    --------
    >>> SlidingGuide(guide_friction=0.1, guide_creep_speed=1e-3).guide_friction
    0.1
    """

    guide_friction: Quantity = parameter(
        "1", "coefficient of friction of the guide, with its overhang", minimum=0.0, maximum=0.6
    )
    guide_creep_speed: Quantity = parameter(
        "m/s", "speed over which the friction changes its sign", minimum=1e-6, maximum=1.0
    )


@dataclass(frozen=True, kw_only=True)
class RollerCam(MirroredCam):
    """Cam on which a roller runs that slides in line with the axis, pressed on by the element: h may be < 0.

    The roller's centre has the distance ρ(θ) = ρ₀ + δ(θ) from the axis, outside the cam, whose two sides are
    mirror images: δ(θ) = ∫₀^q H with q = √(θ² + w²) − w, h = H(q)·θ/√(θ² + w²) = dδ/dθ. H is a uniform cubic
    B-spline with the control values ``lever_arm`` on [0, ``last_angle``], of any sign, and held beyond. The
    base radius ρ₀ and the radius of the roller shape the contour, and the friction of a guide: with the
    pressure angle tan α = h/ρ a follower that is lifted needs F/(1 − µ·|tan α|) in place of F, one that is
    let down F/(1 + µ·|tan α|). Valid while the element presses (F > 0) and µ·|tan α| < 1. Left out: rolling
    friction and the roller's bearing (0.001 to 0.005 of the force for ball bearings) and the follower's mass.
    Source: virtual work; Norton 2009, ch. 7; de Boor 1978 (B-splines).

    Raises
    ------
    ValueRangeError
        If the roller would cover the axis, or there are fewer than five control values.

    Examples
    --------
    >>> row = (0.0, 0.004, 0.006, 0.002, -0.003)
    >>> RollerCam(lever_arm=row, last_angle=1.0, base_radius=0.02, roller_radius=0.005).base_radius.number
    0.02
    """

    base_radius: Quantity = parameter(
        "m", "distance of the roller's centre from the axis at angle zero", minimum=1e-3, maximum=2.0
    )
    roller_radius: Quantity = parameter("m", "radius of the roller", minimum=1e-4, maximum=0.5)
    guide: Reading = read_as(NotDeclared, SlidingGuide, default=NotDeclared())

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base_radius.number <= self.roller_radius.number:
            raise ValueRangeError(
                f"base_radius = {self.base_radius}",
                f"must exceed the radius of the roller, {self.roller_radius}, or there is no cam below it",
                next_step="take a larger base_radius or a smaller roller",
            )

    @property
    def base(self) -> str:
        """The distance of the roller."""
        return "base_radius"

    @property
    def needs_rate(self) -> bool:
        """True where the guide has friction."""
        return isinstance(self.guide, SlidingGuide)

    def raised(self, scope: Scope, arm: Expression, lift: tuple[Expression, Expression]) -> Expression:
        """Return 1/(1 − µ·|tan α|·sgn(dδ/dt)), rounded over the creep speed; 1 without friction."""
        if not isinstance(self.guide, SlidingGuide):
            return super().raised(scope, arm, lift)
        slope = ca.fabs(arm) / (scope.parameter("base_radius") + lift[0])
        lifted = ca.tanh(lift[1] / scope.parameter("guide_creep_speed"))
        return 1 / (1 - scope.parameter("guide_friction") * slope * lifted)
