"""The edge under the cable: offset of the contour by the radius of the cable, and its run-out, as arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import MM
from ..statics.contour import Contour
from .arc_path import ArcPath, biarc, clockwise_arc, joined

ACCURACY = 0.5e-6
"""Largest distance between the arcs and the contour in m."""

_REFINE = 4
_CHECKED = 33


@dataclass(frozen=True, eq=False)
class LipEdge:
    """Edge under the cable from the channel to the end of the run-out, clockwise, as arcs.

    Parameters
    ----------
    path
        Open path in the frame of the cam, in m.
    deviation
        Largest distance between the arcs and the contour less the radius of the cable, in m.
    first_direction, last_direction
        φ at both ends in rad: the outward normal is (sin φ, cos φ).
    last_support
        Distance of the last tangent from the centre in m.
    """

    path: ArcPath
    deviation: float
    first_direction: float
    last_direction: float
    last_support: float


def lip_edge(contour: Contour, cable_radius: float, *, over_travel: float) -> LipEdge:
    """Return the edge on which a cable has its centre line on the contour.

    Beyond the last angle the edge goes on as an arc with the last radius of curvature.
    """
    _check_curvature(contour, cable_radius)
    phi = contour.directions
    support = BPoly.from_derivatives(
        phi,
        np.column_stack(
            [contour.lever_arms, contour.slopes, contour.radii_of_curvature - contour.lever_arms]
        ),
    )
    path, deviation = _arcs(support, phi, cable_radius)
    last = _run_out_end(contour, over_travel)
    radius = float(contour.radii_of_curvature[-1])
    centre = contour.points[-1] - radius * _normal(phi[-1])
    run_out = clockwise_arc(centre, radius - cable_radius, first=float(phi[-1]), last=last)
    return LipEdge(
        joined(path, run_out) if last > phi[-1] else path,
        deviation,
        float(phi[0]),
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
            next_step="design with MinimumRadiusOfCurvature above the cable's radius",
        )
    if radii[index] < cable_radius + ACCURACY:
        raise ValueRangeError(
            f"cable radius {MM * cable_radius:g} mm",
            f"the cable is thicker than the sharpest radius under its centre line, "
            f"{MM * radii[index]:.4g} mm {place}",
            next_step="take a thinner cable or a larger MinimumRadiusOfCurvature",
        )


def _point(support: BPoly, direction: float, cable_radius: float) -> Array:
    p, slope = float(support(direction)), float(support(direction, 1))
    result: Array = (p - cable_radius) * _normal(direction) + slope * _tangent(direction)
    return result


def _arcs(support: BPoly, phi: Array, cable_radius: float) -> tuple[ArcPath, float]:
    """Return as few biarcs as the accuracy allows, and their deviation."""
    share = np.arange(_REFINE) / _REFINE
    grid = np.append((phi[:-1, None] + share * np.diff(phi)[:, None]).ravel(), phi[-1])
    pieces: list[ArcPath] = []
    worst, at = 0.0, 0
    while at < len(grid) - 1:
        # The longest span that is accurate: first by doubling, then by halves.
        good, bad, step = at + 1, len(grid), 2
        piece, deviation = _biarc_over(support, grid[at], grid[good], cable_radius)
        while good + 1 < bad:
            tried = min(at + step, len(grid) - 1) if bad == len(grid) else (good + bad) // 2
            candidate, error = _biarc_over(support, grid[at], grid[tried], cable_radius)
            if error <= ACCURACY:
                good, piece, deviation = tried, candidate, error
            else:
                bad = tried
            step *= 2
        pieces.append(piece)
        worst, at = max(worst, deviation), good
    return joined(*pieces), worst


def _biarc_over(support: BPoly, first: float, last: float, cable_radius: float) -> tuple[ArcPath, float]:
    start, end = (_point(support, direction, cable_radius) for direction in (first, last))
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
