"""What a person sees of an FMU: a page about it, an icon, the licence.

Where an FMU comes from: who made it, when, and from which deck.

``documentation/origin.json`` holds the deck with all numbers, and a digest of every other file of the FMU.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from html import escape
from typing import Any

from ...foundation.deck import ParentDeck
from ...foundation.errors import ExportError, ValueRangeError
from ...foundation.locations import version
from ...foundation.locations import version as own_version
from ...foundation.quantity import typeset_unit
from ...model.flat import FlatModel
from ...model.origin import Origin
from ..files import filled
from .fmu_variables import FLANGE, LOOP, FmuLayout, FmuVariable, Terminal, terminals

SHORT_DIGEST = 12
"""Digits of a deck's digest where the whole would be in the way."""

_LICENCE = (
    "Shells in C: MIT, see documentation/licenses/license.txt; equations and numbers: as the author of the "
    "model states"
)


@dataclass(frozen=True)
class Authorship:
    """What an FMU says of its author; everything may be left out.

    Parameters
    ----------
    author, copyright, licence
        As text; without a licence that of the templates is named.
    version
        Of the model; by default the first digits of the deck's digest.
    date
        Of the export, with a time zone. By default the time that ``SOURCE_DATE_EPOCH`` names, so that an
        archive can be made again bit by bit, and without it the present time.

    Raises
    ------
    ValueRangeError
        If the date has no time zone, or a text holds what is no character.
    """

    author: str = ""
    copyright: str = ""
    licence: str = ""
    version: str = ""
    date: datetime | None = None

    def __post_init__(self) -> None:
        if self.date is not None and self.date.tzinfo is None:
            raise ValueRangeError(
                f"date {self.date}", "has no time zone", next_step="give datetime(..., tzinfo=timezone.utc)"
            )

        for name in ("author", "copyright", "licence", "version"):
            text = getattr(self, name)
            if text != text.encode("utf-8", "replace").decode("utf-8"):
                raise ValueRangeError(
                    f"{name} {text!a}", "holds what is no character", next_step="give it in UTF-8"
                )

    def dated(self) -> Authorship:
        """Return the same with a date.

        Raises
        ------
        ExportError
            If ``SOURCE_DATE_EPOCH`` is no number of seconds.
        """
        if self.date is not None:
            return self
        named = os.environ.get("SOURCE_DATE_EPOCH")
        try:
            when = datetime.fromtimestamp(int(named), UTC) if named else datetime.now(UTC)
        except (ValueError, OverflowError, OSError):
            raise ExportError(
                f"SOURCE_DATE_EPOCH={named!r}",
                "must be a whole number of seconds since 1970-01-01",
                next_step="unset it, or set it to the output of `git log -1 --format=%ct`",
            ) from None
        return replace(self, date=when)

    def undated(self) -> Authorship:
        """Return the same without a date, for what must not change from day to day."""
        return replace(self, date=None)

    def attributes(self, origin: Origin | None) -> dict[str, str]:
        """Return the attributes of a model description.

        Parameters
        ----------
        origin
            Deck behind the model.
        """
        version = self.version or (origin.digest[:SHORT_DIGEST] if origin else "")
        texts: Mapping[str, str] = {
            "author": self.author,
            "version": version,
            "copyright": self.copyright,
            "license": self.licence or _LICENCE,
            "generationDateAndTime": self.stamp,
        }
        return {name: text for name, text in texts.items() if text}

    @property
    def stamp(self) -> str:
        """The date as FMI writes it, in UTC; empty without a date."""
        return self.date.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ") if self.date else ""


def described(description: str, origin: Origin | None) -> str:
    """Return the description of a model with its deck."""
    if origin is None:
        return description
    return f"{description} (deck {origin.deck}, SHA-256 {origin.digest[:SHORT_DIGEST]})"


ORIGIN_FILE = "documentation/origin.json"
ORIGIN_FORMAT = "nlsdesign origin 1"


