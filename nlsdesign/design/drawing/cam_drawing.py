"""Drawings of a cam for the workshop: CSV, SVG, DXF and STEP, all in millimetres.

Each file says its unit and a short hash of the numbers that it was drawn from, so that a part on the bench
can be traced to its design. Files appear whole or not at all.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ...foundation.errors import ValueRangeError, unknown_name
from ...foundation.quantity import MM, Quantity
from ...foundation.text_files import write_text
from ..statics.contour import Contour, turn
from ..statics.roller_contour import RollerContour
from .arc_path import ArcPath
from .cam_part import CamPart
from .dxf_drawing import contour_dxf, part_dxf
from .machined_cam import MachinedCam
from .step_solid import part_step
from .svg_drawing import page, part_svg, path_data

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
    for index, outline in enumerate(part.outlines, start=1):
        for start, end, radius, centre in zip(*outline.ends[:2], outline.radii, outline.centres, strict=True):
            arc = [radius, *centre] if np.isfinite(radius) else [None] * 3
            rows.append((f"edge {index}", [*start, *end, *arc]))
    rows += [(hole.name, [None] * 4 + [hole.diameter / 2.0, *hole.centre]) for hole in part.holes]
    if part.base_radius:
        rows.append(("base", [None] * 4 + [part.base_radius, 0.0, 0.0]))
    head = [
        "# cam, machined edge; lengths in mm, axis at (0, 0), cable at angle zero along x",
        "# a row without a radius is a straight line; a positive radius turns to the left",
        f"# {part.counterpart} radius {part.number(f'{part.counterpart}_radius') * MM:.6g} mm is taken off",
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
