"""The moving picture of a cam: one frame per angle, as lengths and paths for an SVG."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.quantity import MM
from .cam_motion import CamMotion
from .number_text import significant
from .style import BLUE, VERMILLION, described, panels, styled

_POINTS = 24
"""Half the number of points above which a lip or the cable along it is drawn with fewer points."""
MARKER = "now"
"""Identifier of the marker in the torque curve."""


@dataclass(frozen=True, eq=False)
class CamPicture:
    """A cam as lengths in mm, y upwards, and the frames of its motion.

    Parameters
    ----------
    halves
        Outlines of the lower and upper half at angle zero as SVG paths.
    width, height
        Half the width and height of the picture.
    wall
        Distance of the rubber's resting end from the centre.
    frames
        One for each angle: numbers and paths by name, see :func:`cam_picture`.
    start
        Number of the frame that is shown first.
    curve
        Torque over angle with a marker named :data:`MARKER` at the first frame.
    """

    halves: tuple[str, str]
    width: float
    height: float
    wall: float
    frames: tuple[dict[str, Any], ...]
    start: int
    curve: Figure


def cam_picture(motion: CamMotion, *, start: float | None = None) -> CamPicture:
    """Return the moving picture of a cam.

    A frame holds ``angle`` (degrees); for the right-hand side ``cable`` (path from the centre to the rubber),
    ``contact``, ``guide`` and ``foot`` of the lever arm (points) and ``rubber`` (x, y, width, height), the
    left-hand side being the same turned by half a turn; ``marker`` (shift of the marker in the torque curve,
    in points); and ``words``: lever arm, extension, force and torque with units.

    ``start``: angle in rad that is shown first; 60 % of the range by default.
    """
    first = motion.nearest(0.6 * float(motion.angles[-1]) if start is None else start)
    curve = torque_curve(motion, at=first)
    places = _places(curve, motion)
    frames = tuple(_frame(motion, i, places[i] - places[first]) for i in range(len(motion.angles)))
    tallest = max(float(np.max(motion.contour.radii)), 6.5e-3)
    lower, upper = motion.halves
    return CamPicture(
        halves=(_path(_reduced(lower) * MM) + " Z", _path(_reduced(upper) * MM) + " Z"),
        width=motion.wall * MM + 2.0,
        height=tallest * MM + 1.5,
        wall=motion.wall * MM,
        frames=frames,
        start=first,
        curve=curve,
    )


@styled
def torque_curve(motion: CamMotion, *, at: int) -> Figure:
    """Draw the torque over the angle with a marker.

    Parameters
    ----------
    motion
        Cam over its range.
    at
        Number of the angle that is marked.
    """
    figure, (axes,) = panels(width=4.0, height=2.5)
    degrees = np.degrees(motion.angles)
    axes.plot(degrees, motion.torques, color=BLUE.light)
    axes.plot(
        [degrees[at]], [motion.torques[at]], marker="o", color=VERMILLION.light, markersize=7, gid=MARKER
    )
    axes.margins(x=0.03)
    axes.set_xlabel("angle in degrees")
    axes.set_ylabel("torque in N·m")
    top = significant(float(np.max(motion.torques)))
    return described(
        figure,
        f"Torque over the angle from {degrees[0]:.0f}° to {degrees[-1]:.0f}°, up to {top} N·m, one marked.",
    )


def _places(curve: Figure, motion: CamMotion) -> Array:
    """Return where the marker stands at each angle, in points of the SVG, y downwards."""
    curve.draw_without_rendering()
    pixels = curve.axes[0].transData.transform(np.column_stack([np.degrees(motion.angles), motion.torques]))
    places: Array = pixels * [1.0, -1.0] * 72.0 / curve.dpi
    return places


def _frame(motion: CamMotion, index: int, shift: Array) -> dict[str, Any]:
    cable = motion.cable(index)
    wrapped, contact, guide = cable[:-2], cable[-2], cable[-1]
    along = (guide - contact) / float(np.hypot(*(guide - contact)))
    foot = contact - along * float(contact @ along)
    length, height = motion.rubber(index)
    clamp = np.array([motion.wall - length, guide[1]])
    whole = np.vstack([_reduced(wrapped), contact, guide, clamp])
    return {
        "angle": round(float(np.degrees(motion.angles[index])), 1),
        "cable": _path(whole * MM),
        "contact": _rounded(contact * MM),
        "foot": _rounded(foot * MM),
        "guide": _rounded(guide * MM),
        "rubber": _rounded(np.array([clamp[0], guide[1] - height / 2, length, height]) * MM),
        "marker": _rounded(shift),
        "words": {
            "lever arm": f"{MM * abs(motion.lever_arms[index]):.2f} mm",
            "extension": f"{MM * motion.extensions[index]:.2f} mm",
            "force": f"{motion.forces[index]:.1f} N",
            "torque": f"{motion.torques[index]:.2f} N·m".replace("-", "−"),
        },
    }


def _reduced(points: Array) -> Array:
    """Return at most 96 of the points, including the first and the last."""
    if len(points) <= 2 * _POINTS + 1:
        return points
    kept = np.unique(np.round(np.linspace(0, len(points) - 1, 4 * _POINTS)).astype(int))
    result: Array = points[kept]
    return result


def _path(points: Array) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points)


def _rounded(values: Array) -> list[float]:
    return [round(float(value), 2) + 0.0 for value in values]
