"""Edges rolled over by a circle, and followers in balance, by other code than that of the package."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from nlsdesign.components import RollerCam
from nlsdesign.foundation.arrays import Array


def way_of(cam: RollerCam) -> BSpline:
    """The lever arm of a declared cam over the angle on its side, as a spline of scipy."""
    row = np.array(cam.lever_arm.values)
    step = cam.last_angle.number / (len(row) - 3)
    return BSpline(step * np.arange(-3, len(row) + 1), row, 3)


def rolled_over(points: Array, radius: float, angle: float) -> tuple[float, float]:
    """Height above the axis at which a circle lies on points turned anticlockwise, and its lever arm.

    The normal at the point of contact leads to the centre; the force along the y axis has the moment that
    its part along the normal has about the axis.
    """
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y = cosine * points[:, 0] - sine * points[:, 1], sine * points[:, 0] + cosine * points[:, 1]
    below = (np.abs(x) < radius) & (y > -radius)
    heights = y[below] + np.sqrt(radius**2 - x[below] ** 2)
    first = int(np.argmax(heights))
    away = float(x[below][first])
    return float(heights[first]), float(heights[first]) * away / math.sqrt(radius**2 - away**2)


@dataclass(frozen=True)
class Balance:
    """Forces on a roller that is moved along a guide with dry friction, and the torque on its cam."""

    contact: float  # along the normal, in N
    side: float  # on the guide, in N
    torque: float  # in N·m


def balance(centre: Array, normal: Array, radius: float, pressed: float, friction: float) -> Balance:
    """Solve the balance of a follower on the y axis: ΣFx = 0, ΣFy = 0, friction = µ·|side| on top.

    ``friction``: positive where the follower is lifted, negative where it is let down.
    """
    # N·n_x + S = 0 and N·n_y − F − µ·|S| = 0, the sign of S known from the first.
    sign = -math.copysign(1.0, float(normal[0])) if normal[0] else 1.0
    matrix = np.array([[normal[0], 1.0], [normal[1], -friction * sign]])
    contact, side = np.linalg.solve(matrix, np.array([0.0, pressed]))
    touched = centre - radius * normal
    # The cam pushes the roller along n, so the roller pushes the cam along −n, at the point of contact.
    force = -contact * normal
    torque = touched[0] * force[1] - touched[1] * force[0]
    return Balance(float(contact), float(side), float(torque))
