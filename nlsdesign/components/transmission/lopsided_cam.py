"""A two-sided cam whose two sides differ."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from .cam import Cam, TwoSidedCam, side_of
from .cam_shapes import check_row, held_integral, held_spline


@dataclass(frozen=True, kw_only=True)
class LopsidedCam(Cam):
    """Cam through whose centre the cable passes, with a contour of its own for each sign of the angle.

    For θ ≥ 0 it is the :class:`TwoSidedCam` of ``lever_arm`` and ``last_angle``, for θ < 0 that of
    ``back_lever_arm`` and ``back_last_angle``, and both stretch the same element: δ(θ) = ∫₀^q H± and
    h(θ) = H±(q)·θ/√(θ² + w²) = dδ/dθ with q = √(θ² + w²) − w. δ is C¹ at zero and C³ beside it; dh/dθ jumps
    there by (H₊(0) − H₋(0))/w, by nothing where both contours begin in the centre. Beyond its end a side
    goes on as round run-out; a stop is a part beside it. Source: de Boor 1978 (B-splines); virtual work.

    Raises
    ------
    ValueRangeError
        If a side has fewer than five control values.

    Examples
    --------
    >>> front, back = (0.01,) * 6, (0.004,) * 6
    >>> cam = LopsidedCam(lever_arm=front, last_angle=1.2, back_lever_arm=back, back_last_angle=0.4)
    >>> cam.side(back=True).last_angle.number
    0.4
    """

    lever_arm: Quantity = parameter(
        "m", "control values of the lever arm over positive angles", minimum=-0.05, maximum=1.0, row=True
    )
    last_angle: Quantity = parameter("rad", "angle at the end of that side", minimum=0.01, maximum=6.3)
    back_lever_arm: Quantity = parameter(
        "m", "control values of the lever arm over negative angles", minimum=-0.05, maximum=1.0, row=True
    )
    back_last_angle: Quantity = parameter("rad", "size of the angle at its end", minimum=0.01, maximum=6.3)
    anchor_distance: Quantity = parameter(
        "m", "distance from the centre to the fixed end of the cable", minimum=1e-3, maximum=1e9, default=1e6
    )
    changeover: Quantity = parameter(
        "rad", "angle over which the cable changes sides", minimum=1e-6, maximum=0.5, default=1e-3
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_row("lever_arm", self.lever_arm)
        check_row("back_lever_arm", self.back_lever_arm)

    def side(self, *, back: bool) -> TwoSidedCam:
        """Return the cam with two equal sides that is this one for one sign of the angle.

        Parameters
        ----------
        back
            Whether for negative angles.
        """
        row, end = _SIDES[back]
        return TwoSidedCam(
            lever_arm=getattr(self, row), last_angle=getattr(self, end), changeover=self.changeover,
            anchor_distance=self.anchor_distance, elements=self.elements, cable=self.cable,
        )  # fmt: skip

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = ∫₀^q H±."""
        on_side, _ = side_of(angle, scope.parameter("changeover"))
        front, back = (held_integral(scope.row(row), scope.parameter(end), on_side) for row, end in _SIDES)
        return ca.if_else(angle < 0, back, front)

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        on_side, slope = side_of(angle, scope.parameter("changeover"))
        front, back = (held_spline(scope.row(row), scope.parameter(end), on_side) for row, end in _SIDES)
        return ca.if_else(angle < 0, back, front) * slope


_SIDES = (("lever_arm", "last_angle"), ("back_lever_arm", "back_last_angle"))
