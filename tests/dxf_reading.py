"""Reads DXF by its group codes alone, without the library that wrote it, and lays a string around edges."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from nlsdesign.foundation.arrays import Array


@dataclass
class Entity:
    """An entity of a DXF file: its kind, layer, and values by group code."""

    kind: str
    values: dict[int, list[str]] = field(default_factory=dict)

    @property
    def layer(self) -> str:
        return self.values[8][0]

    def numbers(self, code: int) -> Array:
        return np.array([float(value) for value in self.values.get(code, [])])


def pairs_of(text: str) -> list[tuple[int, str]]:
    """Group codes and values."""
    lines = text.splitlines()
    return [(int(code), value) for code, value in zip(lines[::2], lines[1::2], strict=True)]


def header_of(text: str) -> dict[str, str]:
    """The first value of each variable of the header."""
    pairs = pairs_of(text)
    return {value: after for (code, value), (_, after) in pairwise(pairs) if code == 9}


def entities_of(text: str) -> list[Entity]:
    """What stands in the section ENTITIES."""
    found: list[Entity] = []
    section = ""
    for (before, what), (code, value) in pairwise([(-1, ""), *pairs_of(text)]):
        if (before, what) == (0, "SECTION"):
            section = value
        elif section == "ENTITIES" and code == 0:
            found.append(Entity(value))
        elif found and section == "ENTITIES":
            found[-1].values.setdefault(code, []).append(value)
    return [item for item in found if 8 in item.values]


def polylines_of(text: str, layer: str) -> list[Array]:
    """Vertices and bulges of the polylines of a layer, each of shape (n, 3).

    A bulge is written only where it is not zero, in the vertex that it follows.
    """
    found = []
    codes = [0]
    rows: list[list[float]] = []
    kept = False
    pairs = pairs_of(text)
    for code, value in [*pairs[next(i for i, p in enumerate(pairs) if p == (2, "ENTITIES")) :], (0, "END")]:
        if code == 0:
            if kept and rows:
                found.append(np.array(rows))
            rows, kept = [], False
            codes = [value == "LWPOLYLINE"]
        elif not codes[0]:
            continue
        elif code == 8:
            kept = value == layer
        elif code == 10:
            rows.append([float(value), 0.0, 0.0])
        elif code in (20, 42) and rows:
            rows[-1][1 if code == 20 else 2] = float(value)
    return found


def offset_points(outline: Array, distance: float, *, step: float = 1e-3) -> Array:
    """Points at a distance outside a closed clockwise outline of lines and arcs, shape (k, 2)."""
    points = []
    for (x0, y0, bulge), (x1, y1, _) in pairwise([*outline, outline[0]]):
        chord = complex(x1 - x0, y1 - y0)
        sweep = 4.0 * math.atan(bulge)
        # Tangent at the share s of an arc: the chord turned by (s - 1/2) of the sweep.
        for share in np.linspace(0.0, 1.0, max(2, math.ceil(abs(sweep) / step) + 1)):
            tangent = chord / abs(chord) * np.exp(1j * (share - 0.5) * sweep)
            if sweep:
                radius = abs(chord) / 2.0 / math.sin(sweep / 2.0)
                first = chord / abs(chord) * np.exp(-0.5j * sweep)
                place = complex(x0, y0) + radius * 1j * (first - tangent)
            else:
                place = complex(x0, y0) + share * chord
            outer = place + distance * 1j * tangent
            points.append((outer.real, outer.imag))
    return np.array(points)


def hull_of(points: Array) -> Array:
    """Corners of the convex hull, clockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))].tolist()
    chains = []
    for row in (ordered, ordered[::-1]):
        chain: list[list[float]] = []
        for x, y in row:
            while len(chain) > 1 and (chain[-1][0] - chain[-2][0]) * (y - chain[-2][1]) >= (
                chain[-1][1] - chain[-2][1]
            ) * (x - chain[-2][0]):
                chain.pop()
            chain.append([x, y])
        chains += chain[:-1]
    return np.array(chains)


@dataclass
class TautString:
    """A string of no thickness from a point of a body, clockwise around its hull, to an anchor at rest.

    The hull of the offset of an edge is where the centre line of a thick string runs that is laid around it.
    """

    points: Array
    start: Array

    def __post_init__(self) -> None:
        corners = hull_of(np.vstack([self.points, self.start]))
        first = int(np.argmin(np.hypot(*(corners - self.start).T)))
        self.corners = np.roll(corners, -first, axis=0)
        self.wound = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.corners, axis=0).T))])

    def pulled(self, angle: float, anchor: float) -> tuple[float, float, int]:
        """Length, lever arm and corner where the string leaves, with the body turned anticlockwise."""
        cosine, sine = math.cos(angle), math.sin(angle)
        end = np.array([anchor * cosine, -anchor * sine])
        # The corner from which the whole body is seen on the right of the line to the anchor.
        last = 0
        for index in range(1, len(self.corners)):
            (ax, ay), (bx, by) = self.corners[last] - end, self.corners[index] - end
            if ax * by - ay * bx < 0.0:
                last = index
        straight = end - self.corners[last]
        size = math.hypot(*straight)
        corner = self.corners[last]
        arm = abs(corner[0] * straight[1] - corner[1] * straight[0]) / size
        return float(self.wound[last] + size), arm, last
