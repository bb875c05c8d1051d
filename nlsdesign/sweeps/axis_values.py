"""Values of an axis as they are given, and the names that an axis can have.

The assembly behind a point: a deck, other rubbers, other numbers.
"""

from __future__ import annotations

import dataclasses
import math
import re
import typing
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from ..components import material, materials, with_rubber
from ..components.assembly.named_parts import Assembly
from ..components.core.element import Tie
from ..components.materials.specimen import Specimen
from ..foundation.errors import NlsError, UnitError, ValueRangeError, brief, unknown_name
from ..foundation.quantity import BASE, Quantity, parse_unit, same_dimension
from ..foundation.written_numbers import split_number
from .sweep_columns import SweepColumn

DECK: Final = "deck"
"""Name of the axis whose words are decks."""
ASK: Final = "ask"
"""First word of the names of what the question itself holds."""

_MOST_KEPT: Final = 64
_kept: dict[tuple[int, str, str], tuple[Assembly, Assembly]] = {}


def pieces_of_rubber(assembly: Assembly) -> tuple[str, ...]:
    """Return the paths of the pieces of rubber of an assembly."""
    inner = ((path, part.element if isinstance(part, Tie) else part) for path, part in assembly.walk())
    return tuple(path for path, part in inner if isinstance(part, Specimen))


def changed_assembly(bases: Mapping[str, Assembly], values: Mapping[str, Any]) -> Assembly:
    """Return the assembly of a point; what begins with ``ask.`` belongs to the question.

    The deck comes first, then rubbers, then numbers, so that a number that is swept is not undone by a
    rubber that brings its own.

    ``bases``: assemblies by the name of their deck; the first is taken where no axis names a deck.
    """
    name = str(values.get(DECK, next(iter(bases))))
    if name not in bases:
        raise unknown_name("deck of the sweep", name, bases)
    made = bases[name]
    pieces = pieces_of_rubber(made)
    numbers: dict[str, float | tuple[float, ...]] = {}
    for name, value in values.items():
        if name == DECK or name.startswith(f"{ASK}."):
            continue
        if isinstance(value, str):
            if name not in pieces:
                raise unknown_name("piece of rubber", name, pieces)
            # The assembly with another rubber; kept, since the fit of its law takes long.
            key = (id(made), name, value)
            if key not in _kept:
                while len(_kept) >= _MOST_KEPT:
                    _kept.pop(next(iter(_kept)))
                # The base is kept beside it, so that its number stands for nothing else.
                _kept[key] = made, with_rubber(made, material(value), piece=name)
            made = _kept[key][1]
    known = made.quantities()
    for name, value in values.items():
        row = row_of_factor(name)
        if row is not None:
            if row not in known:
                raise unknown_name("parameter", row, known)
            scaled = tuple(float(value) * each for each in known[row].values)
            numbers[row] = scaled if isinstance(known[row].value, tuple) else scaled[0]
        elif not isinstance(value, str) and not name.startswith(f"{ASK}."):
            numbers[name] = float(value)
    return made.with_values(numbers) if numbers else made


def row_of_factor(name: str) -> str | None:
    """Return the name within ``factor(NAME)``, which stands for all numbers of a row times one factor."""
    inside = re.fullmatch(r"factor\((.+)\)", name)
    return inside[1] if inside else None


Given = float | int | str | Quantity
_UNIT: Final = "unit"
_KNOWN_UNITS: Final = (
    *(
        "1",
        "m",
        "kg",
        "s",
        "A",
        "K",
        "rad",
        "N",
        "N*m",
        "Pa",
        "W",
        "V",
        "Ohm",
        "H",
        "N*m/rad",
        "rad/s",
        "m/s",
    ),
    *("m^2", "m^3", "kg*m^2", "N*m*s/rad", "Pa*s", "1/s", "N/m", "N*s/m", "N*m/A", "V*s/rad", "kg/m^3"),
)


def si_unit(unit: str) -> str:
    """Return the unit of a number once it is in SI.

    Examples
    --------
    >>> si_unit("mm"), si_unit("mN*m/A"), si_unit("deg"), si_unit("%")
    ('m', 'N*m/A', 'rad', '1')
    """
    exponents = parse_unit(unit).exponents
    for known in _KNOWN_UNITS:
        if parse_unit(known).exponents == exponents:
            return known
    factors = [f"{name}^{e}" if e != 1 else name for name, e in zip(BASE, exponents, strict=True) if e]
    return "*".join(factors) or "1"


