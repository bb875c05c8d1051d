"""Curves of straight lines and circular arcs, as machines cut them and DXF holds them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...foundation.arrays import Array

_SAME = 1e-10


@dataclass(frozen=True, eq=False)
class ArcPath:
    """Points joined by arcs; b = tan(sweep/4) is the bulge of the arc from a point to the next.

    A bulge of zero is a straight line, a positive one an arc to the left (anticlockwise). From the last point
    of a closed path an arc leads to the first.
    """

    points: Array  # shape (n, 2), in m
    bulges: Array  # shape (n,); of an open path the last is not used
    closed: bool = False  # whether the path returns to its first point

    @cached_property
    def ends(self) -> tuple[Array, Array, Array]:
        """First points, last points and bulges of the arcs, shapes (m, 2), (m, 2) and (m,)."""
        count = len(self.points) if self.closed else len(self.points) - 1
        return self.points[:count], np.roll(self.points, -1, axis=0)[:count], self.bulges[:count]

    @cached_property
    def radii(self) -> Array:
        """Signed radii of the arcs in m, shape (m,): positive to the left, infinite for a line."""
        start, end, bulges = self.ends
        chords = np.hypot(*(end - start).T)
        with np.errstate(divide="ignore"):
            radii: Array = chords * (1.0 + bulges**2) / (4.0 * bulges)
        return radii

    @cached_property
    def centres(self) -> Array:
        """Centres of the arcs, shape (m, 2); not a number for a line."""
        start, end, bulges = self.ends
        left = (end - start)[:, ::-1] * [-1.0, 1.0]
        with np.errstate(divide="ignore", invalid="ignore"):
            result: Array = (start + end) / 2.0 + left * ((1.0 - bulges**2) / (4.0 * bulges))[:, None]
        return result

    @property
    def length(self) -> float:
        """Length in m."""
        start, end, bulges = self.ends
        chords, quarters = np.hypot(*(end - start).T), np.arctan(np.abs(bulges))
        # sweep·R / chord = 4a/(2·sin 2a) with tan a = bulge.
        return float(np.sum(chords * np.where(quarters > 0.0, 1.0 / np.sinc(2.0 * quarters / np.pi), 1.0)))

    def polygon(self, chord_error: float = 1e-6) -> Array:
        """Return points on the path, among them its own, that chords of a given error join.

        Result: shape (k, 2); of a closed path the last point is the first.
        """
        start, end, bulges = self.ends
        rows = [self.points[:1]]
        for first, last, bulge in zip(start, end, bulges, strict=True):
            sweep = 4.0 * math.atan(bulge)
            chord = last - first
            radius = math.hypot(*chord) * (1.0 + bulge**2) / (4.0 * abs(bulge)) if bulge else math.inf
            # A chord of the angle a lies R·(1 − cos(a/2)) below its arc.
            widest = 2.0 * math.acos(max(0.0, 1.0 - chord_error / radius)) if chord_error < radius else 1.0
            count = max(1, math.ceil(abs(sweep) / widest)) if bulge else 1
            share = np.arange(1, count + 1) / count
            # In a circle the chord to the share s of the sweep has the bearing s·sweep/2 against the tangent.
            grown = np.sin(share * sweep / 2.0) / math.sin(sweep / 2.0) if bulge else share
            lean = (share - 1.0) * sweep / 2.0
            turned = np.column_stack([np.cos(lean), np.sin(lean)])
            rows.append(
                first
                + grown[:, None]
                * np.column_stack(
                    [
                        chord[0] * turned[:, 0] - chord[1] * turned[:, 1],
                        chord[0] * turned[:, 1] + chord[1] * turned[:, 0],
                    ]
                )
            )
        return np.vstack(rows)

    def turned(self, angle: float) -> ArcPath:
        """Return the path turned anticlockwise about the centre."""
        cosine, sine = math.cos(angle), math.sin(angle)
        return ArcPath(
            self.points @ np.array([[cosine, sine], [-sine, cosine]]), self.bulges, closed=self.closed
        )

    def mirrored(self) -> ArcPath:
        """Return the mirror image at the y axis, run through backwards; only for open paths."""
        # Mirroring changes the sign of a bulge, and so does running backwards.
        return ArcPath(
            self.points[::-1] * [-1.0, 1.0], np.concatenate([self.bulges[-2::-1], [0.0]]), closed=False
        )


def line(*points: tuple[float, float] | Array) -> ArcPath:
    """Return straight lines through points."""
    return ArcPath(np.array(points, dtype=float), np.zeros(len(points)))


def clockwise_arc(centre: Array, radius: float, *, first: float, last: float) -> ArcPath:
    """Return an arc between two directions of its outward normal (sin φ, cos φ)."""
    count = max(1, math.ceil((last - first) / 2.0))
    steps = np.linspace(first, last, count + 1)
    points = centre + radius * np.column_stack([np.sin(steps), np.cos(steps)])
    bulges = np.append(np.full(count, -math.tan((last - first) / count / 4.0)), 0.0)
    return ArcPath(points, bulges)


def joined(*paths: ArcPath, closed: bool = False) -> ArcPath:
    """Return open paths one after the other, with a straight line over any gap.

    ``paths``: in their order; pieces without length are dropped.
    """
    points: list[Array] = []
    bulges: list[float] = []
    for path in paths:
        for point, bulge in zip(path.points, path.bulges, strict=True):
            if points and float(np.hypot(*(point - points[-1]))) < _SAME:
                bulges[-1] = float(bulge)
                continue
            points.append(point)
            bulges.append(float(bulge))
    if closed and float(np.hypot(*(points[0] - points[-1]))) < _SAME:
        points.pop()
        bulges.pop()
    return ArcPath(np.array(points), np.array(bulges), closed=closed)


def arc_along(start: Array, end: Array, *, tangent: Array) -> float:
    """Return the bulge of the arc that leaves a point along a tangent and ends in another."""
    chord = end - start
    across = float(tangent[0] * chord[1] - tangent[1] * chord[0])
    return math.tan(math.atan2(across, float(tangent @ chord)) / 2.0)


def biarc(start: Array, end: Array, *, first: Array, last: Array) -> ArcPath:
    """Return the two arcs that join two points with given tangents, without a corner between them.

    Notes
    -----
    Both tangents are followed equally far: with start + d·first and end − d·last the arcs meet in the middle
    of these two points, which lie 2·d apart.
    """
    chord, both = end - start, first + last
    along, square = float(chord @ both), float(chord @ chord)
    apart = 2.0 * (1.0 - float(first @ last))
    if apart > 1e-12:
        reach = (-along + math.sqrt(along**2 + apart * square)) / apart
    else:
        reach = square / (4.0 * float(chord @ last))
    middle = (start + end + reach * (first - last)) / 2.0
    bulges = [arc_along(start, middle, tangent=first), -arc_along(end, middle, tangent=-last), 0.0]
    return ArcPath(np.array([start, middle, end]), np.array(bulges))


def distance_to(points: Array, polygon: Array) -> Array:
    """Return the distance of points to a line of chords, shape (n,), in m.

    ``points``: shape (n, 2), in m. ``polygon``: shape (k, 2), in m.
    """
    start, step = polygon[:-1], np.diff(polygon, axis=0)
    away = points[:, None, :] - start
    size = np.maximum(np.sum(step**2, axis=1), 1e-300)
    share = np.clip(np.sum(away * step, axis=2) / size, 0.0, 1.0)
    result: Array = np.min(np.hypot(*np.moveaxis(away - share[..., None] * step, 2, 0)), axis=1)
    return result


def inside_of(point: Array, polygon: Array) -> bool:
    """Tell whether a point lies inside a closed polygon.

    ``polygon``: shape (k, 2), the last point is the first.
    """
    (x0, y0), (x1, y1) = polygon[:-1].T, polygon[1:].T
    crosses = (y0 > point[1]) != (y1 > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x0 + (point[1] - y0) / (y1 - y0) * (x1 - x0)
    return bool(np.count_nonzero(crosses & (point[0] < at)) % 2)


def crossing(polygon: Array) -> Array | None:
    """Return a point in which a closed polygon crosses itself, or ``None``.

    ``polygon``: shape (k, 2), the last point is the first.
    """
    start, end = polygon[:-1], polygon[1:]
    count = len(start)
    for index in range(count - 2):
        # Neighbours share a point; the last is a neighbour of the first.
        others = slice(index + 2, count - 1 if index == 0 else count)
        a, b, c, d = start[index], end[index], start[others], end[others]
        first, second = _side(a, b, c), _side(a, b, d)
        third, fourth = _side(c, d, a), _side(c, d, b)
        hit = np.flatnonzero((first * second < 0.0) & (third * fourth < 0.0))
        if len(hit):
            share = third[hit[0]] / (third[hit[0]] - fourth[hit[0]])
            place: Array = a + share * (b - a)
            return place
    return None


def _side(a: Array, b: Array, c: Array) -> Array:
    """Return which side of the line from a to b the point c lies on, for one or many lines or points."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (
        c[..., 0] - a[..., 0]
    )
