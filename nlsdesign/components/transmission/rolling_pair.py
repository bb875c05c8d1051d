"""Two cams that roll on one another, with the element between their pivots: no guide and no cable."""

from __future__ import annotations

from dataclasses import dataclass

from ...foundation.quantity import Quantity
from ..core.part import parameter
from .cam_shapes import MirroredCam


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
        If there are fewer than five control values.

    Examples
    --------
    >>> row = (0.0, 0.004, 0.006, 0.002, -0.003)
    >>> RollingPair(lever_arm=row, last_angle=1.0, base_distance=0.04).base_distance.number
    0.04
    """

    base_distance: Quantity = parameter(
        "m", "distance of the two pivots at angle zero", minimum=2e-3, maximum=4.0
    )

    @property
    def base(self) -> str:
        """The distance of the pivots."""
        return "base_distance"
