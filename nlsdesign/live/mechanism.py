"""Cam, cable and rubber in the plane, to scale."""

from __future__ import annotations

import numpy as np

from ..design import Contour
from ..design.statics.contour import turn
from ..foundation.arrays import Array
from .answers import Mechanism

_CLEARANCE = 3e-3
"""Least distance in m between guide and clamp of the rubber, so that both can be seen."""
_THICKNESS = 6e-3
"""Drawn height in m of unstretched rubber whose width is not to scale."""
_REACH = 2.5
"""A guide further away than this many radii of the cam is drawn there."""


def mechanism_at(
    contour: Contour, angle: float, *, extensions: tuple[float, float, float], rest_length: float
) -> Mechanism:
    """Return the mechanism at one angle.

    ``contour``: of the cam; a finite anchor for a cable through the centre.
    """
    both = bool(np.isfinite(contour.anchor_distance))
    angle = float(np.clip(angle, -contour.angles[-1] if both else 0.0, contour.angles[-1]))
    radius = max(float(np.max(contour.radii)), 1e-3)
    guide = min(contour.anchor_distance, _REACH * radius)
    shown = min(rest_length + extensions[0], guide)
    wall = guide + _CLEARANCE + extensions[2] - extensions[0] + shown
    line, contact, end = _cable(contour, angle, guide, both)
    clamp = np.array([wall - shown - (extensions[1] - extensions[0]), end[1]])
    half = 0.5 * _THICKNESS * float(np.sqrt(rest_length / max(rest_length + extensions[1], 1e-6)))
    up = np.array([0.0, half])
    corners = np.array([clamp + up, [wall, end[1] + half], [wall, end[1] - half], clamp - up])
    cable = np.vstack([line, clamp])
    sides = (1.0, -1.0) if both else (1.0,)
    outlines = contour.outlines(angle) if both else (_one_lip(contour, angle),)
    short = "; the rubber is drawn shorter than it is" if shown < rest_length + extensions[0] else ""
    return Mechanism(
        angle=angle,
        halves=tuple(outlines),
        cables=tuple(side * cable for side in sides),
        contacts=tuple(side * contact for side in sides),
        guides=tuple(side * end for side in sides),
        rubbers=tuple(side * corners for side in sides),
        extent=(wall + 2e-3, radius + _THICKNESS),
        remark="extension, cam and cable are to scale, the height of the rubber is not" + short,
    )


def _cable(contour: Contour, angle: float, guide: float, both: bool) -> tuple[Array, Array, Array]:
    """Return the line of the cable up to its guide, its contact point and the guide."""
    touched = contour.points[contour.angles < abs(angle)]
    side = np.array([1.0, -1.0 if angle < 0.0 else 1.0])
    contact, anchor = contour.cable(angle)
    share = min(1.0, (guide - contact[0]) / (anchor[0] - contact[0]))
    end = contact + share * (anchor - contact)
    begin = np.zeros((1, 2)) if both else np.zeros((0, 2))
    wrapped = turn(np.vstack([begin, touched]) * side, angle)
    return np.vstack([wrapped, contact, end]), contact, end


def _one_lip(contour: Contour, angle: float) -> Array:
    """Return the sector between the lip and the centre, closed, in the resting frame."""
    points = contour.points
    result: Array = turn(np.vstack([[0.0, 0.0], points, [0.0, 0.0]]), angle)
    return result
