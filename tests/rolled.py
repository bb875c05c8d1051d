"""Edges rolled over by a circle or an edge, and followers in balance, by other code than the package."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline
from scipy.optimize import brentq

from nlsdesign.components import RollerCam, RollingPair
from nlsdesign.foundation.arrays import Array


def way_of(cam: RollerCam | RollingPair) -> BSpline:
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


def laid_on(outline: Array, radius: float, angle: float) -> tuple[float, float]:
    """Height on the y axis at which a circle lies on a closed clockwise outline of arcs, and its lever arm.

    The outline, shape (n, 3), is turned anticlockwise. The circle's centre lies on an arc about the same
    centre, larger or smaller by the radius, from which the normal leads to it.
    """
    upwards, place = 1j * np.exp(-1j * angle), outline[:, :2] @ [1.0, 1.0j]
    curved = outline[:, 2] != 0.0
    chords, sweeps = (np.roll(place, -1) - place)[curved], 4.0 * np.arctan(outline[curved, 2])
    along, sizes = chords / np.abs(chords), np.abs(chords) / 2.0 / np.sin(sweeps / 2.0)
    centres = place[curved] + chords / 2.0 + 1j * along * sizes * np.cos(sweeps / 2.0)
    found = []
    for side in (1.0, -1.0):
        across = np.conj(upwards) * centres
        with np.errstate(invalid="ignore"):
            heights = across.real + side * np.sqrt((sizes - radius) ** 2 - across.imag**2)
        normals = (centres - heights * upwards) / (sizes - radius)
        turned = np.angle(normals / (1j * along * np.exp(-0.5j * sweeps))) * np.sign(sweeps)
        on_it = (turned > -1e-5) & (turned < np.abs(sweeps) + 1e-5)
        found += list(zip(heights[on_it], np.angle(normals[on_it] / upwards), strict=True))
    height, leaning = max(found)
    return float(height), float(height * math.tan(leaning))


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


@dataclass(frozen=True)
class Rolled:
    """Where a profile has got to that rolls on another over equal arcs, in the frame of that."""

    angles: Array  # by which it has turned
    distances: Array  # of its axis from that of the first
    arms: Array  # of the line through both axes about the contact


Curve = Callable[[Array], tuple[Array, Array]]
"""From arcs to points and unit tangents, as complex numbers; an arc of zero is the middle of an edge."""


def through_points(points: Array) -> Curve:
    """Return the curve through points from left to right, by a spline over the chords."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    spline = make_interp_spline(arc - np.interp(0.0, points[:, 0], arc), points @ [1.0, 1.0j], k=3)
    return lambda at: (spline(at), spline(at, 1) / np.abs(spline(at, 1)))


def along_edge(outline: Array) -> Curve:
    """Return the curve along a closed clockwise outline, shape (n, 3), from where it crosses x = 0 above."""
    place, sweeps = outline[:, :2] @ [1.0, 1.0j], 4.0 * np.arctan(outline[:, 2])
    chords = np.roll(place, -1) - place
    lengths = np.abs(chords) / np.sinc(sweeps / 2.0 / np.pi)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])

    def at_arc(arcs: Array) -> tuple[Array, Array]:
        which = np.clip(np.searchsorted(ends, arcs % ends[-1], side="right") - 1, 0, len(chords) - 1)
        share, sweep, chord = (arcs % ends[-1] - ends[which]) / lengths[which], sweeps[which], chords[which]
        # In a circle the chord to the share s of the sweep has the bearing s·sweep/2 against the tangent.
        grown = share * np.sinc(share * sweep / 2.0 / np.pi) / np.sinc(sweep / 2.0 / np.pi)
        points = place[which] + chord * grown * np.exp(0.5j * (share - 1.0) * sweep)
        return points, chord / np.abs(chord) * np.exp(1j * (share - 0.5) * sweep)

    dense = np.linspace(0.0, ends[-1], 20001)
    points = at_arc(dense)[0]
    (above,) = np.flatnonzero((points.imag[:-1] > 0.0) & (points.real[:-1] < 0.0) & (points.real[1:] >= 0.0))
    middle = brentq(lambda arc: float(at_arc(np.array([arc]))[0].real[0]), *dense[above : above + 2])
    return lambda at: at_arc(np.asarray(at) + middle)


def rolled_on(first: Curve, second: Curve, arcs: Array) -> Rolled:
    """Roll the second of two edges on the first without slip, from the middle of both.

    Contact is where the arcs from the middle are equal, one ahead and one back; there the points meet and the
    tangents are opposite.
    """
    (touched, ahead), (met, back) = first(arcs), second(-arcs)
    turned = np.unwrap(np.angle(-ahead / back))
    axis = touched - np.exp(1j * turned) * met
    return Rolled(turned - turned[0], np.abs(axis), (np.conj(axis / np.abs(axis)) * touched).imag)
