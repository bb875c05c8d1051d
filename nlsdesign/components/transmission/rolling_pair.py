"""Two cams that roll on one another, with the element between their pivots: no guide and no cable."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import MM, Quantity
from ..core.part import parameter
from .cam_shapes import MirroredCam

_CHECKED = 401
"""Angles at which a profile is checked."""
_RIPPLE = 0.1
"""Share by which a fitted lever arm may fall short of a convex profile between the knots of its spline."""


@dataclass(frozen=True, kw_only=True)
class RollingPair(MirroredCam):
    """Two equal cams that roll on one another, pulled together by the element between their pivots.

    One cam is fixed to each body, and each is the mirror image of the other at their common tangent, so when
    they have rolled by θ the normal at the contact has turned by φ = θ/2 in each. The distance of the pivots
    is twice the support function of the profile, d(θ) = d₀ + δ(θ) = 2p(φ), the contact lies p′(φ) = h = dδ/dθ
    beside the line of the pivots, and the torque is N·F(e₀ + δ)·h: the moment of the element about the
    contact, which is the instantaneous centre. δ(θ) = ∫₀^q H with q = √(θ² + w²) − w, h = H(q)·θ/√(θ² + w²).
    H is a uniform cubic B-spline with the control values ``lever_arm`` on [0, ``last_angle``], of any sign,
    and held beyond. The profile has the radius of curvature ρ = p + p″ = d/2 + 2·dh/dθ.
    Valid while the element pulls (F > 0) and both profiles are convex, ρ > 0: mirror images that are hollow
    meet. A pure torque leaves no force along the contact; what else acts on the bodies is for teeth or bands.
    The axis of the motion wanders with the contact. Left out: rolling friction, mass and that wandering.
    Source: Wu and Mintchev 2024; virtual work; Schneider 2014 (support function); de Boor 1978 (B-splines).

    Raises
    ------
    ValueRangeError
        If a profile would be hollow, which names where and the least distance of the pivots that mends it, or
        there are fewer than five control values.

    Examples
    --------
    >>> row = (0.0, 0.004, 0.006, 0.002, -0.003)
    >>> RollingPair(lever_arm=row, last_angle=1.0, base_distance=0.04).base_distance.number
    0.04
    """

    base_distance: Quantity = parameter(
        "m", "distance of the two pivots at angle zero", minimum=2e-3, maximum=4.0
    )

    def __post_init__(self) -> None:
        from scipy.interpolate import BSpline  # a list of parts needs no SciPy

        super().__post_init__()
        row, end = np.array(self.lever_arm.values), self.last_angle.number
        spline = BSpline(end / (len(row) - 3) * np.arange(-3, len(row) + 1), row, 3)
        angles = np.linspace(0.0, end, _CHECKED)
        # ρ = d₀/2 + δ/2 + 2·dh/dθ
        needed = -spline.antiderivative()(angles) + spline.antiderivative()(0.0) - 4.0 * spline(angles, 1)
        worst = int(np.argmax(needed))
        if self.base_distance.number < (1.0 - _RIPPLE) * needed[worst]:
            raise ValueRangeError(
                f"base_distance = {self.base_distance}",
                f"makes both profiles hollow at {math.degrees(angles[worst]):.3g}°, where they would meet",
                next_step=f"take at least {MM * needed[worst]:.4g} mm, or a lever arm that falls more slowly",
            )
