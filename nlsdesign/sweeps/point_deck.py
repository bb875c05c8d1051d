"""The assembly behind a point of a sweep (a deck, other rubbers, other numbers), and its deck as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from ..components import material, with_rubber
from ..components.assembly.deck_writer import deck_text, declare
from ..components.assembly.named_parts import Assembly
from ..components.core.tie import Tie
from ..components.materials.specimen import Specimen
from ..foundation.deck import read_deck
from ..foundation.errors import MeasurementError, NlsError, unknown_name
from .sweep_table import SweepTable

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
            made = _with_rubber(made, name, value)
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


def _with_rubber(base: Assembly, piece: str, rubber: str) -> Assembly:
    """Return the assembly with another rubber; kept, since the fit of its law takes long."""
    key = (id(base), piece, rubber)
    if key not in _kept:
        while len(_kept) >= _MOST_KEPT:
            _kept.pop(next(iter(_kept)))
        # The base is kept beside it, so that its number stands for nothing else.
        _kept[key] = base, with_rubber(base, material(rubber), piece=piece)
    return _kept[key][1]


def row_of_factor(name: str) -> str | None:
    """Return the name within ``factor(NAME)``, which stands for all numbers of a row times one factor."""
    inside = re.fullmatch(r"factor\((.+)\)", name)
    return inside[1] if inside else None


def point_deck_text(table: SweepTable, point: int) -> str:
    """Return the deck behind a point: the deck that was swept with the numbers and materials of the point.

    Axes that belong to the question and not to the machine, such as a target or a seed, stand above it as
    comments.
    """
    row = table.row_of(point)
    return _text(table, row, _bases(table))


def point_deck_texts(table: SweepTable, points: Iterable[int]) -> Iterator[tuple[int, str | NlsError]]:
    """Yield the deck behind each point, or why it has none; decks that were swept are read once."""
    bases: dict[str, Assembly] | NlsError
    try:
        bases = _bases(table)
    except NlsError as error:
        bases = error
    for point in points:
        row = table.row_of(point)
        try:
            yield point, bases if isinstance(bases, NlsError) else _text(table, row, bases)
        except NlsError as error:
            yield point, error


def _bases(table: SweepTable) -> dict[str, Assembly]:
    if not table.decks:
        raise MeasurementError(
            "sweep", "has no deck beside its table", next_step="run the sweep again into another folder"
        )
    return {name: declare(read_deck(text, Path(f"{name}.toml"))) for name, text in table.decks.items()}


def _text(table: SweepTable, row: int, bases: dict[str, Assembly]) -> str:
    values = {axis.name: table.values[axis.name][row] for axis in table.axes}
    text = deck_text(changed_assembly(bases, values))
    deck = table.about.get("deck", "a deck")
    lines = [f"Point {table.values['point'][row]} of a sweep of {deck}; its axes, in SI:"]
    lines += [f"{axis.name} = {values[axis.name]} {axis.unit}".rstrip() for axis in table.axes]
    return "".join(f"# {' '.join(_printable(line).split())}\n" for line in lines) + text


def _printable(text: str) -> str:
    """Return a text without control characters, which a comment of TOML may not hold."""
    return "".join(each if each.isprintable() else " " for each in text)
