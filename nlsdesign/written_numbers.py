"""Numbers and heads of columns as people write them: taken apart into number or name, and unit."""

from __future__ import annotations

import re

from .errors import UnitError
from .quantity import parse_unit

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]+)\]$")


def split_number(text: str) -> tuple[float, str]:
    """Return number and unit of ``"5 N·m"``, ``"5N*m"`` or ``"5N.m"``; a full stop in a unit is a product.

    Parameters
    ----------
    text
        Number and unit.

    Raises
    ------
    UnitError
        If it does not begin with a number.

    Examples
    --------
    >>> split_number("5N.m")
    (5.0, 'N*m')
    """
    match = re.match(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)\b)\s*(.*)$", text)
    if match is None:
        raise UnitError(f"'{text}'", "does not start with a number")
    unit = re.sub(r"(?<=[^\W\d])\.(?=[^\W\d])", "*", match.group(2).strip())
    return float(match.group(1)), unit


def name_and_unit(head: str) -> tuple[str, str | None]:
    """Return what the head of a column says, ``name [unit]`` or ``name_unit``: its name and its unit.

    Parameters
    ----------
    head
        Without a unit it is the name as it stands, and the unit is ``None``.
    """
    match = _BRACKETED.match(head)
    name, _, unit = (match["name"], "", match["unit"]) if match else head.rpartition("_")
    try:
        parse_unit(unit)
    except UnitError:
        return head, None  # brackets that hold no unit belong to the name
    return name, unit
