"""Drawings of a cam for the workshop: CSV, SVG, DXF and STEP, all in millimetres.

Each file says its unit and a short hash of the numbers that it was drawn from, so that a part on the bench
can be traced to its design. Files appear whole or not at all.

SVG of a cam at scale 1:1, with true arcs.

DXF of the year 2000 with units: closed edges of lines and arcs, holes, axis, cable and text on layers.

Layers: ``EDGE`` and ``BASE`` are cut, ``HOLES`` drilled; ``CENTRE``, ``CABLE``, ``PITCH`` (way of a roller,
or of the other pivot), ``ROLLER``, ``PARTNER`` (cam that rolls on this one), ``CONTOUR`` and ``TEXT`` are
for reading. Files are the same for the same part: they hold no date.

STEP of a cam as a solid, through Open CASCADE: an extra, because that library takes 380 MB of disk.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import math
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError, ValueRangeError, missing_library, unknown_name
from ...foundation.quantity import MM, Quantity
from ...foundation.text_files import write_text
from ..statics.contour import Contour, PairContour, RollerContour, turn
from .arc_path import ArcPath
from .cam_part import CamPart
from .machined_cam import MachinedCam

if TYPE_CHECKING:
    from ezdxf.document import Drawing

_PRODUCT = re.compile(r"PRODUCT\('[^']*','[^']*'")
_USE = re.compile(r"NEXT_ASSEMBLY_USAGE_OCCURRENCE\('\d+'")
_STAMP = re.compile(r"(FILE_NAME\(\s*')[^']*('\s*,\s*')[^']*(')")


def part_step(part: CamPart, *, name: str = "cam") -> str:
    """Return the text of a STEP file (AP214, millimetres): plate, lips and holes, without a date.

    The base plate lies from z = 0 up, the lips on it; holes through the base alone end below them.

    ``name``: name of the product in the file; what is neither letter nor digit becomes ``_``.
    """
    name = re.sub(r"[^\w.-]", "_", name, flags=re.ASCII)
    try:
        from OCP.Interface import Interface_Static
        from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    except ImportError:
        raise missing_library("STEP", "OCP (cadquery-ocp-novtk)", "step") from None
    shape = _solid(part)
    from OCP.Message import Message, Message_Gravity

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer = STEPControl_Writer()
    for key, value in (("write.step.schema", "AP214IS"), ("write.step.unit", "MM"),
                       ("write.step.product.name", name)):  # fmt: skip
        Interface_Static.SetCVal_s(key, value)
    writer.Transfer(shape, STEPControl_AsIs)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cam.step"
        writer.Write(str(file))
        if not file.is_file():
            raise ExportError("STEP", "Open CASCADE did not write it", next_step="take DXF or SVG instead")
        text = file.read_text(encoding="ascii", errors="replace")
    plain = _STAMP.sub(rf"\g<1>{name}\g<2>2000-01-01T00:00:00\g<3>", text, count=1)
    # Open CASCADE counts the products and uses of a session.
    plain = _PRODUCT.sub(f"PRODUCT('{name}','{name}'", plain)
    number = itertools.count(1)
    return _USE.sub(lambda _: f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{next(number)}'", plain)


def _solid(part: CamPart) -> Any:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepCheck import BRepCheck_Analyzer

    top = MM * part.number("thickness")
    floor = top - MM * part.number("groove_depth") if part.base_radius else 0.0
    shape = _cylinder(0.0, 0.0, MM * part.base_radius, floor) if part.base_radius else None
    for outline in part.outlines:
        lip = _prism(outline, floor, top)
        shape = lip if shape is None else BRepAlgoAPI_Fuse(shape, lip).Shape()
    for hole in part.holes:
        x, y = MM * hole.centre
        height = floor if hole.base_only else top
        tool = _cylinder(x, y, MM * hole.diameter / 2.0, height)
        if hole.outline is not None:
            tool = _prism(hole.outline, 0.0, height)
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    if shape is None or not BRepCheck_Analyzer(shape).IsValid():
        raise ExportError("STEP", "Open CASCADE made no valid solid", next_step="take DXF or SVG instead")
    return shape


def _prism(outline: ArcPath, bottom: float, top: float) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.gp import gp_Pnt, gp_Vec

    def point(place: Any) -> Any:
        return gp_Pnt(MM * float(place[0]), MM * float(place[1]), bottom)

    wire = BRepBuilderAPI_MakeWire()
    for start, end, bulge in zip(*outline.ends, strict=True):
        if bulge == 0.0:
            wire.Add(BRepBuilderAPI_MakeEdge(point(start), point(end)).Edge())
            continue
        # The middle of the arc lies bulge·chord/2 to the right of the chord's middle.
        chord = end - start
        middle = (start + end) / 2.0 + np.array([chord[1], -chord[0]]) * (bulge / 2.0)
        arc = GC_MakeArcOfCircle(point(start), point(middle), point(end)).Value()
        wire.Add(BRepBuilderAPI_MakeEdge(arc).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, top - bottom)).Shape()


def _cylinder(x: float, y: float, radius: float, height: float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, 0.0), gp_Dir(0.0, 0.0, 1.0)), radius, height).Shape()


# name -> (colour of AutoCAD's index, line type)
_LAYERS = {
    "EDGE": (7, "CONTINUOUS"),
    "BASE": (8, "CONTINUOUS"),
    "HOLES": (5, "CONTINUOUS"),
    "CENTRE": (1, "CENTER"),
    "CABLE": (3, "CONTINUOUS"),
    "CONTOUR": (3, "CONTINUOUS"),
    "PITCH": (3, "CENTER"),
    "ROLLER": (6, "CONTINUOUS"),
    "PARTNER": (6, "CONTINUOUS"),
    "TEXT": (8, "CONTINUOUS"),
}
_DASHES = (12.0, 8.0, -1.5, 1.0, -1.5)
_TEXT_HEIGHT = 1.8


def part_dxf(part: CamPart, *, note: str = "") -> str:
    """Return a cam as it is made; the numbers of the file are millimetres, and it says so."""
    document = _document()
    space = document.modelspace()
    for outline in part.outlines:
        _add_path(document, outline, "EDGE")
    if part.base_radius:
        space.add_circle((0.0, 0.0), _rounded(part.base_radius), dxfattribs={"layer": "BASE"})
    for hole in part.holes:
        if hole.outline is not None:
            _add_path(document, hole.outline, "HOLES")
            continue
        x, y = (_rounded(value) for value in hole.centre)
        space.add_circle((x, y), _rounded(hole.diameter / 2.0), dxfattribs={"layer": "HOLES"})
    for roller in part.rollers:
        x, y = (_rounded(value) for value in roller.centre)
        space.add_circle((x, y), _rounded(roller.diameter / 2.0), dxfattribs={"layer": "ROLLER"})
    for cable in part.cables:
        _add_path(document, cable, "PITCH" if part.rolls else "CABLE")
    for partner in part.partners:
        _add_path(document, partner, "PARTNER")
    _add_axes(document, part.outermost)
    lines = [
        "Cam, machined edge; millimetres, 1:1",
        f"for {part.size_of_counterpart}, plate {MM * part.number('thickness'):.4g} mm",
        f"arcs within {1e6 * part.number('edge_deviation'):.2g} um of the exact edge",
    ]
    if "groove_depth" in part.numbers:
        lines.append(f"edges milled {MM * part.number('groove_depth'):.4g} mm deep, base disc below")
    _add_text(document, [*lines, note] if note else lines, below=part.outermost)
    return _text(document)


def contour_dxf(outlines: tuple[Array, ...], *, lines: list[str]) -> str:
    """Return closed polygons on the layer ``CONTOUR``.

    ``outlines``: each of shape (n, 2) in m; the last point is the first.
    """
    document = _document()
    for outline in outlines:
        _add_path(document, ArcPath(outline[:-1], np.zeros(len(outline) - 1), closed=True), "CONTOUR")
    reach = max(float(np.hypot(*outline.T).max()) for outline in outlines)
    _add_axes(document, reach)
    _add_text(document, lines, below=reach)
    return _text(document)


def _document() -> Drawing:
    from ezdxf import units
    from ezdxf.filemanagement import new

    with _undated():
        document = new("R2000", units=units.MM)
    document.header["$MEASUREMENT"] = 1
    document.linetypes.add("CENTER", list(_DASHES), description="Center ____ _ ____ _ ____")
    for name, (colour, style) in _LAYERS.items():
        document.layers.add(name, color=colour, linetype=style)
    return document


@contextmanager
def _undated() -> Iterator[None]:
    """Let ezdxf write no date and no identifier of the moment; its own setting comes back afterwards."""
    from ezdxf._options import options

    kept = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = kept


def _text(document: Drawing) -> str:
    stream = io.StringIO()
    with _undated():
        document.write(stream)
    # Other letters in the way of DXF, so that the file is ASCII and reads the same on every system.
    return "".join(c if ord(c) < 128 else f"\\U+{ord(c):04X}" for c in stream.getvalue())


def _rounded(value: float) -> float:
    """Return millimetres to a millionth, so that all processors write the same digits."""
    return round(MM * float(value), 6) + 0.0


def _add_path(document: Drawing, path: ArcPath, layer: str) -> None:
    rows = [
        (_rounded(x), _rounded(y), round(float(bulge), 10) + 0.0)
        for (x, y), bulge in zip(path.points, path.bulges, strict=True)
    ]
    document.modelspace().add_lwpolyline(rows, format="xyb", close=path.closed, dxfattribs={"layer": layer})


def _add_axes(document: Drawing, reach: float) -> None:
    end = math.ceil(1.15 * MM * reach)
    for x, y in ((end, 0.0), (0.0, end)):
        document.modelspace().add_line((-x, -y), (x, y), dxfattribs={"layer": "CENTRE"})
    document.modelspace().add_point((0.0, 0.0), dxfattribs={"layer": "CENTRE"})


def _add_text(document: Drawing, lines: list[str], *, below: float) -> None:
    top = -math.ceil(1.2 * MM * below) - 2.0 * _TEXT_HEIGHT
    for index, line in enumerate(lines):
        document.modelspace().add_text(line, height=_TEXT_HEIGHT, dxfattribs={"layer": "TEXT"}).set_placement(
            (-math.ceil(MM * below), top - 1.7 * _TEXT_HEIGHT * index)
        )


_TEXT = 2.2


def part_svg(part: CamPart, *, note: str = "") -> str:
    """Return a cam as it is made, at scale 1:1, its cable at angle zero and at both ends of the contour."""
    sizes = [float(np.abs(cable.points).max()) for cable in (*part.cables, *part.partners)]
    sizes += [float(np.abs(each.centre).max()) + each.diameter / 2.0 for each in part.rollers]
    reach = 1.12 * MM * max(part.outermost, *sizes)
    body = []
    if part.base_radius:
        body.append(
            _circle(0.0, 0.0, part.base_radius, 'fill="#f0f0f0" stroke="#606060" stroke-width="0.12"')
        )
    body += [
        f'<path class="edge" d="{path_data(outline)}" fill="#d4d8dc" stroke="#202020" stroke-width="0.15"/>'
        for outline in part.outlines
    ]
    for hole in part.holes:
        look = (
            'fill="none" stroke="#202020" stroke-width="0.12" stroke-dasharray="0.8 0.5"'
            if hole.base_only
            else 'fill="white" stroke="#202020" stroke-width="0.12"'
        )
        if hole.outline is not None:
            body.append(f'<path d="{path_data(hole.outline)}" {look}/>')
        else:
            body.append(_circle(hole.centre[0], hole.centre[1], hole.diameter / 2.0, look))
    look = 'fill="none" stroke="#b03020" stroke-width="0.12"'
    body += [_circle(each.centre[0], each.centre[1], each.diameter / 2.0, look) for each in part.rollers]
    body += [
        f'<path class="cable" d="{path_data(cable)}" stroke="#b03020" stroke-width="0.1"/>'
        for cable in (*part.cables, *part.partners)
    ]
    body.append('<path d="M -1.5 0 H 1.5 M 0 -1.5 V 1.5" stroke="#202020" stroke-width="0.08"/>')
    text = (
        f"Machined edge for {part.size_of_counterpart}, plate {MM * part.number('thickness'):.4g} mm; mm, 1:1"
    )
    return page(reach, body, lines=[text, note])


def page(reach: float, body: list[str], *, lines: list[str]) -> str:
    """Return a square page about the axis with some lines of text below.

    ``reach``: half the width of the drawing in mm. ``body``: elements in mm with y upwards. ``lines``: text
    below the drawing; the first is the title too.
    """
    lines = [line.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") for line in lines if line]
    longest = max(len(line) for line in lines)
    size = min(_TEXT, 2.0 * reach / (0.56 * longest))
    below = (len(lines) + 0.5) * 1.5 * size
    width, height = 2.0 * reach, 2.0 * reach + below
    texts = [
        f'<text x="{-reach + size:.3f}" y="{reach + 1.5 * size * (index + 0.6):.3f}" '
        f'font-family="sans-serif" font-size="{size:.3f}">{line}</text>'
        for index, line in enumerate(lines)
    ]
    return (
        "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.3f}mm" height="{height:.3f}mm" '
                f'viewBox="{-reach:.3f} {-reach:.3f} {width:.3f} {height:.3f}">',
                f"<title>{'. '.join(lines)}</title>",
                f'<rect x="{-reach:.3f}" y="{-reach:.3f}" width="{width:.3f}" height="{height:.3f}" '
                'fill="white"/>',
                '<g transform="scale(1,-1)" fill="none" stroke-linejoin="round">',
                *body,
                "</g>",
                *texts,
                "</svg>",
            ]
        )
        + "\n"
    )


def path_data(path: ArcPath) -> str:
    """Return the path in mm as the data of an SVG path, y upwards."""
    points, (_, ends, bulges) = path.points * MM, path.ends
    steps = [f"M {points[0][0]:.5f} {points[0][1]:.5f}"]
    for (x, y), bulge, radius in zip(ends * MM, bulges, np.abs(path.radii) * MM, strict=True):
        if bulge == 0.0:
            steps.append(f"L {x:.5f} {y:.5f}")
        else:
            steps.append(
                f"A {radius:.6f} {radius:.6f} 0 {int(abs(bulge) > 1.0)} {int(bulge > 0.0)} {x:.5f} {y:.5f}"
            )
    return " ".join([*steps, "Z"] if path.closed else steps)


def _circle(x: float, y: float, radius: float, look: str) -> str:
    return f'<circle cx="{MM * x:.5f}" cy="{MM * y:.5f}" r="{MM * radius:.5f}" {look}/>'


FORMATS = ("csv", "svg", "dxf")
"""Files that are written unless others are asked for."""

_COLUMNS = "angle_deg,direction_deg,x_mm,y_mm,lever_arm_mm,radius_of_curvature_mm,radius_mm"


def fingerprint(values: Mapping[str, Quantity]) -> str:
    """Return twelve hexadecimal digits that stand for a set of named numbers.

    Parameters
    ----------
    values
        Quantities by name; the order does not matter.
    """
    lines = [f"{name}={[float(v).hex() for v in values[name].values]}" for name in sorted(values)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:12]


def write_drawings(
    folder: Path,
    contour: Contour,
    *,
    machined: MachinedCam | CamPart | None = None,
    name: str = "cam",
    note: str = "",
    cable_radius: float = 0.0,
    formats: Sequence[str] = FORMATS,
) -> list[Path]:
    """Write the drawings of a cam: ``name.csv``, ``name.svg`` and ``name.dxf``.

    With ``machined`` they show the part that a workshop makes: edge under the cable, channel, run-out, holes;
    ``name_centre_line.csv`` holds the curve of the cable's centre line. Without, they show the contour alone.

    Parameters
    ----------
    folder
        Is made where it does not exist.
    contour
        What the cable's centre line touches.
    machined
        Sizes of the part, or the part itself where it was made for this contour.
    name
        Name of the files without suffix.
    note
        One line for each file, for instance a fingerprint and what it was designed for.
    cable_radius
        In m, for the contour alone: the curve lies deeper by it. A machined cam declares its cable itself.
    formats
        ``"csv"``, ``"svg"``, ``"dxf"`` and, with ``machined`` and the extra ``step``, ``"step"``.

    Returns
    -------
    list of Path
        The files, in the order of the formats.

    Raises
    ------
    ValueRangeError
        If the cable is given twice, or the part cannot be made.
    ArrangementError
        If the edge crosses itself, or a bore would cut the channel.
    UnknownNameError
        If there is no such format.
    MissingLibraryError
        If STEP is asked for and Open CASCADE is not installed.
    """
    folder = Path(folder)
    note = " ".join(note.split())
    known = (*FORMATS, "step") if machined is not None else FORMATS
    for suffix in formats:
        if suffix not in known:
            raise unknown_name("format", suffix, known)
    texts: dict[str, dict[str, Callable[[], str]]]
    if machined is None:
        texts = {
            suffix: {f".{suffix}": partial(make, contour, note=note, cable_radius=cable_radius)}
            for suffix, make in (("csv", csv_text), ("svg", svg_text), ("dxf", dxf_text))
        }
    elif cable_radius:
        raise ValueRangeError(
            f"cable_radius {cable_radius * MM:g} mm", "is declared by the machined cam already",
            next_step="leave cable_radius out",
        )  # fmt: skip
    else:
        part = machined if isinstance(machined, CamPart) else machined.part(contour)
        texts = _part_texts(part, contour, name, note)
    # All are made before the first is written.
    made = [(f"{name}{ending}", text()) for suffix in formats for ending, text in texts[suffix].items()]
    for file, text in made:
        write_text(folder / file, text)
    return [folder / file for file, _ in made]


def _part_texts(
    part: CamPart, contour: Contour, name: str, note: str
) -> dict[str, dict[str, Callable[[], str]]]:
    note = f"{note}; sizes {fingerprint(part.numbers)}" if note else f"sizes {fingerprint(part.numbers)}"
    return {
        "csv": {
            ".csv": partial(edge_csv, part, note=note),
            "_centre_line.csv": partial(csv_text, contour, note=note),
        },
        "svg": {".svg": partial(part_svg, part, note=note)},
        "dxf": {".dxf": partial(part_dxf, part, note=note)},
        "step": {".step": partial(part_step, part, name=name)},
    }


def edge_csv(part: CamPart, *, note: str = "") -> str:
    """Return the lines and arcs of the edges, then the holes, one a row, in mm."""
    rows = []
    closed = [(f"edge {index}", outline) for index, outline in enumerate(part.outlines, start=1)]
    closed += [(hole.name, hole.outline) for hole in part.holes if hole.outline is not None]
    for name, outline in closed:
        for start, end, radius, centre in zip(*outline.ends[:2], outline.radii, outline.centres, strict=True):
            arc = [radius, *centre] if np.isfinite(radius) else [None] * 3
            rows.append((name, [*start, *end, *arc]))
    rows += [
        (hole.name, [None] * 4 + [hole.diameter / 2.0, *hole.centre])
        for hole in part.holes
        if hole.outline is None
    ]
    if part.base_radius:
        rows.append(("base", [None] * 4 + [part.base_radius, 0.0, 0.0]))
    head = [
        "# cam, machined edge; lengths in mm, axis at (0, 0), cable at angle zero along x",
        "# a row without a radius is a straight line; a positive radius turns to the left",
        f"# for {part.size_of_counterpart}" + ("" if part.partners else ", which is taken off"),
        f"# {note}",
        "outline,start_x_mm,start_y_mm,end_x_mm,end_y_mm,radius_mm,centre_x_mm,centre_y_mm",
    ]
    cells = [
        ",".join([what, *("" if item is None else f"{item * MM + 0.0:.6f}" for item in row)])
        for what, row in rows
    ]
    return "\n".join([*head, *cells]) + "\n"


def csv_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return the table of the lower right lip; the other three are its mirror images."""
    points = contour.surface(cable_radius) * MM
    table = np.column_stack(
        [
            np.degrees(contour.angles),
            np.degrees(contour.directions),
            points,
            contour.lever_arms * MM,
            (contour.radii_of_curvature - cable_radius) * MM,
            np.hypot(*points.T),
        ]
    )
    what = f"cable radius {cable_radius * MM:.6g} mm is taken off, "
    what += f"anchor distance {contour.anchor_distance * MM:.6g} mm"
    if isinstance(contour, PairContour):
        what = f"edge that rolls on its mirror image; pivots {contour.centre_radii[0] * MM:.6g} mm apart"
    if isinstance(contour, RollerContour):
        what = f"centre of a roller of radius {contour.roller_radius * MM:.6g} mm; radius of curvature: edge"
    head = [
        "# cam contour, lower right lip in the frame of the cam; lengths in mm, angles in deg",
        f"# {what}",
        f"# {note}",
        _COLUMNS,
    ]
    return "\n".join([*head, *(",".join(f"{item:.6f}" for item in row) for row in table)]) + "\n"


