"""Geometry of a cam whose cable runs through its centre to an anchor at a finite distance.

With lever arm h(θ) and anchor distance D the normal of the cable, seen from the cam, has turned by

    φ = θ + asin(h/D)   (ψ = −φ),        p(φ) = h   (support function),        ρ = p + p''.

The contour point is p·n + p'·t with n = (sin φ, cos φ), t = (cos φ, −sin φ); it moves along t with speed ρ,
so ρ ≥ 0 everywhere means convex. At φ = 0 the cable lies along the x axis and leaves the cam at x = p'(0).
What is described is the lower right lip; the other three are its mirror images. All lengths are those of the
cable's centre line: the cam itself lies deeper by the radius of the cable.

Source: Schneider 2014 (support function of a convex curve).

Geometry of a cam on which a roller runs that slides in line with the axis.

The roller's centre has the distance ρ(θ) = ρ₀ + x(θ) from the axis, and in the frame of the cam the bearing
θ, so it moves along the pitch curve ρ·u, u = (sin θ, cos θ). With h = dx/dθ, the pressure angle
α = atan(h/ρ) between the normal of the edge and the line of the follower, and s² = ρ² + h²,

    n = (sin φ, cos φ), φ = θ − α,    κ = (ρ² + 2h² − ρ·dh/dθ)/s³,    edge = ρ·u − r·n,    1/κ − r its radius.

Where κ < 0 the edge is hollow, with the radius 1/|κ| + r, always wider than the roller; where 1/κ < r the
roller undercuts it. Source: Norton 2009, ch. 7 (pressure angle, radius of curvature, undercutting).

Geometry of a cam that rolls on its mirror image.

Their common tangent stays half way between the two pivots, so with the distance d(θ) of these, in either cam,

    φ = θ/2,    p(φ) = d/2,    p' = dd/dθ = h,    ρ = p + p'' = d/2 + 2·dh/dθ,    point p·n + h·t.

Both are convex where ρ ≥ 0; mirror images that are hollow meet. Source: Wu and Mintchev 2024.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError


@dataclass(frozen=True, eq=False)
class Contour:
    """One lip of a cam, as what the cable's centre line touches; arrays of shape (n,), in SI.

    Parameters
    ----------
    directions
        φ, ascending.
    lever_arms, slopes
        p and dp/dφ.
    radii_of_curvature
        ρ.
    anchor_distance
        D; infinite for a parallel cable.
    """

    directions: Array
    lever_arms: Array
    slopes: Array
    radii_of_curvature: Array
    anchor_distance: float

    @cached_property
    def angles(self) -> Array:
        """Cam angle θ at which the cable touches each point."""
        return self.directions - np.arcsin(self.lever_arms / self.anchor_distance)

    @cached_property
    def points(self) -> Array:
        """Points in the frame of the cam, shape (n, 2)."""
        sine, cosine = np.sin(self.directions), np.cos(self.directions)
        return np.column_stack(
            [self.lever_arms * sine + self.slopes * cosine, self.lever_arms * cosine - self.slopes * sine]
        )

    @property
    def centre_line(self) -> Array:
        """Centre line of what lies on the cam, shape (n, 2): of the cable these points."""
        return self.points

    @property
    def drawn_line(self) -> str:
        """What is drawn of it where no part is made."""
        return "cable's centre line"

    @cached_property
    def radii(self) -> Array:
        """Distance of the points from the centre."""
        return np.hypot(self.lever_arms, self.slopes)

    @cached_property
    def free_lengths(self) -> Array:
        """Length of the cable between contact point and anchor; a cam that reaches the anchor has none.

        With an infinite anchor distance it is infinite; see :attr:`taken_lengths`.
        """
        return np.sqrt(self.anchor_distance**2 - self.lever_arms**2) - self.slopes

    @cached_property
    def arc_lengths(self) -> Array:
        """Length of the contour from its first point."""
        rho = self.radii_of_curvature
        steps = (rho[1:] + rho[:-1]) / 2 * np.diff(self.directions)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @cached_property
    def taken_lengths(self) -> Array:
        """Length of cable that the cam has taken up since the first point: the integral of the lever arm."""
        root = np.sqrt(self.anchor_distance**2 - self.lever_arms**2)
        straight = (self.lever_arms[0] ** 2 - self.lever_arms**2) / (root + root[0])
        result: Array = self.arc_lengths + straight - (self.slopes - self.slopes[0])
        return result

    def surface(self, cable_radius: float = 0.0) -> Array:
        """Return the points of the cam below a cable of that radius, in the frame of the cam.

        Parameters
        ----------
        cable_radius
            In m; zero gives the curve of the cable's centre line.

        Returns
        -------
        numpy.ndarray
            Shape (n, 2).

        Raises
        ------
        ValueRangeError
            If the contour is sharper than the cable is thick.
        """
        sharpest = float(self.radii_of_curvature.min())
        if not 0.0 <= cable_radius <= sharpest:
            raise ValueRangeError(
                f"cable radius {1e3 * cable_radius:g} mm",
                f"must not exceed the sharpest radius under the cable, {1e3 * sharpest:.4g} mm",
                next_step="take a thinner cable, or ask for a larger radius (MinimumRadiusOfCurvature)",
            )
        normals = np.column_stack([np.sin(self.directions), np.cos(self.directions)])
        return self.points - cable_radius * normals

    def cable(self, angle: float) -> Array:
        """Return contact point and anchor in the resting frame, for the right-hand cable.

        The left-hand cable is the same turned by half a turn. With an infinite anchor distance the second
        point is one on the parallel cable, ten times the largest radius away from the axis.

        Parameters
        ----------
        angle
            Cam angle in rad, of either sign, within the contour.

        Returns
        -------
        numpy.ndarray
            Shape (2, 2): contact point, then anchor.

        Raises
        ------
        ValueRangeError
            If the angle lies beyond the end of the contour.
        """
        if abs(angle) > self.angles[-1] * (1 + 1e-9) + 1e-12:
            raise ValueRangeError(
                f"angle {angle:g} rad", f"the contour ends at {self.angles[-1]:g} rad",
                next_step="ask for a smaller angle",
            )  # fmt: skip
        contact = [np.interp(abs(angle), self.angles, column) for column in self.points.T]
        touched = turn(np.array([contact]), abs(angle))[0]
        # A negative angle uses the upper lip: everything mirrored at the x axis.
        side = -1.0 if angle < 0.0 else 1.0
        anchor = np.array([self.anchor_distance, 0.0])
        if math.isinf(self.anchor_distance):
            anchor = np.array([10.0 * self.radii.max(), side * touched[1]])
        return np.array([touched * [1.0, side], anchor])

    def outlines(self, angle: float = 0.0, *, cable_radius: float = 0.0) -> tuple[Array, ...]:
        """Return the two halves of the cam as closed polygons in the resting frame: lower, upper.

        Between the ends of its two lips each half is closed by a straight line; so is the channel of the
        cable between their beginnings.

        Parameters
        ----------
        angle
            Cam angle in rad.
        cable_radius
            In m.

        Returns
        -------
        tuple of numpy.ndarray
            Each of shape (2n + 1, 2); the last point is the first.
        """
        right = self.surface(cable_radius)
        lower = np.vstack([right[::-1] * [-1.0, 1.0], right, right[-1:] * [-1.0, 1.0]])
        return turn(lower, angle), turn(-lower, angle)


def turn(points: Array, angle: float) -> Array:
    """Turn points about the centre.

    ``points``: shape (n, 2).
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    result: Array = points @ np.array([[cosine, sine], [-sine, cosine]])
    return result


