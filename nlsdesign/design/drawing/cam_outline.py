"""Edges and outlines of cams as arcs: under the cable, run-out, round ends, back, channel or lead-in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from ...foundation.symbolic import remembered
from ..statics.contour import Contour
from .arc_path import ArcPath, biarc, clockwise_arc, joined, line

ACCURACY = 0.5e-6
"""Largest distance between the arcs and the contour in m."""

_REFINE = 4
_CHECKED = 33


@dataclass(frozen=True, eq=False)
class LipEdge:
    """Edge under the cable from the channel to the end of the run-out, clockwise, as arcs."""

    path: ArcPath  # open path in the frame of the cam, in m
    deviation: float  # largest distance between the arcs and the contour less the radius of the cable, in m
    # first_direction, last_direction: φ at both ends in rad: the outward normal is (sin φ, cos φ)
    first_direction: float
    last_direction: float
    last_support: float  # distance of the last tangent from the centre in m


Contours = tuple[Contour, Contour]
"""Those for positive and for negative angles."""
Lips = tuple[LipEdge, LipEdge]
"""Edges under the cable at positive and at negative angles."""


@remembered(8)
def lip_edge(
    contour: Contour, cable_radius: float, *, over_travel: float, accuracy: float = ACCURACY
) -> LipEdge:
    """Return the edge on which a cable has its centre line on the contour.

    Beyond the last angle the edge goes on as an arc with the last radius of curvature.
    """
    _check_curvature(contour, cable_radius)
    directions = contour.directions
    support = scipy.interpolate.BPoly.from_derivatives(
        directions,
        np.column_stack(
            [contour.lever_arms, contour.slopes, contour.radii_of_curvature - contour.lever_arms]
        ),
    )

    def over(first: float, last: float) -> tuple[ArcPath, float]:
        start, end = (
            (float(support(phi)) - cable_radius) * _normal(phi) + float(support(phi, 1)) * _tangent(phi)
            for phi in (first, last)
        )
        path = biarc(start, end, first=_tangent(first), last=_tangent(last))
        phi = np.linspace(first, last, _CHECKED)
        normals = np.column_stack([np.sin(phi), np.cos(phi)])
        tangents = normals[:, ::-1] * [1.0, -1.0]
        curve = (support(phi) - cable_radius)[:, None] * normals + support(phi, 1)[:, None] * tangents
        # On convex arcs the direction of the normal says which of the two a point belongs to.
        turned = -4.0 * math.atan(float(path.bulges[0]))
        arc = (phi > first + turned).astype(int)
        distance = np.hypot(*(curve - path.centres[arc]).T) - np.abs(path.radii)[arc]
        error = float(np.max(np.abs(distance)))
        return path, error if np.all(path.bulges[:2] < 0.0) else math.inf

    path, deviation = few_arcs(over, directions, accuracy)
    last = _run_out_end(contour, over_travel)
    radius = float(contour.radii_of_curvature[-1])
    centre = contour.points[-1] - radius * _normal(directions[-1])
    run_out = clockwise_arc(centre, radius - cable_radius, first=float(directions[-1]), last=last)
    return LipEdge(
        joined(path, run_out) if last > directions[-1] else path,
        deviation,
        float(directions[0]),
        last,
        float(centre @ _normal(last)) + radius - cable_radius,
    )


def _normal(direction: float) -> Array:
    return np.array([math.sin(direction), math.cos(direction)])


def _tangent(direction: float) -> Array:
    return np.array([math.cos(direction), -math.sin(direction)])


def _check_curvature(contour: Contour, cable_radius: float) -> None:
    radii = contour.radii_of_curvature
    index = int(np.argmin(radii))
    place = f"at the cam angle {math.degrees(contour.angles[index]):.3g}°"
    if radii[index] <= 0.0:
        raise ValueRangeError(
            f"contour {place}",
            f"is concave there (radius of curvature {MM * radii[index]:.4g} mm); a taut cable lifts off",
            next_step="ask for a radius of curvature above that of the cable (MinimumRadiusOfCurvature)",
        )
    if radii[index] < cable_radius + ACCURACY:
        raise ValueRangeError(
            f"cable radius {MM * cable_radius:g} mm",
            f"the cable is thicker than the sharpest radius under its centre line, "
            f"{MM * radii[index]:.4g} mm {place}",
            next_step="take a thinner cable, or ask for a larger radius (MinimumRadiusOfCurvature)",
        )


def few_arcs(
    over: Callable[[float, float], tuple[ArcPath, float]], phi: Array, accuracy: float = ACCURACY
) -> tuple[ArcPath, float]:
    """Return as few biarcs as an accuracy in m allows, and their deviation.

    ``over``: from the ends of a span to its biarc and the deviation of that; ``phi``: nodes along the edge.
    """
    share = np.arange(_REFINE) / _REFINE
    grid = np.append((phi[:-1, None] + share * np.diff(phi)[:, None]).ravel(), phi[-1])
    pieces: list[ArcPath] = []
    worst, at = 0.0, 0
    while at < len(grid) - 1:
        # The longest span that is accurate: first by doubling, then by halves.
        good, bad, step = at + 1, len(grid), 2
        piece, deviation = over(grid[at], grid[good])
        while good + 1 < bad:
            tried = min(at + step, len(grid) - 1) if bad == len(grid) else (good + bad) // 2
            candidate, error = over(grid[at], grid[tried])
            if error <= accuracy:
                good, piece, deviation = tried, candidate, error
            else:
                bad = tried
            step *= 2
        pieces.append(piece)
        worst, at = max(worst, deviation), good
    return joined(*pieces), worst


def _run_out_end(contour: Contour, over_travel: float) -> float:
    """Return φ at which the cable touches the run-out when the cam has turned on by the over-travel."""
    phi, radius = float(contour.directions[-1]), float(contour.radii_of_curvature[-1])
    p, slope, anchor = float(contour.lever_arms[-1]), float(contour.slopes[-1]), contour.anchor_distance
    steps = np.linspace(0.0, min(math.pi, 4.0 * over_travel + 0.2), 2001)
    arms = radius + (p - radius) * np.cos(steps) + slope * np.sin(steps)
    slopes = -(p - radius) * np.sin(steps) + slope * np.cos(steps)
    free = arms**2 + slopes**2 < anchor**2 if math.isfinite(anchor) else np.full(len(steps), True)
    ratio = np.clip(arms / anchor, -1.0, 1.0)
    turned = steps - np.arcsin(ratio) + math.asin(p / anchor)
    reached = np.flatnonzero(turned >= over_travel)
    if over_travel == 0.0:
        return phi
    if not len(reached) or not np.all(free[: reached[0] + 1]):
        raise ValueRangeError(
            f"over-travel of {math.degrees(over_travel):.3g}°",
            "the run-out reaches the anchor before that angle",
            next_step="take a smaller over_travel or a larger anchor distance",
        )
    end = int(reached[0])
    return phi + float(np.interp(over_travel, turned[end - 1 : end + 1], steps[end - 1 : end + 1]))


def two_sided_outlines(lips: Lips, numbers: Mapping[str, Quantity]) -> tuple[ArcPath, ArcPath]:
    """Return the lower and the upper half, each closed and clockwise.

    ``lips``: under the cable at positive and at negative angles. Turned by half a turn the halves are alike.
    """
    wall = -numbers["channel_width"].number / 2.0
    seat = [_seat(numbers["ferrule_seat"].number / 2.0, -wall)] if "ferrule_seat" in numbers else []
    taken = float(seat[0].points[-1][0]) if seat else 0.0
    reliefs = []
    for lip in lips:
        mouth = lip.path.points[0]
        relief = _relief(mouth, lip.first_direction, wall, numbers["tool_radius"].number)
        if relief.points[0][0] < taken:
            raise ValueRangeError(
                f"channel, {MM * float(mouth[0]):.4g} mm from the axis to its mouth",
                f"needs {MM * (float(mouth[0] - relief.points[0][0]) + taken):.4g} mm for its relief"
                + (" and the ferrule" if seat else ""),
                next_step="take a smaller channel_clearance or ferrule, or a contour that begins farther out",
            )
        reliefs.append(relief)
    (front, back), (right, left) = lips, reliefs
    around = back_of(lips, numbers)
    lower = joined(
        front.path, around, back.path.mirrored(), left.mirrored(), *seat, right, closed=True
    )  # fmt: skip
    return lower, lower.turned(math.pi)


def back_of(lips: Lips, numbers: Mapping[str, Quantity]) -> ArcPath:
    """Return the back from the end of one lip to that of the other, mirrored: round ends, and the body."""
    for lip in lips:
        if lip.last_direction >= math.pi:
            ends = f"{math.degrees(lip.last_direction):.4g}°"
            raise ValueRangeError(
                "run-out", f"the lip ends at the direction {ends}, beyond 180°",
                next_step="take a smaller over_travel",
            )  # fmt: skip
    end, (across, radius) = (_end_circle(lip, numbers) for lip in lips)
    circles = [end, (np.zeros(2), numbers["body_radius"].number), (across * [-1.0, 1.0], radius)]
    return _back(circles, lips[0].last_direction, 2.0 * math.pi - lips[1].last_direction)


def one_sided_outline(lip: LipEdge, numbers: Mapping[str, Quantity]) -> ArcPath:
    """Return the outline of a one-sided cam, closed and clockwise."""
    phi, corner = lip.first_direction, numbers["corner_radius"].number
    along = np.array([math.cos(phi), -math.sin(phi)])
    start = lip.path.points[0] - numbers["lead_in"].number * along
    entry = (start - corner * np.array([math.sin(phi), math.cos(phi)]), corner)
    body = (np.zeros(2), numbers["body_radius"].number)
    if lip.last_direction >= phi + 2.0 * math.pi:
        raise ArrangementError(
            "run-out",
            "the edge would go round the axis more than once",
            next_step="take a smaller over_travel",
        )
    back = _back([_end_circle(lip, numbers), body, entry], lip.last_direction, phi + 2.0 * math.pi)
    lead = line(start, lip.path.points[0])
    if "ferrule_seat" in numbers:
        radius, wall = numbers["ferrule_seat"].number / 2.0, numbers["minimum_wall"].number
        seat = _seat(radius, numbers["cable_radius"].number)
        middle = start + (radius + wall) * along
        placed = ArcPath(seat.points - [0.0, seat.points[0][1]], seat.bulges).turned(-phi)
        lead = joined(line(start, start), ArcPath(placed.points + middle, placed.bulges),
                      line(lip.path.points[0], lip.path.points[0]))  # fmt: skip
    return joined(lip.path, back, lead, closed=True)


def _end_circle(lip: LipEdge, numbers: Mapping[str, Quantity]) -> tuple[Array, float]:
    radius = numbers["corner_radius"].number
    normal = np.array([math.sin(lip.last_direction), math.cos(lip.last_direction)])
    return lip.path.points[-1] - radius * normal, radius


def _back(circles: list[tuple[Array, float]], first: float, last: float) -> ArcPath:
    """Return the convex cover, clockwise, from one direction of the normal to another.

    The middle circle is left out where the line between the others covers it.
    """
    one, body, other = circles
    into, out = _joining(one, body, first), _joining(body, other, first)
    straight = _joining(one, other, first)
    if straight is not None and (into is None or out is None or into >= straight):
        pieces = [(one, first, straight), (other, straight, last)]
    elif into is not None and out is not None and into <= out <= last:
        pieces = [(one, first, into), (body, into, out), (other, out, last)]
    else:
        raise ArrangementError(
            f"body of radius {MM * body[1]:.4g} mm",
            "has no convex back together with the ends of the edge",
            next_step="take a smaller over_travel or body_radius, or a shorter lead_in",
        )
    return joined(*(clockwise_arc(centre, size, first=a, last=b) for (centre, size), a, b in pieces))


def _joining(one: tuple[Array, float], other: tuple[Array, float], after: float) -> float | None:
    """Return the direction of the normal of the common outer tangent from one circle to another."""
    step, growth = other[0] - one[0], one[1] - other[1]
    size = math.hypot(*step)
    if size <= abs(growth):
        return None
    direction = math.atan2(-step[1], step[0]) + math.asin(growth / size)
    return after + (direction - after) % (2.0 * math.pi)


def _relief(mouth: Array, direction: float, wall: float, tool_radius: float) -> ArcPath:
    """Return the edge from the wall of the channel up to its mouth: two arcs the tool can cut."""
    depth = float(mouth[1]) - wall
    if depth < 1e-9:
        return line(mouth)
    radius = max(tool_radius, depth)
    start = mouth - [math.sqrt(4.0 * radius * depth - depth**2), depth]
    tangent = np.array([math.cos(direction), -math.sin(direction)])
    return biarc(start, mouth, first=np.array([1.0, 0.0]), last=tangent)


def _seat(radius: float, depth: float) -> ArcPath:
    """Return the pocket of a ferrule about the origin, below a wall at −depth, from left to right."""
    if radius <= depth:
        raise ValueRangeError(
            f"ferrule seat of {MM * 2 * radius:.4g} mm",
            f"is no wider than the channel, {MM * 2 * depth:.4g} mm",
            next_step="give the diameter of the ferrule",
        )
    half = math.sqrt(radius**2 - depth**2)
    sweep = 2.0 * math.acos(depth / radius)
    return ArcPath(np.array([[-half, -depth], [half, -depth]]), np.array([math.tan(sweep / 4.0), 0.0]))
