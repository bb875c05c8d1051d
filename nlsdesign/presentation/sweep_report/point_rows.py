"""Rows of points as the page shows them: values with few digits, what kept a point from counting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...foundation.errors import visible
from ...foundation.quantity import typeset_unit
from ...sweeps import SweepColumn, SweepTable
from ...sweeps.ranked_points import RankedPoints
from .shown_points import ShownPoints, shown_column

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
