"""STEP of a cam as a solid, through Open CASCADE: an extra, because that library takes 380 MB of disk."""

from __future__ import annotations

import itertools
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ...foundation.errors import ExportError, missing_library
from ...foundation.quantity import MM
from .cam_part import CamPart

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
        from OCP.BRepBuilderAPI import (
            BRepBuilderAPI_MakeEdge,
            BRepBuilderAPI_MakeFace,
            BRepBuilderAPI_MakeWire,
        )
        from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
        from OCP.GC import GC_MakeArcOfCircle
        from OCP.gp import gp_Pnt, gp_Vec

        def point(place: Any) -> Any:
            return gp_Pnt(MM * float(place[0]), MM * float(place[1]), floor)

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
        lip = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, top - floor)).Shape()
        shape = lip if shape is None else BRepAlgoAPI_Fuse(shape, lip).Shape()
    for hole in part.holes:
        x, y = MM * hole.centre
        height = floor if hole.base_only else top
        shape = BRepAlgoAPI_Cut(shape, _cylinder(x, y, MM * hole.diameter / 2.0, height)).Shape()
    if shape is None or not BRepCheck_Analyzer(shape).IsValid():
        raise ExportError("STEP", "Open CASCADE made no valid solid", next_step="take DXF or SVG instead")
    return shape


def _cylinder(x: float, y: float, radius: float, height: float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, 0.0), gp_Dir(0.0, 0.0, 1.0)), radius, height).Shape()
