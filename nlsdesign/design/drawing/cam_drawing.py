"""Drawings of a cam for the workshop: CSV, SVG and DXF (R12), all in millimetres.

Each file says its unit and a short hash of the numbers that it was drawn from, so that a part on the bench
can be traced to its design. Files appear whole or not at all.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...quantity import Quantity
from ...writing import write_text
from ..statics.contour import Contour, turn

Floats = NDArray[np.float64]

_MM = 1e3
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
    folder: Path, contour: Contour, *, name: str = "cam", note: str = "", cable_radius: float = 0.0
) -> list[Path]:
    """Write the contour as ``name.csv``, ``name.svg`` and ``name.dxf``.

    Parameters
    ----------
    folder
        Is made where it does not exist.
    contour
        What the cable's centre line touches.
    name
        Name of the files without suffix.
    note
        One line for each file, for instance a fingerprint and what it was designed for.
    cable_radius
        Radius of the cable in m: the cam lies deeper by it.

    Returns
    -------
    list of Path
        The files, in this order.
    """
    folder = Path(folder)
    note = " ".join(note.split())
    texts = {
        "csv": csv_text(contour, note=note, cable_radius=cable_radius),
        "svg": svg_text(contour, note=note, cable_radius=cable_radius),
        "dxf": dxf_text(contour, note=note, cable_radius=cable_radius),
    }
    paths = [folder / f"{name}.{suffix}" for suffix in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        write_text(path, text)
    return paths


def csv_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return the table of the lower right lip; the other three are its mirror images.

    Parameters
    ----------
    contour, note, cable_radius
        As for :func:`write_drawings`.
    """
    points = contour.surface(cable_radius) * _MM
    table = np.column_stack(
        [
            np.degrees(contour.angles),
            np.degrees(contour.directions),
            points,
            contour.lever_arms * _MM,
            (contour.radii_of_curvature - cable_radius) * _MM,
            np.hypot(*points.T),
        ]
    )
    head = [
        "# cam contour, lower right lip in the frame of the cam; lengths in mm, angles in deg",
        f"# cable radius {cable_radius * _MM:.6g} mm is taken off, "
        f"anchor distance {contour.anchor_distance * _MM:.6g} mm",
        f"# {note}",
        _COLUMNS,
    ]
    return "\n".join([*head, *(",".join(f"{item:.6f}" for item in row) for row in table)]) + "\n"


def svg_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return a picture at scale 1:1 with both halves, the centre and the cable at rest and at the last angle.

    Parameters
    ----------
    contour, note, cable_radius
        As for :func:`write_drawings`.
    """
    reach = 1.15 * float(contour.radii.max()) * _MM + 4.0
    last = float(contour.angles[-1])
    halves = [_svg_path(half * _MM) for half in contour.outlines(cable_radius=cable_radius)]
    # In the frame of the cam the cable turns the other way.
    cables = []
    for angle in (0.0, last, -last):
        line = contour.cable(angle) * _MM
        end = line[0] + (line[1] - line[0]) * min(1.0, 0.8 * reach / float(np.hypot(*(line[1] - line[0]))))
        cables += [_svg_line(turn(np.array([line[0], end]) * side, -angle)) for side in (1.0, -1.0)]
    size = 2 * reach
    body = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size:.3f}mm" height="{size:.3f}mm" '
        f'viewBox="{-reach:.3f} {-reach:.3f} {size:.3f} {size:.3f}">',
        f"<title>Cam contour, millimetres, scale 1:1. {_escaped(note)}</title>",
        '<g transform="scale(1,-1)" fill="none" stroke-linejoin="round">',
        *[f'<path d="{d}" fill="#d8d8d8" stroke="#202020" stroke-width="0.15"/>' for d in halves],
        *[f'<path d="{d}" stroke="#b03020" stroke-width="0.12"/>' for d in cables],
        '<path d="M -1.5 0 H 1.5 M 0 -1.5 V 1.5" stroke="#202020" stroke-width="0.1"/>',
        "</g>",
        f'<text x="{-reach + 1:.3f}" y="{reach - 1:.3f}" font-family="sans-serif" font-size="1.8">'
        f"mm, 1:1. {_escaped(note)}</text>",
        "</svg>",
    ]
    return "\n".join(body) + "\n"


def dxf_text(contour: Contour, *, note: str = "", cable_radius: float = 0.0) -> str:
    """Return both halves as closed polylines in AutoCAD R12 form, drawing units millimetres.

    Parameters
    ----------
    contour, note, cable_radius
        As for :func:`write_drawings`.
    """
    pairs: list[tuple[int, object]] = [
        (999, "cam contour; drawing units are millimetres"),
        (999, note.encode("ascii", "replace").decode()),
        (0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC"),
        (0, "SECTION"), (2, "ENTITIES"),
    ]  # fmt: skip
    for half in contour.outlines(cable_radius=cable_radius):
        pairs += [(0, "POLYLINE"), (8, "CAM"), (66, 1), (10, 0.0), (20, 0.0), (30, 0.0), (70, 1)]
        for x, y in half[:-1] * _MM:
            pairs += [(0, "VERTEX"), (8, "CAM"), (10, x), (20, y), (30, 0.0)]
        pairs += [(0, "SEQEND"), (8, "CAM")]
    pairs += [(0, "POINT"), (8, "CENTRE"), (10, 0.0), (20, 0.0), (30, 0.0), (0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code:3d}\n{_dxf_value(value)}\n" for code, value in pairs)


def _dxf_value(value: object) -> str:
    return f"{value:.6f}" if isinstance(value, float) else str(value)


def _svg_path(points: Floats) -> str:
    return f"{_svg_line(points)} Z"


def _svg_line(points: Iterable[Sequence[float]]) -> str:
    return "M " + " L ".join(f"{x:.4f} {y:.4f}" for x, y in points)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
