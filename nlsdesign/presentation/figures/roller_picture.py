"""Cam, roller and follower of a finished design, to scale."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...design import CamDesign
from ...design.statics.contour import turn
from ...design.statics.roller_contour import RollerContour
from ...foundation.quantity import MM
from .style import BLUE, GRID, INK, MUTED, VERMILLION, WIDTH, described, panels


def draw_roller(axes: Axes, design: CamDesign, contour: RollerContour, angle: float) -> None:
    """Draw cam, roller and the line of the follower at an angle in rad into axes, in mm."""
    for polygon in contour.outlines(angle):
        axes.fill(*(polygon * MM).T, facecolor=GRID.light, edgecolor=MUTED.light, linewidth=0.8)
    way = np.vstack([contour.centre_line[:0:-1] * [-1.0, 1.0], contour.centre_line])
    axes.plot(*(turn(way, angle) * MM).T, color=BLUE.light, linewidth=0.8, linestyle=(0, (5, 2)))
    touched, centre = contour.cable(angle) * MM
    size, turned = MM * contour.roller_radius, np.linspace(0.0, 2.0 * np.pi, 73)
    circle = centre[:, None] + size * np.array([np.cos(turned), np.sin(turned)])
    axes.fill(*circle, facecolor="none", edgecolor=BLUE.light, linewidth=1.4)
    axes.plot(*touched, marker="o", color=VERMILLION.light, markersize=4)
    axes.plot(
        [0.0, 0.0], [0.0, centre[1] + 2.5 * size], color=INK.light, linewidth=0.8, linestyle=(0, (8, 2, 1, 2))
    )
    axes.plot([0], [0], marker="o", color=INK.light, markersize=4)
    curves, check = design.curves, design.check
    numbers = (
        f"arm {MM * float(np.interp(angle, contour.angles, contour.lever_arms)):.1f} mm",
        f"{float(np.interp(angle, curves.angles, curves.forces)):.0f} N",
        f"{float(np.interp(angle, check.angles, check.torques)):.3g} N·m",
    )
    axes.set_title(f"{np.degrees(angle):.0f}°: {', '.join(numbers)}", fontsize=8.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)


def roller_picture(design: CamDesign, contour: RollerContour) -> Figure:
    """Draw cam and roller above each other at angle zero and at the last angle."""
    last = float(contour.angles[-1])
    reach = MM * (float(contour.centre_radii.max()) + 2.6 * contour.roller_radius)
    figure, axes = panels(2, 1, height=0.5 * WIDTH, sharex=True)
    for panel, angle in zip(axes, (0.0, last), strict=True):
        draw_roller(panel, design, contour, angle)
        panel.set(xlim=(-reach, reach), ylim=(-reach, reach))
    axes[1].set_xlabel("distance from the axis in mm")
    steepest = float(np.degrees(np.abs(contour.pressure_angles).max()))
    return described(
        figure,
        f"The designed cam with its roller at 0° and {np.degrees(last):.0f}°, to scale: radius "
        f"{MM * float(contour.radii.max()):.1f} mm, roller {MM * contour.roller_radius:.1f} mm, "
        f"pressure angle up to {steepest:.0f}°.",
    )
