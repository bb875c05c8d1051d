"""Which part of a closed-form cam cannot be made, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from ...foundation.arrays import Array, Mask
from ...foundation.quantity import Quantity
from ..curves.numbers import in_si
from .declared_cam import declared_cam
from .energy import CamProfile

_JUMP = 1e-3
"""First lever arm, relative to the largest, from which it counts as a jump."""


@dataclass(frozen=True)
class UnmakeablePart:
    """A range of angles over which a closed-form cam has no contour that a taut cable can lie on.

    Parameters
    ----------
    first, last
        Angles in rad; equal for a jump.
    reason
        In words.
    """

    first: float
    last: float
    reason: str

    def __str__(self) -> str:
        ends = (
            f"at {np.degrees(self.first):.3g}°"
            if self.first == self.last
            else f"from {np.degrees(self.first):.3g}° to {np.degrees(self.last):.3g}°"
        )
        return f"{ends}: {self.reason}"


def unmakeable_parts(
    profile: CamProfile, cam: object, *, minimum_radius: Quantity | float = 0.0
) -> tuple[UnmakeablePart, ...]:
    """Return where a closed-form cam cannot be made; empty where all of it can.

    With D the distance of the anchor and h the lever arm, the direction of the cable on the cam turns by
    φ = θ + asin(h/D) and ρ = h + d²h/dφ²; a taut cable lies on convex contours only, ρ ≥ 0.

    Parameters
    ----------
    profile
        Of :func:`energy_profile`.
    cam
        Declared cam for which it was made: it says whether the cable passes through the centre, and where
        its anchor is.
    minimum_radius
        Smallest radius of curvature, of tool and cable, in m.

    Raises
    ------
    ArrangementError
        If the cam has no contour.
    """
    made, radius = declared_cam(cam), in_si("minimum_radius", minimum_radius, "m", maximum=0.5)
    anchor = made.anchor_distance
    theta, arm = profile.angles, profile.lever_arms
    result: list[UnmakeablePart] = []
    if made.through_centre and arm[0] > _JUMP * np.max(arm):
        reason = (
            f"the lever arm jumps to {1e3 * arm[0]:.3g} mm, but a cable through the centre has none at angle "
            "zero: give the rubber pretension, or ask for a curve that starts without slope"
        )
        result.append(UnmakeablePart(0.0, 0.0, reason))
    # A jump at angle zero is no part of the contour behind it.
    inner = slice(1, None)
    theta, arm = theta[inner], arm[inner]
    beyond = arm >= anchor
    safe = np.minimum(arm, 0.999 * anchor) if np.isfinite(anchor) else arm
    spline = make_interp_spline(theta, safe, k=5)
    first, second = spline(theta, 1), spline(theta, 2)
    root = np.sqrt(anchor**2 - safe**2)
    speed = 1.0 + first / root
    growth = second / root + safe * first**2 / root**3
    rho = safe + (second - first / speed * growth) / speed**2
    back = ~beyond & (speed <= 0.0)
    hollow = ~beyond & ~back & (rho < 0.0)
    sharp = ~beyond & ~back & ~hollow & (rho < radius * (1 - 1e-9))
    least = f"{1e3 * radius:.3g} mm"
    for where, reason in (
        (beyond, f"the lever arm reaches the anchor at {1e3 * anchor:.4g} mm"),
        (back, "the lever arm falls so fast that the cable would turn back"),
        (hollow, "the contour would have to be hollow, and a taut cable lifts off"),
        (sharp, f"the contour is sharper than {least}"),
    ):
        result += [
            UnmakeablePart(float(theta[a]), float(theta[b]), _with_radius(reason, rho[a : b + 1]))
            for a, b in _runs(where)
        ]
    return tuple(sorted(result, key=lambda part: part.first))


def _with_radius(reason: str, radii: Array) -> str:
    return f"{reason} (radius of curvature down to {1e3 * float(radii.min()):.3g} mm)"


def _runs(where: Mask) -> list[tuple[int, int]]:
    """Return first and last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