def cable_up_to(contour: Contour, angle: float, guide: float, *, from_centre: bool) -> Array:
    """Return the line of the right-hand cable up to its guide, shape (n, 2) in m, in the resting frame.

    From the centre or the first point of the lip, along the lip to the contact point, straight to the guide:
    the last point but one is the contact point, the last lies on the guide, or at the anchor where that is
    nearer.
    ``guide``: distance of the guide from the centre in m.
    """
    touched = contour.points[contour.angles < abs(angle)]
    side = np.array([1.0, -1.0 if angle < 0.0 else 1.0])
    begin = np.zeros((1 if from_centre else 0, 2))
    contact, anchor = contour.cable(angle)
    share = min(1.0, (guide - contact[0]) / (anchor[0] - contact[0]))
    wrapped = turn(np.vstack([begin, touched]) * side, angle)
    return np.vstack([wrapped, contact, contact + share * (anchor - contact)])


def contour_from_curvature(
    nodes: ArrayLike,
    radii_of_curvature: ArrayLike,
    *,
    first_slope: float,
    anchor_distance: float,
    first_lever_arm: float = 0.0,
    refine: int = 8,
) -> Contour:
    """Return the contour of a radius of curvature that is linear between nodes; p'' + p = ρ solved exactly.

    ``nodes`` are φ from zero, ``radii_of_curvature`` ρ there in m; ``first_slope`` is p'(0) in m, where the
    cable leaves the cam at angle zero, ``first_lever_arm`` p(0) in m, zero for a cable through the centre;
    ``anchor_distance`` is D in m, infinite for a cable that stays parallel.
    """
    phi, rho = np.asarray(nodes, dtype=float), np.asarray(radii_of_curvature, dtype=float)
    value, slope = first_lever_arm, first_slope
    rows = [(phi[0], value, slope, rho[0])]
    for left, right, start, end in zip(phi[:-1], phi[1:], rho[:-1], rho[1:], strict=True):
        growth = (end - start) / (right - left)
        for step in np.linspace(0.0, right - left, refine + 1)[1:]:
            cosine, sine = np.cos(step), np.sin(step)
            p = start + growth * step + (value - start) * cosine + (slope - growth) * sine
            rows.append(
                (
                    left + step,
                    p,
                    growth - (value - start) * sine + (slope - growth) * cosine,
                    start + growth * step,
                )
            )
        _, value, slope, _ = rows[-1]
    table = np.array(rows).T
    return Contour(table[0], table[1], table[2], table[3], anchor_distance)


