"""Numbers with units on the command line, such as ``"20 mm"``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ..errors import UnitError
from ..quantity import Quantity, quantity, same_dimension, typeset_unit, with_unit

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
    """

    name = "number unit"

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the value in SI."""
        if isinstance(value, float):
            return value
        return parse_number(str(value), self.unit).number


def parse_number(text: str, unit: str) -> Quantity:
    """Read ``"5 N·m"`` or ``"5 N*m"``.

    Parameters
    ----------
    text
        Number, space, unit.
    unit
        A unit of the expected dimension.

    Raises
    ------
    UnitError
        If the unit is missing or measures something else.
    """
    head, _, tail = text.strip().partition(" ")
    try:
        number = float(head)
    except ValueError:
        raise UnitError(
            f"'{text}'", "does not start with a number", next_step=f"write '{with_unit('1', unit)}'"
        ) from None
    given = tail.strip()
    if not given and unit != "1":
        raise UnitError(f"'{text}'", "has no unit", next_step=f"write '{with_unit(text.strip(), unit)}'")
    if not same_dimension(given or "1", unit):
        raise UnitError(
            f"'{text}'",
            f"'{given}' is not a unit like '{typeset_unit(unit)}'",
            next_step=f"write '{with_unit('1', unit)}'",
        )
    return quantity(number, given or "1", source="given on the command line")
