"""Which points of a sweep a page shows, by a rule that keeps what matters; columns in readable units."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ...foundation.arrays import Indices, Mask
from ...sweeps import SweepColumn, SweepTable
from ...sweeps.ranked_points import RankedPoints
from ..figures.sweep_points import PointKinds, ShownColumn

MOST_OTHERS: Final = 1500
MOST_KEPT: Final = 10_000
_UNITS: Final = {"rad": ("deg", 180.0 / np.pi), "m": ("mm", 1e3), "m^2": ("mm^2", 1e6), "m^3": ("cm^3", 1e6)}
_SEED: Final = 0


class ShownPoints(NamedTuple):
    """Points that the page shows.

    Parameters
    ----------
    rows
        Their rows in the table, ascending.
    kinds
        What they are.
    rule
        How they were chosen, as text; empty where all are shown.
    """

    rows: Indices
    kinds: PointKinds
    rule: str


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
    always = ranked.failed | on_front | _ends(table)
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


def _ends(table: SweepTable) -> Mask:
    """Return the points with the least and the largest number of each column."""
    mask = np.zeros(len(table), dtype=bool)
    for column in (*table.axes, *table.answers):
        values = np.asarray(table.values[column.name])
        if values.dtype.kind != "f":
            continue
        finite = np.flatnonzero(np.isfinite(values))
        if len(finite):
            mask[finite[[np.argmin(values[finite]), np.argmax(values[finite])]]] = True
    return mask
