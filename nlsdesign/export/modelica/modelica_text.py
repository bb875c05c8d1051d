"""Modelica text: names, numbers, strings and units."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable

from ...foundation.errors import ExportError
from ...foundation.quantity import parse_unit

_NOT_QUOTABLE = re.compile(r"[^A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~]")
_KEYWORDS = frozenset(
    keyword
    for line in (
        "algorithm and annotation block break class connect connector constant constrainedby der discrete",
        "each else elseif elsewhen encapsulated end enumeration equation expandable extends external false",
        "final flow for function if import impure in initial inner input loop model not operator or outer",
        "output package parameter partial protected public pure record redeclare replaceable return stream",
        "then true type when while within time",
    )
    for keyword in line.split()
)


def class_name(text: str) -> str:
    """Return a plain Modelica identifier made from a name.

    ``text``: any name; other characters become ``_``.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text) or "_"
    if name[0].isdigit():
        name = "_" + name
    return name + "_" if name in _KEYWORDS else name


def quoted_names(names: Iterable[str]) -> dict[str, str]:
    """Return quoted Modelica identifiers, which may hold dots and brackets; different for different names.

    Examples
    --------
    >>> quoted_names(["motor.angle"])
    {'motor.angle': "'motor.angle'"}
    """
    quoted: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = _NOT_QUOTABLE.sub("_", name)
        number, other = 1, plain
        while other in taken:
            number, other = number + 1, f"{plain}_{number + 1}"
        taken.add(other)
        quoted[name] = f"'{other}'"
    return quoted


def literal(value: float) -> str:
    """Return a number that reads back as the same number; an infinite one becomes the largest finite one."""
    if value != value:
        raise ExportError(
            "the model", "contains the number NaN", next_step="correct the law or the start value behind it"
        )
    return repr(min(max(float(value), -sys.float_info.max), sys.float_info.max))


def string(text: str) -> str:
    """Return a Modelica string.

    ``text``: any text; line breaks become spaces.
    """
    flat = " ".join(text.split())
    # A last backslash is followed by a space, as not every tool sees that it is escaped itself.
    flat += " " if flat.endswith("\\") else ""
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'


def modelica_unit(unit: str) -> str:
    """Return a unit in the syntax of Modelica: dots for products, one slash, no sign of a power.

    Examples
    --------
    >>> modelica_unit("N*m*s/rad"), modelica_unit("1/N/s"), modelica_unit("kg*m^2")
    ('N.m.s/rad', '1/(N.s)', 'kg.m2')
    """
    parse_unit(unit)
    above: list[str] = []
    below: list[str] = []
    place = above
    for piece in re.split(r"([*·/])", unit.replace("Ω", "Ohm").replace(" ", "")):
        if piece in ("*", "·", "/"):
            place = below if piece == "/" else above
        elif piece != "1":
            place.append(piece.replace("^", ""))
    if not below:
        return ".".join(above) or "1"
    denominator = ".".join(below)
    return f"{'.'.join(above) or '1'}/{denominator if len(below) == 1 else f'({denominator})'}"
