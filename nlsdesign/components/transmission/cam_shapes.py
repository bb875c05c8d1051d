"""More cams: one-sided, and two-sided given by its made contour with the anchor at a finite distance.

Base of cams without a cable, whose lever arm may be of either sign.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, symbol, uniform_spline, uniform_spline_integral
from ..core.element import Scope
from ..core.part import parameter
from ..core.part_numbers import NotDeclared, Reading, read_as
from .cam import Cam, side_of
from .stretchy_cable import newton_root

_CHECKED = 1001
"""Directions at which a contour is checked against its anchor."""


def check_row(name: str, values: Quantity) -> None:
    """Refuse fewer control values than a contour needs."""
    if len(values.values) < 5:
        raise ValueRangeError(
            f"{name} with {len(values.values)} control values", "a contour needs at least 5"
        )


@dataclass(frozen=True, kw_only=True)
class OneSidedCam(Cam):
    """Cam that takes up its cable on one side only: δ(θ) = ∫₀^q H for θ > 0, and nothing below.

    H is a uniform cubic B-spline with the control values ``lever_arm`` on [0, ``last_angle``]; beyond, it
    stays what it was there. The lever arm sets in over the angle w: q = w·(r³ − r⁴/2) with r = θ/w held in
    [0, 1], plus θ − w where θ > w. So q = 0 for θ ≤ 0, exactly, and q = θ − w/2 beyond w. h = H(q)·q' is
    dδ/dθ. δ is C², h is C¹; for θ ≤ 0 the cable lies slack or at its pretension without a lever arm.
    Source: virtual work; de Boor 1978 (B-splines).

    Examples
    --------
    >>> OneSidedCam(lever_arm=(0.01,) * 6, last_angle=1.5).onset.number
    0.001
    """

    lever_arm: Quantity = parameter(
        "m", "control values of the lever arm over the angle", minimum=-0.05, maximum=1.0, row=True
    )
    last_angle: Quantity = parameter("rad", "angle at the end of the contour", minimum=0.01, maximum=6.3)
    onset: Quantity = parameter(
        "rad", "angle over which the lever arm sets in", minimum=1e-6, maximum=0.5, default=1e-3
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_row("lever_arm", self.lever_arm)

    def _taken(self, scope: Scope, angle: Expression) -> tuple[Expression, Expression]:
        width = scope.parameter("onset")
        r = ca.fmin(ca.fmax(angle / width, 0), 1)
        return width * r**3 * (1 - r / 2) + ca.fmax(angle - width, 0), r * r * (3 - 2 * r)

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = ∫₀^q H."""
        taken, _ = self._taken(scope, angle)
        end, row = scope.parameter("last_angle"), scope.row("lever_arm")
        return held_integral(row, end, taken)

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        taken, slope = self._taken(scope, angle)
        return held_spline(scope.row("lever_arm"), scope.parameter("last_angle"), taken) * slope


