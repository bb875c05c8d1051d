"""The closed-form cam of a whole actuator, and where no taut cable could lie on it: a yardstick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.design.curves.target import Target
from nlsdesign.design.statics.declared_cam import declared_cam
from nlsdesign.design.statics.energy import CamProfile, closed_form
from nlsdesign.design.statics.equilibrium import elastic_law
from nlsdesign.model import flatten


def energy_profile(
    actuator: Assembly, *, target: Target, spring: str | None = None, points: int = 401
) -> CamProfile:
    """Return the closed-form cam for the rubber, pretension and number of elements of an actuator.

    ``actuator``: assembly with a cam spring; its present cam does not matter. ``spring``: path of the cam
    spring; decided from the structure if it is left out.
    """
    model = flatten(actuator)
    law = elastic_law(model, spring)
    values = model.values
    return closed_form(
        law, target, elements=values[law.cam.elements], pretension=values[law.cam.pretension],
        points=points,
    )  # fmt: skip


_JUMP = 1e-3
"""First lever arm, relative to the largest, from which it counts as a jump."""


@dataclass(frozen=True)
class UnmakeablePart:
    """A range of angles over which a closed-form cam has no contour that a taut cable can lie on."""

    # first, last: angles in rad; equal for a jump
    first: float
    last: float
    reason: str  # in words

    def __str__(self) -> str:
        ends = (
            f"at {np.degrees(self.first):.3g}°"
            if self.first == self.last
            else f"from {np.degrees(self.first):.3g}° to {np.degrees(self.last):.3g}°"
        )
        return f"{ends}: {self.reason}"


def unmakeable_parts(
    profile: CamProfile, cam: object, *, minimum_radius: float = 0.0
) -> tuple[UnmakeablePart, ...]:
    """Return where a closed-form cam cannot be made; empty where all of it can.

    With D the distance of the anchor and h the lever arm, the direction of the cable on the cam turns by
    φ = θ + asin(h/D) and ρ = h + d²h/dφ²; a taut cable lies on convex contours only, ρ ≥ 0.

    ``cam``: the declared cam for which the profile was made.
    ``minimum_radius``: smallest radius of curvature, of tool and cable, in m.
    """
    made, radius = declared_cam(cam), minimum_radius
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
        # A run of true values begins at an even edge and ends before the next one.
        edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
        result += [
            UnmakeablePart(
                float(theta[a]),
                float(theta[b - 1]),
                f"{reason} (radius of curvature down to {1e3 * float(rho[a:b].min()):.3g} mm)",
            )
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
    return tuple(sorted(result, key=lambda part: part.first))
