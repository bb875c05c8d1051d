"""Numbers with unit, source and spread; units are read, converted and typeset here and nowhere else."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

from .errors import UnitError, ValueRangeError, nearest, visible
from .spread import EXACT, NormalSpread, Spread, as_spread

NOT_SI = {
    "psi": "6.895 kPa for one psi", "bar": "100 kPa for one bar", "atm": "101.325 kPa for one atm",
    "lbf": "4.448 N for one lbf", "lb": "0.4536 kg for one lb", "lbs": "0.4536 kg for one lb",
    "oz": "28.35 g for one oz (a force: 0.278 N)", "ozf": "0.278 N for one ozf", "kgf": "9.807 N for one kgf",
    "kp": "9.807 N for one kp", "in": "25.4 mm for one inch", "inch": "25.4 mm for one inch",
    "ft": "304.8 mm for one foot", "mil": "25.4 um for one mil", "thou": "25.4 um for one thou",
    "C": "temperatures in K: 20 degrees Celsius are 293.15 K", "°C": "temperatures in K: 20 °C are 293.15 K",
    "degC": "temperatures in K: 20 degrees Celsius are 293.15 K", "hr": "'h'", "turn": "'rev'",
    "turns": "'rev'", "hp": "745.7 W for one hp", "percent": "'%'", "ohm": "'Ohm'",
    "L": "1000 cm³ for one litre", "l": "1000 cm³ for one litre", "t": "1000 kg for one tonne",
    "Grad": "'deg'", "grad": "'deg'", "gon": "0.9 deg for one gon", "U": "'rev', or 'rpm' for U/min",
    "qmm": "'mm^2'", "qcm": "'cm^2'", "qm": "'m^2'",
}  # fmt: skip
"""What to write for a symbol that is none of ours; ``Grad`` is no giga-radian."""
_RUN_TOGETHER = re.compile(r"^(?P<head>[GMkcmµun]?(?:N|Pa|g|V|A|W|J|Ohm))(?P<tail>mm|cm|ms|m|s|h|rad)$")


def misspelt_unit(token: str, unit: str, plain: str) -> UnitError | None:
    """Return the error for a symbol that is known and not one of ours, with what to write; else ``None``.

    Examples
    --------
    >>> print(misspelt_unit("kgcm", "kgcm²", "kgcm2"))
    unit 'kgcm²': 'kgcm' stands for a product, which needs its sign -> write 'kg*cm^2'
    """
    if token in NOT_SI:
        return UnitError(
            f"unit '{unit}'", f"'{token}' is not a unit of the SI", next_step=f"write {NOT_SI[token]}"
        )
    match = _RUN_TOGETHER.match(token)
    if match is None:
        return None
    product = f"{match['head']}*{'m*s' if match['tail'] == 'ms' else match['tail']}"
    # The power of the last symbol comes behind it: kgcm2 is kg*cm^2.
    pattern = rf"{re.escape(token)}\^?(-?\d+)?"
    written = re.sub(pattern, lambda power: product + (f"^{power[1]}" if power[1] else ""), plain, count=1)
    rule = f"'{token}' stands for a product, which needs its sign"
    return UnitError(f"unit '{unit}'", rule, next_step=f"write '{written}'")


NOT_STATED = "not stated"
_CHANGED = f"{NOT_STATED}; changed from"

BASE = ("kg", "m", "s", "A", "K", "rad")

MM = 1e3
"""Millimetres in a metre: lengths of drawings and figures are shown in millimetres."""

_HIGHEST_POWER = 20
_DEGREE = math.pi / 180.0
# symbol -> (factor to SI, exponents of kg, m, s, A, K, rad)
_ATOMS: dict[str, tuple[float, tuple[int, ...]]] = {
    "1": (1.0, (0, 0, 0, 0, 0, 0)),
    "%": (0.01, (0, 0, 0, 0, 0, 0)),
    "kg": (1.0, (1, 0, 0, 0, 0, 0)),
    "g": (1e-3, (1, 0, 0, 0, 0, 0)),
    "m": (1.0, (0, 1, 0, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0, 0, 0)),
    "min": (60.0, (0, 0, 1, 0, 0, 0)),
    "h": (3600.0, (0, 0, 1, 0, 0, 0)),
    "A": (1.0, (0, 0, 0, 1, 0, 0)),
    "K": (1.0, (0, 0, 0, 0, 1, 0)),
    "rad": (1.0, (0, 0, 0, 0, 0, 1)),
    "deg": (_DEGREE, (0, 0, 0, 0, 0, 1)),
    "°": (_DEGREE, (0, 0, 0, 0, 0, 1)),
    "rev": (2.0 * math.pi, (0, 0, 0, 0, 0, 1)),
    "rpm": (2.0 * math.pi / 60.0, (0, 0, -1, 0, 0, 1)),
    "Hz": (1.0, (0, 0, -1, 0, 0, 0)),
    "N": (1.0, (1, 1, -2, 0, 0, 0)),
    "Pa": (1.0, (1, -1, -2, 0, 0, 0)),
    "J": (1.0, (1, 2, -2, 0, 0, 0)),
    "W": (1.0, (1, 2, -3, 0, 0, 0)),
    "V": (1.0, (1, 2, -3, -1, 0, 0)),
    "Ohm": (1.0, (1, 2, -3, -2, 0, 0)),
    "Ω": (1.0, (1, 2, -3, -2, 0, 0)),
    "H": (1.0, (1, 2, -2, -2, 0, 0)),
}
_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "m": 1e-3, "µ": 1e-6, "u": 1e-6, "n": 1e-9}
_PREFIXED = {"g", "m", "s", "A", "N", "Pa", "J", "W", "V", "Hz", "rad", "Ohm", "Ω", "H", "K"}
# Superscripts, and the Greek mu and the ohm sign that look like the micro sign and the Greek omega.
_TO_ASCII = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻\u03bc\u2126", "0123456789-\u00b5\u03a9")
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"^(?P<atom>[^\d^\-]+|1)(?:\^?(?P<power>-?\d+))?$")


@dataclass(frozen=True)
class Unit:
    """A unit as a factor to SI and exponents of the base units."""

    text: str  # the unit as written
    factor: float  # value in SI = value in this unit × factor
    exponents: tuple[int, ...]  # exponents of kg, m, s, A, K, rad, in this order

    @property
    def mechanical(self) -> tuple[int, ...]:
        """Exponents without the radian, which cancels against arc lengths."""
        return self.exponents[:-1]


def _atom(token: str, unit: str) -> tuple[float, tuple[int, ...]]:
    if token in _ATOMS:
        return _ATOMS[token]
    head, tail = token[:1], token[1:]
    if head in _PREFIXES and tail in _PREFIXED and token not in NOT_SI:
        factor, exponents = _ATOMS[tail]
        return _PREFIXES[head] * factor, exponents
    slip = misspelt_unit(token, unit, unit.strip().translate(_TO_ASCII).replace(" ", ""))
    if slip is not None:
        raise slip
    names = list(_ATOMS) + [p + a for p in _PREFIXES for a in _PREFIXED]
    raise UnitError(
        f"unit '{unit}'",
        f"'{token}' is not a known unit",
        did_you_mean=nearest(token, names),
        next_step="write products and quotients of SI units, for instance 'N·m/rad' or 'N*m/rad', 'kg*m^2'",
    )


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Read a unit such as ``"N*m/rad"``, ``"kg·m²"`` or ``"MPa"``.

    Everything behind a ``/`` is one factor: ``"N*m*s/rad"`` has the radian below the line,
    and ``"1/(N*s)"`` is written ``"1/N/s"``.
    """
    factor, exponents = 1.0, [0] * len(BASE)
    if "(" in text or ")" in text:
        step = "write a product below the line as two quotients: 'A/N/m' for 'A/(N*m)'"
        raise UnitError(f"unit '{text}'", "has brackets, which units do without", next_step=step)
    pieces = re.split(r"([*·/])", text.strip().translate(_TO_ASCII).replace(" ", ""))
    sign = 1
    for piece in pieces:
        if piece in ("*", "·"):
            sign = 1
            continue
        if piece == "/":
            sign = -1
            continue
        match = _POWER.match(piece)
        if not match:
            raise UnitError(
                f"unit '{text}'",
                f"'{piece}' cannot be read",
                next_step="write for instance 'N·m/rad' or 'N*m/rad'",
            )
        power = sign * _power(match["power"] or "1", text)
        one_factor, one = _atom(match["atom"], text)
        factor *= one_factor**power
        exponents = [total + power * each for total, each in zip(exponents, one, strict=True)]
    if not sys.float_info.min <= factor <= sys.float_info.max:
        raise UnitError(f"unit '{text}'", "is too large or too small a multiple of SI units to compute with")
    return Unit(text, factor, tuple(exponents))