def svg_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return a picture at scale 1:1: both halves, the centre, the cable at rest and at the last angle."""
    reach = 1.15 * float(contour.radii.max()) * MM + 4.0
    last = float(contour.angles[-1])
    halves = [
        ArcPath(half[:-1], np.zeros(len(half) - 1), closed=True)
        for half in contour.outlines(cable_radius=cable_radius)
    ]
    # In the frame of the cam the cable turns the other way.
    cables = []
    sides = (1.0, -1.0)[: len(halves)]
    for angle in (0.0, last, -last):
        line = contour.cable(angle)
        step = line[1] - line[0]
        end = line[0] + step * min(1.0, 8e-4 * reach / float(np.hypot(*step)))
        cables += [turn(np.array([line[0], end]) * side, -angle) for side in sides]
    body = [
        *[f'<path d="{path_data(d)}" fill="#d8d8d8" stroke="#202020" stroke-width="0.15"/>' for d in halves],
        *[
            f'<path d="{path_data(ArcPath(d, np.zeros(2)))}" stroke="#b03020" stroke-width="0.12"/>'
            for d in cables
        ],
        '<path d="M -1.5 0 H 1.5 M 0 -1.5 V 1.5" stroke="#202020" stroke-width="0.1"/>',
    ]
    return page(reach, body, lines=["Cam contour, no edge to be cut; mm, 1:1", note])


def dxf_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return both halves as closed polylines on the layer ``CONTOUR``, in millimetres."""
    taken = f"cable radius {cable_radius * MM:.6g} mm taken off" if cable_radius else contour.drawn_line
    lines = [f"Cam contour, {taken}; millimetres, 1:1", "no edge to be cut: without channel and run-out"]
    return contour_dxf(contour.outlines(cable_radius=cable_radius), lines=[*lines, note] if note else lines)
