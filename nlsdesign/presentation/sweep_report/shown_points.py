"""Which points of a sweep a page shows, by a rule that keeps what matters, and their rows."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from ...foundation.arrays import Indices
from ...foundation.errors import visible
from ...foundation.quantity import typeset_unit
from ...sweeps import SweepColumn, SweepTable
from ...sweeps.preferences import RankedPoints
from ...sweeps.sensitivity import AnswerSensitivity
from ..figures.sweep_figures import PointKinds, ShownColumn

MOST_OTHERS: Final = 1500
MOST_KEPT: Final = 10_000
_UNITS: Final = {"rad": ("deg", 180.0 / np.pi), "m": ("mm", 1e3), "m^2": ("mm^2", 1e6), "m^3": ("cm^3", 1e6)}
_SEED: Final = 0


class ShownPoints(NamedTuple):
    """Points that the page shows."""

    rows: Indices  # their rows in the table, ascending
    kinds: PointKinds  # what they are
    rule: str  # how they were chosen, as text; empty where all are shown


def shown_unit(unit: str) -> tuple[str, float]:
    """Return the unit that people read in place of one of SI, and how many of it make one of SI.

    ``unit``: of a column; empty for words and counts.
    """
    return _UNITS.get(unit, (unit, 1.0))


def shown_column(table: SweepTable, column: SweepColumn, rows: Indices | slice = slice(None)) -> ShownColumn:
    """Return a column as figures show it.

    ``rows``: which rows; all by default.
    """
    values = np.asarray(table.values[column.name])[rows]
    unit, factor = shown_unit(column.unit)
    if values.dtype.kind in "fiub":
        return ShownColumn(column.name, unit, values.astype(float) * factor)
    return ShownColumn(column.name, "", values.astype(str))


def shown_points(table: SweepTable, ranked: RankedPoints) -> ShownPoints:
    """Return the points that are shown: failures, the front, the ends of columns, and others by lot."""
    count = len(table)
    on_front = np.zeros(count, dtype=bool)
    on_front[ranked.front] = True
    # The points with the least and the largest number of each column.
    mask = np.zeros(len(table), dtype=bool)
    for column in (*table.axes, *table.answers):
        values = np.asarray(table.values[column.name])
        if values.dtype.kind != "f":
            continue
        finite = np.flatnonzero(np.isfinite(values))
        if len(finite):
            mask[finite[[np.argmin(values[finite]), np.argmax(values[finite])]]] = True
    always = ranked.failed | on_front | mask
    chosen, rule = np.ones(count, dtype=bool), ""
    others = np.flatnonzero(~always)
    random = np.random.default_rng(_SEED)
    if len(others) > MOST_OTHERS:
        chosen[others] = False
        chosen[random.permutation(others)[:MOST_OTHERS]] = True
        rule = (
            f"Of {count} points {count - len(others) + MOST_OTHERS} are drawn: all that failed, all on the "
            f"front, the least and the largest of each column, and {MOST_OTHERS} of the rest, taken by "
            "lot, the same in each run."
        )
    kept = np.flatnonzero(always)
    if len(kept) > MOST_KEPT:
        # The front is never thinned, so the lot is among the rest.
        rest = np.flatnonzero(always & ~on_front)
        chosen[random.permutation(rest)[max(0, MOST_KEPT - int(on_front.sum())) :]] = False
        rule += (
            f" {len(kept) - MOST_KEPT} failures are not drawn, for a page of more than {MOST_KEPT} points "
            "opens slowly; they are counted, and the table holds them."
        )
    rows = np.flatnonzero(chosen)
    kinds = PointKinds(
        np.asarray(table.values["point"])[rows].astype(np.int64),
        on_front[rows], ranked.missed[rows], ranked.failed[rows],
    )  # fmt: skip
    return ShownPoints(rows, kinds, rule.strip())


_DIGITS, _LONGEST = 6, 300


def row_columns(table: SweepTable) -> list[SweepColumn]:
    """Return the columns of a row: axes, then answers."""
    return [*table.axes, *table.answers]


def named_columns(table: SweepTable) -> list[tuple[str, str]]:
    """Return name and unit of each column of a row, as people read them."""
    shown = (shown_column(table, column) for column in row_columns(table))
    return [(each.name, typeset_unit(each.unit or "1")) for each in shown]


def point_rows(table: SweepTable, ranked: RankedPoints, shown: ShownPoints) -> dict[int, Mapping[str, Any]]:
    """Return for each point that is shown its status, reason and values, by number."""
    columns = [_texts(table, column, shown) for column in row_columns(table)]
    front = set(ranked.front.tolist())
    rows: dict[int, Mapping[str, Any]] = {}
    for place, row in enumerate(shown.rows.tolist()):
        values = [column[place] for column in columns]
        point = int(table.values["point"][row])
        if ranked.failed[row]:
            reason = visible(str(table.values["reason"][row]))[:_LONGEST]
            rows[point] = {"status": "failed", "reason": reason, "values": values}
            continue
        note = (
            "On the front." if row in front else
            "Misses a requirement." if ranked.missed[row] else
            "An answer that is compared is no finite number." if ranked.incomplete[row] else ""
        )  # fmt: skip
        rows[point] = {"note": note, "values": values} if note else {"values": values}
    return rows


def _texts(table: SweepTable, column: SweepColumn, shown: ShownPoints) -> list[Any]:
    """Return the values of one column as JSON holds them; nothing where an answer is missing."""
    values = shown_column(table, column, shown.rows).values
    if values.dtype.kind not in "fiub":
        return [visible(str(value))[:_LONGEST] for value in values.tolist()]
    return [_number(value) for value in values.astype(float).tolist()]


def _number(value: float) -> float | int | str | None:
    if np.isnan(value):
        return None
    if np.isinf(value):
        return "∞" if value > 0 else "−∞"
    short = float(f"{value:.{_DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 1e9 else short


def listed_names(names: list[str]) -> str:
    """Return names as text, the first of them."""
    return ", ".join(f"`{name}`" for name in names[:8]) + (", …" if len(names) > 8 else "")


class PageContent(NamedTuple):
    """What the figures of a page are made from."""

    table: SweepTable
    ranked: RankedPoints
    shown: ShownPoints
    answers: tuple[str, ...]
    sensitivities: dict[str, AnswerSensitivity]
    points_file: Path

    def varies(self, column: SweepColumn) -> bool:
        """Tell whether a column has two different values."""
        return self.distinct(column) > 1

    def distinct(self, column: SweepColumn) -> int:
        """Return how many different values a column has, those that are finite or words."""
        values = np.asarray(self.table.values[column.name])
        return len(np.unique(values[np.isfinite(values)] if values.dtype.kind == "f" else values.astype(str)))

    def varying_axes(self) -> list[SweepColumn]:
        """Return the axes that have two different values."""
        return [axis for axis in self.table.axes if self.varies(axis)]
