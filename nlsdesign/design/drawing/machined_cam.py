"""Sizes that a workshop needs beside the contour: cable, channel, plate, run-out, bore, bolts, cable end."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity, quantity
from ..curves.numbers import in_si, plain
from ..statics.contour import Contour
from .arc_path import ArcPath
from .cam_outline import (
    Contours,
    LipEdge,
    Lips,
    lip_edge,
    one_sided_outline,
    two_sided_outlines,
)
from .cam_part import KEYS, CamPart, Hole, Key, check_machinable

_CLEARANCE = quantity(0.1, "mm", source="assumed: a braided cable of this size passes a gap so much wider")
_OVER_TRAVEL = quantity(10.0, "deg", source="assumed: room for a stop behind the last angle")
_CORNER = quantity(1.0, "mm", source="assumed: a corner that does not cut")
_WALL = quantity(1.0, "mm", source="assumed: least wall that a workshop holds in metal")
_TOLERANCE = quantity(0.02, "mm", source="assumed: usual in fine milling and wire erosion")
_RANGES = {
    "cable_radius": ("m", 1e-5, 0.01),
    "roller_radius": ("m", 1e-4, 0.5),
    "channel_clearance": ("m", 0.0, 0.01),
    "thickness": ("m", 1e-4, 0.2),
    "groove_depth": ("m", 1e-4, 0.2),
    "over_travel": ("rad", 0.0, math.pi),
    "corner_radius": ("m", 1e-5, 0.1),
    "tool_radius": ("m", 0.0, 0.05),
    "minimum_wall": ("m", 0.0, 0.05),
    "edge_tolerance": ("m", 1e-7, 1e-3),
    "body_radius": ("m", 0.0, 1.0),
    "hub_bore": ("m", 1e-4, 0.5),
    "lead_in": ("m", 0.0, 0.5),
    "circle": ("m", 1e-4, 1.0),
    "hole": ("m", 1e-4, 0.1),
    "diameter": ("m", 1e-4, 0.1),
}


def _check(item: object) -> None:
    """Turn the numbers of a frozen object into quantities, each checked for dimension and range."""
    for field in fields(item):  # type: ignore[arg-type]
        given = getattr(item, field.name)
        if field.name in _RANGES and given is not None:
            unit, minimum, maximum = _RANGES[field.name]
            value = in_si(field.name, given, unit, minimum=minimum, maximum=maximum)
            if not isinstance(given, Quantity):
                object.__setattr__(item, field.name, Quantity(value, unit))


@dataclass(frozen=True, kw_only=True)
class BoltCircle:
    """Bolt holes on a circle about the axis.

    On a two-sided cam they lie as far from the channel as their number allows.

    Parameters
    ----------
    count
        Number of holes; even on a two-sided cam.
    circle
        Diameter of the circle of their centres, in m.
    hole
        Diameter of a hole, in m.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> BoltCircle(count=4, circle=quantity(16.0, "mm"), hole=quantity(2.2, "mm")).centres.shape
    (4, 2)
    """

    count: int
    circle: Quantity | float
    hole: Quantity | float

    def __post_init__(self) -> None:
        in_si("count of bolts", float(self.count), "1", minimum=1.0, maximum=100.0)
        _check(self)

    @property
    def centres(self) -> Array:
        """Centres of the holes in m, shape (count, 2); the first nearest to the y axis."""
        step = 2.0 * math.pi / self.count
        # Half a step off the y axis where a hole would else lie on the x axis.
        first = math.pi / 2 + (step / 2 if self.count % 4 == 0 else 0.0)
        angles = first + step * np.arange(self.count)
        return plain(self.circle) / 2 * np.column_stack([np.cos(angles), np.sin(angles)])


@dataclass(frozen=True, kw_only=True)
class FerruleSeat:
    """Round pocket in the line of the cable for a ferrule that is pressed on it.

    On a two-sided cam it lies on the axis, on a one-sided at the end of the lead-in.

    Parameters
    ----------
    diameter
        Of the pocket, in m.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range.
    """

    diameter: Quantity | float

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, kw_only=True)
class ClampScrew:
    """Hole beside the cable for a screw whose head or washer clamps it.

    On a two-sided cam there is one in each half, across the axis; on a one-sided one beside the lead-in.

    Parameters
    ----------
    diameter
        Of the hole (core hole of the thread), in m.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range.
    """

    diameter: Quantity | float

    def __post_init__(self) -> None:
        _check(self)


class DrawnCam(NamedTuple):
    """What is drawn of a cam: outlines, holes but those of the bolts, cables or ways, rollers, partners."""

    outlines: list[ArcPath]
    holes: list[Hole]
    cables: list[ArcPath]
    rollers: tuple[Hole, ...] = ()
    partners: tuple[ArcPath, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MachinedCam(ABC):
    """Sizes common to all cams; take one of the classes for a kind of cam, such as MachinedTwoSidedCam.

    Each number is a quantity, or bare in SI. What is left out is derived from the contour and the cable; the
    drawing lists every number with its source.

    Parameters
    ----------
    thickness
        Of the plate.
    over_travel
        Angle of the cam beyond the last one over which the edge goes on.
    corner_radius
        Of the ends of the lips.
    tool_radius
        Smallest radius of an inner corner.
    minimum_wall
        Least material between holes and edges.
    edge_tolerance
        Profile tolerance of the edge, ± in m.
    body_radius
        The lips are backed by material to at least this distance from the axis.
    hub_bore
        Diameter of a bore on the axis.
    keyway
        Whether the bore has the keyway of its parallel key, DIN 6885-1; it points to y, across the cable.
    bolts
        Bolt holes.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range, which mostly means a slip of units.
    UnitError
        If a unit measures something else.
    ArrangementError
        If there is a keyway without a bore.
    """

    thickness: Quantity | float | None = None
    over_travel: Quantity | float = _OVER_TRAVEL
    corner_radius: Quantity | float = _CORNER
    tool_radius: Quantity | float | None = None
    minimum_wall: Quantity | float = _WALL
    edge_tolerance: Quantity | float = _TOLERANCE
    body_radius: Quantity | float | None = None
    hub_bore: Quantity | float | None = None
    keyway: bool = False
    bolts: BoltCircle | None = None

    def __post_init__(self) -> None:
        _check(self)
        if not isinstance(self.keyway, bool):
            raise ValueRangeError(
                f"keyway = {self.keyway!r}", "is neither true nor false: its sizes follow from the bore",
                next_step="write keyway = true",
            )  # fmt: skip
        if self.keyway and self.hub_bore is None:
            raise ArrangementError("keyway", "has no bore", next_step='give one too, hub_bore = "8 mm"')
        if self.keyway and self.key is None:
            raise ValueRangeError(
                f"hub_bore {self.hub_bore} with a keyway",
                f"no key is made for it; bores are over {KEYS[0].above:g} and up to {KEYS[-1].up_to:g} mm "
                "(DIN 6885-1)",
                next_step="take such a bore, or leave keyway out and take bolts",
            )

    @property
    def key(self) -> Key | None:
        """The key of the bore, where it has a keyway."""
        bore = MM * plain(self.hub_bore) if self.keyway and self.hub_bore is not None else 0.0
        return next((key for key in KEYS if key.above < bore <= key.up_to), None)

    @property
    def milled(self) -> bool:
        """Whether the edges are milled into the plate, so that a base plate remains below them."""
        return False

    def given(self) -> dict[str, Quantity]:
        """Return the numbers by name, with those derived that need no contour."""
        numbers = {
            field.name: item
            for field in fields(self)
            if isinstance(item := getattr(self, field.name), Quantity)
        }
        if self.bolts is not None:
            numbers |= {
                "bolt_count": quantity(float(self.bolts.count), "1"),
                "bolt_circle": as_quantity(self.bolts.circle),
                "bolt_hole": as_quantity(self.bolts.hole),
            }
        if self.key is not None:
            numbers |= {
                "keyway_width": quantity(self.key.width, "mm", source="DIN 6885-1"),
                "keyway_depth": quantity(self.key.depth, "mm", source="DIN 6885-1"),
            }
        return numbers

    def bore(self, *, base_only: bool = False) -> list[Hole]:
        """Return the bore on the axis, or nothing."""
        if self.hub_bore is None:
            return []
        return [Hole("hub bore", np.zeros(2), plain(self.hub_bore), base_only, self.key)]

    def part(self, contour: Contour, *, back: Contour | None = None) -> CamPart:
        """Return the cam as it is made, checked.

        Parameters
        ----------
        contour
            Curve of the cable's centre line.
        back
            That for negative angles, of a cam through whose centre the cable runs; the same if left out.

        Raises
        ------
        ArrangementError
            If the edge crosses itself, a bore would cut the channel, or the cam has one contour only.
        ValueRangeError
            If the contour, the cable, a hole or the plate does not fit; the message names it.
        """
        numbers = self.given()
        if back is not None and not isinstance(self, MachinedTwoSidedCam):
            raise ArrangementError(
                f"a {type(self).__name__}", "has no second contour",
                next_step="leave back out, or draw it as a MachinedTwoSidedCam",
            )  # fmt: skip
        contours = (contour, contour if back is None else back)
        lips, sharpest = [], []
        for each in contours:
            lips.append(self._edge(each, numbers))
            sharpest.append(numbers["sharpest_edge"])
        deviation = max(lip.deviation for lip in lips)
        numbers |= {
            "sharpest_edge": min(sharpest, key=lambda size: size.number),
            "last_angle": quantity(math.degrees(contour.angles[-1]), "deg", source="contour"),
            "edge_deviation": derived_size(deviation, "largest distance of the arcs from the exact edge"),
        }
        if back is not None:
            end = quantity(math.degrees(back.angles[-1]), "deg", source="contour for negative angles")
            numbers["back_last_angle"] = end
        outlines, holes, cables, rollers, partners = self._drawn(contours, (lips[0], lips[1]), numbers)
        if self.bolts is not None:
            holes += [
                Hole(f"bolt hole {k}", c, plain(self.bolts.hole)) for k, c in enumerate(self.bolts.centres, 1)
            ]
        base = 0.0
        if self.milled:
            rims = [float(np.hypot(*outline.polygon().T).max()) for outline in outlines]
            rims += [math.hypot(*hole.centre) + hole.reach for hole in holes]
            base = math.ceil(1e4 * (max(rims) + numbers["minimum_wall"].number)) * 1e-4
            numbers["base_radius"] = derived_size(base, "lips, holes and the least wall around them")
        line = contour.centre_line
        made = CamPart(tuple(outlines), tuple(holes), base, tuple(cables), line, numbers, rollers, partners)
        numbers["reach"] = derived_size(made.reach, "largest distance of an edge from the axis")
        check_machinable(made)
        return made

    @abstractmethod
    def _edge(self, contour: Contour, numbers: dict[str, Quantity]) -> LipEdge:
        """Return the edge; adds its sharpest radius and what else it derives."""

    @abstractmethod
    def _drawn(self, contours: Contours, lips: Lips, numbers: dict[str, Quantity]) -> DrawnCam:
        """Return what is drawn of the contours for both signs of the angle; adds numbers that it derives."""

    def _body_radius(self, limit: float, numbers: dict[str, Quantity]) -> None:
        """Add the body radius where it is not given: what holes need, else half of what fits."""
        needed = 0.0
        if self.bolts is not None and not self.milled:
            needed = (plain(self.bolts.circle) + plain(self.bolts.hole)) / 2 + plain(self.minimum_wall)
        needed = max([needed, *(bore.reach + plain(self.minimum_wall) for bore in self.bore())])
        size = max(0.0, min(limit, max(needed, limit / 2)))
        numbers.setdefault(
            "body_radius", derived_size(size, "what the holes need, at least half of what fits")
        )
        if numbers["body_radius"].number > limit + 1e-9:
            raise ValueRangeError(
                f"body_radius {numbers['body_radius']}",
                f"stands out over the edge under the cable; at most {1e3 * limit:.4g} mm fits",
                next_step="take a smaller body_radius",
            )


@dataclass(frozen=True, kw_only=True)
class MachinedCableCam(MachinedCam):
    """Sizes common to the cams that a cable lies on; other parameters are those of :class:`MachinedCam`.

    Parameters
    ----------
    cable_radius
        Half the diameter of the cable: the edge lies deeper than the contour by it.
    channel_clearance
        By how much the channel is wider than the cable, between its mouths.
    groove_depth
        Depth from the face of the plate to which the edges are milled; the rest is a round base plate that
        carries the lips. Left out: the edges are cut through the plate.
    cable_end
        What holds the cable on the cam.
    """

    cable_radius: Quantity | float
    channel_clearance: Quantity | float = _CLEARANCE
    groove_depth: Quantity | float | None = None
    cable_end: FerruleSeat | ClampScrew | None = None

    @property
    def milled(self) -> bool:
        """Whether a groove is milled."""
        return self.groove_depth is not None

    def given(self) -> dict[str, Quantity]:
        """Return the numbers by name, with those derived that need no contour."""
        numbers = super().given()
        if isinstance(self.cable_end, FerruleSeat):
            numbers["ferrule_seat"] = as_quantity(self.cable_end.diameter)
        if isinstance(self.cable_end, ClampScrew):
            numbers["clamp_hole"] = as_quantity(self.cable_end.diameter)
        radius = plain(self.cable_radius)
        numbers.setdefault(
            "tool_radius",
            derived_size(
                min(5e-4, radius), "smaller of 0.5 mm and the cable radius, so that it passes the mouth"
            ),
        )
        numbers.setdefault("thickness", self._thickness())
        return numbers

    def _edge(self, contour: Contour, numbers: dict[str, Quantity]) -> LipEdge:
        radius = numbers["cable_radius"].number
        numbers["sharpest_edge"] = derived_size(
            float(np.min(contour.radii_of_curvature)) - radius,
            "smallest radius of curvature of the contour less the cable radius",
        )
        if math.isfinite(contour.anchor_distance):
            numbers["anchor_distance"] = quantity(1e3 * contour.anchor_distance, "mm", source="contour")
        return lip_edge(contour, radius, over_travel=numbers["over_travel"].number)

    def _thickness(self) -> Quantity:
        """Plate so thick that the cable stays on it: four diameters, with a groove as much again below."""
        if self.groove_depth is not None:
            wall = max(2e-3, plain(self.minimum_wall))
            return derived_size(
                plain(self.groove_depth) + wall, "groove and a base of 2 mm or the least wall"
            )
        return derived_size(
            max(4e-3, math.ceil(8e3 * plain(self.cable_radius)) * 1e-3),
            "4 diameters of the cable, at least 4 mm",
        )


@dataclass(frozen=True, kw_only=True)
class MachinedTwoSidedCam(MachinedCableCam):
    """Sizes of a cam whose cable runs through its centre, in a channel between two halves.

    At the mouths the channel is exactly as wide as the cable, so that the cable leaves it along the contour;
    between them it is wider by the clearance. Parameters are those of :class:`MachinedCableCam`.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> MachinedTwoSidedCam(cable_radius=quantity(0.25, "mm")).given()["thickness"].shown
    4.0
    """

    def _drawn(self, contours: Contours, lips: Lips, numbers: dict[str, Quantity]) -> DrawnCam:
        radius, clearance = numbers["cable_radius"].number, numbers["channel_clearance"].number
        offset = max((float(each.lever_arms[0]) for each in contours), key=abs)
        if abs(offset) > max(clearance / 2, 1e-6) or min(each.slopes[0] for each in contours) <= 0.0:
            raise ArrangementError(
                f"contour with a lever arm of {1e3 * offset:.4g} mm at angle zero",
                "its cable does not run through the centre, so there is no channel between two halves",
                next_step="draw it as a MachinedOneSidedCam",
            )
        if self.hub_bore is not None and self.groove_depth is None:
            raise ArrangementError(
                f"hub bore of {numbers['hub_bore']}",
                "would cut the channel of the cable, which runs through the axis",
                next_step="give a groove_depth, or leave hub_bore out and take bolts",
            )
        if self.bolts is not None and self.groove_depth is None and self.bolts.count < 4:
            raise ArrangementError(
                f"{self.bolts.count} bolts", "do not hold two separate halves, each needs two",
                next_step="take 4 or more, or a groove_depth so that the cam is one piece",
            )  # fmt: skip
        numbers["channel_width"] = derived_size(2 * radius + clearance, "cable diameter and clearance")
        numbers["mouth_width"] = derived_size(
            2 * (radius - offset), "cable diameter: the lips guide the cable"
        )
        mouths = sum(float(each.slopes[0]) for each in contours)
        numbers["channel_length"] = derived_size(mouths, "between the mouths")
        self._body_radius(min(lip.last_support for lip in lips), numbers)
        outlines = list(two_sided_outlines(lips, numbers))
        holes = self.bore(base_only=True)
        if isinstance(self.cable_end, ClampScrew):
            size = plain(self.cable_end.diameter)
            away = numbers["channel_width"].number / 2 + plain(self.minimum_wall) + size / 2
            # Beside the bore in the base, which lies under them.
            aside = holes[0].reach + plain(self.minimum_wall) + size / 2 if holes else 0.0
            holes += [Hole("clamp hole", side * np.array([-aside, away]), size) for side in (-1.0, 1.0)]
        reach = max(float(each.radii.max()) for each in contours)
        halves = [_cable(each, float(each.angles[-1]), 0.35 * reach) for each in contours]
        front, back = (np.vstack([-half[::-1], half]) for half in halves)
        end = min(1.3 * reach, contours[0].anchor_distance)
        lines = (np.array([[-end, 0.0], [end, 0.0]]), front, back * [1.0, -1.0])
        return DrawnCam(outlines, holes, [ArcPath(points, np.zeros(len(points))) for points in lines])


@dataclass(frozen=True, kw_only=True)
class MachinedOneSidedCam(MachinedCableCam):
    """Sizes of a cam that takes up its cable on one side.

    Before the contour a straight lead-in carries the cable from its end. Other parameters are those of
    :class:`MachinedCableCam`.

    Parameters
    ----------
    lead_in
        Length of the straight edge before the contour, in m; four diameters of the cable, and room for its
        end, if it is left out.
    """

    lead_in: Quantity | float | None = None

    def given(self) -> dict[str, Quantity]:
        """Return the numbers by name, with those derived that need no contour."""
        numbers = super().given()
        end = plain(self.cable_end.diameter) if self.cable_end is not None else 0.0
        room = end + 2.0 * plain(self.minimum_wall) if end else 0.0
        numbers.setdefault(
            "lead_in",
            derived_size(
                8.0 * plain(self.cable_radius) + room, "4 diameters of the cable, and room for its end"
            ),
        )
        return numbers

    def _drawn(self, contours: Contours, lips: Lips, numbers: dict[str, Quantity]) -> DrawnCam:
        contour, lip = contours[0], lips[0]
        radius, wall = numbers["cable_radius"].number, plain(self.minimum_wall)
        self._body_radius(float(np.min(contour.lever_arms)) - radius, numbers)
        outline = one_sided_outline(lip, numbers)
        phi, lead = float(contour.directions[0]), numbers["lead_in"].number
        along, normal = np.array([math.cos(phi), -math.sin(phi)]), np.array([math.sin(phi), math.cos(phi)])
        holes = self.bore()
        if holes and self.groove_depth is not None and holes[0].reach + wall > numbers["body_radius"].number:
            holes = self.bore(base_only=True)
        start = contour.points[0] - lead * along
        if isinstance(self.cable_end, ClampScrew):
            size = plain(self.cable_end.diameter)
            place = start + (size / 2 + wall) * along - (radius + wall + size / 2) * normal
            holes.append(Hole("clamp hole", place, size))
        beyond = 0.35 * float(contour.radii.max())
        cables = [
            np.vstack([start, _cable(contour, angle, beyond)])
            for angle in (float(contour.angles[0]), float(contour.angles[-1]))
        ]
        return DrawnCam([outline], holes, [ArcPath(points, np.zeros(len(points))) for points in cables])


def _cable(contour: Contour, angle: float, beyond: float) -> Array:
    """Return the cable from the first point of the contour to beyond the contact, in the frame of the cam."""
    on = contour.angles <= angle
    last = int(np.flatnonzero(on)[-1])
    away = min(float(contour.free_lengths[last]), beyond + (0.0 if last else float(contour.radii.max())))
    direction = float(contour.directions[last])
    leaving = contour.points[last] + away * np.array([math.cos(direction), -math.sin(direction)])
    return np.vstack([contour.points[: last + 1], leaving])


def as_quantity(given: Quantity | float) -> Quantity:
    """Return a size as a quantity; a bare number is in m."""
    return given if isinstance(given, Quantity) else Quantity(given, "m")


def derived_size(value: float, how: str) -> Quantity:
    """Return a size that follows from others, in mm."""
    return quantity(round(1e3 * value, 9), "mm", source=f"derived: {how}")
