"""Parts: immutable declarations whose numbers carry unit, range, meaning and source."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Self

from ..errors import UnitError, ValueRangeError, unknown_name
from ..quantity import Quantity, parse_unit, same_dimension


@dataclass(frozen=True)
class ParameterInfo:
    """What a part says of one of its numbers.

    Parameters
    ----------
    unit
        SI unit.
    description
        Meaning in words.
    minimum, maximum
        Range in which the law holds and beyond which a number is taken for a slip of units; inclusive.
    """

    unit: str
    description: str
    minimum: float
    maximum: float

    def checked(self, name: str, given: Quantity | float | tuple[float, ...] | list[float]) -> Quantity:
        """Return the number as a quantity of the right dimension and size.

        Parameters
        ----------
        name
            Name of the field, for messages.
        given
            A quantity, or bare number(s) in SI.

        Raises
        ------
        UnitError
            If the unit measures something else.
        ValueRangeError
            If a number lies outside the range.
        """
        if isinstance(given, list):
            given = tuple(given)
        result = given if isinstance(given, Quantity) else Quantity(given, self.unit)
        if not same_dimension(result.unit, self.unit):
            raise UnitError(
                f"{name} = {result}",
                f"'{result.unit}' does not measure {self.description}",
                next_step=f"give it in a unit like '{self.unit}'",
            )
        for value in result.values:
            if not self.minimum <= value <= self.maximum:
                raise ValueRangeError(
                    f"{name} = {result}",
                    f"{self.description} must lie in [{self.minimum:g}, {self.maximum:g}] {self.unit}",
                    next_step=self._slip(result, value),
                )
        return result

    def _slip(self, given: Quantity, value: float) -> str | None:
        for prefix, factor in (("m", 1e-3), ("k", 1e3), ("M", 1e6), ("c", 1e-2)):
            if self.minimum <= value * factor <= self.maximum and value * factor != value:
                slipped = prefix + given.unit
                try:
                    parse_unit(slipped)
                except UnitError:
                    continue
                number = value / parse_unit(given.unit).factor
                return f"was '{slipped}' meant? {number:g} {slipped} is in the range"
        return None


def parameter(
    unit: str,
    description: str,
    *,
    minimum: float = 0.0,
    maximum: float = math.inf,
    default: float | tuple[float, ...] | None = None,
) -> Any:
    """Declare a number of a part as a dataclass field.

    Parameters
    ----------
    unit
        SI unit.
    description
        Meaning in words, without an article.
    minimum, maximum
        Inclusive range.
    default
        Value in SI where there is a natural one; such a value is marked as assumed.
    """
    info = ParameterInfo(unit, description, minimum, maximum)
    if default is None:
        return dataclasses.field(metadata={"parameter": info})
    value = Quantity(default, unit, "assumed: default of the component")
    return dataclasses.field(default=value, metadata={"parameter": info})


@dataclass(frozen=True, kw_only=True)
class Part(ABC):  # noqa: B024 - a bare part has no law; its kinds do
    """Base of everything that is declared: its numbers are the fields made by :func:`parameter`."""

    def __post_init__(self) -> None:
        for name, info in self.parameter_infos().items():
            object.__setattr__(self, name, info.checked(name, getattr(self, name)))

    @classmethod
    def parameter_infos(cls) -> dict[str, ParameterInfo]:
        """Return unit, description and range of each number by field name."""
        return {f.name: f.metadata["parameter"] for f in dataclasses.fields(cls) if "parameter" in f.metadata}

    def parameters(self) -> dict[str, Quantity]:
        """Return the numbers of this part alone by field name."""
        return {name: getattr(self, name) for name in self.parameter_infos()}

    def children(self) -> Mapping[str, Part]:
        """Return the parts inside this one by name."""
        return {}

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other parts inside.

        Parameters
        ----------
        children
            All parts inside, by name.
        """
        if children:
            raise unknown_name("part", next(iter(children)), ())
        return self

    def title(self) -> str:
        """Return one line that names the law and its numbers."""
        numbers = ", ".join(f"{n} = {_short(q)}" for n, q in self.parameters().items())
        return f"{type(self).__name__}({numbers})"


def _short(given: Quantity) -> str:
    return str(given) if len(given.values) <= 4 else f"<{len(given.values)} numbers in {given.unit}>"


def walk(part: Part, path: str = "") -> Iterator[tuple[str, Part]]:
    """Yield every part with its path, parents first, in written order.

    Parameters
    ----------
    part
        Root.
    path
        Path of the root.
    """
    yield path, part
    for name, child in part.children().items():
        yield from walk(child, f"{path}.{name}" if path else name)


def quantities(part: Part, path: str = "") -> dict[str, Quantity]:
    """Return all numbers of a part and everything in it by full name.

    Parameters
    ----------
    part
        Root.
    path
        Path of the root.
    """
    found: dict[str, Quantity] = {}
    for where, each in walk(part, path):
        found |= {f"{where}.{name}" if where else name: q for name, q in each.parameters().items()}
    return found


def find(part: Part, path: str) -> Part:
    """Return the part at a path.

    Parameters
    ----------
    part
        Root.
    path
        Names joined by dots.

    Raises
    ------
    UnknownNameError
        With the nearest path that exists.
    """
    parts = dict(walk(part))
    if path not in parts:
        raise unknown_name("part", path, (name for name in parts if name))
    return parts[path]


def replaced(part: Part, path: str, new: Part) -> Part:
    """Return a copy in which the part at a path is another one.

    Parameters
    ----------
    part
        Root.
    path
        Where; the empty path is the root itself.
    new
        The part to put there.
    """
    if not path:
        return new
    find(part, path)
    head, _, tail = path.partition(".")
    children = dict(part.children())
    return part.with_children(children | {head: replaced(children[head], tail, new)})


def with_values(part: Part, values: Mapping[str, Quantity | float | tuple[float, ...]]) -> Part:
    """Return a copy with other numbers.

    Parameters
    ----------
    part
        Root.
    values
        Quantities, or numbers in SI, by full name; ``name[3]`` is the third of a row.

    Raises
    ------
    UnknownNameError
        With the nearest name that exists.
    """
    known = quantities(part)
    for name, value in values.items():
        row, index = _row_item(name)
        if row not in known:
            raise unknown_name("parameter", name, known)
        owner, _, field_name = row.rpartition(".")
        target = find(part, owner) if owner else part
        new = _changed(known[row], value, index)
        part = replaced(part, owner, dataclasses.replace(target, **{field_name: new}))
        known[row] = new
    return part


def _row_item(name: str) -> tuple[str, int | None]:
    if not name.endswith("]"):
        return name, None
    row, _, index = name[:-1].rpartition("[")
    return row, int(index) - 1


def _changed(old: Quantity, value: Quantity | float | tuple[float, ...], index: int | None) -> Quantity:
    if isinstance(value, Quantity) and index is None:
        return value
    number = value.value if isinstance(value, Quantity) else value
    if index is not None and not isinstance(number, tuple):
        items = list(old.values)
        items[index] = float(number)
        return old.with_value(tuple(items))
    return old.with_value(number)
