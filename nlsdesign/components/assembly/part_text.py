"""Parts as the text of a deck: tables, numbers that read back exactly, texts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from decimal import Context
from fractions import Fraction
from itertools import chain

from ...foundation.deck import Written
from ...foundation.quantity import Quantity, parse_unit
from ...foundation.spread import NormalSpread, RelativeSpread, UniformSpread
from ..core.part import Part


def part_lines(
    path: str, part: Part, *, structure: Sequence[str] = (), changed: Mapping[str, Quantity] | None = None
) -> list[str]:
    """Return the lines of a part and of everything in it, the first one empty."""
    new = changed or {}
    lines = ["", f"[{path}]", f"component = {text_of(type(part).__name__)}", *structure]
    domain = part.stated_domain()
    if domain:
        lines.append(f"domain = {text_of(domain.name)}")
    for name, declared in part.parameters().items():
        lines.append(f"{name} = {number_of(new.get(f'{path}.{name}', declared))}")
    for name, child in part.children().items():
        lines += part_lines(f"{path}.{name}", child, changed=new)
    return lines


def number_of(given: Quantity) -> str:
    """Return a number as an inline table that reads back as the same number."""
    factor, spread = parse_unit(given.unit).factor, given.spread
    if isinstance(spread, UniformSpread):
        ends = (given.number - spread.half_width, given.number + spread.half_width)
        number = f"range = [{', '.join(_shortest(v, factor) for v in ends)}]"
    else:
        items = [_shortest(v, factor) for v in given.values]
        number = f"value = {'[' + ', '.join(items) + ']' if isinstance(given.value, tuple) else items[0]}"
    text = f"{{{number}, unit = {text_of(given.unit)}, source = {text_of(given.source)}"
    if isinstance(spread, RelativeSpread):
        return text + (f", spread = {spread.relative!r}}}" if spread else "}")
    if isinstance(spread, NormalSpread):
        size = f"{_shortest(spread.size, factor)} {given.unit}"
        return f"{text}, spread = {text_of(size)}}}"
    return text + "}"


def text_of(text: str) -> str:
    """Return a text as TOML writes it, which is as JSON does but for the delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _shortest(value: float, factor: float) -> str:
    """Return the shortest decimal that reads back as the same number in SI."""
    exact = Fraction(value) / Fraction(factor)
    short = (repr(float(f"{float(exact):.{digits}g}")) for digits in (6, 12, 15))
    # Where no float times the factor is the value, the text has more digits than a float.
    long = (str(Context(prec=n).divide(exact.numerator, exact.denominator)) for n in range(17, 40))
    return next(text for text in chain(short, long) if Written(text).times(factor) == value)
