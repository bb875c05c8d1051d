"""Values on the command line: numbers with units, sizes of memory, ``NAME=VALUE``, paths with a name."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..foundation.errors import NlsError, UnitError, ValueRangeError
from ..foundation.quantity import Quantity, parse_unit, quantity, same_dimension, typeset_unit, with_unit
from ..foundation.written_numbers import split_number as split_number

T = TypeVar("T")
if TYPE_CHECKING:
    _FloatKind = click.ParamType[float]
    _IntKind = click.ParamType[int]
    _PairKind = click.ParamType[tuple[float, float]]
    _PathKind = click.Path[Path]
else:
    _FloatKind = _IntKind = _PairKind = click.ParamType
    _PathKind = click.Path


class Number(_FloatKind):
    """A number with a unit of one dimension; gives its value in SI, refused outside its bounds in SI."""

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


_BYTES = {"B": 1, "kB": 1000, "KiB": 1024, "MB": 1000**2, "MiB": 1024**2}


class Bytes(_IntKind):
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


class TimeBudget(_PairKind):
    """A share of the sample time at a clock, such as ``20%@80MHz``; gives the share and the clock in Hz."""

    name = "budget"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """Return share and clock."""
        if isinstance(value, tuple):
            return value
        matched = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*%\s*@(.+)", str(value))
        if matched is None or not 0.0 < float(matched[1]) <= 100.0:
            raise UnitError(f"'{value}'", "is no share at a clock", next_step="write '20%@80MHz'")
        return float(matched[1]) / 100.0, Number("Hz", above=0.0).convert(matched[2], param, ctx)


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


class NamedPath(_PathKind):
    """A path with a name; gives a :class:`~pathlib.Path`.

    A variable of the shell that is not set gives an empty text, which Python reads as the current folder:
    files would be written where nobody looks for them, or whatever is there would be read. ``example``: a
    name for the message, where the option has no usual one.
    """

    def __init__(
        self, *, file_okay: bool = True, dir_okay: bool = True, exists: bool = False, example: str = ""
    ) -> None:
        super().__init__(exists=exists, file_okay=file_okay, dir_okay=dir_okay, path_type=Path)
        self._example = example

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """Return the path."""
        if not os.fspath(value).strip():
            what = "folder" if not self.file_okay else "file" if not self.dir_okay else "file or folder"
            name = "" if param is None else param.metavar or (param.name or "").upper()
            if isinstance(param, click.Option):
                name = param.opts[0]
            usual = param.default if param is not None and isinstance(param.default, str) else ""
            example = self._example or usual or f"my_{what.partition(' ')[0]}"
            if name.startswith("-"):
                example = f"{name} {example}"
            step = f"write for instance {example}" + (
                ", or '.' for the current folder" if self.dir_okay else ""
            )
            raise ValueRangeError(f"{name} '{value}'".lstrip(), f"names no {what}", next_step=step)
        path: Path = super().convert(value, param, ctx)
        return path


def read_pairs(option: str, given: Iterable[str], read: Callable[[str], T]) -> dict[str, T]:
    """Return what ``NAME=VALUE`` options give, by name.

    ``read``: from a value as text; may raise a ``ValueError`` where it cannot be read.
    """
    values: dict[str, T] = {}
    for text in given:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise ValueRangeError(f"{option} '{text}'", "is not NAME=VALUE", next_step="write NAME=VALUE")
        if name in values:
            raise ValueRangeError(f"{option} '{text}'", f"'{name}' is given twice", next_step="remove one")
        try:
            values[name] = read(value)
        except ValueError:
            hint = "give a number, or for an input amplitude@frequency in Hz, for instance 1.5@2"
            raise ValueRangeError(f"{option} '{text}'", f"'{value}' cannot be read", next_step=hint) from None
    return values
