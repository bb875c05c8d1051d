"""Files beside the page of a sweep: all numbers as CSV, and the decks of the points in its table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ...foundation.errors import NlsError
from ...foundation.writing import write_table, write_text
from ...sweeps import SweepTable
from ...sweeps.point_deck import point_deck_texts

_NAMES = {
    "points": "points asked",
    "asked": "question, digest",
    "digest": "deck, digest",
    "plan": "points, digest",
}
POINTS_FILE = "points.csv"
DECKS_FOLDER = "point_decks"
"""Not that of the decks that were swept, so that the page may stand in the folder of the sweep."""


def write_points(table: SweepTable, folder: Path) -> Path:
    """Write all points as a table of comma-separated values, in SI, and return its path."""
    path = folder / POINTS_FILE
    write_table(path, _rows(table))
    return path


def _rows(table: SweepTable) -> Iterator[Sequence[str]]:
    columns = [column for column in table.columns if column.name in table.values]
    yield [f"{column.name} [{column.unit}]" if column.unit else column.name for column in columns]
    values = [np.asarray(table.values[column.name]) for column in columns]
    for row in zip(*values, strict=True):
        yield [f"{float(cell):.9g}" if isinstance(cell, float | np.floating) else str(cell) for cell in row]


def write_decks(table: SweepTable, points: Iterable[int], folder: Path) -> tuple[dict[int, str], list[str]]:
    """Write the decks behind points; a point whose deck cannot be made has none, with the reason."""
    written: dict[int, str] = {}
    remarks: dict[str, list[int]] = {}
    for point, text in point_deck_texts(table, points):
        if isinstance(text, NlsError):
            remarks.setdefault(f"{text.thing}: {text.rule}", []).append(point)
            continue
        name = f"{DECKS_FOLDER}/point_{point}.toml"
        write_text(folder / name, text)
        written[point] = name
    return written, [f"no deck for {_numbers(numbers)}: {reason}" for reason, numbers in remarks.items()]


def _numbers(points: Sequence[int]) -> str:
    shown = ", ".join(map(str, points[:5]))
    return ("point " if len(points) == 1 else "points ") + shown + (", …" if len(points) > 5 else "")


def about_of(table: SweepTable) -> dict[str, str]:
    """Return what the sweep says of itself, in texts by name."""
    result = {}
    for name, value in table.about.items():
        if name in ("format", "columns") or value in (None, "", [], {}):
            continue
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        result[_NAMES.get(name, name.replace("_", " "))] = text if len(text) <= 200 else text[:197] + "..."
    return result
