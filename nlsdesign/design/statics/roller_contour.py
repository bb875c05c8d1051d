"""Geometry of a cam on which a roller runs that slides in line with the axis.

The roller's centre has the distance ρ(θ) = ρ₀ + x(θ) from the axis, and in the frame of the cam the bearing
θ, so it moves along the pitch curve ρ·u, u = (sin θ, cos θ). With h = dx/dθ, the pressure angle
α = atan(h/ρ) between the normal of the edge and the line of the follower, and s² = ρ² + h²,

    n = (sin φ, cos φ), φ = θ − α,    κ = (ρ² + 2h² − ρ·dh/dθ)/s³,    edge = ρ·u − r·n,    1/κ − r its radius.

Where κ < 0 the edge is hollow, with the radius 1/|κ| + r, always wider than the roller; where 1/κ < r the
roller undercuts it. Source: Norton 2009, ch. 7 (pressure angle, radius of curvature, undercutting).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...foundation.arrays import Array
from .contour import Contour, turn

STRAIGHT = 10.0
"""Radius of curvature in m from which an edge counts as straight."""


@dataclass(frozen=True, eq=False)
class RollerContour(Contour):
    """One side of a cam with a roller, from angle zero on; arrays of shape (n,), in SI.

    Of the base class ``lever_arms`` and ``slopes`` are h and dh/dθ, ``directions`` those of the normal, which
    may turn back, and ``radii_of_curvature`` those of the edge, below zero where it is hollow.
    """

    bearings: Array  # θ, ascending from zero
    centre_radii: Array  # ρ
    roller_radius: float

    @cached_property
    def angles(self) -> Array:
        """Cam angle θ at which the roller touches each point."""
        return self.bearings

    @cached_property
    def normals(self) -> Array:
        """Outward normals of the edge, shape (n, 2)."""
        result: Array = np.column_stack([np.sin(self.directions), np.cos(self.directions)])
        return result

    @cached_property
    def centre_line(self) -> Array:
        """Points of the pitch curve, shape (n, 2)."""
        outwards = np.column_stack([np.sin(self.bearings), np.cos(self.bearings)])
        result: Array = self.centre_radii[:, None] * outwards
        return result

    @cached_property
    def points(self) -> Array:
        """Points of the edge in the frame of the cam, shape (n, 2)."""
        result: Array = self.centre_line - self.roller_radius * self.normals
        return result

    @cached_property
    def radii(self) -> Array:
        """Distance of the edge from the axis."""
        result: Array = np.hypot(*self.points.T)
        return result

    @cached_property
    def pressure_angles(self) -> Array:
        """Angle between the normal of the edge and the line of the follower, of the sign of h."""
        return np.arctan2(self.lever_arms, self.centre_radii)

    @cached_property
    def taken_lengths(self) -> Array:
        """Way of the follower since angle zero: the integral of the lever arm."""
        result: Array = self.centre_radii - self.centre_radii[0]
        return result

    def surface(self, cable_radius: float = 0.0) -> Array:
        """Return the points at a distance inside the pitch curve: at the radius of the roller the edge."""
        result: Array = self.centre_line - cable_radius * self.normals
        return result

    @property
    def drawn_line(self) -> str:
        """The edge."""
        return "edge under the roller"

    def cable(self, angle: float) -> Array:
        """Return where roller and edge touch, and the roller's centre, in the resting frame."""
        here = [np.interp(abs(angle), self.bearings, column) for column in self.points.T]
        mirrored = np.array([here]) * [1.0 if angle >= 0.0 else -1.0, 1.0]
        centre = float(np.interp(abs(angle), self.bearings, self.centre_radii))
        return np.vstack([turn(mirrored, angle), [0.0, centre]])

    def outlines(self, angle: float = 0.0, *, cable_radius: float = 0.0) -> tuple[Array, ...]:
        """Return both sides as one closed polygon in the resting frame, closed through the axis."""
        right = self.points
        both = np.vstack([right[::-1] * [-1.0, 1.0], right[1:], [[0.0, 0.0]]])
        return (turn(np.vstack([both, both[:1]]), angle),)


def roller_contour(
    bearings: Array, way: tuple[Array, Array, Array], *, base_radius: float, roller_radius: float
) -> RollerContour:
    """Return the contour of a roller's way x, h = dx/dθ and dh/dθ over ascending bearings θ."""
    taken, arms, slopes = way
    rho = base_radius + taken
    speed = np.hypot(rho, arms)
    curvature = (rho**2 + 2.0 * arms**2 - rho * slopes) / speed**3
    safe = np.where(np.abs(curvature) < 1.0 / STRAIGHT, np.copysign(1.0 / STRAIGHT, curvature), curvature)
    return RollerContour(
        directions=bearings - np.arctan2(arms, rho),
        lever_arms=arms,
        slopes=slopes,
        radii_of_curvature=1.0 / safe - roller_radius,
        anchor_distance=np.inf,
        bearings=bearings,
        centre_radii=rho,
        roller_radius=roller_radius,
    )
