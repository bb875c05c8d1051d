"""Drawing of a cam for the workshop on one page A4: views, dimensions, torque table, title block."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from ...design import CamPart, carrying_note, process_of
from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import MM, Quantity, with_unit
from .sheet import THICK, THIN, Sheet
from .style import GRID, MUTED, SURFACE, VERMILLION, described, styled

_WIDTH, _HEIGHT, _BORDER = 297.0, 210.0, 8.0
_COLUMN = 202.0
"""Left edge of the column with tables and title block."""
_VIEW = (38.0, 78.0, 158.0, 192.0)
"""Left, lower, right and upper edge of the place of the main view."""
_DETAIL = (42.0, 37.0, 21.0)
"""Centre and radius of the detail."""
_AXIS = (0, (10, 2, 1.5, 2))
"""Dashes of an axis."""
_SCALES = (50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)
_MOST_ROWS = 16
_CORNERS = np.array([[-1.0, -1.0], [1.0, 1.0]])
_NOTE = 96
"""Letters in a line of the notes."""
_SIZES = (
    ("cable_radius", "Cable radius"),
    ("roller_radius", "Roller radius"),
    ("pitch_radius", "Axis to roller at 0°"),
    ("pivot_distance", "Pivot to pivot at 0°"),
    ("narrowest_hollow", "Narrowest hollow"),
    ("thickness", "Plate thickness"),
    ("groove_depth", "Depth of the edges"),
    ("base_radius", "Base radius"),
    ("channel_width", "Channel width"),
    ("mouth_width", "Channel width, mouth"),
    ("channel_length", "Mouth to mouth"),
    ("ferrule_seat", "Ferrule seat"),
    ("clamp_hole", "Clamp hole"),
    ("lead_in", "Lead-in"),
    ("sharpest_edge", "Sharpest edge radius"),
    ("tool_radius", "Tool radius, at most"),
    ("over_travel", "Run-out beyond last angle"),
    ("anchor_distance", "Axis to cable anchor"),
)


@dataclass(frozen=True)
class InspectionRow:
    """What is to be measured on the finished spring at one angle, in SI.

    Parameters
    ----------
    angle
        Cam angle in rad.
    torque
        In N·m.
    lever_arm
        In m.
    tension
        Of one cable, in N.
    """

    angle: float
    torque: float
    lever_arm: float
    tension: float


@dataclass(frozen=True, kw_only=True)
class TitleBlock:
    """What the drawing says of itself; it holds no date, so that the same part gives the same file.

    Parameters
    ----------
    title
        Name of the part.
    deck
        Deck or design that it belongs to.
    fingerprint
        Of the numbers of the design.
    material
        Of the plate.
    file
        File that holds the edge.
    """

    title: str
    deck: str
    fingerprint: str
    material: str = "to be stated"
    file: str = "cam.dxf"


@styled
def workshop_drawing(part: CamPart, *, title: TitleBlock, rows: Sequence[InspectionRow] = ()) -> Figure:
    """Return the drawing of a cam on one page A4, for SVG and PDF at true scale.

    Parameters
    ----------
    part
        The cam.
    title
        Title block.
    rows
        Torque table for inspection, at most 16 rows.

    Raises
    ------
    ValueRangeError
        If the table does not fit.
    """
    if len(rows) > _MOST_ROWS:
        raise ValueRangeError(
            f"torque table of {len(rows)} rows", f"at most {_MOST_ROWS} fit on the page",
            next_step="take fewer angles",
        )  # fmt: skip
    page = Sheet(_WIDTH, _HEIGHT)
    page.box(_BORDER, _BORDER, width=_WIDTH - 2 * _BORDER, height=_HEIGHT - 2 * _BORDER)
    view = _View(part)
    _main_view(page, view)
    _dimensions(page, view)
    _side_view(page, view)
    if "mouth_width" in part.numbers:
        _mouth_detail(page, part)
    _notes(page, part, title, max((row.torque for row in rows), default=0.0))
    _column(page, part, rows, title, view.scale)
    return described(
        page.figure,
        f"Drawing of {title.title} for the workshop, scale {scale_text(view.scale)}, with dimensions, "
        f"{len(rows)} rows of a torque table and the title block.",
    )


def scale_text(scale: float) -> str:
    """Return a scale as it is written on drawings.

    Examples
    --------
    >>> scale_text(5.0), scale_text(0.5)
    ('5:1', '1:2')
    """
    return f"{scale:g}:1" if scale >= 1.0 else f"1:{1.0 / scale:g}"


class _View:
    """Where the points of the part lie on the page."""

    def __init__(self, part: CamPart) -> None:
        self.part = part
        self.outlines = [outline.polygon(2e-6) for outline in part.outlines]
        rim = part.base_radius * np.array([[-1.0, -1.0], [1.0, 1.0]])
        around = [each.centre + each.diameter / 2 * rim for each in part.rollers for rim in _CORNERS]
        every = np.vstack([*self.outlines, *([rim] if part.base_radius else []), *around])
        self.low, self.high = every.min(axis=0), every.max(axis=0)
        left, lower, right, upper = _VIEW
        room = np.array([right - left, upper - lower])
        fits = [s for s in _SCALES if np.all(s * MM * (self.high - self.low) <= room)]
        self.scale = fits[0] if fits else _SCALES[-1]
        self.origin = (
            np.array([left + right, lower + upper]) / 2 - self.scale * MM * (self.low + self.high) / 2
        )

    def at(self, points: Array) -> Array:
        """Return places on the page of points of the part."""
        result: Array = self.origin + self.scale * MM * np.asarray(points)
        return result


def _main_view(page: Sheet, view: _View) -> None:
    part = view.part
    if part.base_radius:
        _circle(page, view.at(np.zeros(2)), view.scale * MM * part.base_radius, linewidth=THICK)
    for outline in view.outlines:
        page.area(view.at(outline), facecolor=GRID.light)
    for hole in part.holes:
        look: dict[str, Any] = {"linewidth": THICK, "linestyle": "-", "facecolor": SURFACE.light}
        if hole.base_only:
            look = {"linewidth": THIN, "linestyle": (0, (3, 2)), "facecolor": "none"}
        if hole.outline is not None:
            page.area(view.at(hole.outline.polygon(2e-6)), **look)
        else:
            _circle(page, view.at(hole.centre), view.scale * MM * hole.diameter / 2, **look)
        centre = view.at(hole.centre)
        reach = view.scale * MM * hole.diameter / 2 + 1.2
        for step in (np.array([reach, 0.0]), np.array([0.0, reach])):
            page.line(centre - step, centre + step, color=MUTED.light, width=0.3)
    for roller in part.rollers:
        size = view.scale * MM * roller.diameter / 2
        _circle(page, view.at(roller.centre), size, linewidth=THIN, edgecolor=VERMILLION.light)
    for cable in part.cables:
        page.line(*view.at(_clipped(cable.points, 1.06 * part.outermost)), color=VERMILLION.light, width=THIN)
    low, high = view.at(view.low) - 4.0, view.at(view.high) + 4.0
    axis = view.at(np.zeros(2))
    page.line((axis[0], low[1]), (axis[0], high[1]), linestyle=_AXIS, color=MUTED.light)
    page.line((low[0], axis[1]), (high[0], axis[1]), linestyle=_AXIS, color=MUTED.light)
    if "bolt_circle" in part.numbers:
        circle = view.scale * MM * part.number("bolt_circle") / 2
        _circle(page, axis, circle, linewidth=THIN, linestyle=_AXIS, edgecolor=MUTED.light)


def _dimensions(page: Sheet, view: _View) -> None:
    every = np.vstack(view.outlines)
    size = every.max(axis=0) - every.min(axis=0)
    left, bottom = (float(value) for value in view.at(view.low))
    ends = [
        view.at(every[index])
        for axis in (0, 1)
        for index in (every[:, axis].argmin(), every[:, axis].argmax())
    ]
    page.measure(ends[0], ends[1], text=_length(size[0]), away=bottom - 9.0)
    page.measure(ends[2], ends[3], text=_length(size[1]), away=left - 12.0, upright=True)
    _named_holes(page, view)
    _edge_ends(page, view)


def _edge_ends(page: Sheet, view: _View) -> None:
    """Say where the cable touches at the last angle, and what rounds the end; away from the dimensions."""
    part = view.part
    left, bottom = (float(value) for value in view.at(view.low))
    near = np.argmin(np.hypot(*(view.outlines[0] - part.centre_line[-1]).T))
    place = view.at(view.outlines[0][near])
    right = place[0] > view.at((view.low + view.high) / 2)[0]
    bends = [(place[0] + 5.0, bottom - 17.0), (place[0] + 5.0, bottom - 24.0)]
    if not right:
        bends = [(left - 2.0, bottom - 23.0), (left - 2.0, bottom - 15.0)]
    last, beyond = (math.degrees(part.number(name)) for name in ("last_angle", "over_travel"))
    page.pointer(place, bends[0], text=f"contact at {last:.4g}°,\nthen run-out {beyond:.3g}°")
    outline, corner = part.outlines[0], part.number("corner_radius")
    arcs = np.flatnonzero(np.isclose(np.abs(outline.radii), corner, rtol=1e-6))
    if len(arcs):
        middle = view.at((outline.ends[0] + outline.ends[1])[arcs[0]] / 2)
        page.pointer(middle, bends[1], text=f"R{_length(corner)}, ends of the edge")


def _named_holes(page: Sheet, view: _View) -> None:
    """Diameters above the view: the rightmost to the right, the others to the left, the leftmost lowest."""
    part = view.part
    named: list[tuple[Array, float, str]] = []
    bolts = [hole for hole in part.holes if hole.name.startswith("bolt")]
    if bolts:
        chosen = max(bolts, key=lambda hole: float(hole.centre @ [1.0, 1.2]))
        where = _length(part.number("bolt_circle"))
        named.append(
            (
                chosen.centre,
                chosen.diameter,
                f"{len(bolts)} × Ø{_length(chosen.diameter)} through, on Ø{where}",
            )
        )
    for name, text in (("hub bore", "hub bore"), ("clamp hole", "for the clamp")):
        these = [hole for hole in part.holes if hole.name == name]
        if these:
            hole = min(these, key=lambda hole: float(hole.centre[0]))
            count = f"{len(these)} × " if len(these) > 1 else ""
            where = ", base only" if hole.base_only else ""
            if hole.key is not None:
                across = _length(hole.diameter / 2 + hole.reach)
                where += f", keyway {hole.key.width:g} JS9, {across} across"
            named.append((hole.centre, hole.diameter, f"{count}Ø{_length(hole.diameter)} {text}{where}"))
    if part.base_radius:
        named.append((np.zeros(2), 2 * part.base_radius, f"Ø{_length(2 * part.base_radius)} base"))
    top = float(view.at(view.high)[1])
    shift = {id(item): -item[1] / 2 if item[2].endswith("base") else 0.0 for item in named}
    named.sort(key=lambda item: float(item[0][0]) + shift[id(item)])
    for number, (centre, diameter, text) in enumerate(named):
        right = number == len(named) - 1
        lean = np.array([0.5 if right else -0.6, math.sqrt(0.75) if right else 0.8])
        tip = view.at(centre + diameter / 2 * lean)
        height = top + 6.0 + (0.0 if right else 5.5 * number)
        page.pointer(tip, (tip[0] + (6.0 if right else -5.0), height), text=text)


def _side_view(page: Sheet, view: _View) -> None:
    """Plate seen from the right: lips and, with a groove, the base plate."""
    part = view.part
    left = 184.0
    thick = view.scale * MM * part.number("thickness")
    if thick > 14.0:
        left = max(198.0 - thick - 2.0, _VIEW[2] + 8.0)
    floor = thick - view.scale * MM * part.number("groove_depth") if part.base_radius else 0.0
    for outline in view.outlines:
        low, high = (
            view.at(np.array([0.0, float(value)]))[1] for value in (outline[:, 1].min(), outline[:, 1].max())
        )
        page.area(_rectangle(left + floor, low, thick - floor, high - low), facecolor=GRID.light)
    rim = part.base_radius
    if rim:
        low, high = (view.at(np.array([0.0, side * rim]))[1] for side in (-1.0, 1.0))
        page.area(_rectangle(left, low, floor, high - low), facecolor=GRID.light)
    else:
        low, high = view.at(view.low)[1], view.at(view.high)[1]
    page.measure(
        np.array([left, low]),
        np.array([left + thick, low]),
        text=_length(part.number("thickness")),
        away=low - 9.0,
    )
    if rim:
        lips = max(float(outline[:, 1].max()) for outline in view.outlines)
        top = view.at(np.array([0.0, lips]))[1]
        page.measure(
            np.array([left + floor, top]), np.array([left + thick, top]),
            text=_length(part.number("groove_depth")), away=high + 6.0,
        )  # fmt: skip


def _mouth_detail(page: Sheet, part: CamPart) -> None:
    """The right mouth of the channel, with the widths there and inside."""
    x, y, radius = _DETAIL
    mouth = part.number("channel_length") / 2
    inside = part.number("channel_width")
    relief = part.outlines[0].points[-1] if len(part.outlines[0].points) else np.zeros(2)
    shown = max(1.6 * inside, 1.25 * (mouth - float(relief[0])), 4 * part.number("cable_radius"))
    scale = next((s for s in _SCALES if s * MM * shown <= radius), _SCALES[-1])
    middle = np.array([mouth, 0.0])
    frame = Circle((x, y), radius, facecolor="none", edgecolor=MUTED.light, linewidth=THIN)
    page.axes.add_patch(frame)
    for outline in part.outlines:
        patch = page.area((outline.polygon(5e-7) - middle) * MM * scale + [x, y], facecolor=GRID.light)
        patch.set_clip_path(frame)
    half = MM * scale * part.number("mouth_width") / 2
    text = f"{_length(part.number('mouth_width'))} at the mouth"
    page.measure(
        np.array([x, y - half]), np.array([x, y + half]), text=text, away=x + radius + 3.0, upright=True
    )
    half, at = MM * scale * inside / 2, x - 0.75 * radius
    text = f"{_length(inside)} inside"
    page.measure(
        np.array([at, y - half]), np.array([at, y + half]), text=text, away=x - radius - 3.0, upright=True
    )
    page.text(x, y - radius - 3.6, text=f"Mouths of the channel, {scale_text(scale)}", ha="center")


def _notes(page: Sheet, part: CamPart, title: TitleBlock, torque: float) -> None:
    tolerance = MM * part.number("edge_tolerance")
    lines = [
        f"1  Edge under the {part.counterpart}: lines and arcs of {title.file}, "
        f"profile ± {tolerance:.3g} mm over the",
        "    contact and the run-out; no burr, break the flanks 0.1 mm.",
        f"2  The drawn edge is that for the {part.counterpart} stated; another one needs another edge.",
    ]
    if "mouth_width" in part.numbers:
        lines.append(
            f"3  Mouths of the channel: + {tolerance:.3g} / 0 mm, edges opposite each other within that."
        )
    elif part.partners:
        lines.append("3  Cut two. Teeth or bands that keep them from slipping are not drawn.")
    elif part.rollers:
        lines.append("3  No roller runs on the back, between the ends of the edge.")
    else:
        lines.append("3  The lead-in is straight and tangent to the edge at angle zero.")
    lines += [
        f"4  Holes: places as in {title.file}, ± 0.05 mm; else ISO 2768-1 m (both assumed).",
        "5  Coloured: "
        + ("way of the centre of what rolls on it" if part.rolls else "centre line of the cable")
        + " at zero and at the last angle.",
        *textwrap.wrap(f"6  Process: {process_of(part)}.", _NOTE, subsequent_indent="    "),
    ]
    lines += textwrap.wrap(f"7  {carrying_note(part, torque)}", _NOTE, subsequent_indent="    ")
    lines.append("*  Size assumed, or without a source.")
    x = 84.0 if "mouth_width" in part.numbers else 14.0
    page.text(x, 13.0, text="\n".join(lines), va="bottom", linespacing=1.45)


def _column(
    page: Sheet, part: CamPart, rows: Sequence[InspectionRow], title: TitleBlock, scale: float
) -> None:
    top, right = _HEIGHT - _BORDER, _WIDTH - _BORDER
    width = right - _COLUMN
    if rows:
        head = ("angle in °", "torque in N·m", "arm in mm", f"{'spring' if part.rolls else 'cable'} in N")
        cells = [
            (
                f"{math.degrees(r.angle):.1f}",
                f"{r.torque:.3f}",
                f"{MM * r.lever_arm:.3f}",
                f"{r.tension:.1f}",
            )
            for r in rows
        ]
        top = page.table(
            (_COLUMN, top), (0.21 * width, 0.30 * width, 0.25 * width, 0.24 * width), rows=[head, *cells]
        )
    known = [(text, part.numbers[name]) for name, text in _SIZES if name in part.numbers]
    sizes = [(f"{text}{' *' if number.assumed else ''}", _value(number)) for text, number in known]
    sizes.append(("Edge drawn within", f"{1e6 * part.number('edge_deviation'):.2g} µm"))
    page.table((_COLUMN, top), (0.66 * width, 0.34 * width), rows=[("Size", "Value"), *sizes])
    block = [
        ("Part", title.title),
        ("Deck", title.deck),
        ("Design", title.fingerprint),
        ("Material", title.material),
        (
            ("Pair", part.size_of_counterpart)
            if part.partners
            else (part.counterpart.title(), f"Ø{_length(2 * part.number(f'{part.counterpart}_radius'))} mm")
        ),
        ("Scale, sheet", f"{scale_text(scale)}, A4, mm"),
    ]
    row, low = 5.2, _BORDER
    for number, (name, text) in enumerate(reversed(block)):
        base = low + number * row
        page.box(_COLUMN, base, width=width, height=row)
        page.text(_COLUMN + 1.2, base + 1.6, text=name, color=MUTED.light)
        longest = int(0.72 * width / 1.45)
        shown = text if len(text) <= longest else text[: longest - 1] + "…"
        page.text(
            _COLUMN + 0.26 * width, base + 1.6, text=shown, weight="bold" if name == "Part" else "normal"
        )


def _circle(page: Sheet, centre: Array, radius: float, **look: Any) -> None:
    style: dict[str, Any] = {"facecolor": "none", "edgecolor": "#1c2127", **look}
    page.axes.add_patch(Circle((float(centre[0]), float(centre[1])), radius, **style))


def _clipped(points: Array, reach: float) -> Array:
    """Return a line whose first and last piece end at a distance from the axis."""
    result = points.copy()
    for end, before in ((0, 1), (-1, -2)):
        inner, step = points[before], points[end] - points[before]
        # |inner + s·step| = reach
        a, b, c = step @ step, 2 * inner @ step, inner @ inner - reach**2
        if c < 0.0 < a:
            share = (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
            result[end] = inner + min(1.0, share) * step
    return result


def _rectangle(x: float, y: float, width: float, height: float) -> Array:
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


def _length(value: float) -> str:
    return f"{round(MM * value, 2):g}"


def _value(number: Quantity) -> str:
    if number.unit == "m":
        return f"{MM * number.number:.4g} mm"
    return f"{number.shown:.4g}°" if number.unit == "deg" else with_unit(f"{number.shown:.4g}", number.unit)