def with_origin(model: FlatModel, contents: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the contents of an FMU with one file more, which says where they come from."""
    origin = model.origin
    deck = origin and {
        "name": origin.deck,
        "sha256": origin.digest,
        "changed": list(origin.changed),
        "parent": _parent(origin.parent),
        "numbers": {
            name: {"value": q.shown, "unit": q.unit, "source": q.source, "spread": q.spread_data}
            for name, q in origin.numbers.items()
        },
    }
    record = {
        "format": ORIGIN_FORMAT,
        "generator": f"nlsdesign {version()}",
        "model": model.name,
        "deck": deck,
        "files": {path: hashlib.sha256(contents[path]).hexdigest() for path in sorted(contents)},
    }
    text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
    return {**contents, ORIGIN_FILE: text.encode()}


def _parent(parent: ParentDeck | None) -> dict[str, Any] | None:
    if parent is None:
        return None
    words = {"name": parent.name, "sha256": parent.digest, "change": parent.change}
    return {**words, "parent": _parent(parent.parent)}


def page(layout: FmuLayout, authorship: Authorship | None = None) -> str:
    """Return ``documentation/index.html``: a table of all variables, readable without a network."""
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
    attached = terminals(model)
    tables += "".join(_terminal_table(each) for each in attached)
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


def _terminal_table(each: Terminal) -> str:
    rows = "\n".join(
        f"<tr><td>{escape(m.name)}</td><td>{escape(m.variable)}</td><td>{m.kind}</td></tr>"
        for m in each.members
    )
    head = "<tr><th>member</th><th>variable</th><th>kind</th></tr>"
    title = f"Terminal {escape(each.name)} ({each.rule}, FMI 3.0 only)"
    return f"\n<h2>{title}</h2>\n<p>{escape(each.description)}</p>\n<table>\n{head}\n{rows}\n</table>"


def _table_row(each: FmuVariable) -> str:
    v = each.variable
    limits = "" if math.isinf(v.minimum) and math.isinf(v.maximum) else f"{v.minimum:g} to {v.maximum:g}"
    spread = f" {v.spread_text}" if v.spread else ""
    cells = (
        v.name,
        f"{v.start:g}{spread}" if each.has_start else "",
        typeset_unit(v.unit),
        limits,
        v.description,
        v.source,
    )
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


@cache
def icon(name: str = "icon") -> bytes:
    """Return a PNG: the model as a spiral cam with its cable, or one of its terminals."""
    size, pixel = 96, {LOOP: _of_loop, FLANGE: _of_flange}.get(name, _of_model)
    axis = [(i + 0.5) / size * 2 - 1 for i in range(size)]
    rows = b"".join(b"\0" + bytes(v for x in axis for v in pixel(x, -y)) for y in axis)
    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


_Pixel = tuple[int, int, int, int]
_BLUE, _RED, _WHITE, _CLEAR = (38, 84, 124, 255), (200, 85, 61, 255), (255, 255, 255, 255), (0, 0, 0, 0)


def _of_model(x: float, y: float) -> _Pixel:
    radius, angle = math.hypot(x + 0.25, y), math.atan2(y, x + 0.25) % (2 * math.pi)
    rim = 0.3 + 0.3 * angle / (2 * math.pi)
    if radius < 0.08:
        return _WHITE
    if radius < rim:
        return _BLUE
    return _RED if x > -0.25 and abs(y + 0.55) < 0.045 else _CLEAR


def _of_loop(x: float, y: float) -> _Pixel:
    """A bus: three lines in a frame."""
    if max(abs(x), abs(y)) > 0.8:
        return _BLUE
    return _BLUE if min(abs(y - at) for at in (-0.4, 0.0, 0.4)) < 0.07 else _WHITE


def _of_flange(x: float, y: float) -> _Pixel:
    """A flange: a disc with four holes."""
    if min(math.hypot(x - a, y - b) for a in (-0.45, 0.45) for b in (-0.45, 0.45)) < 0.13:
        return _WHITE
    return _RED if math.hypot(x, y) < 0.95 else _CLEAR
