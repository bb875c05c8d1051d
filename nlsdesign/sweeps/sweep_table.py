"""The table of a sweep in the order of the points, with what was asked beside it and the deck behind each."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..components.assembly.deck_writer import deck_text, declare
from ..components.assembly.named_parts import Assembly
from ..foundation.arrays import Mask
from ..foundation.deck import read_deck
from ..foundation.errors import DeckError, MeasurementError, NlsError, unknown_name
from ..foundation.text_files import is_there, text_of
from .axis_values import changed_assembly
from .sweep_columns import DONE, RESULTS_FILE, SweepColumn, give_back, libraries, numpy_column, read_columns
from .sweep_parts import rows_in_order

__all__ = [
    "SweepColumn",
    "SweepTable",
    "read_sweep",
]

FORMAT: Final = "nlsdesign sweep 1"
ABOUT_FILE: Final = "sweep.json"
DECK_FILE: Final = "deck.toml"
DECKS_FOLDER: Final = "decks"


@dataclass(frozen=True, eq=False, repr=False)
class SweepTable:
    """Points and answers of a sweep.

    Parameters
    ----------
    columns
        Of the table.
    values
        By name of the column, one for each point: numbers in SI as float64, ``point`` as int64, words as
        texts.
    about
        What ``sweep.json`` holds: question, deck, digest, version, seed.
    decks
        Text of the decks behind the points by name; the first is the one that was swept.
    """

    columns: tuple[SweepColumn, ...]
    values: Mapping[str, NDArray[Any]]
    about: Mapping[str, Any] = field(default_factory=dict)
    decks: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.values["point"])

    def __repr__(self) -> str:
        failed = len(self) - int(self.done.sum())
        asked = self.about.get("points", len(self))
        here = f"{len(self)} points" if asked == len(self) else f"{len(self)} of {asked} points"
        named = [f"{c.name} in {c.unit}" if c.unit else c.name for c in (*self.axes, *self.answers)]
        what = f"{self.about.get('question', 'sweep')} of {self.about.get('deck', 'a deck')}"
        return f"{what}: {here}, {failed} failed; columns: {', '.join(named)}"

    @property
    def axes(self) -> tuple[SweepColumn, ...]:
        """Columns that were chosen."""
        return tuple(column for column in self.columns if column.role == "axis")

    @property
    def answers(self) -> tuple[SweepColumn, ...]:
        """Columns that were answered."""
        return tuple(column for column in self.columns if column.role == "answer")

    @property
    def done(self) -> Mask:
        """Which points have answers."""
        result: Mask = self.values["status"] == DONE
        return result

    def failures(self) -> list[tuple[str, int, int]]:
        """Return each reason of failures, the most frequent first, with number of points and first point."""
        counts: dict[str, list[int]] = {}
        failed = ~self.done
        for point, reason in zip(self.values["point"][failed], self.values["reason"][failed], strict=True):
            counts.setdefault(str(reason), [0, int(point)])[0] += 1
        reasons = [(reason, count, first) for reason, (count, first) in counts.items()]
        return sorted(reasons, key=lambda row: -row[1])

    def column(self, name: str) -> SweepColumn:
        """Return one column.

        Parameters
        ----------
        name
            Of an axis, an answer or a state.

        Raises
        ------
        UnknownNameError
            With the nearest that exists.
        """
        for each in self.columns:
            if each.name == name:
                return each
        raise unknown_name("column", name, (each.name for each in self.columns))

    def row_of(self, point: int) -> int:
        """Return the row of a point; rows and points differ where a sweep is not finished.

        Parameters
        ----------
        point
            Number of the point, from 0.

        Raises
        ------
        UnknownNameError
            If the table has no such point.
        """
        rows = np.flatnonzero(self.values["point"] == point)
        if not len(rows):
            shown = f"{self.values['point'][0]} to {self.values['point'][-1]}" if len(self) else "none"
            raise unknown_name("point", str(point), [shown])
        return int(rows[0])

    def assembly_at(self, point: int) -> Assembly:
        """Return the assembly behind a point, from 0: its deck with the numbers and materials of the point.

        Raises
        ------
        UnknownNameError
            If there is no such point.
        MeasurementError
            If the decks do not stand beside the table.
        """
        row = self.row_of(point)
        return _assembly(self, row, _bases(self))


def point_deck_text(table: SweepTable, point: int) -> str:
    """Return the deck behind a point: the deck that was swept with the numbers and materials of the point.

    Axes that belong to the question and not to the machine, such as a target or a seed, stand above it as
    comments.
    """
    row = table.row_of(point)
    return _deck_text(table, row, _bases(table))


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
            yield point, bases if isinstance(bases, NlsError) else _deck_text(table, row, bases)
        except NlsError as error:
            yield point, error


def _bases(table: SweepTable) -> dict[str, Assembly]:
    if not table.decks:
        raise MeasurementError("sweep", f"has no {DECK_FILE} beside its table",
                               next_step="run the sweep again into another folder")  # fmt: skip
    return {name: declare(read_deck(text, Path(f"{name}.toml"))) for name, text in table.decks.items()}


def _assembly(table: SweepTable, row: int, bases: Mapping[str, Assembly]) -> Assembly:
    return changed_assembly(bases, {axis.name: table.values[axis.name][row] for axis in table.axes})


def _deck_text(table: SweepTable, row: int, bases: Mapping[str, Assembly]) -> str:
    text = deck_text(_assembly(table, row, bases))
    deck = table.about.get("deck", "a deck")
    lines = [f"Point {table.values['point'][row]} of a sweep of {deck}; its axes, in SI:"]
    lines += [f"{axis.name} = {table.values[axis.name][row]} {axis.unit}".rstrip() for axis in table.axes]
    # Without control characters, which a comment of TOML may not hold.
    printable = ["".join(each if each.isprintable() else " " for each in line) for line in lines]
    return "".join(f"# {' '.join(line.split())}\n" for line in printable) + text


def about_text(about: Mapping[str, Any], columns: tuple[SweepColumn, ...]) -> str:
    """Return what stands in ``sweep.json``."""
    content = {"format": FORMAT, **about, "columns": [asdict(column) for column in columns]}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def read_about(folder: Path) -> tuple[dict[str, Any], tuple[SweepColumn, ...]]:
    """Return what ``sweep.json`` says, and the columns."""
    path = folder / ABOUT_FILE
    if not is_there(path):
        raise MeasurementError(str(path), "no such file",
                               next_step="name the folder that 'nlsdesign sweep' wrote")  # fmt: skip
    try:
        content = json.loads(text_of(path, MeasurementError))
        columns = tuple(SweepColumn(**each) for each in content["columns"])
    except (ValueError, KeyError, TypeError, RecursionError):
        content, columns = {}, ()
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise MeasurementError(str(path), f"is no '{FORMAT}'", next_step="run the sweep again")
    return content, columns


def read_sweep(folder: Path | str) -> SweepTable:
    """Return the table of a sweep, also of one that is not finished, with the points that it has.

    Parameters
    ----------
    folder
        That ``nlsdesign sweep`` wrote.

    Raises
    ------
    MeasurementError
        If the folder holds no sweep, or a file in it is damaged.
    MissingLibraryError
        If pyarrow is not installed.
    """
    place = Path(folder)
    about, columns = read_about(place)
    results = place / RESULTS_FILE
    values = _columns_of(results, columns) if is_there(results) else rows_in_order(place, columns)
    return SweepTable(columns, values, about, _decks(place, about))


def _columns_of(path: Path, columns: tuple[SweepColumn, ...]) -> dict[str, NDArray[Any]]:
    pyarrow, _ = libraries()
    try:
        table = read_columns(path)
        values = {column.name: numpy_column(table.column(column.name)) for column in columns}
    except (OSError, KeyError, pyarrow.ArrowException) as error:
        raise MeasurementError(
            str(path), f"cannot be read as the table of a sweep ({error})",
            next_step="remove it and run the same sweep again: finished points are not computed again",
        ) from None  # fmt: skip
    del table
    give_back()
    return values


def _decks(folder: Path, about: Mapping[str, Any]) -> dict[str, str]:
    path = folder / DECK_FILE
    if not is_there(path):
        return {}
    decks = {str(about.get("deck", "deck")): text_of(path, DeckError)}
    for each in sorted((folder / DECKS_FOLDER).glob("*.toml")):
        decks[each.stem] = text_of(each, DeckError)
    return decks
