"""How a part can be made and held: the process that its channel asks for, and what carries its torque."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from ...foundation.errors import NlsError
from ...foundation.quantity import MM
from ..statics.contour import Contour
from .cam_part import CamPart
from .machined_cam import BoltCircle, MachinedCam

_DEEPEST = 4.0
"""Depth of a slot over its width that is milled. Source: Neptune Labs, guideline for machined parts."""
_USUAL = 5e-5
"""Deviation in m of sizes from 0.5 to 6 mm of the fine class. Source: ISO 2768-1, class f."""
_SHEAR = 0.6 * 800e6 / 1.25
"""Shear of a screw of class 8.8 over its stress area in Pa. Source: EN 1993-1-8, table 3.4."""
_FACTOR = 2.0
"""Torque that bolts must bear over the largest of the curve; assumed, since it alternates."""
_COUNTS = (4, 6, 8)
_CIRCLES = 12


class _Screw(NamedTuple):
    """A screw, its hole in m and its stress area in m². Sources: ISO 273, fine; ISO 898-1."""

    name: str
    hole: float
    area: float


_SCREWS = (
    _Screw("M1.6", 1.7e-3, 1.27e-6),
    _Screw("M2", 2.2e-3, 2.07e-6),
    _Screw("M2.5", 2.7e-3, 3.39e-6),
    _Screw("M3", 3.2e-3, 5.03e-6),
    _Screw("M4", 4.3e-3, 8.78e-6),
    _Screw("M5", 5.3e-3, 14.2e-6),
    _Screw("M6", 6.4e-3, 20.1e-6),
)


def process_of(part: CamPart) -> str:
    """Return the process that the edges and the channel of a part ask for, and why."""
    tolerance = part.number("edge_tolerance")
    fine = f"± {MM * tolerance:.3g} mm"
    if "groove_depth" in part.numbers and "mouth_width" in part.numbers:
        depth, width = part.number("groove_depth"), part.number("mouth_width")
        deep = f"channel {MM * width:.3g} mm wide and {MM * depth:.3g} mm deep, {depth / width:.2g} times"
        if depth > _DEEPEST * width:
            return (
                f"{deep}: die-sinking erosion, since mills reach {_DEEPEST:g} widths (Neptune Labs) and "
                "a wire needs a channel that is cut through"
            )
        return f"{deep}: milling" + (
            f", fine for {fine} (ISO 2768-1 f: ± 0.05)" if tolerance < _USUAL else ""
        )
    if tolerance < _USUAL:
        return f"edges cut through, {fine}: wire erosion or fine milling (ISO 2768-1 f: ± 0.05)"
    return f"edges cut through, {fine}: milling"


@dataclass(frozen=True, eq=False)
class Mounting:
    """A part on its shaft: what carries the largest torque of a curve from one to the other."""

    # machined, contour: sizes of the part, and the curve that it is made for
    machined: MachinedCam
    contour: Contour
    part: CamPart  # made of both
    torque: float  # in N·m

    def remarks(self) -> Iterator[str]:
        """Yield the process of the part, where nothing carries the torque, and bolts that would."""
        yield f"to be made by: {process_of(self.part)}"
        if self.machined.bolts is not None:
            count = self.machined.bolts.count
            hole = self.part.number("bolt_hole") * (1.0 + 1e-9)
            screw = next((each for each in reversed(_SCREWS) if each.hole <= hole), None)
            force = _FACTOR * self.torque / (count * self.part.number("bolt_circle") / 2.0)
            if screw is None or force > _SHEAR * screw.area:
                most = "no screw from M1.6 on passes"
                if screw is not None:
                    most = f"{screw.name} carries {_SHEAR * screw.area:.3g} N"
                yield (
                    f"{count} bolts take {_FACTOR:g} times {self.torque:.3g} N·m with {force:.3g} N each, "
                    f"{most} in shear (class 8.8, EN 1993-1-8){self.bolts_that_do()}"
                )
            return
        bore = "neither bore, bolts, key nor clamp"
        if self.machined.hub_bore is not None:
            radius = self.part.number("hub_bore") / 2.0
            bore = (
                f"a bore of {2.0 * MM * radius:.3g} mm without bolts, key or clamp, on whose rim it is "
                f"{self.torque / radius:.3g} N"
            )
        yield (
            f"nothing carries the largest torque, {self.torque:.3g} N·m, from the part to its shaft: {bore}"
            f"{self.bolts_that_do()}"
        )

    def bolts_that_do(self) -> str:
        """Return bolts in words that carry the torque in shear and fit the part, each tried; else nothing."""
        reach = 2.0 * float(self.contour.radii.max())
        for count in _COUNTS:
            for step in range(_CIRCLES, 2, -1):
                circle = math.floor(1e3 * reach * step / _CIRCLES) * 1e-3
                needed = _FACTOR * self.torque / (count * circle / 2.0) / _SHEAR
                screw = next((each for each in _SCREWS if each.area >= needed), None)
                if screw is None:
                    continue
                bolts = BoltCircle(count=count, circle=circle, hole=screw.hole)
                try:
                    replace(self.machined, bolts=bolts).part(self.contour)
                except NlsError:
                    # It does not fit there.
                    continue
                sizes = f'count = {count}, circle = "{MM * circle:.3g} mm", hole = "{MM * screw.hole:.3g} mm"'
                held = f"carry {_FACTOR:g} times it in shear ({screw.name}, class 8.8)"
                return f" -> bolts = {{{sizes}}} fit and {held}"
        return " -> no bolts that carry it fit: leave room for a key or a clamp, or take a larger body_radius"