def contour_from_lever_arm(angles: ArrayLike, lever_arms: ArrayLike, *, anchor_distance: float) -> Contour:
    """Return the contour that gives a lever arm, by derivatives of a quintic spline through it.

    Parameters
    ----------
    angles
        θ from zero, ascending, shape (n,), n ≥ 6.
    lever_arms
        h, shape (n,), in m.
    anchor_distance
        D in m; infinite for a parallel cable.

    Raises
    ------
    ValueRangeError
        If the lever arm reaches to the anchor, or falls so fast that the cable would turn back.
    """
    theta, arm = np.asarray(angles, dtype=float), np.asarray(lever_arms, dtype=float)
    if np.max(np.abs(arm)) >= anchor_distance:
        raise ValueRangeError(
            f"anchor_distance = {1e3 * anchor_distance:g} mm",
            f"must exceed the largest lever arm, {1e3 * float(np.max(np.abs(arm))):.4g} mm",
        )
    spline = scipy.interpolate.make_interp_spline(theta, arm, k=5)
    first, second = spline(theta, 1), spline(theta, 2)
    root = np.sqrt(anchor_distance**2 - arm**2)
    speed = 1.0 + first / root
    if np.any(speed <= 0.0):
        raise ValueRangeError("lever arm", "falls so fast that the cable would turn back on the contour")
    growth = second / root + arm * first**2 / root**3
    slope = first / speed
    slope_rate = (second - slope * growth) / speed
    return Contour(
        theta + np.arcsin(arm / anchor_distance), arm, slope, arm + slope_rate / speed, anchor_distance
    )


STRAIGHT = 10.0
"""Radius of curvature in m from which an edge counts as straight."""