@dataclasses.dataclass(frozen=True, eq=False)
class Subject:
    """What axes change: the decks and the question."""

    assemblies: Mapping[str, Assembly]  # by the name of their deck; the first is the one that is swept
    question: Any  # a dataclass; its fields are named ask.FIELD

    @property
    def base(self) -> Assembly:
        """The assembly that is swept."""
        return next(iter(self.assemblies.values()))

    def names(self) -> list[str]:
        """Return all names that an axis can have."""
        numbers = self.base.quantities()
        rows = [f"{name}[1]" for name, q in numbers.items() if isinstance(q.value, tuple)]
        single = [name for name, q in numbers.items() if not isinstance(q.value, tuple)]
        return [DECK, *pieces_of_rubber(self.base), *single, *rows, *question_settings(self.question)]

    def column(self, name: str, values: Sequence[Given], kind: str) -> tuple[SweepColumn, tuple[Any, ...]]:
        """Return the column of an axis, and its values: words, or numbers in SI.

        ``name``: of a number, a piece of rubber, ``deck``, ``factor(NAME)`` or ``ask.FIELD``. ``values``: as
        given: words, numbers with unit, or numbers in SI.
        """
        if self.is_chosen(name):  # its column would read as if the answers did not depend on it
            raise ValueRangeError(
                f"axis '{name}'", "is chosen by the question itself at each point, so it has no effect",
                next_step="leave the axis out, or take it out of what is free",
            )  # fmt: skip
        words = self._words_for(name)
        if words is not None:
            given = tuple(str(each) for each in values)
            for each in given:
                if words and each not in words:
                    raise unknown_name(f"axis {name}", each, words)
            return SweepColumn(name, "", "words of the sweep", "axis", kind), given
        unit = self._unit_of(name, values)
        numbers = tuple(_number(name, each, unit) for each in values)
        if self.is_whole(name) and any(each != round(each) for each in numbers):
            raise ValueRangeError(f"axis '{name}'", "takes whole numbers only")
        self._require_unit(name, numbers[:1], unit)
        text = "" if unit == "1" else unit
        described = "asked of the point" if name.startswith(f"{ASK}.") else "number of the deck"
        return SweepColumn(name, text, described, "axis", kind, min(numbers), max(numbers)), numbers

    def is_whole(self, name: str) -> bool:
        """Return whether an axis takes whole numbers only."""
        if name not in question_settings(self.question):
            return False
        *path, last = name.split(".")[1:]
        holder = self.question
        for each in path:
            holder = _inner(holder)[each]
        return _is_whole(holder, last)

    def is_chosen(self, name: str) -> bool:
        """Return whether the question chooses a number itself, whatever it was before.

        ``name``: of a number, an item of a row, or ``factor(NAME)``.
        """
        return (row_of_factor(name) or name.partition("[")[0]) in self.question.chosen(self.base)

    def _require_unit(self, name: str, first: tuple[float, ...], unit: str) -> None:
        """Refuse a unit that the question would refuse at every point; a value out of range fails its own."""
        if name not in question_settings(self.question):
            return
        try:
            with_settings(self.question, dict.fromkeys([name], *first), {name: unit})
        except UnitError as error:
            raise error.at(f"axis {name}") from None
        except NlsError:
            return

    def _words_for(self, name: str) -> list[str] | None:
        """Return the words that an axis may have; an empty list for any, ``None`` for an axis of numbers."""
        if name == DECK:
            return list(self.assemblies)
        if name in pieces_of_rubber(self.base):
            return list(materials())
        return [] if isinstance(question_settings(self.question).get(name), str) else None

    def _unit_of(self, name: str, values: Sequence[Given]) -> str:
        """Return the unit in SI; that of the question's own fields is the one that is written."""
        if name in question_settings(self.question):
            present = question_settings(self.question)[name]
            stated = {f"{ASK}.{each.name}": unit_of_field(each) for each in dataclasses.fields(self.question)}
            fixed = stated.get(name)
            if fixed is not None:
                return fixed
            units = [u for u in (_written_unit(name, v) for v in (*values, present)) if u]
            return si_unit(units[0]) if units else "1"
        row = row_of_factor(name)
        known = self.base.quantities()
        if row is not None and row in known:
            return "1"
        head, _, index = name.partition("[")
        if head not in known:
            raise unknown_name("axis", name, self.names())
        count = len(known[head].value) if isinstance(known[head].value, tuple) else 0  # type: ignore[arg-type]
        if count != 0 and index.rstrip("]") not in map(str, range(1, count + 1)):
            raise ValueRangeError(
                f"axis '{name}'", f"'{head}' is a row of {count} numbers",
                next_step=f"name one, for instance '{head}[1]', or all by a factor: 'factor({head})'",
            )  # fmt: skip
        if count == 0 and index:
            raise unknown_name("axis", name, [head])
        return si_unit(known[head].unit)