def _power(text: str, unit: str) -> int:
    # The length comes first: whole numbers of thousands of digits are not read at all.
    if len(text) <= len(str(-_HIGHEST_POWER)) and abs(int(text)) <= _HIGHEST_POWER:
        return int(text)
    raise UnitError(
        f"unit '{unit}'",
        f"'{text}' is no power of a unit; powers lie between -{_HIGHEST_POWER} and {_HIGHEST_POWER}",
        next_step="write for instance 'kg*m^2'",
    )


def typeset_unit(unit: str) -> str:
    """Return a unit as it is typeset for people, an empty text for ``"1"``.

    Machine formats (decks, CSV, FMI, JSON) keep the ASCII form; :func:`parse_unit` reads both.

    Examples
    --------
    >>> typeset_unit("N*m/rad"), typeset_unit("kg*m^2"), typeset_unit("m*s^-2"), typeset_unit("mOhm")
    ('N·m/rad', 'kg·m²', 'm·s⁻²', 'mΩ')
    """
    if unit == "1":
        return ""
    pieces = re.split(r"([*·/])", unit.translate(_TO_ASCII).replace(" ", ""))
    return "".join("·" if piece == "*" else _typeset_power(piece) for piece in pieces)


def _typeset_power(piece: str) -> str:
    match = _POWER.match(piece)
    if match is None:
        return piece
    return match["atom"].replace("Ohm", "Ω") + (match["power"] or "").translate(_SUPERSCRIPTS)


