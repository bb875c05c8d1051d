"""What can be bought: numbers and rubbers to choose from, one by one."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...components.assembly.library_rubber import placed_coil, with_rubber
from ...components.assembly.named_parts import Assembly
from ...foundation.errors import ArrangementError, NlsError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.rubber_library import material
from ..curves.numbers import plain
from ..curves.target_files import read_columns

_MOST = 1000
_NUMBER, _OUTER = "number", "outer_diameter"
"""Columns of a catalogue that hold the maker's number of a coil, and its mean diameter and one wire."""


@dataclass(frozen=True)
class StockChoice(ABC):
    """Base of what a design chooses from a list."""

    @property
    @abstractmethod
    def chosen(self) -> str:
        """Full name of what is chosen."""

    @abstractmethod
    def options(self, actuator: Assembly) -> Iterator[tuple[str, Assembly]]:
        """Yield each option in words, and the assembly with it.

        Parameters
        ----------
        actuator
            As declared.

        Raises
        ------
        NlsError
            If an option cannot be put into the assembly.
        """


@dataclass(frozen=True)
class Stock(StockChoice):
    """Numbers that are in stock, for instance thicknesses of sheets, diameters, numbers of elements.

    Parameters
    ----------
    name
        Full name of the number.
    values
        Quantities, or bare numbers in SI.

    Raises
    ------
    ValueRangeError
        If the list is empty or has something twice.

    Examples
    --------
    >>> Stock("spring.cam.elements", (1, 2, 4)).chosen
    'spring.cam.elements'
    """

    name: str
    values: tuple[Quantity | float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(self.values))
        _require_list(f"Stock('{self.name}')", self.values)
        if self.name.endswith(".elements"):
            for value in self.values:
                if plain(value) % 1.0:
                    raise ValueRangeError(
                        f"Stock('{self.name}') with {value}", "elements are counted",
                        next_step="offer whole numbers",
                    )  # fmt: skip

    @property
    def chosen(self) -> str:
        """The name."""
        return self.name

    def options(self, actuator: Assembly) -> Iterator[tuple[str, Assembly]]:
        """Yield the assembly with each number.

        Raises
        ------
        UnknownNameError
            If there is no such number.
        """
        known = actuator.quantities()
        if self.name not in known:
            raise unknown_name("stock of", self.name, known)
        for value in self.values:
            old = known[self.name]
            number = value.number if isinstance(value, Quantity) else float(value)
            source = value.source if isinstance(value, Quantity) else "chosen from the stock that was offered"
            new = value if isinstance(value, Quantity) else old.with_value(number, source)
            yield f"{self.name} = {new}", actuator.with_values({self.name: new})


@dataclass(frozen=True)
class RubberStock(StockChoice):
    """Rubbers of the library to choose from.

    Parameters
    ----------
    materials
        Names in the library; see ``nlsdesign materials``.
    piece
        Path of the piece of rubber; decided from the structure if it is left out.

    Raises
    ------
    ValueRangeError
        If the list is empty or has something twice.
    """

    materials: tuple[str, ...]
    piece: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "materials", tuple(self.materials))
        _require_list("RubberStock", self.materials)

    @property
    def chosen(self) -> str:
        """The piece of rubber, or that it is the only one."""
        return self.piece or "rubber"

    def options(self, actuator: Assembly) -> Iterator[tuple[str, Assembly]]:
        """Yield the assembly with each rubber."""
        for name in self.materials:
            yield f"{self.chosen} of {name}", with_rubber(actuator, material(name), piece=self.piece)


@dataclass(frozen=True)
class CoilStock(StockChoice):
    """Coils of a catalogue: a CSV file with a row for each and a column for each number that it states.

    Heads are names of numbers of the coil with units, such as ``rate [N/mm]`` or ``wire_diameter [mm]``; a
    column ``number`` is the maker's, and ``outer_diameter`` may stand for the mean one. What the file does
    not state stays as declared, spreads among it.

    Parameters
    ----------
    file
        Path of the file.
    coil
        Path of the coil in the assembly; not needed where there is but one.

    Examples
    --------
    >>> CoilStock("coils.csv").chosen
    'coil'
    """

    file: Path | str
    coil: str | None = None

    @property
    def chosen(self) -> str:
        """The path of the coil, or that it is the only one."""
        return self.coil or "coil"

    def options(self, actuator: Assembly) -> Iterator[tuple[str, Assembly]]:
        """Yield the assembly with each coil.

        Raises
        ------
        ArrangementError
            If an outside diameter stands without its wire.
        ValueRangeError
            If two rows have one number.
        NlsError
            If the file cannot be read, or a row is no coil that can be.
        """
        placed = placed_coil(actuator, self.coil)
        units = placed.units
        known = {_NUMBER: ("1",), _OUTER: ("m",)} | {name: (unit,) for name, unit in units.items()}
        table = read_columns(self.file, known, least_rows=1)
        own_numbers = list(table.values.get(_NUMBER, ()))
        for row, line in enumerate(table.lines):
            if own_numbers and own_numbers.index(own_numbers[row]) < row:
                first = table.lines[own_numbers.index(own_numbers[row])]
                raise ValueRangeError(
                    f"{table.file}, line {line}", f"has the number of line {first}",
                    next_step="write another number, or leave one of the two out",
                )  # fmt: skip
            source = f"{table.file}, line {line}"
            numbers = {
                name: placed.number(name, Quantity(float(column[row]), table.units[name], source))
                for name, column in table.values.items()
                if name != _NUMBER
            }
            if _OUTER in numbers:
                outer, wire = numbers.pop(_OUTER), numbers.get("wire_diameter")
                if wire is None or "mean_diameter" in numbers:
                    raise ArrangementError(
                        f"{table.file}: {_OUTER}",
                        "stands beside wire_diameter and in the place of mean_diameter",
                        next_step="add or leave out the other column",
                    )  # fmt: skip
                mean = Quantity(outer.number - wire.number, "m", source)
                numbers["mean_diameter"] = placed.number("mean_diameter", mean)
            own = f"no. {table.values[_NUMBER][row]:g} of {source}" if _NUMBER in table.values else source
            try:
                yield f"{placed.path} = {own}", placed.exchanged(numbers)
            except NlsError as error:
                raise error.at(source) from None


def require_once(names: Sequence[str], choices: Sequence[StockChoice]) -> None:
    """Refuse a number that is free and offered from a stock at once."""
    for each in choices:
        if each.chosen in names:
            raise ValueRangeError(
                f"free: '{each.chosen}'", "is free and offered from a stock at once",
                next_step="leave its name or its stock out",
            )  # fmt: skip


def combinations(actuator: Assembly, choices: Sequence[StockChoice]) -> list[tuple[str, Assembly]]:
    """Return every combination of options in words, with its assembly."""
    combined = [("", actuator)]
    for choice in choices:
        combined = [
            (", ".join(filter(None, (label, option))), changed)
            for label, assembly in combined
            for option, changed in itertools.islice(choice.options(assembly), _MOST + 1)
        ]
        if len(combined) > _MOST:
            raise ValueRangeError(
                "free: " + ", ".join(each.chosen for each in choices),
                f"gives more than {_MOST} combinations",
                next_step="offer fewer, or free a size without a stock first to see where it wants to be",
            )
    return combined


def _require_list(what: str, values: Sequence[object]) -> None:
    if not values:
        raise ValueRangeError(what, "is an empty list", next_step="name at least one that can be had")
    for place, value in enumerate(values):
        if value in values[:place]:
            raise ValueRangeError(what, f"has {value} twice", next_step="name each once")
