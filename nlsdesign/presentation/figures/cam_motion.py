"""Cam, cable, rubber and contact point over the angle, still and as one frame per angle.

Cam, roller and follower of a finished design, to scale.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc

from ...design import CamDesign, Contour, elastic_law
from ...design.statics.contour import RollerContour, RollingContour, cable_up_to, turn
from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import MM, typeset_number
from ...foundation.written_numbers import prefixed
from ...model import FlatModel
from .style import (
    BLUE,
    GREEN,
    GRID,
    INK,
    MUTED,
    ORANGE,
    SURFACE,
    VERMILLION,
    WIDTH,
    described,
    panels,
    styled,
)

_CLEARANCE = 3e-3
"""Smallest distance in m between guide and cable clamp, so that both can be seen."""
_THICKNESS = 9e-3
"""Drawn height in m of unstretched rubber; it falls with the square root of the stretch."""


@dataclass(frozen=True, eq=False)
class CamMotion:
    """A cam with cable and rubber at a row of angles; arrays of shape (n,), in SI."""

    contour: Contour  # lower right lip; the other three are its mirror images
    angles: Array  # cam angles in rad, ascending, within the contour on both sides
    extensions: Array  # extension of one element since angle zero in m
    forces: Array  # force of one element in N
    torques: Array  # torque of the spring in N·m
    rest_length: float  # length of the rubber without force in m
    pretension: float = 0.0  # extension in m at angle zero

    def __post_init__(self) -> None:
        rows = (self.angles, self.extensions, self.forces, self.torques)
        if (
            any(row.shape != self.angles.shape for row in rows)
            or self.angles.ndim != 1
            or not len(self.angles)
        ):
            raise ValueRangeError(
                f"motion of a cam with {[row.shape for row in rows]} samples",
                "needs one extension, force and torque for each angle",
            )

    @property
    def lever_arms(self) -> Array:
        """Lever arm in m at each angle; odd like the torque."""
        arms = np.interp(np.abs(self.angles), self.contour.angles, self.contour.lever_arms)
        return np.sign(self.angles) * arms

    @property
    def guide(self) -> float:
        """Distance in m from the centre at which the end of the free cable is drawn.

        That is the anchor, at most 2.5 times the largest radius of the cam.
        """
        return float(min(self.contour.anchor_distance, max(2.5 * float(np.max(self.contour.radii)), 1e-3)))

    @property
    def wall(self) -> float:
        """Distance in m from the centre at which the resting end of the rubber is drawn."""
        return self.guide + _CLEARANCE + float(np.max(self.extensions)) + self._shown_length

    @property
    def warning(self) -> str:
        """Message where the lips are concave and cannot be made; empty where they are convex."""
        rho = self.contour.radii_of_curvature
        if float(np.min(rho)) >= 0.0:
            return ""
        concave = np.degrees(self.contour.angles[rho < 0.0])
        return (
            f"The lips are concave between {concave[0]:.1f}° and {concave[-1]:.1f}°: there the radius of "
            f"curvature is negative (down to −{-MM * float(np.min(rho)):.1f} mm) and the curve may cross "
            "itself. A cable cannot follow it, so this cam cannot be made as drawn; the torque is that of "
            "the law, not of such a cam."
        )

    @property
    def halves(self) -> tuple[Array, Array]:
        """Lower and upper half of the cam at angle zero, closed polygons, also where a lip is not convex."""
        right = self.contour.points
        lower = np.vstack([right[::-1] * [-1.0, 1.0], right, right[-1:] * [-1.0, 1.0]])
        return lower, -lower

    def rubber(self, index: int) -> tuple[float, float]:
        """Return length and height in m at which the rubber is drawn; its extension is to scale."""
        length = self.rest_length + self.pretension + float(self.extensions[index])
        shown = self._shown_length + float(self.extensions[index])
        return shown, _THICKNESS * float(np.sqrt(self.rest_length / length))

    @property
    def _shown_length(self) -> float:
        """Length in m of the rubber drawn at angle zero; long rubber is cut off."""
        return min(self.rest_length + self.pretension, self.guide)

    def nearest(self, angle: float) -> int:
        """Return the number of the sampled angle that is nearest to an angle in rad."""
        return int(np.argmin(np.abs(self.angles - angle)))

    def cable(self, index: int) -> Array:
        """Return the right-hand cable from the centre of the cam, through the channel and over the lip.

        The left-hand cable is the same turned by half a turn. Shape (n, 2) in m; the last point but one is
        the contact point, the last lies at the guide.
        """
        return cable_up_to(self.contour, float(self.angles[index]), self.guide, from_centre=True)


def cam_motion(
    contour: Contour,
    force: Callable[[Array], Array],
    *,
    elements: float = 2.0,
    rest_length: float,
    pretension: float = 0.0,
    count: int = 121,
) -> CamMotion:
    """Move a cam through its whole range, to both sides, with all relaxation at rest.

    The extension is the integral of the lever arm, the torque N·h·F.
    """
    last = float(contour.angles[-1])
    angles = np.linspace(-last, last, count | 1)
    steps = np.diff(contour.angles) * (contour.lever_arms[1:] + contour.lever_arms[:-1]) / 2
    extension = np.interp(np.abs(angles), contour.angles, np.concatenate([[0.0], np.cumsum(steps)]))
    forces = np.asarray(force(extension + pretension), dtype=float)
    arms = np.sign(angles) * np.interp(np.abs(angles), contour.angles, contour.lever_arms)
    return CamMotion(contour, angles, extension, forces, elements * arms * forces, rest_length, pretension)


def cam_motion_of(
    model: FlatModel, contour: Contour, *, spring: str | None = None, count: int = 121
) -> CamMotion:
    """Move the cam of a flat model, with the equilibrium law of the element behind it.

    Parameters
    ----------
    model
        Flat model of the actuator.
    contour
        Lower right lip of its cam, for instance from ``contour_of_cam`` or a finished design.
    spring
        Path of the cam spring; decided from the structure if it is left out.
    count
        Number of angles.

    Raises
    ------
    UnknownNameError
        If there is no cam spring of that name.
    ArrangementError
        If the structure does not say which spring is meant.
    """
    law, values = elastic_law(model, spring), model.values
    lengths = [values[name] for name in law.cam.lengths]
    return cam_motion(
        contour,
        law.force,
        elements=values[law.cam.elements],
        pretension=values[law.cam.pretension],
        rest_length=lengths[0] if lengths else 2.0 * float(np.max(contour.radii)),
        count=count,
    )


@styled
def cam_positions(motion: CamMotion, *, angles: Sequence[float] | None = None) -> Figure:
    """Draw the cam at some angles: cable, contact point, lever arm and rubber.

    Parameters
    ----------
    motion
        Cam over its range.
    angles
        In rad; by default zero, a third, two thirds and all of the range.
    """
    last = float(motion.angles[-1])
    shown_angles = list(angles) if angles is not None else [0.0, last / 3, 2 * last / 3, last]
    columns = min(2, len(shown_angles))
    rows = (len(shown_angles) + 1) // 2
    tall = float(np.max(motion.contour.radii)) / motion.wall * WIDTH / columns
    figure, axes = panels(rows, columns, height=0.4 + (0.5 + tall) * rows, sharex=True, sharey=True)
    for panel, angle in zip(axes, shown_angles, strict=False):
        _draw(panel, motion, motion.nearest(angle))
    for panel in axes[len(shown_angles) :]:
        panel.set_visible(False)
    figure.supxlabel("distance from the centre in mm", fontsize=9)
    shown = ", ".join(f"{np.degrees(a):.0f}°" for a in shown_angles)
    return described(
        figure,
        f"The cam at {shown}: the cable runs from the cam's centre over its lip to a guide on either side "
        f"and stretches the rubber behind it by {MM * float(np.max(motion.extensions)):.1f} mm at most.",
    )


def _draw(axes: Axes, motion: CamMotion, index: int) -> None:
    for half in motion.halves:
        axes.fill(
            *(turn(half, float(motion.angles[index])) * MM).T,
            facecolor=GRID.light,
            edgecolor=MUTED.light,
            linewidth=0.8,
        )
    cable = motion.cable(index) * MM
    length, height = (item * MM for item in motion.rubber(index))
    wall, y = motion.wall * MM, cable[-1, 1]
    for side in (1.0, -1.0):
        end = np.vstack([cable, [[wall - length, y]]]) * side
        axes.plot(*end.T, color=BLUE.light, linewidth=1.4)
        axes.fill(
            side * np.array([wall - length, wall, wall, wall - length]),
            side * y + np.array([-0.5, -0.5, 0.5, 0.5]) * height,
            facecolor=ORANGE.light,
            alpha=0.85,
        )
        axes.plot([side * wall] * 2, [-6.5, 6.5], color=MUTED.light, linewidth=2.0)
        axes.plot([side * motion.guide * MM], [side * y], marker="o", color=MUTED.light, markersize=4)
        axes.plot(*(side * cable[-2]), marker="o", color=VERMILLION.light, markersize=5)
    contact, guide = cable[-2], cable[-1]
    along = (guide - contact) / float(np.hypot(*(guide - contact)))
    foot = contact - along * float(contact @ along)
    axes.plot([0.0, foot[0]], [0.0, foot[1]], color=GREEN.light, linewidth=1.4, linestyle=(0, (2, 1)))
    axes.plot([0], [0], marker="o", color=INK.light, markersize=4, markerfacecolor=SURFACE.light)
    degrees = float(np.degrees(motion.angles[index]))
    if abs(degrees) > 1.0:
        reach = 13.0
        axes.add_patch(Arc((0, 0), 2 * reach, 2 * reach, theta1=min(0, degrees), theta2=max(0, degrees),
                           edgecolor=MUTED.light, linewidth=0.8))  # fmt: skip
    axes.set_title(
        f"{degrees:.0f}°: lever arm {MM * motion.lever_arms[index]:.1f} mm, "
        f"{motion.forces[index]:.0f} N, {motion.torques[index]:.2f} N·m"
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.margins(0.02, 0.06)


_POINTS = 24
"""Half the number of points above which a lip or the cable along it is drawn with fewer points."""
MARKER = "now"
"""Identifier of the marker in the torque curve."""


@dataclass(frozen=True, eq=False)
class CamPicture:
    """A cam as lengths in mm, y upwards, and the frames of its motion."""

    halves: tuple[str, str]  # outlines of the lower and upper half at angle zero as SVG paths
    # width, height: half the width and height of the picture
    width: float
    height: float
    wall: float  # distance of the rubber's resting end from the centre
    frames: tuple[dict[str, Any], ...]  # one for each angle: numbers and paths by name, see cam_picture
    start: int  # number of the frame that is shown first
    curve: Figure  # torque over angle with a marker named MARKER at the first frame


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
    # Where the marker stands at each angle, in points of the SVG, y downwards.
    curve.draw_without_rendering()
    pixels = curve.axes[0].transData.transform(np.column_stack([np.degrees(motion.angles), motion.torques]))
    places: Array = pixels * [1.0, -1.0] * 72.0 / curve.dpi
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
    axes.set(xlabel="angle in degrees", ylabel="torque in N·m")
    top = typeset_number(float(np.max(motion.torques)))
    return described(
        figure,
        f"Torque over the angle from {degrees[0]:.0f}° to {degrees[-1]:.0f}°, up to {top} N·m, one marked.",
    )


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


def draw_rolling(axes: Axes, design: CamDesign, contour: RollingContour, angle: float) -> None:
    """Draw cam, what rolls on it and the line of both centres at an angle in rad into axes, in mm."""
    for polygon in contour.outlines(angle):
        axes.fill(*(polygon * MM).T, facecolor=GRID.light, edgecolor=MUTED.light, linewidth=0.8)
    way = np.vstack([contour.centre_line[:0:-1] * [-1.0, 1.0], contour.centre_line])
    axes.plot(
        *(turn(way, contour.turned(angle)) * MM).T, color=BLUE.light, linewidth=0.8, linestyle=(0, (5, 2))
    )
    touched, centre = contour.cable(angle) * MM
    for polygon in _rolls(contour, angle):
        axes.fill(*(polygon * MM).T, facecolor="none", edgecolor=BLUE.light, linewidth=1.4)
    axes.plot(*touched, marker="o", color=VERMILLION.light, markersize=4)
    end = MM * _reach(contour)
    axes.plot([0.0, 0.0], [0.0, end], color=INK.light, linewidth=0.8, linestyle=(0, (8, 2, 1, 2)))
    axes.plot([0, centre[0]], [0, centre[1]], "o", color=INK.light, markersize=4)
    axes.set_title(numbers_at(design, angle), fontsize=8.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)


def numbers_at(design: CamDesign, angle: float) -> str:
    """Return lever arm, force and torque at an angle in rad as text."""
    contour, curves, check = design.contour, design.curves, design.check
    arm = float(np.interp(angle, contour.angles, contour.lever_arms))
    force = float(np.interp(angle, curves.angles, curves.forces))
    torque = float(np.interp(angle, check.angles, check.torques))
    # Where the torque jumps, or begins within an onset, zero would contradict arm and force.
    begins = torque == 0.0 and abs(arm * force) > 1e-3 * design.target.largest
    words = "torque begins here" if begins else prefixed(torque)
    return f"{np.degrees(angle):.0f}°: arm {MM * arm:.1f} mm, {prefixed(force, 'N')}, {words}"


def _rolls(contour: RollingContour, angle: float) -> tuple[Array, ...]:
    """Return the outline in m of what rolls on a cam: a roller, or its mirror image at the common tangent."""
    _, centre = contour.cable(angle)
    if isinstance(contour, RollerContour):
        turned = np.linspace(0.0, 2.0 * np.pi, 73)
        return (centre + contour.roller_radius * np.column_stack([np.cos(turned), np.sin(turned)]),)
    return tuple(centre + polygon * [1.0, -1.0] for polygon in contour.outlines(angle))


def _reach(contour: RollingContour) -> float:
    """Return how far in m what rolls on a cam gets from its axis."""
    size = contour.roller_radius if isinstance(contour, RollerContour) else float(contour.radii.max())
    return float(contour.centre_radii.max()) + 1.3 * size


def rolling_picture(design: CamDesign, contour: RollingContour) -> Figure:
    """Draw cam and what rolls on it above each other at angle zero and at the last angle."""
    last = float(contour.angles[-1])
    reach = MM * _reach(contour)
    figure, axes = panels(2, 1, height=0.5 * WIDTH, sharex=True)
    for panel, angle in zip(axes, (0.0, last), strict=True):
        draw_rolling(panel, design, contour, angle)
        panel.set(xlim=(-reach, reach), ylim=(-1.1 * MM * float(contour.radii.max()), reach))
    axes[1].set_xlabel("distance from the axis in mm")
    what, more = "another that rolls on it", f"pivots {MM * contour.centre_radii[0]:.1f} mm apart at 0°"
    if isinstance(contour, RollerContour):
        steepest = float(np.degrees(np.abs(contour.pressure_angles).max()))
        what = "its roller"
        more = f"roller {MM * contour.roller_radius:.1f} mm, pressure angle up to {steepest:.0f}°"
    return described(
        figure,
        f"The designed cam with {what} at 0° and {np.degrees(last):.0f}°, to scale: radius "
        f"{MM * float(contour.radii.max()):.1f} mm, {more}.",
    )
