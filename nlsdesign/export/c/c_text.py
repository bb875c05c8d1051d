"""C99 text: number types, literals, identifiers, comments and heads of functions.

Where generated C comes from: deck, digest, numbers, date, and whether a file was changed afterwards.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
import textwrap
import zlib
from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from ...foundation.errors import ExportError, nearest
from ...foundation.locations import version
from ...foundation.quantity import Quantity
from ...foundation.text_files import STAMP
from ...model.flat import FlatModel
from ...model.origin import Origin

# C99 and C++ together: the headers are meant to be included from both.
_KEYWORDS = frozenset(
    keyword
    for line in (
        "auto break case char const continue default do double else enum extern float for goto if",
        "inline int long register restrict return short signed sizeof static struct switch typedef",
        "union unsigned void volatile while alignas alignof and asm bool catch class concept",
        "constexpr decltype delete explicit export false friend mutable namespace new noexcept not",
        "nullptr operator or private protected public requires template this thread_local throw true",
        "try typeid typename using virtual wchar_t xor",
    )
    for keyword in line.split()
)


class Real(StrEnum):
    """A floating-point type of C: how its numbers and functions are written."""

    DOUBLE = "double"
    FLOAT = "float"

    @classmethod
    def named(cls, name: str) -> Real:
        """Return the type of that name, ``"double"`` or ``"float"``."""
        if name not in tuple(cls):
            raise ExportError(
                f"real='{name}'",
                "must be 'double' or 'float'",
                did_you_mean=nearest(name, list(cls)),
            )
        return cls(name)

    @property
    def suffix(self) -> str:
        """Suffix of literals and of functions of ``math.h``."""
        return "f" if self is Real.FLOAT else ""

    @property
    def largest(self) -> float:
        """Largest finite number."""
        return float(self._format.max)

    @property
    def epsilon(self) -> float:
        """Distance from 1 to the next number."""
        return float(self._format.eps)

    @property
    def _format(self) -> np.finfo[Any]:
        return np.finfo(np.float32 if self is Real.FLOAT else np.float64)

    def round(self, value: float) -> float:
        """Return the number of this type that is nearest to a value."""
        with np.errstate(over="ignore"):
            return float(np.float32(value)) if self is Real.FLOAT else float(value)

    def literal(self, value: float) -> str:
        """Return a number as C text that reads back as the same number; an infinite one as ``INFINITY``."""
        if math.isnan(value):
            raise ExportError(
                "the equations", "contain the constant NaN", next_step="correct the law that contains it"
            )
        if math.isinf(value):
            return f"({'-' if value < 0 else ''}({self})INFINITY)"
        rounded = self.round(value)
        if math.isinf(rounded):
            raise ExportError(
                f"the constant {value:g}",
                f"is too large for {self}",
                next_step="export with real='double'",
            )
        text = str(np.float32(value)) if self is Real.FLOAT else repr(rounded)
        return (text if any(mark in text for mark in ".e") else text + ".0") + self.suffix

    def bound(self, value: float) -> str:
        """Return a limit as C text; an infinite limit becomes the largest finite number."""
        return self.literal(min(max(value, -self.largest), self.largest))

    def function(self, name: str) -> str:
        """Return the name of a function of C for this type from its name for ``double``."""
        return name + self.suffix

    def table(self, name: str, rows: Sequence[Sequence[float]]) -> list[str]:
        """Return the definition of a table of constants, NaN too; none where it has no column."""
        width = len(rows[0]) if rows else 0
        if not width:
            return []
        lines = [f"static const {self} {name}[{len(rows)}][{width}] = {{"]
        for row in rows:
            cells = (f"({self})NAN" if math.isnan(v) else self.literal(v) for v in row)
            lines.append("    {" + ", ".join(cells) + "},")
        return [*lines, "};"]


def identifier(text: str, keywords: Collection[str] = _KEYWORDS) -> str:
    """Return an identifier made from any name, by default one of C and C++; other characters become ``_``."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text) or "_"
    if name[0].isdigit():
        name = "_" + name
    return name + "_" if name in keywords else name


def comment(text: str) -> str:
    """Return text on one line that cannot end, nest or continue a C comment."""
    flat = " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    return flat.rstrip("\\")


def wrapped(text: str) -> list[str]:
    """Return a text as a C comment of as many lines as it needs."""
    lines = textwrap.wrap(comment(text), 104, break_on_hyphens=False)
    return [("/* " if i == 0 else "   ") + line for i, line in enumerate(lines[:-1])] + [
        ("   " if len(lines) > 1 else "/* ") + lines[-1] + " */"
    ]


def signature(head: str, *parameters: str) -> str:
    """Return the head of a function, with one parameter per line if they do not fit on one line."""
    line = f"{head}({', '.join(parameters)})"
    return line if len(line) < 110 else f"{head}(\n    " + ",\n    ".join(parameters) + ")"


def cells(name: str, count: int) -> list[str]:
    """Return the elements of an array of C."""
    return [f"{name}[{i}]" for i in range(count)]


def string(text: str) -> str:
    """Return a C string literal of one line."""
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"').replace("??", '?""?') + '"'


SHORT = 12
"""Digits of a digest that a person reads: 48 bits, in which two decks of one workshop never agree."""

_LONGEST_ROW = 6
"""Numbers of a row that are shown; of a longer row the first three and the last."""

_DIGEST = "SHA-256 of all above this comment:"
_STAMPED = re.compile(
    rf"/\* Exported [^\n]*; (?:no deck|deck ([0-9a-f]{{12}}))\. {re.escape(_DIGEST)}\n"
    r"   ([0-9a-f]{64}) \*/\n*\Z"
)
_DATE_VARIABLE = "SOURCE_DATE_EPOCH"