@dataclass(frozen=True, kw_only=True)
class AnchoredCam(Cam):
    """Two-sided cam of a given shape: the cable through its centre ends at an anchor at the distance D.

    The shape is the support function p(φ), distance from the centre to the tangent whose normal has turned by
    φ: a uniform cubic B-spline with the control values ``support`` on [0, ``last_direction``]; beyond, p
    stays what it was there. The cable is the tangent through the anchor, so with the angle q on its side
    φ − asin(p(φ)/D) = q, the lever arm is h = p(φ), and what the cam takes up of the cable is exactly
    δ = P(φ) − P(φ₀) + √(D² − p²(φ)) − √(D² − p²(φ₀)), P = ∫p, φ₀ = φ at q = 0. φ is found by six Newton
    steps; the remainder is checked. As D → ∞ the cable stays parallel, φ = q and δ = P(q): then this is
    :class:`TwoSidedCam` with ``lever_arm`` = ``support``. The sides change over the angle w, C∞:
    q = √(θ² + w²) − w, h = p(φ)·θ/√(θ² + w²). δ is C³ along a side, h is C².
    Source: Schneider 2014 (support function of a convex curve).

    Raises
    ------
    ArrangementError
        If the contour reaches the anchor of its cable.

    Examples
    --------
    >>> row = (0.006, 0.008, 0.01, 0.012, 0.013)
    >>> AnchoredCam(support=row, last_direction=1.2, anchor_distance=0.03).anchor_distance.number
    0.03
    """

    support: Quantity = parameter(
        "m", "control values of the support function over the direction", minimum=-0.05, maximum=1.0, row=True
    )
    last_direction: Quantity = parameter(
        "rad", "direction of the normal at the end of the contour", minimum=0.01, maximum=6.3
    )
    anchor_distance: Quantity = parameter(
        "m", "distance from the centre to the fixed end of the cable", minimum=1e-3, maximum=1e9
    )
    changeover: Quantity = parameter(
        "rad", "angle over which the cable changes sides", minimum=1e-6, maximum=0.5, default=1e-3
    )

    def __post_init__(self) -> None:
        from scipy.interpolate import BSpline  # a list of parts needs no SciPy

        super().__post_init__()
        check_row("support", self.support)
        anchor, values = self.anchor_distance.number, np.array(self.support.values)
        last = self.last_direction.number
        step, at = last / (len(values) - 3), np.linspace(0.0, last, _CHECKED)
        spline = BSpline(step * np.arange(-3, len(values) + 1), values, 3)
        support, contact = spline(at), spline.derivative()(at)
        outermost, steepest = float(np.max(np.abs(support))), float(np.max(contact))
        if outermost >= anchor or np.any(np.sqrt(anchor**2 - support**2) <= contact):
            raise ArrangementError(
                f"AnchoredCam with anchor_distance = {self.anchor_distance}",
                f"reaches its anchor: support up to {1e3 * outermost:.4g} mm, "
                f"contact up to {1e3 * steepest:.4g} mm along the cable",
                next_step="move the anchor out, or take a smaller cam",
            )

    def _support(self, scope: Scope, direction: Expression) -> Expression:
        return held_spline(scope.row("support"), scope.parameter("last_direction"), direction)

    def _direction(self, scope: Scope, on_side: Expression) -> Expression:
        """Return φ of φ − asin(p(φ)/D) = q."""
        unknown, given = symbol(f"{scope.path}.sought"), symbol(f"{scope.path}.turned")
        leaning = ca.asin(self._support(scope, unknown) / scope.parameter("anchor_distance"))
        residual = unknown - leaning - given
        start = given + ca.substitute(leaning, unknown, given)
        direction = ca.substitute(newton_root(residual, unknown, start), given, on_side)
        remainder = ca.substitute(ca.substitute(residual, unknown, direction), given, on_side)
        scope.check(f"{scope.path}.direction", remainder)
        return direction

    def _taken(self, scope: Scope, direction: Expression) -> Expression:
        arm, anchor = self._support(scope, direction), scope.parameter("anchor_distance")
        # √(D² − p²) − D, without cancellation where the anchor is far.
        shortened = -arm * arm / (anchor + ca.sqrt(anchor * anchor - arm * arm))
        return held_integral(scope.row("support"), scope.parameter("last_direction"), direction) + shortened

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = P(φ) − P(φ₀) + √(D² − p²(φ)) − √(D² − p²(φ₀))."""
        on_side, _ = side_of(angle, scope.parameter("changeover"))
        first, now = self._direction(scope, ca.SX(0)), self._direction(scope, on_side)
        return self._taken(scope, now) - self._taken(scope, first)

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        on_side, slope = side_of(angle, scope.parameter("changeover"))
        return self._support(scope, self._direction(scope, on_side)) * slope


@dataclass(frozen=True, kw_only=True)
class MirroredCam(Cam):
    """Base of cams without a cable, with two sides that are mirror images: δ(θ) = ∫₀^q H of a spline H."""

    lever_arm: Quantity = parameter(
        "m", "control values of the lever arm over the angle", minimum=-1.0, maximum=1.0, row=True
    )
    last_angle: Quantity = parameter("rad", "angle at the end of the contour", minimum=0.01, maximum=3.0)
    changeover: Quantity = parameter(
        "rad", "angle over which the lever arm changes sides", minimum=1e-6, maximum=0.5, default=1e-3
    )
    cable: Reading = read_as(NotDeclared, default=NotDeclared())

    def __post_init__(self) -> None:
        super().__post_init__()
        check_row("lever_arm", self.lever_arm)

    @property
    @abstractmethod
    def base(self) -> str:
        """Name of the length at angle zero that shapes the contour beside the lever arms."""

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = ∫₀^q H."""
        on_side, _ = side_of(angle, scope.parameter("changeover"))
        return held_integral(scope.row("lever_arm"), scope.parameter("last_angle"), on_side)

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        on_side, slope = side_of(angle, scope.parameter("changeover"))
        return held_spline(scope.row("lever_arm"), scope.parameter("last_angle"), on_side) * slope


def held_spline(row: list[Expression], end: Expression, at: Expression) -> Expression:
    """Return a spline on [0, end], held beyond."""
    return uniform_spline(row, 0.0, end / (len(row) - 3), ca.fmin(at, end))


def held_integral(row: list[Expression], end: Expression, at: Expression) -> Expression:
    """Return the integral from 0 of a spline on [0, end] that is held beyond."""
    within, step = ca.fmin(at, end), end / (len(row) - 3)
    run_out = uniform_spline(row, 0.0, step, within) * (at - within)
    return uniform_spline_integral(row, 0.0, step, within) + run_out
