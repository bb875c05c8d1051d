"""C99 text: number types, literals, identifiers and comments."""

from __future__ import annotations

import math
import re
import textwrap
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Real:
    """A floating-point type of C: how its numbers and functions are written.

    Parameters
    ----------
    name
        ``"double"`` or ``"float"``.
    suffix
        Suffix of literals and of functions of ``math.h``.
    largest
        Largest finite number.
    epsilon
        Distance from 1 to the next number.
    portable
        Functions of ``math.h`` that are replaced by our own, see :mod:`.elementary`.
    """

    name: str
    suffix: str
    largest: float
    epsilon: float
    portable: frozenset[str] = frozenset()

    def round(self, value: float) -> float:
        """Return the number of this type that is nearest to a value.

        Parameters
        ----------
        value
            Any number.
        """
        with np.errstate(over="ignore"):
            return float(np.float32(value)) if self.name == "float" else float(value)

    def literal(self, value: float) -> str:
        """Return a number as C text that reads back as the same number.

        Parameters
        ----------
        value
            Any number but NaN; an infinite one becomes ``INFINITY``.

        Raises
        ------
        ExportError
            If a finite value has no finite counterpart in this type.
        """
        if math.isnan(value):
            raise ExportError(
                "the equations", "contain the constant NaN", next_step="correct the law that contains it"
            )
        if math.isinf(value):
            return f"({'-' if value < 0 else ''}({self.name})INFINITY)"
        rounded = self.round(value)
        if math.isinf(rounded):
            raise ExportError(
                f"the constant {value:g}",
                f"is too large for {self.name}",
                next_step="export with real='double'",
            )
        text = str(np.float32(value)) if self.name == "float" else repr(rounded)
        return (text if any(mark in text for mark in ".e") else text + ".0") + self.suffix

    def bound(self, value: float) -> str:
        """Return a limit as C text; an infinite limit becomes the largest finite number.

        Parameters
        ----------
        value
            A minimum or maximum.
        """
        return self.literal(min(max(value, -self.largest), self.largest))

    def function(self, name: str) -> str:
        """Return the name of a function of ``math.h`` for this type, or of our own in its place.

        Parameters
        ----------
        name
            Name for ``double``.
        """
        return ("portable_" if name in self.portable else "") + name + self.suffix


DOUBLE = Real("double", "", float(np.finfo(np.float64).max), float(np.finfo(np.float64).eps))
FLOAT = Real("float", "f", float(np.finfo(np.float32).max), float(np.finfo(np.float32).eps))


def real_type(name: str) -> Real:
    """Return the number type of that name.

    Parameters
    ----------
    name
        ``"double"`` or ``"float"``.

    Raises
    ------
    ExportError
        If it is neither.
    """
    for each in (DOUBLE, FLOAT):
        if each.name == name:
            return each
    raise ExportError(
        f"real='{name}'",
        "must be 'double' or 'float'",
        did_you_mean=nearest(name, ["double", "float"]),
    )


def identifier(text: str) -> str:
    """Return a C and C++ identifier made from a name.

    Parameters
    ----------
    text
        Any name; other characters become ``_``.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text) or "_"
    if name[0].isdigit():
        name = "_" + name
    return name + "_" if name in _KEYWORDS else name


def comment(text: str) -> str:
    """Return text that cannot end, nest or continue a C comment.

    Parameters
    ----------
    text
        Any text; line breaks become spaces.
    """
    flat = " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    return flat.rstrip("\\")


def wrapped(text: str) -> list[str]:
    """Return a C comment of several lines.

    Parameters
    ----------
    text
        Any text.
    """
    lines = textwrap.wrap(comment(text), 104, break_on_hyphens=False)
    return [("/* " if i == 0 else "   ") + line for i, line in enumerate(lines[:-1])] + [
        ("   " if len(lines) > 1 else "/* ") + lines[-1] + " */"
    ]


def signature(head: str, *parameters: str) -> str:
    """Return the head of a function, with one parameter per line if they do not fit on one line.

    Parameters
    ----------
    head
        Result type and name.
    parameters
        The parameters.
    """
    line = f"{head}({', '.join(parameters)})"
    return line if len(line) < 110 else f"{head}(\n    " + ",\n    ".join(parameters) + ")"


def string(text: str) -> str:
    """Return a C string literal.

    Parameters
    ----------
    text
        Any text; line breaks become spaces.
    """
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"').replace("??", '?""?') + '"'
