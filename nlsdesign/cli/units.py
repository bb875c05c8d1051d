"""Numbers with units on the command line, such as ``"20 mm"``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError, UnitError, ValueRangeError
from ..foundation.quantity import Quantity, parse_unit, quantity, same_dimension, typeset_unit, with_unit
from ..foundation.written_numbers import split_number as split_number

if TYPE_CHECKING:
    _Kind = click.ParamType[float]
else:
    _Kind = click.ParamType


class Number(_Kind):
    """A number with a unit of one dimension; gives its value in SI.

    Parameters
    ----------
    unit
        A unit of the expected dimension.
    above
        In SI; what is not larger is refused before any work.
    up_to
        In SI; what is larger is refused before any work.
    """

    name = "number unit"

    def __init__(self, unit: str, *, above: float | None = None, up_to: float | None = None) -> None:
        self.unit, self.above, self.up_to = unit, above, up_to

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the value in SI; errors name the option."""
        if isinstance(value, float):
            return value
        option = param.opts[0] if param is not None and param.opts else "number"
        try:
            number = parse_number(str(value), self.unit).number
        except NlsError as error:
            raise error.at(option) from None
        if self.above is not None and not number > self.above:
            unit = typeset_unit(self.unit)
            rule = "must be above zero" if self.above == 0.0 else f"must be above {self.above:g} in SI"
            raise ValueRangeError(f"{option} '{value}'", rule, next_step=f"write for instance '1 {unit}'")
        if self.up_to is not None and number > self.up_to:
            most = with_unit(f"{self.up_to / parse_unit(self.unit).factor:g}", self.unit)
            raise ValueRangeError(f"{option} '{value}'", f"must be at most {most}")
        return number


if TYPE_CHECKING:
    _Count = click.ParamType[int]
else:
    _Count = click.ParamType

_BYTES = {"B": 1, "kB": 1000, "KiB": 1024, "MB": 1000**2, "MiB": 1024**2}


class Bytes(_Count):
    """A size of memory such as ``16kB``; gives bytes. A kB has 1000 of them, a KiB 1024."""

    name = "size"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number of bytes."""
        if isinstance(value, int):
            return value
        number, unit = split_number(str(value))
        if unit not in _BYTES or not 0.0 < number < math.inf:
            raise UnitError(
                f"'{value}'", f"is no size of memory; units are {', '.join(_BYTES)}", next_step="write '16kB'"
            )
        return int(number * _BYTES[unit])


def parse_number(text: str, unit: str) -> Quantity:
    """Read ``"5 N·m"``, ``"5 N*m"`` or ``"5N.m"``."""
    try:
        number, given = split_number(text)
    except UnitError as error:
        step = error.next_step or f"write '{with_unit('1', unit)}'"
        raise UnitError(error.thing, error.rule, next_step=step) from None
    if not given and unit != "1":
        raise UnitError(f"'{text}'", "has no unit", next_step=f"write '{with_unit(text.strip(), unit)}'")
    if not same_dimension(given or "1", unit) and unit == "1":
        raise UnitError(
            f"'{text}'", "stands for a pure number, without a unit", next_step=f"write '{number:g}'"
        )
    if not same_dimension(given or "1", unit):
        raise UnitError(
            f"'{text}'",
            f"'{given}' is not a unit like '{typeset_unit(unit)}'",
            next_step=f"write '{with_unit(f'{number:.12g}', unit)}'",
        )
    return quantity(number, given or "1", source="given on the command line")
