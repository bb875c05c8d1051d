"""C99 text: number types, literals, identifiers, comments and heads of functions."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Collection, Sequence
from enum import StrEnum
from typing import Any

import numpy as np

from ...foundation.errors import ExportError, nearest

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
