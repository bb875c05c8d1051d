"""Closed outlines of cams: the edge under the cable, round ends, the back, and the channel or the lead-in."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from .arc_path import ArcPath, biarc, clockwise_arc, joined, line
from .lip_edge import LipEdge


def two_sided_outlines(lip: LipEdge, numbers: Mapping[str, Quantity]) -> tuple[ArcPath, ArcPath]:
    """Return the lower and the upper half, each closed and clockwise."""
    end = _end_circle(lip, numbers)
    if lip.last_direction >= math.pi:
        raise ValueRangeError(
            "run-out", f"the lip ends at the direction {math.degrees(lip.last_direction):.4g}°, beyond 180°",
            next_step="take a smaller over_travel",
        )  # fmt: skip
    across = (end[0] * [-1.0, 1.0], end[1])
    back = _back([end, (np.zeros(2), numbers["body_radius"].number), across], lip.last_direction,
                 2.0 * math.pi - lip.last_direction)  # fmt: skip
    mouth, wall = lip.path.points[0], -numbers["channel_width"].number / 2.0
    relief = _relief(mouth, lip.first_direction, wall, numbers["tool_radius"].number)
    seat = [_seat(numbers["ferrule_seat"].number / 2.0, -wall)] if "ferrule_seat" in numbers else []
    taken = float(seat[0].points[-1][0]) if seat else 0.0
    if relief.points[0][0] < taken:
        raise ValueRangeError(
            f"channel, {MM * float(mouth[0]):.4g} mm from the axis to its mouth",
            f"needs {MM * (float(mouth[0] - relief.points[0][0]) + taken):.4g} mm for its relief"
            + (" and the ferrule" if seat else ""),
            next_step="take a smaller channel_clearance or ferrule, or a contour that begins farther out",
        )
    lower = joined(
        lip.path, back, lip.path.mirrored(), relief.mirrored(), *seat, relief, closed=True
    )  # fmt: skip
    return lower, lower.turned(math.pi)


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