def with_unit(number: str, unit: str) -> str:
    """Return a number that is text already with its unit, typeset for people.

    ``unit``: as in decks; ``"1"`` adds nothing.

    Examples
    --------
    >>> with_unit("0.05", "N*m"), with_unit("3", "1")
    ('0.05 N·m', '3')
    """
    return f"{number} {typeset_unit(unit)}".rstrip()


def _plain(value: float | Iterable[float]) -> float | tuple[float, ...]:
    """Return a float, or a tuple of floats for a row of any kind (list, array)."""
    if isinstance(value, Iterable) and getattr(value, "shape", None) != ():
        return tuple(float(item) for item in value)
    return float(value)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Quantity:
    """A number (or a row of numbers) in SI with its unit, source and spread.

    Parameters
    ----------
    value
        Value in SI; a tuple for a row of numbers.
    unit
        Unit in which it was given and is shown.
    source
        Citation, data-sheet page, bench file with date, or "assumed" with a reason.
    spread
        How far the true number may lie from this one; a bare 0.06 is a relative spread of ± 6 %.

    Raises
    ------
    ValueRangeError
        If the row is empty, a value is not finite, or the spread is negative.
    """

    value: float | tuple[float, ...]
    unit: str = "1"
    source: str = "not stated"
    spread: Spread = EXACT
    _parsed: Unit = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_parsed", parse_unit(self.unit))
        object.__setattr__(self, "value", _plain(self.value))
        object.__setattr__(self, "source", visible(self.source))
        if not self.values:
            raise ValueRangeError(with_unit("()", self.unit), "a row of numbers needs at least one")
        if not all(math.isfinite(item) for item in self.values):
            raise ValueRangeError(with_unit(str(self.value), self.unit), "a quantity must be finite")
        object.__setattr__(self, "spread", as_spread(self.spread))

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers in SI as a tuple, also for a single one."""
        return self.value if isinstance(self.value, tuple) else (self.value,)

    @property
    def number(self) -> float:
        """The single number in SI.

        Raises
        ------
        ValueRangeError
            If the quantity is a row of numbers.
        """
        if isinstance(self.value, tuple):
            raise ValueRangeError(with_unit(str(self.value), self.unit), "one number was expected, not a row")
        return self.value

    @property
    def shown(self) -> float | tuple[float, ...]:
        """The number(s) in the unit in which they were given."""
        rounded = tuple(float(f"{item / self._parsed.factor:.15g}") for item in self.values)
        return rounded if isinstance(self.value, tuple) else rounded[0]

    @property
    def spread_text(self) -> str:
        """The spread as people read it, in the unit of the number; nothing for an exact one."""
        return self.spread.text(self._with_unit)

    @property
    def spread_data(self) -> float | str:
        """The spread in a file of data: a relative one as a number, others as text with unit."""
        return self.spread.data(self._with_unit)

    def _with_unit(self, value: float) -> str:
        return with_unit(f"{value / self._parsed.factor:.6g}", self.unit)

    @property
    def assumed(self) -> bool:
        """Whether the source is an assumption rather than evidence."""
        return self.source.lower().startswith(("assumed", "not stated"))

    def with_value(self, value: float | tuple[float, ...], source: str | None = None) -> Quantity:
        """Return a changed copy.

        Parameters
        ----------
        value
            New value(s) in SI.
        source
            New source. Without one the copy says that it was changed, and from which number and source.

        Examples
        --------
        >>> quantity(2.5, "mm", source="drawing 7").with_value(0.003).source
        'not stated; changed from 2.5 mm: drawing 7'
        """
        new = replace(self, value=value)
        if source is None:
            source = self.source if new.value == self.value else changed_source(self._brief(), self.source)
        return replace(new, source=source)

    def with_spread(self, spread: Spread | float) -> Quantity:
        """Return a copy with another spread.

        Parameters
        ----------
        spread
            A bare number is a relative spread.
        """
        return replace(self, spread=as_spread(spread))

    def _brief(self) -> str:
        count = len(self.values)
        return str(self) if count <= 4 else f"{count} numbers in {typeset_unit(self.unit)}"

    def __str__(self) -> str:
        shown = self.shown
        text = (
            "(" + ", ".join(f"{item:.6g}" for item in shown) + ")"
            if isinstance(shown, tuple)
            else f"{shown:.6g}"
        )
        return with_unit(text, self.unit)


def changed_source(old: str, source: str) -> str:
    """Return the source of a number that was changed without one.

    ``source``: source of that number. After several changes it is still the first number with a source.
    """
    known = source != NOT_STATED and not source.startswith(_CHANGED)
    return f"{_CHANGED} {old}: {source}" if known else source


def quantity(
    value: float | tuple[float, ...],
    unit: str,
    *,
    source: str = "not stated",
    spread: Spread | Quantity | float = EXACT,
) -> Quantity:
    """Return a quantity from a value in the given unit.

    Parameters
    ----------
    value
        Value(s) in ``unit``.
    unit
        For instance ``"MPa"``.
    source
        Where the number comes from.
    spread
        How far the true number may lie from this one: a bare 0.06 is a relative spread of ± 6 %, a quantity
        one standard deviation in its unit, for a number that may be zero or change its sign.

    Raises
    ------
    UnitError
        If the spread is given in a unit of something else.

    Examples
    --------
    >>> quantity(0.0, "N*m", spread=quantity(30.0, "mN*m")).spread_text
    '± 0.03 N·m'
    >>> quantity(0.58, "MPa", source="Austin 2015, Table I").number
    580000.0
    """
    factor, plain = parse_unit(unit).factor, _plain(value)
    converted = tuple(item * factor for item in plain) if isinstance(plain, tuple) else plain * factor
    if isinstance(spread, Quantity):
        if not same_dimension(spread.unit, unit):
            raise UnitError(f"spread {spread}", f"is not of the dimension of '{unit}'")
        spread = NormalSpread(spread.number)
    return Quantity(converted, unit, source, as_spread(spread))


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


def three_digits(value: float) -> str:
    """Return a number with three significant digits as text for people.

    Examples
    --------
    >>> three_digits(26.0), three_digits(0.011422), three_digits(12345.6), three_digits(2e-7)
    ('26.0', '0.0114', '12300', '2.00·10⁻⁷')
    """
    return "0.00" if value == 0.0 else typeset_number(value)


def typeset_number(value: float, digits: int = 3) -> str:
    """Return a number with the given number of significant digits, typeset.

    Examples
    --------
    >>> typeset_number(0.012345), typeset_number(1234.5), typeset_number(-3.4e-9, 2), typeset_number(0.0)
    ('0.0123', '1230', '−3.4·10⁻⁹', '0')
    """
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "∞" if value > 0 else "−∞"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    places = digits - 1 - int(power)
    text = f"{round(value, places):.{max(0, places)}f}"
    if not -5 < int(power) < 6:
        text = f"{mantissa}·10{superscript(int(power))}"
    return text.replace("-", "−")


def superscript(number: int) -> str:
    """Return an integer in superscript digits."""
    return str(number).translate(_SUPERSCRIPTS)


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


def degrees(value: float) -> float:
    """Return an angle in rad from degrees.

    Parameters
    ----------
    value
        Angle in degrees.
    """
    return value * _DEGREE


def same_dimension(unit: str, other: str) -> bool:
    """Tell whether two units measure the same thing; the radian counts as a dimension."""
    return parse_unit(unit).exponents == parse_unit(other).exponents


def sources(quantities: Mapping[str, Quantity]) -> dict[str, float]:
    """Return the share of numbers per kind of evidence: ``assumed`` and ``sourced``.

    Parameters
    ----------
    quantities
        Numbers by name.
    """
    total = max(1, len(quantities))
    assumed = sum(item.assumed for item in quantities.values())
    return {"assumed": assumed / total, "sourced": (len(quantities) - assumed) / total}
