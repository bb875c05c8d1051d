"""How a part is made and held: the process of its channel, what carries its torque, what holds its cable."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from ...foundation.errors import NlsError
from ...foundation.quantity import MM
from ..curves.numbers import plain
from ..statics.contour import Contour
from .cam_part import CamPart, Key
from .machined_cam import BoltCircle, ClampScrew, MachinedCam, MachinedOneSidedCam

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
_GRIP = 2.0 * 0.1 * 500e6 / 1.6
"""Friction of a cable between plate and washer over the stress area of their screw in Pa: on both faces, 0.1
(assumed: wire, a little oil), preload of class 8.8, scatter of a torque wrench. Source: VDI 2230-1."""
_YIELD, _PRESSED = 900e6, 0.9
"""Yield strength of the strongest usual hub in Pa (assumed), and its share that a key may press. Source: DIN
6892, method C."""


class _Screw(NamedTuple):
    """A screw, its hole, the core hole of its thread in m, its stress area in m².

    Sources: ISO 273, fine; ISO 2306; ISO 898-1.
    """

    name: str
    hole: float
    core: float
    area: float


_SCREWS = (
    _Screw("M1.6", 1.7e-3, 1.25e-3, 1.27e-6),
    _Screw("M2", 2.2e-3, 1.6e-3, 2.07e-6),
    _Screw("M2.5", 2.7e-3, 2.05e-3, 3.39e-6),
    _Screw("M3", 3.2e-3, 2.5e-3, 5.03e-6),
    _Screw("M4", 4.3e-3, 3.3e-3, 8.78e-6),
    _Screw("M5", 5.3e-3, 4.2e-3, 14.2e-6),
    _Screw("M6", 6.4e-3, 5.0e-3, 20.1e-6),
)


class BoltLoad(NamedTuple):
    """The bolts of a part under the factor times a torque: the thickest that pass, and the shear of each."""

    bolts: int
    screw: _Screw | None
    force: float  # in N

    @property
    def carried(self) -> bool:
        """Whether they bear it in shear."""
        return self.screw is not None and self.force <= _SHEAR * self.screw.area

    def __str__(self) -> str:
        most = "no screw from M1.6 on passes"
        if self.screw is not None:
            most = f"{self.screw.name} carries {_SHEAR * self.screw.area:.3g} N"
        return f"{self.force:.3g} N each, {most} in shear (class 8.8, EN 1993-1-8)"


def bolt_load(part: CamPart, torque: float) -> BoltLoad | None:
    """Return the load of the bolts of a part under a torque in N·m; ``None`` where it has none."""
    if "bolt_count" not in part.numbers:
        return None
    count, hole = int(part.number("bolt_count")), part.number("bolt_hole") * (1.0 + 1e-9)
    screw = next((each for each in reversed(_SCREWS) if each.hole <= hole), None)
    return BoltLoad(count, screw, _FACTOR * torque / (count * part.number("bolt_circle") / 2.0))


class KeyLoad(NamedTuple):
    """A key under the factor times a torque: what it is pressed over, and what plate and shaft need."""

    key: Key
    length: float  # in mm
    # plate, shaft: least yield strength in Pa, against pressure, and of a solid shaft in torsion
    plate: float
    shaft: float

    @property
    def carried(self) -> bool:
        """Whether a usual plate and a usual shaft bear it."""
        return max(self.plate, self.shaft) <= _YIELD

    def __str__(self) -> str:
        return (
            f"a key of {self.key} over {self.length:.3g} mm, with a yield strength of at least "
            f"{1e-6 * self.plate:.3g} MPa of the plate (DIN 6892 C) and {1e-6 * self.shaft:.3g} MPa of "
            "a solid shaft (torsion beside its keyway)"
        )


def key_load(part: CamPart, torque: float) -> KeyLoad | None:
    """Return the load of the key of a part under a torque in N·m; ``None`` where it has none."""
    bore = next((hole for hole in part.holes if hole.key is not None), None)
    if bore is None or bore.key is None:
        return None
    key, size, length = bore.key, MM * bore.diameter, MM * part.number("thickness")
    if bore.base_only:
        length -= MM * part.number("groove_depth")
    pressure = 1e6 * _FACTOR * 2e3 * torque / (size * key.pressed * length)
    # Round what is left beside the keyway of the shaft; its yield in shear is 1/√3 of that in tension.
    core = (size - (key.height - key.pressed)) / MM
    shear = 16.0 * _FACTOR * torque / (math.pi * core**3)
    return KeyLoad(key, length, pressure / _PRESSED, math.sqrt(3.0) * shear)


def carrying_note(part: CamPart, torque: float) -> str:
    """Return in words what carries a torque in N·m from a part to its shaft; zero where it is not known."""
    load, keyed = bolt_load(part, torque), key_load(part, torque)
    if load is None and keyed is not None:
        if not torque:
            return f"A key of {keyed.key} carries the torque."
        verb = "carries" if keyed.carried else "DOES NOT CARRY"
        return f"The key {verb} {_FACTOR:g} times {torque:.3g} N·m: {keyed}."
    if load is None:
        what = f" of {torque:.3g} N·m" if torque else ""
        return f"Nothing drawn here carries the torque{what}: no bolts, key or clamp."
    if not torque:
        return f"{load.bolts} bolts carry the torque."
    verb = "carry" if load.carried else "DO NOT CARRY"
    return f"{load.bolts} bolts {verb} {_FACTOR:g} times {torque:.3g} N·m: {load}."


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
    tension: float = 0.0  # largest of the cable in N

    def remarks(self) -> Iterator[str]:
        """Yield the process of the part, what does not carry the torque or hold the cable, and what would."""
        yield f"to be made by: {process_of(self.part)}"
        yield from self.cable_remarks()
        load = bolt_load(self.part, self.torque)
        if load is not None:
            if not load.carried:
                yield (
                    f"{load.bolts} bolts take {_FACTOR:g} times {self.torque:.3g} N·m with {load}"
                    f"{self.bolts_that_do()}"
                )
            return
        keyed = key_load(self.part, self.torque)
        if keyed is not None:
            yield carrying_note(self.part, self.torque) + ("" if keyed.carried else self.bolts_that_do())
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

    def cable_remarks(self) -> Iterator[str]:
        """Yield that a clamp screw does not hold the cable, and the thinnest that fits and does.

        A two-sided cam is pulled alike on both sides, so its clamps bear only what the sides differ by.
        """
        end = self.machined.cable_end if isinstance(self.machined, MachinedOneSidedCam) else None
        if not isinstance(end, ClampScrew):
            return
        hole = self.part.number("clamp_hole") * (1.0 + 1e-9)
        screw = next((each for each in reversed(_SCREWS) if each.core <= hole), None)
        if screw is not None and _FACTOR * self.tension <= _GRIP * screw.area:
            return
        most = "no thread from M1.6 on has so small a core hole"
        if screw is not None:
            most = f"{screw.name} holds {_GRIP * screw.area:.3g} N by friction (class 8.8, VDI 2230-1)"
        remedy = " -> no thicker screw that holds it fits: take a FerruleSeat"
        for thicker in _SCREWS:
            if _FACTOR * self.tension <= _GRIP * thicker.area and self.fits(
                cable_end=replace(end, diameter=thicker.core)
            ):
                sizes = f'cable_end = {{ClampScrew = {{diameter = "{MM * thicker.core:.3g} mm"}}}}'
                remedy = f" -> {sizes} fits, and {thicker.name} holds it"
                break
        yield (f"the clamp of the cable has to hold {_FACTOR:g} times {self.tension:.3g} N: {most}{remedy}")

    def fits(self, **changes: object) -> bool:
        """Tell whether the part can be made with other sizes."""
        try:
            replace(self.machined, **changes).part(self.contour)  # type: ignore[arg-type]
        except NlsError:
            return False
        return True

    def bolts_that_carry(self) -> tuple[BoltCircle, str] | None:
        """Return bolts that carry the torque in shear and fit the part, each tried, and their thread."""
        reach = 2.0 * float(self.contour.radii.max())
        for count in _COUNTS:
            for step in range(_CIRCLES, 2, -1):
                circle = math.floor(1e3 * reach * step / _CIRCLES) * 1e-3
                needed = _FACTOR * self.torque / (count * circle / 2.0) / _SHEAR
                screw = next((each for each in _SCREWS if each.area >= needed), None)
                if screw is None:
                    continue
                bolts = BoltCircle(count=count, circle=circle, hole=screw.hole)
                if self.fits(bolts=bolts):
                    return bolts, screw.name
        return None

    def bolts_that_do(self) -> str:
        """Return those bolts in words, or else a key."""
        carry = self.bolts_that_carry()
        if carry is None:
            return f" -> no bolts that carry it fit: {self.key_that_does()}"
        bolts, thread = carry
        circle, hole = (MM * plain(size) for size in (bolts.circle, bolts.hole))
        sizes = f'count = {bolts.count}, circle = "{circle:.3g} mm", hole = "{hole:.3g} mm"'
        return f" -> bolts = {{{sizes}}} fit and carry {_FACTOR:g} times it in shear ({thread}, class 8.8)"

    def key_that_does(self) -> str:
        """Return the key of the bore where it fits and a hub bears it, with its strength; else what to do."""
        if self.machined.keyway:
            return "take a larger bore or a thicker plate"
        try:
            keyed = key_load(replace(self.machined, keyway=True).part(self.contour), self.torque)
        except NlsError:
            keyed = None  # no key is made for this bore, or its keyway leaves too thin a wall: then none does
        if keyed is not None and keyed.carried:
            return f"keyway = true does: {keyed}"
        return "leave room for a key or a clamp, or take a larger body_radius"
