"""What a person sees of an FMU: a page about it, an icon, the licence."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from html import escape

from ...locations import version as own_version
from ...model.origin import Origin
from ...quantity import typeset_unit
from ..files import filled
from .authorship import Authorship
from .fmu_variables import FmuLayout, FmuVariable


def page(layout: FmuLayout, authorship: Authorship | None = None) -> str:
    """Return ``documentation/index.html``: a table of all variables, readable without a network.

    Parameters
    ----------
    layout
        Variables of the FMU.
    authorship
        Author, licence and date.
    """
    model = layout.model
    kind = (
        "Continuous; integrated inside by Rodas4 with an exact Jacobian, inputs held over each step."
        if model.sample_time is None
        else f"Sampled every {model.sample_time:g} s from the start time on; outputs held between samples."
    )
    groups = (
        ("Inputs", layout.inputs),
        ("Outputs", layout.given_out),
        (
            "Parameters",
            (*layout.parameters, *([layout.extra] if layout.extra.causality == "parameter" else [])),
        ),
        ("States", layout.states),
        ("Derivatives and signals", (*layout.derivatives, *layout.signals)),
    )
    tables = "\n".join(_table(title, group) for title, group in groups if group)
    rows = _about(model.origin, authorship or Authorship())
    texts = {"title": model.name, "description": model.description, "kind": kind, "version": own_version()}
    return filled(
        "index.html", {key: escape(text) for key, text in texts.items()} | {"about": rows, "tables": tables}
    )


def _about(origin: Origin | None, authorship: Authorship) -> list[str]:
    """Return rows of a list that says where the FMU comes from."""
    known = authorship.attributes(origin)
    texts = {
        "Deck": origin.deck if origin else "",
        "SHA-256 of the deck": origin.digest if origin else "",
        "Version": known.get("version", ""),
        "Author": authorship.author,
        "Copyright": authorship.copyright,
        "Licence": known["license"],
        "Date of export": authorship.stamp,
    }
    return [f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in texts.items() if text]


def _table(title: str, group: Sequence[FmuVariable]) -> str:
    rows = "\n".join(_table_row(each) for each in group)
    head = (
        "<tr><th>name</th><th>value</th><th>unit</th><th>range</th><th>description</th><th>source</th></tr>"
    )
    return f"<h2>{title}</h2>\n<table>\n{head}\n{rows}\n</table>"


def _table_row(each: FmuVariable) -> str:
    v = each.variable
    limits = "" if math.isinf(v.minimum) and math.isinf(v.maximum) else f"{v.minimum:g} to {v.maximum:g}"
    spread = f" ± {100 * v.spread:g} %" if v.spread else ""
    cells = (
        v.name,
        f"{v.start:g}{spread}" if each.has_start else "",
        typeset_unit(v.unit),
        limits,
        v.description,
        v.source,
    )
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def icon(size: int = 96) -> bytes:
    """Return a PNG: a spiral cam with its centre and the cable that leaves it.

    Parameters
    ----------
    size
        Width and height in pixels.
    """
    rows = b"".join(b"\0" + bytes(v for i in range(size) for v in _pixel(i, j, size)) for j in range(size))
    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _pixel(i: int, j: int, size: int) -> tuple[int, int, int, int]:
    x, y = (i + 0.5) / size * 2 - 1, 1 - (j + 0.5) / size * 2
    radius, angle = math.hypot(x + 0.25, y), math.atan2(y, x + 0.25) % (2 * math.pi)
    rim = 0.3 + 0.3 * angle / (2 * math.pi)
    if radius < 0.08:
        return 255, 255, 255, 255
    if radius < rim:
        return 38, 84, 124, 255
    if x > -0.25 and abs(y + 0.55) < 0.045:
        return 200, 85, 61, 255
    return 0, 0, 0, 0