@dataclass(frozen=True, eq=False)
class RollingContour(Contour):
    """One side of a cam on which something rolls, from angle zero on; the other side is its mirror image.

    Of the base class ``lever_arms`` and ``slopes`` are h and dh/dθ, ``directions`` those of the normal.
    """

    bearings: Array  # of the centre of what rolls, in the frame of the cam, ascending from zero
    centre_radii: Array  # distance of that centre from the axis of the cam

    @cached_property
    def normals(self) -> Array:
        """Outward normals of the edge, shape (n, 2)."""
        result: Array = np.column_stack([np.sin(self.directions), np.cos(self.directions)])
        return result

    @cached_property
    def centre_line(self) -> Array:
        """Points of the way of that centre, shape (n, 2)."""
        outwards = np.column_stack([np.sin(self.bearings), np.cos(self.bearings)])
        result: Array = self.centre_radii[:, None] * outwards
        return result

    @cached_property
    def radii(self) -> Array:
        """Distance of the edge from the axis."""
        result: Array = np.hypot(*self.points.T)
        return result

    @cached_property
    def taken_lengths(self) -> Array:
        """Way of that centre since angle zero: the integral of the lever arm."""
        result: Array = self.centre_radii - self.centre_radii[0]
        return result

    def turned(self, angle: float) -> float:
        """Return by how much the cam has turned in the frame of the line of both centres."""
        return angle

    def cable(self, angle: float) -> Array:
        """Return the contact, and the centre of what rolls on the y axis."""
        here = [np.interp(abs(angle), self.angles, column) for column in self.points.T]
        mirrored = np.array([here]) * [1.0 if angle >= 0.0 else -1.0, 1.0]
        centre = float(np.interp(abs(angle), self.angles, self.centre_radii))
        return np.vstack([turn(mirrored, self.turned(angle)), [0.0, centre]])

    def outlines(self, angle: float = 0.0, *, cable_radius: float = 0.0) -> tuple[Array, ...]:
        """Return both sides as one closed polygon under the line of both centres, closed through the axis."""
        right = self.points
        both = np.vstack([right[::-1] * [-1.0, 1.0], right[1:], [[0.0, 0.0]]])
        return (turn(np.vstack([both, both[:1]]), self.turned(angle)),)


@dataclass(frozen=True, eq=False)
class RollerContour(RollingContour):
    """One side of a cam with a roller, from angle zero on; arrays of shape (n,), in SI.

    The ``directions`` may turn back; ``radii_of_curvature`` are below zero where the edge is hollow.
    """

    roller_radius: float

    @cached_property
    def angles(self) -> Array:
        """Cam angle θ at which the roller touches each point."""
        return self.bearings

    @cached_property
    def points(self) -> Array:
        """Points of the edge in the frame of the cam, shape (n, 2)."""
        result: Array = self.centre_line - self.roller_radius * self.normals
        return result

    @cached_property
    def pressure_angles(self) -> Array:
        """Angle between the normal of the edge and the line of the follower, of the sign of h."""
        return np.arctan2(self.lever_arms, self.centre_radii)

    def surface(self, cable_radius: float = 0.0) -> Array:
        """Return the points at a distance inside the pitch curve: at the radius of the roller the edge."""
        result: Array = self.centre_line - cable_radius * self.normals
        return result

    @property
    def drawn_line(self) -> str:
        """The edge."""
        return "edge under the roller"


@dataclass(frozen=True, eq=False)
class PairContour(RollingContour):
    """One side of a cam that rolls on its mirror image, whose pivot has half of the angle as its bearing."""

    @cached_property
    def angles(self) -> Array:
        """Angle θ by which the pair has rolled to each point."""
        return 2.0 * self.directions

    @cached_property
    def points(self) -> Array:
        """Points of the edge in the frame of the cam, shape (n, 2)."""
        return self.edge.points

    @cached_property
    def edge(self) -> Contour:
        """The edge by its support function."""
        p = self.centre_radii / 2.0
        return Contour(self.directions, p, self.lever_arms, self.radii_of_curvature, np.inf)

    def turned(self, angle: float) -> float:
        """Return half of the angle."""
        return angle / 2.0

    def surface(self, cable_radius: float = 0.0) -> Array:
        """Return the points of the edge."""
        return self.points

    @property
    def drawn_line(self) -> str:
        """The edge."""
        return "edge that rolls on its mirror image"


def pair_contour(edge: Contour) -> PairContour:
    """Return the side of a cam that rolls on its mirror image, of the support function of its edge."""
    p, rho = edge.lever_arms, edge.radii_of_curvature
    return PairContour(
        directions=edge.directions, lever_arms=edge.slopes, slopes=(rho - p) / 2.0, radii_of_curvature=rho,
        anchor_distance=np.inf, bearings=edge.directions, centre_radii=2.0 * p,
    )  # fmt: skip


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
