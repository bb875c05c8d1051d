"""DXF of the year 2000 with units: closed edges of lines and arcs, holes, axis, cable and text on layers.

Layers: ``EDGE`` and ``BASE`` are cut, ``HOLES`` drilled; ``CENTRE``, ``CABLE``, ``PITCH`` (way of a roller),
``ROLLER``, ``CONTOUR`` and ``TEXT`` are for reading. Files are the same for the same part: they hold no date.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import MM
from .arc_path import ArcPath
from .cam_part import CamPart

if TYPE_CHECKING:
    from ezdxf.document import Drawing


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
        x, y = (_rounded(value) for value in hole.centre)
        space.add_circle((x, y), _rounded(hole.diameter / 2.0), dxfattribs={"layer": "HOLES"})
    for roller in part.rollers:
        x, y = (_rounded(value) for value in roller.centre)
        space.add_circle((x, y), _rounded(roller.diameter / 2.0), dxfattribs={"layer": "ROLLER"})
    for cable in part.cables:
        _add_path(document, cable, "PITCH" if part.rollers else "CABLE")
    _add_axes(document, part.outermost)
    radius, thickness = (f"{MM * part.number(n):.4g} mm" for n in (f"{part.counterpart}_radius", "thickness"))
    lines = [
        "Cam, machined edge; millimetres, 1:1",
        f"for a {part.counterpart} of radius {radius}, plate {thickness}",
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