def _written_unit(name: str, given: object) -> str:
    if isinstance(given, Quantity):
        return given.unit
    return _split(name, given)[1] if isinstance(given, str) else ""


def _split(name: str, text: str) -> tuple[float, str]:
    try:
        return split_number(text)
    except UnitError as error:
        step = error.next_step or "write for instance '20 mm'"
        raise UnitError(f"axis {name} = '{text}'", error.rule, next_step=step) from None


def _number(name: str, given: Given, unit: str) -> float:
    """Return a number in SI; a bare one is in SI already."""
    written = _written_unit(name, given)
    if written and not same_dimension(written, unit):
        raise UnitError(
            f"axis {name} = {given}",
            f"'{written}' is no unit of it",
            next_step=f"give it in a unit like '{unit}'",
        )
    if isinstance(given, Quantity):
        value = given.number
    elif isinstance(given, str):
        number, text = _split(name, given)
        value = number * parse_unit(text or "1").factor
    elif isinstance(given, bool) or not isinstance(given, int | float | np.number):
        raise ValueRangeError(f"axis {name} = {brief(given)}", "is not a number")
    else:
        value = float(given)
    if not math.isfinite(value):
        raise ValueRangeError(f"axis {name} = {given}", "is not finite")
    return float(value)


def question_settings(question: Any, prefix: str = ASK) -> dict[str, Any]:
    """Return what an axis can change in a question: single numbers and words, by name.

    ``question``: a dataclass; also those that it holds are looked through. In a row of them each goes by the
    name of its class, for instance ``ask.keep.MaximumCamRadius.radius``.
    """
    known: dict[str, Any] = {}
    for name, value in _inner(question).items():
        full = f"{prefix}.{name}"
        if isinstance(value, str | Quantity) or (
            isinstance(value, int | float) and not isinstance(value, bool)
        ):
            known[full] = value
        elif dataclasses.is_dataclass(value) or isinstance(value, tuple):
            known |= question_settings(value, full)
    return known


def in_unit(default: float, unit: str) -> Any:
    """Return a field of a question for a number in SI whose unit is checked where it is read."""
    return dataclasses.field(default=default, metadata={_UNIT: unit})


def unit_of_field(field: dataclasses.Field[Any]) -> str | None:
    """Return the unit in SI that a field of a question states, or ``None``."""
    unit: str | None = field.metadata.get(_UNIT)
    return unit


def _inner(holder: Any) -> dict[str, Any]:
    if isinstance(holder, tuple):
        return {type(each).__name__: each for each in holder if dataclasses.is_dataclass(each)}
    if not dataclasses.is_dataclass(holder):
        return {}
    return {field.name: getattr(holder, field.name) for field in dataclasses.fields(holder) if field.init}


def _is_whole(holder: Any, field: str) -> bool:
    """Return whether a field takes whole numbers only, whatever number stands in it."""
    hint = typing.get_type_hints(type(holder)).get(field)
    kinds = set(typing.get_args(hint)) or {hint}
    return int in kinds and not kinds & {float, Quantity}


def with_settings(question: Any, values: Mapping[str, Any], units: Mapping[str, str]) -> Any:
    """Return a copy of a question with other numbers and words."""
    for name, value in values.items():
        question = _changed(question, name.split(".")[1:], value, units.get(name, ""))
    return question


def _changed(holder: Any, path: list[str], value: Any, unit: str) -> Any:
    first, *rest = path
    if isinstance(holder, tuple):
        return tuple(
            _changed(each, rest, value, unit) if type(each).__name__ == first else each for each in holder
        )
    present = getattr(holder, first)
    if rest:
        new = _changed(present, rest, value, unit)
    elif isinstance(present, str):
        new = str(value)
    elif _is_whole(holder, first):
        new = round(value)
    else:
        # A field that takes a quantity checks the dimension of what it gets.
        takes = Quantity in typing.get_args(typing.get_type_hints(type(holder)).get(first))
        new = Quantity(float(value), unit, "swept") if takes and unit else float(value)
    return dataclasses.replace(holder, **{first: new})
