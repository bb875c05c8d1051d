"""Numbers and heads of columns as people write them: taken apart into number or name, and unit.

Errors are written with the prefix of their unit that leaves no power of ten.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterable
from decimal import Decimal

from .errors import UnitError
from .quantity import parse_unit, typeset_unit

_COMMA = re.compile(r",(?P<digits>\d[\d.,]*(?:[eE][-+]?\d+)?)\s*(?P<unit>.*)$")
_FORMS_OF_HEADS = tuple(
    re.compile(rf"^(?P<name>.*?){behind}$")
    for behind in (
        r"\s*\[(?P<unit>[^\]]+)\]",
        r"\s*\((?P<unit>[^)]+)\)",
        r"_(?P<unit>[^_]+)",
        r"\s+in\s+(?P<unit>\S+)",
        r"\s+/\s*(?P<unit>\S+)",
        r"\s*,\s*(?P<unit>\S+)",
        r"(?<=[^\s/])/(?P<unit>[^\s/]+)",
    )
)
"""Forms in which heads of columns give units; what holds no unit belongs to the name."""


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
        # The error on a comma, which parts decimals in one country and thousands in another.
        whole = match.group(1)
        digits, unit_typed = comma["digits"], comma["unit"]
        pieces = [f"{whole}.{digits} {unit_typed}".rstrip()]
        if len(digits) == 3 and whole.strip("-+0"):
            pieces.append(f"{whole}{digits} {unit_typed}".rstrip())
        several = any(mark in digits for mark in ",.")
        step = (
            "write it without commas" if several else "write " + " or ".join(f"'{each}'" for each in pieces)
        )
        raise UnitError(f"'{text}'", "has a comma; decimals are written with a point", next_step=step)
    unit = re.sub(r"(?<=[^\W\d])\.(?=[^\W\d])", "*", match.group(2).strip())
    return float(match.group(1)), unit


_OF_HEADS = {
    "Nm": "N*m", "mNm": "mN*m", "kNm": "kN*m", "Nmm": "N*mm", "Ncm": "N*cm", "Newton": "N", "Ampere": "A",
    "amps": "A", "sec": "s", "Sek": "s", "Sekunden": "s", "seconds": "s", "msec": "ms", "Grad": "deg",
    "degrees": "deg", "radians": "rad", "U/min": "rpm",
}  # fmt: skip
"""Units as heads of columns have them, where nothing else can be meant; a deck asks for the symbol."""


def unit_as_written(text: str) -> str:
    """Return the symbol of a unit for what a head of a column calls it.

    Examples
    --------
    >>> unit_as_written("Nm"), unit_as_written("mm")
    ('N*m', 'mm')
    """
    return _OF_HEADS.get(text.strip(), text.strip())


def name_and_unit(head: str) -> tuple[str, str | None]:
    """Return what the head of a column says: its name and its unit.

    Examples
    --------
    >>> name_and_unit("force [kN]"), name_and_unit("t_ms"), name_and_unit("Moment in Nm")
    (('force', 'kN'), ('t', 'ms'), ('Moment', 'N*m'))
    >>> name_and_unit("F/N"), name_and_unit("speed rad/s")
    (('F', 'N'), ('speed rad/s', None))
    """
    for form in _FORMS_OF_HEADS:
        match = form.match(head)
        if match is None or (form is _FORMS_OF_HEADS[-1] and _is_unit(match["name"].split()[-1])):
            continue
        unit = unit_as_written(match["unit"])
        if _is_unit(unit):
            return match["name"], unit
    return head, None


def _is_unit(text: str) -> bool:
    """Tell whether a text is a unit."""
    with contextlib.suppress(UnitError):
        parse_unit(text)
        return True
    return False


_PREFIXES = ((1e3, 1e-3, "k"), (1.0, 1.0, ""))


def shared_prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor by which numbers of one table or line are shown, and their unit, typeset.

    ``values``: in SI; the largest decides, below one it is shown in thousandths.

    Examples
    --------
    >>> shared_prefix([0.002, 0.4], "N*m"), shared_prefix([0.4, -3.99], "N*m")
    ((1000.0, 'mN·m'), (1.0, 'N·m'))
    """
    sizes = (abs(float(f"{value:.3g}")) for value in values if math.isfinite(value))
    largest = max(sizes, default=0.0)
    for least, factor, prefix in _PREFIXES:
        if largest >= least:
            return factor, prefix + typeset_unit(unit)
    return 1e3, "m" + typeset_unit(unit)


def prefixed(value: float, unit: str = "N*m", *, digits: int = 3) -> str:
    """Return a number with the prefix that fits it.

    ``unit``: without a prefix; a torque if none is given.

    Examples
    --------
    >>> prefixed(3.99), prefixed(0.0123), prefixed(0.9999), prefixed(346.0, "N", digits=2)
    ('3.99 N·m', '12.3 mN·m', '1 N·m', '350 N')
    """
    factor, shown = shared_prefix([value], unit)
    return f"{without_power(factor * value, digits)} {shown}"


def without_power(value: float, digits: int = 3) -> str:
    """Return a number with significant digits, and zeros in place of a power of ten.

    Examples
    --------
    >>> without_power(3987.0), without_power(0.01234), without_power(2.5e7, 2), without_power(-1.25e-5)
    ('3990', '0.0123', '25000000', '-0.0000125')
    """
    text = f"{value:.{digits}g}"
    return f"{Decimal(text):f}" if "e" in text and abs(value) > 1e-7 else text
