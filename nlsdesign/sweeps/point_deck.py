"""The decks behind points of a sweep, as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from ..components.assembly.deck_writer import deck_text, declare
from ..components.assembly.named_parts import Assembly
from ..foundation.deck import read_deck
from ..foundation.errors import MeasurementError, NlsError
from .changes import changed_assembly
from .sweep_table import SweepTable


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
    # Without control characters, which a comment of TOML may not hold.
    printable = ["".join(each if each.isprintable() else " " for each in line) for line in lines]
    return "".join(f"# {' '.join(line.split())}\n" for line in printable) + text
