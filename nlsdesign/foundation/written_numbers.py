"""Numbers and heads of columns as people write them: taken apart into number or name, and unit."""

from __future__ import annotations

import re

from .errors import UnitError
from .quantity import parse_unit

_COMMA = re.compile(r",(?P<digits>\d[\d.,]*(?:[eE][-+]?\d+)?)\s*(?P<unit>.*)$")
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]+)\]$")


def split_number(text: str) -> tuple[float, str]:
    """Return number and unit of ``"5 N·m"``, ``"5N*m"`` or ``"5N.m"``; a full stop in a unit is a product.

    Examples
    --------
    >>> split_number("5N.m")
    (5.0, 'N*m')
    """
    match = re.match(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)\b)\s*(.*)$", text)
    if match is None:
        raise UnitError(f"'{text}'", "does not start with a number")
    comma = _COMMA.match(match.group(2))
    if comma is not None:
        raise _with_comma(text, match.group(1), comma)
    unit = re.sub(r"(?<=[^\W\d])\.(?=[^\W\d])", "*", match.group(2).strip())
    return float(match.group(1)), unit


def _with_comma(text: str, whole: str, behind: re.Match[str]) -> UnitError:
    """Return the error on a comma, which parts decimals in one country and thousands in another."""
    digits, unit = behind["digits"], behind["unit"]
    pieces = [f"{whole}.{digits} {unit}".rstrip()]
    if len(digits) == 3 and whole.strip("-+0"):
        pieces.append(f"{whole}{digits} {unit}".rstrip())
    several = any(mark in digits for mark in ",.")
    step = "write it without commas" if several else "write " + " or ".join(f"'{each}'" for each in pieces)
    return UnitError(f"'{text}'", "has a comma; decimals are written with a point", next_step=step)


def name_and_unit(head: str) -> tuple[str, str | None]:
    """Return what the head of a column says, ``name [unit]`` or ``name_unit``: its name and its unit."""
    match = _BRACKETED.match(head)
    name, _, unit = (match["name"], "", match["unit"]) if match else head.rpartition("_")
    try:
        parse_unit(unit)
    except UnitError:
        return head, None  # brackets that hold no unit belong to the name
    return name, unit
