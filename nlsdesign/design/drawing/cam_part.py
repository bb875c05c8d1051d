"""What is drawn of a cam, outlines, holes, cable and numbers, and the checks that it can be made."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from .arc_path import ArcPath, crossing, distance_to, inside_of


class Key(NamedTuple):
    """A parallel key in mm: bores above and up to, its sides, depth in the hub, height that presses it.

    Source: DIN 6885-1.
    """

    above: float
    up_to: float
    width: float
    height: float
    depth: float
    pressed: float

    def __str__(self) -> str:
        return f"{self.width:g} x {self.height:g} mm (DIN 6885-1)"


KEYS = (
    Key(6.0, 8.0, 2.0, 2.0, 1.0, 0.8),
    Key(8.0, 10.0, 3.0, 3.0, 1.4, 1.2),
    Key(10.0, 12.0, 4.0, 4.0, 1.8, 1.5),
    Key(12.0, 17.0, 5.0, 5.0, 2.3, 2.0),
    Key(17.0, 22.0, 6.0, 6.0, 2.8, 2.5),
    Key(22.0, 30.0, 8.0, 7.0, 3.3, 3.0),
)


@dataclass(frozen=True, eq=False)
class Hole:
    """A round hole, with or without a keyway towards y."""

    name: str  # what it is for
    centre: Array  # shape (2,), in m
    diameter: float  # in m
    base_only: bool = False  # whether it goes through the base plate alone, under cable and lips
    key: Key | None = None  # whose keyway it has

    @property
    def reach(self) -> float:
        """Distance from the centre to the material that is farthest from it, in m."""
        return self.diameter / 2.0 + (0.0 if self.key is None else self.key.depth / MM)

    @property
    def outline(self) -> ArcPath | None:
        """Closed edge of a hole with a keyway; ``None`` of a round one."""
        if self.key is None:
            return None
        half, radius = self.key.width / 2.0 / MM, self.diameter / 2.0
        corner = math.sqrt(radius**2 - half**2)
        points = [(half, corner), (half, self.reach), (-half, self.reach), (-half, corner), (0.0, -radius)]
        bulge = math.tan((math.pi - math.asin(half / radius)) / 4.0)
        bulges = np.array([0.0, 0.0, 0.0, bulge, bulge])
        return ArcPath(self.centre + np.array(points), bulges, closed=True)


@dataclass(frozen=True, eq=False)
class CamPart:
    """A cam as it is made, in its own frame: the axis at (0, 0), the cable at angle zero along x; in m.

    Parameters
    ----------
    outlines
        Closed edges under the cable, clockwise: one of a one-sided cam, two (lower, upper) of a two-sided.
    holes
        Round holes.
    base_radius
        Radius of the round base plate that carries the lips in m; zero if the lips are cut through.
    cables
        Centre line of the cable at angle zero, at the last angle and, on two-sided cams, at the last angle of
        the other sense; open paths in the frame of the cam.
    centre_line
        Curve of the cable's centre line on the first lip, shape (n, 2).
    numbers
        Sizes by name, given and derived, with unit and source.
    rollers
        Roller at angle zero and at the last angle of either sense, in the frame of the cam; ``cables`` are
        then the way of its centre and the line of the follower.
    partners
        Edge at angle zero of the equal cam that rolls on this one, and its ``holes`` in ``rollers``;
        ``cables`` are then the way of its pivot and the line of the element.
    """

    outlines: tuple[ArcPath, ...]
    holes: tuple[Hole, ...]
    base_radius: float
    cables: tuple[ArcPath, ...]
    centre_line: Array
    numbers: Mapping[str, Quantity]
    rollers: tuple[Hole, ...] = ()
    partners: tuple[ArcPath, ...] = ()

    @property
    def counterpart(self) -> str:
        """What runs on the edge: a cable, a roller, or an equal cam."""
        return "equal cam" if self.partners else "roller" if self.rollers else "cable"

    @property
    def rolls(self) -> bool:
        """Whether something rolls on the edge."""
        return bool(self.rollers or self.partners)

    @property
    def size_of_counterpart(self) -> str:
        """What the edge is for, in words with its size."""
        if self.partners:
            return f"two equal cams, pivots {MM * self.number('pivot_distance'):.4g} mm apart"
        return f"a {self.counterpart} of radius {MM * self.number(f'{self.counterpart}_radius'):.4g} mm"

    @cached_property
    def reach(self) -> float:
        """Largest distance of an edge from the axis in m, without the base plate."""
        return max(float(np.hypot(*outline.polygon().T).max()) for outline in self.outlines)

    @cached_property
    def outermost(self) -> float:
        """Largest distance of any material from the axis in m."""
        return max(self.reach, self.base_radius)

    def number(self, name: str) -> float:
        """Return one of the numbers in SI.

        Parameters
        ----------
        name
            One of ``numbers``.
        """
        return self.numbers[name].number


_CHORD = 2e-6
_SLACK = 3e-6


def check_machinable(part: CamPart) -> None:
    """Refuse a part that cannot be made as drawn."""
    _check_plate(part)
    _check_edges(part)
    _check_tool(part)
    _check_anchor(part)
    polygons = [outline.polygon(_CHORD) for outline in part.outlines]
    for hole in part.holes:
        _check_hole(hole, part, polygons)
    _check_between_holes(part)


def _check_plate(part: CamPart) -> None:
    if "groove_depth" not in part.numbers:
        return
    groove, cable = part.number("groove_depth"), 2.0 * part.number("cable_radius")
    if groove < cable:
        raise ValueRangeError(
            f"groove_depth {MM * groove:.4g} mm", f"is less than the cable is thick, {MM * cable:.4g} mm",
            next_step="mill deeper, for instance two diameters of the cable",
        )  # fmt: skip
    base, wall = part.number("thickness") - groove, part.number("minimum_wall")
    if base < wall - _SLACK:
        raise ValueRangeError(
            f"groove_depth {MM * groove:.4g} mm",
            f"leaves a base of {MM * base:.4g} mm, less than minimum_wall {MM * wall:.4g} mm",
            next_step="take a thicker plate",
        )


def _check_edges(part: CamPart) -> None:
    for outline in part.outlines:
        place = crossing(outline.polygon(10 * _CHORD))
        if place is not None:
            x, y = MM * place
            raise ArrangementError(
                "edge of the cam", f"crosses itself at x = {x:.4g} mm, y = {y:.4g} mm",
                next_step="take a smaller over_travel, lead_in, corner_radius or body_radius",
            )  # fmt: skip
    if len(part.outlines) == 2:
        lower, upper = (outline.polygon(10 * _CHORD) for outline in part.outlines)
        gap = float(distance_to(lower, upper).min())
        if gap < 2.0 * part.number("cable_radius") - part.number("channel_width"):
            raise ArrangementError("halves of the cam", "overlap", next_step="take a smaller over_travel")
        # The material between channel and back, on the y axis where the channel is closest to it.
        heights = [
            y0 + (y1 - y0) * x0 / (x0 - x1)
            for (x0, y0), (x1, y1) in itertools.pairwise(lower)
            if (x0 <= 0.0) != (x1 <= 0.0)
        ]
        depth, wall = max(heights) - min(heights), part.number("minimum_wall")
        if depth < wall:
            raise ValueRangeError(
                f"half of the cam, {MM * depth:.4g} mm between channel and back",
                f"is thinner than minimum_wall {MM * wall:.4g} mm",
                next_step="take a larger body_radius",
            )


def _check_tool(part: CamPart) -> None:
    sharpest, tolerance = part.number("sharpest_edge"), part.number("edge_tolerance")
    if sharpest < tolerance:
        raise ValueRangeError(
            f"edge under the {part.counterpart}, with a radius of {MM * sharpest:.3g} mm at its sharpest",
            f"is a corner within its tolerance of {MM * tolerance:.3g} mm",
            next_step="ask for a larger radius (MinimumRadiusOfCurvature), or take a thinner cable",
        )
    tool = part.number("tool_radius")
    inner = np.concatenate([outline.radii for outline in part.outlines])
    # Edges are clockwise: a turn to the left is an inner corner.
    smallest = float(np.min(inner, where=(inner > 0.0) & np.isfinite(inner), initial=math.inf))
    if smallest < tool * (1.0 - 1e-6):
        raise ValueRangeError(
            f"tool_radius {MM * tool:.4g} mm",
            f"is larger than an inner corner of the edge, {MM * smallest:.4g} mm",
            next_step="take a smaller tool or a larger ferrule seat",
        )
    if "groove_depth" in part.numbers and "mouth_width" in part.numbers:
        mouth = part.number("mouth_width")
        if 2.0 * tool > mouth * (1.0 + 1e-6):
            raise ValueRangeError(
                f"tool_radius {MM * tool:.4g} mm",
                f"does not pass the mouth of the channel, {MM * mouth:.4g} mm wide",
                next_step="take a smaller tool, or leave groove_depth out and cut the halves through",
            )


def _check_anchor(part: CamPart) -> None:
    if "anchor_distance" in part.numbers and part.reach >= part.number("anchor_distance"):
        raise ValueRangeError(
            f"edge of the cam, up to {MM * part.reach:.4g} mm from the axis",
            f"reaches the anchor at {MM * part.number('anchor_distance'):.4g} mm",
            next_step="take a smaller over_travel or corner_radius, or move the anchor out",
        )


def _check_hole(hole: Hole, part: CamPart, polygons: list[Array]) -> None:
    wall = part.number("minimum_wall")
    away = MM * math.hypot(*hole.centre)
    keyed = "" if hole.key is None else f" with a keyway {hole.key.depth:g} mm deep"
    what = f"{hole.name} of {MM * hole.diameter:.4g} mm{keyed} at {away:.4g} mm from the axis"
    if part.base_radius:
        left = part.base_radius - math.hypot(*hole.centre) - hole.reach
        if left < wall - _SLACK:
            raise ValueRangeError(
                what, f"leaves {MM * left:.4g} mm to the rim, minimum_wall is {MM * wall:.4g} mm",
                next_step="take a smaller circle or hole",
            )  # fmt: skip
    if hole.base_only:
        return
    inside = any(inside_of(hole.centre, polygon) for polygon in polygons)
    left = min(float(distance_to(hole.centre[None, :], polygon)[0]) for polygon in polygons) - hole.reach
    if not inside and not part.base_radius:
        raise ValueRangeError(
            what, "lies outside the material",
            next_step="take a smaller bolt circle, or a groove_depth so that a base plate remains",
        )  # fmt: skip
    if left < wall - _SLACK:
        raise ValueRangeError(
            what,
            f"leaves {MM * left:.4g} mm to the edge, minimum_wall is {MM * wall:.4g} mm",
            next_step="take smaller holes, another circle, or a larger body_radius",
        )


def _check_between_holes(part: CamPart) -> None:
    wall = part.number("minimum_wall")
    for index, one in enumerate(part.holes):
        for other in part.holes[index + 1 :]:
            left = math.hypot(*(one.centre - other.centre)) - one.reach - other.reach
            if left < wall - _SLACK:
                raise ValueRangeError(
                    f"{one.name} and {other.name}",
                    f"leave {MM * left:.4g} mm between them, minimum_wall is {MM * wall:.4g} mm",
                    next_step="take fewer or smaller holes, or a larger circle",
                )