def export_date() -> datetime:
    """Return the date of the export in UTC: now, or what ``SOURCE_DATE_EPOCH`` says, in seconds since 1970.

    Notes
    -----
    With the variable an export is the same bytes every time, as https://reproducible-builds.org proposes.
    """
    given = os.environ.get(_DATE_VARIABLE, "")
    if not given:
        return datetime.now(UTC)
    try:
        return datetime.fromtimestamp(int(given), UTC)
    except (ValueError, OverflowError, OSError):
        raise ExportError(
            f"{_DATE_VARIABLE}={given}", "is not a number of seconds since 1970",
            next_step=f"unset {_DATE_VARIABLE}, or set it for instance to $(date +%s)",
        ) from None  # fmt: skip


def stamped(text: str, model: FlatModel) -> str:
    """Return a generated file with a last comment: version, date, deck, and a digest of what is above."""
    deck = f"deck {model.origin.digest[:SHORT]}" if model.origin else "no deck"
    digest = hashlib.sha256(text.encode()).hexdigest()
    date = f"{export_date():%Y-%m-%d %H:%M} UTC"
    return f"{text}{STAMP}{version()} on {date}; {deck}. {_DIGEST}\n   {digest} */\n"


class Stamp(NamedTuple):
    """Last comment of a generated file: first digits of its deck, digest of the text, and what it is now."""

    deck: str
    stated: str
    actual: str


def stamp_of(text: str) -> Stamp | None:
    r"""Return what the last comment of a file says, and the digest of what is above it.

    Result: ``None`` where the file has no such comment.
    """
    match = _STAMPED.search(text)
    if match is None:
        return None
    return Stamp(match[1] or "", match[2], hashlib.sha256(text[: match.start()].encode()).hexdigest())


def origin_lines(model: FlatModel) -> list[str]:
    """Return lines of a comment: the deck of a model with its digest, its parents, and what was changed."""
    origin = model.origin
    if origin is None:
        return ["   Made without a deck."]
    lines = [f"   Deck {comment(origin.deck)}, {origin.digest[:SHORT]} (SHA-256 of its parts)."]
    for parent in origin.parent.line() if origin.parent else ():
        how = comment(parent.change)
        lines.append(f"   From {comment(parent.name)}, {parent.digest[:SHORT]}{how and f' ({how})'}.")
    if origin.changed:
        names = ", ".join(origin.changed[:4]) + ", ..." * (len(origin.changed) > 4)
        lines.append(f"   Not as in the deck that was read: {comment(names)}.")
    return lines


def origin_macros(model: FlatModel, name: str) -> list[str]:
    """Return ``#define`` lines for the deck of a model, empty texts where there is none."""
    upper, origin = name.upper(), model.origin or Origin("", "")
    return [
        f"#define {upper}_DECK {string(origin.deck)}",
        f"#define {upper}_DECK_DIGEST {string(origin.digest)}",
        f"#define {upper}_PARENT_DIGEST {string(origin.parent.digest if origin.parent else '')}",
    ]


def number_lines(model: FlatModel) -> list[str]:
    """Return a comment with all numbers of the deck behind a model, none where there is no deck."""
    numbers = model.origin.numbers if model.origin else {}
    if not numbers:
        return []
    lines = ["", "/* Numbers of the deck, each with its source."]
    for name, number in numbers.items():
        first, *rest = (line[3:].removesuffix(" */") for line in wrapped(_number(name, number)))
        lines += [f"   {first}", *(f"     {line}" for line in rest)]
    lines[-1] += " */"
    return lines


def _number(name: str, number: Quantity) -> str:
    shown = number.shown
    items = [f"{v:.12g}" for v in (shown if isinstance(shown, tuple) else (shown,))]
    if len(items) > _LONGEST_ROW:
        items = [*items[:3], "...", f"{items[-1]} ({len(items)} numbers)"]
    value = f"[{', '.join(items)}]" if isinstance(shown, tuple) else items[0]
    unit = "" if number.unit == "1" else f" {number.unit}"
    spread = f" {number.spread_text}".replace("±", "+-").rstrip()
    return f"{name} = {value}{unit}{spread} ({number.source})"


def interface_version(header: str, model: FlatModel) -> str:
    """Return a number that is another one where structures, functions or units of a header are others.

    It is the CRC-32 of the header without comments and macros, and of the units of the variables.
    """
    bare = re.sub(r"/\*.*?\*/", " ", header, flags=re.DOTALL)
    lines = [" ".join(line.split()) for line in bare.splitlines() if not line.lstrip().startswith("#")]
    groups = (model.inputs, model.outputs, model.parameters, model.states)
    units = [f"{v.name} {v.unit}" for group in groups for v in group]
    # A state that was never started is most often zero, and this number marks one that was.
    return f"0x{zlib.crc32(chr(10).join([*filter(None, lines), *units]).encode()) or 1:08x}u"


def comma_rows(items: Sequence[str]) -> list[str]:
    """Return items of a list of C, six in a line."""
    return [", ".join(items[i : i + 6]) + "," for i in range(0, len(items), 6)]


def half_byte_sums() -> list[str]:
    """Return the CRC-32 of each half byte as rows of C."""
    crc = list(range(16))
    for _ in range(4):
        crc = [(k >> 1) ^ (0xEDB88320 if k & 1 else 0) for k in crc]
    return comma_rows([f"0x{k:08x}u" for k in crc])
