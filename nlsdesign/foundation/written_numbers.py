"""Numbers from text, and numbers as people write them: rounded, typeset, with error, prefix or unit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from .errors import UnitError
from .quantity import parse_unit, typeset_unit, with_unit

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


def rounded(value: float, digits: int) -> float:
    """Return a number rounded to significant digits, so that every processor writes the same.

    Examples
    --------
    >>> rounded(0.0123456789, 4), rounded(98765.0, 2)
    (0.01235, 99000.0)
    """
    return float(f"{value:.{digits}g}")


def significant(values: Iterable[float], digits: int = 9) -> tuple[float, ...]:
    """Return numbers rounded to significant digits of the largest of them, zero and all.

    What a spline, a solver or a fit gives differs in its last digits from one processor to the next; a number
    that is written down is rounded to what it means, so that everybody writes the same.

    Examples
    --------
    >>> significant([0.0123456789012, 1.2e-19], 6)
    (0.0123457, 0.0)
    """
    row = [float(v) for v in values]
    largest = max((abs(v) for v in row if math.isfinite(v)), default=0.0)
    if largest == 0.0:
        return tuple(row)
    places = digits - 1 - math.floor(math.log10(largest))
    return tuple(round(v, places) + 0.0 for v in row)


def to_resolution(value: float, error: float) -> float:
    """Return a number rounded to at most a thousandth of its standard error.

    ``error``: standard error in the same unit; where it is zero or not finite, nine significant digits stay.

    Examples
    --------
    >>> to_resolution(0.0212345678, 2e-4)
    0.0212346
    """
    if not (math.isfinite(error) and error > 0.0):
        return significant([value])[0]
    return round(value, 3 - math.floor(math.log10(error))) + 0.0


_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def superscript(number: int) -> str:
    """Return an integer in superscript digits."""
    return str(number).translate(_SUPERSCRIPTS)


def with_digits(value: float, digits: int) -> str:
    """Return a number with significant digits, typeset for people; those at its end may be zeros.

    Examples
    --------
    >>> with_digits(0.012345, 3), with_digits(1234.5, 3), with_digits(-3.4e-9, 2), with_digits(0.0, 3)
    ('0.0123', '1230', '−3.4·10⁻⁹', '0')
    """
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "∞" if value > 0 else "−∞"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    exponent = int(power)
    if -5 < exponent < 6:
        text = f"{rounded(value, digits):.{max(0, digits - 1 - exponent)}f}"
    else:
        text = f"{mantissa}·10{superscript(exponent)}"
    return text.replace("-", "−")


def three_digits(value: float) -> str:
    """Return a number with three significant digits, typeset for people.

    Examples
    --------
    >>> three_digits(26.0), three_digits(0.011422), three_digits(12345.6), three_digits(2e-7)
    ('26.0', '0.0114', '12300', '2.00·10⁻⁷')
    """
    return with_digits(value, 3)


def compact(value: float, digits: int = 4) -> str:
    """Return a number with at most so many significant digits, typeset, without zeros at its end.

    Parameters
    ----------
    value
        Any number.
    digits
        Largest number of significant digits.

    Examples
    --------
    >>> compact(0.25), compact(12.0), compact(2e-9), compact(1200.0)
    ('0.25', '12', '2·10⁻⁹', '1200')
    """
    mantissa, dot, power = with_digits(value, digits).partition("·")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return mantissa + dot + power


def with_error(value: float, error: float) -> str:
    """Return a number with its standard error as text for people, both to the same digit.

    ``error``: standard error in the same unit, shown to two digits; left out where it is zero or not finite.

    Examples
    --------
    >>> with_error(0.374817, 4.3e-4), with_error(1.5e-7, 2e-9), with_error(12345.0, 678.0)
    ('0.37482 ± 0.00043', '(1.500 ± 0.020)·10⁻⁷', '12340 ± 680')
    """
    if not (math.isfinite(error) and error > 0.0):
        return f"{value:.4g}".replace("-", "−")
    exponent = math.floor(math.log10(max(abs(value), error)))
    small = not -5 <= exponent < 6
    scale = 10.0**exponent if small else 1.0
    digit = 1 - math.floor(math.log10(error / scale))
    pair = [f"{round(number / scale, digit):.{max(0, digit)}f}" for number in (value, error)]
    text = " ± ".join(pair).replace("-", "−")
    return f"({text})·10{superscript(exponent)}" if small else text


def in_unit(value: float, unit: str, digits: int = 4) -> str:
    """Return a number of SI in a unit, with it; at most so many significant digits.

    Examples
    --------
    >>> in_unit(0.0201, "mm"), in_unit(0.5, "1")
    ('20.1 mm', '0.5')
    """
    return with_unit(f"{value / parse_unit(unit).factor:.{digits}g}", unit)


_PREFIXES = ((1e3, 1e-3, "k"), (1.0, 1.0, ""))


def shared_prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor by which numbers of one table or line are shown, and their unit, typeset.

    ``values``: in SI; the largest decides, below one it is shown in thousandths.

    Examples
    --------
    >>> shared_prefix([0.002, 0.4], "N*m"), shared_prefix([0.4, -3.99], "N*m")
    ((1000.0, 'mN·m'), (1.0, 'N·m'))
    """
    sizes = (abs(rounded(value, 3)) for value in values if math.isfinite(value))
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
    >>> without_power(3987.0), without_power(0.01234), without_power(2.5e7, 2)
    ('3990', '0.0123', '25000000')
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text else text
