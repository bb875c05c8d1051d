"""Parts: immutable declarations whose numbers carry unit, range, meaning and source."""

from __future__ import annotations

import dataclasses
import math
import re
from abc import ABC
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from ...errors import ArrangementError, UnitError, ValueRangeError, unknown_name
from ...quantity import Quantity, parse_unit, same_dimension

RESERVED = frozenset({"component", "between", "of"})
"""Keys of a deck that say what a part is and where it sits."""


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
    row
        Whether it may be a row of numbers.
    """

    unit: str
    description: str
    minimum: float
    maximum: float
    row: bool = False

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
            If a number lies outside the range, or a row stands where one number belongs.
        """
        result = given if isinstance(given, Quantity) else Quantity(given, self.unit)  # type: ignore[arg-type]
        if isinstance(result.value, tuple) and not self.row:
            raise ValueRangeError(
                f"{name} = {result}",
                f"is a row of {len(result.values)} numbers; {self.description} is one number",
                next_step="give one number without brackets",
            )
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
        number = value / parse_unit(given.unit).factor
        for unit in [prefix + given.unit for prefix in ("m", "k", "M", "c")] + ["%"]:
            try:
                factor = parse_unit(unit).factor
            except UnitError:
                continue
            if same_dimension(unit, self.unit) and self.minimum <= number * factor <= self.maximum:
                return f"was '{unit}' meant? {number:g} {unit} is in the range"
        return None


def parameter(
    unit: str,
    description: str,
    *,
    minimum: float = 0.0,
    maximum: float = math.inf,
    default: float | tuple[float, ...] | None = None,
    row: bool = False,
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
    row
        Whether it may be a row of numbers.
    """
    info = ParameterInfo(unit, description, minimum, maximum, row)
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


def check_names(owner: str, names: Sequence[str], taken: Collection[str] = ()) -> None:
    """Check that names of parts are plain words, used once.

    Parameters
    ----------
    owner
        What holds the parts, for messages.
    names
        As given.
    taken
        Names that mean something else there.

    Raises
    ------
    ArrangementError
        If a name cannot stand in a deck, or stands there twice.
    """
    for number, name in enumerate(names):
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
            raise ArrangementError(
                f"{owner}: name '{name}'",
                "is not a plain word",
                next_step="use letters, digits and underscores, and a letter first",
            )
        if name in taken or name in names[:number]:
            raise ArrangementError(f"{owner}: name '{name}'", "is taken", next_step="choose another name")


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
        As for :func:`resolved`.

    Raises
    ------
    UnknownNameError
        With the nearest name that exists.
    """
    changes: dict[str, dict[str, Quantity]] = {}
    for name, value in resolved(quantities(part), values).items():
        owner, _, field_name = name.rpartition(".")
        changes.setdefault(owner, {})[field_name] = value
    # All numbers of a part change at once: rules between them, such as ascending knots, hold at the end.
    for owner, fields in changes.items():
        target = find(part, owner) if owner else part
        part = replaced(part, owner, dataclasses.replace(target, **fields))
    return part


def resolved(
    known: Mapping[str, Quantity], values: Mapping[str, Quantity | float | tuple[float, ...]]
) -> dict[str, Quantity]:
    """Return new numbers as whole quantities by full name.

    Parameters
    ----------
    known
        The numbers as they are.
    values
        Quantities, or numbers in SI, by full name; ``name[3]`` is the third of a row. A number without a
        source says so, and what the old source spoke of.

    Raises
    ------
    UnknownNameError
        With the nearest name that exists.
    """
    found: dict[str, Quantity] = {}
    for name, value in values.items():
        row, index = _row_item(name)
        if row not in known:
            raise unknown_name("parameter", name, known)
        found[row] = _changed(name, found.get(row, known[row]), value, index)
    return found


def _row_item(name: str) -> tuple[str, int | None]:
    found = re.fullmatch(r"(.+)\[(\d+)\]", name)
    return (found[1], int(found[2])) if found else (name, None)


def _changed(
    name: str, old: Quantity, value: Quantity | float | tuple[float, ...], index: int | None
) -> Quantity:
    if index is None:
        return value if isinstance(value, Quantity) else old.with_value(value)
    if not isinstance(old.value, tuple) or not 1 <= index <= len(old.value):
        row = name.rpartition("[")[0]
        items = range(1, len(old.value) + 1) if isinstance(old.value, tuple) else ()
        raise unknown_name("parameter", name, [f"{row}[{i}]" for i in items] or [row])
    if isinstance(value, Quantity) and not same_dimension(value.unit, old.unit):
        raise UnitError(f"{name} = {value}", f"the others of the row are in '{old.unit}'")
    number = value.number if isinstance(value, Quantity) else value
    return old.with_value(tuple(number if i == index else v for i, v in enumerate(old.value, start=1)))  # type: ignore[misc]
