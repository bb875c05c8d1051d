"""Gaps in the time of a record: single late samples are filled in, at longer gaps the record is split."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.arrays import Array, Indices
from ....foundation.quantity import parse_unit
from .mapping import ColumnMap
from .quality import GAP, Finding, rows_in_words, slower_clock
from .table_files import LEAST_ROWS, RecordTable

_LATE = 3.5
"""Up to this many usual steps a sample is late, with at most two missing before it."""
_LARGEST_SHARE = 1e-3
"""Largest share of late samples that are filled in."""
_MOST_LEFT_OUT = 0.2
"""Largest share of rows in parts too short for a record; above it the clock is late throughout, not split."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The parts of one file between its gaps."""

    tables: tuple[RecordTable, ...]  # in order of time; the table as it stands where there is no gap
    remarks: tuple[Finding, ...] = ()  # what was filled in, split or left out


def between_gaps(table: RecordTable, mapping: ColumnMap) -> Pieces:
    """Return the parts of a table between the gaps of its clock.

    ``mapping``: with a common clock to resample to nothing is split, that rule has its own bounds on gaps.
    A time that does not ascend is left to the check of the table.
    """
    head = mapping.time.name
    if mapping.resample is not None or head not in table.given:
        return Pieces((table,))
    time = table.given[head]
    same = [name for name, values in table.given.items() if len(values) == len(time)]
    steps = np.diff(time)
    if len(steps) == 0 or not np.all(steps > 0.0) or len(same) < len(table.given):
        return Pieces((table,))
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if len(gaps) == 0:
        return Pieces((table,))
    place = f"{table.file}: column '{head}', {rows_in_words(gaps[:1] + 1, table.first_row)}"
    if float(np.max(steps)) <= _LATE * usual and len(gaps) <= _LARGEST_SHARE * len(time):
        filled, count = _filled(table, gaps, np.rint(steps / usual).astype(int))
        filled_in = "1 missing sample was" if count == 1 else f"{count} missing samples were"
        text = f"{filled_in} filled in by straight lines, where {len(gaps)} came late"
        return Pieces((filled,), (Finding(place, text),))
    factor = parse_unit(mapping.time.unit).factor
    seconds = factor * steps
    parts = [range(a, b) for a, b in zip([0, *(gaps + 1)], [*(gaps + 1), len(time)], strict=True)]
    long = [part for part in parts if len(part) >= LEAST_ROWS]
    short = len(time) - sum(len(part) for part in long)
    if short > _MOST_LEFT_OUT * len(time):
        return Pieces((table,))  # refused by the check of time, with its advice
    text = f"a gap of {seconds[gaps[0]]:.3g} s"
    text += f", {len(gaps)} gaps in all" if len(gaps) > 1 else ""
    text += f": split into {len(long)} records" if len(long) > 1 else ": one record is left"
    text += f"; {short} rows in parts shorter than {LEAST_ROWS} are left out" if short else ""
    text += slower_clock(seconds, factor * usual)
    pieces = (
        replace(
            table,
            given={name: values[part.start : part.stop] for name, values in table.given.items()},
            first_row=table.first_row + part.start,
        )
        for part in long
    )
    return Pieces(tuple(pieces), (Finding(place, text),))


def _filled(table: RecordTable, gaps: Indices, lengths: Sequence[int] | Indices) -> tuple[RecordTable, int]:
    """Return the table with the samples that are missing in its gaps, and how many these are."""
    missing = {int(gap): int(lengths[gap]) - 1 for gap in gaps}
    before = np.concatenate([np.full(count, gap) for gap, count in missing.items()])
    share = np.concatenate([np.arange(1, count + 1) / (count + 1) for count in missing.values()])

    def with_missing(values: Array) -> Array:
        between: Array = values[before] + share * (values[before + 1] - values[before])
        return np.insert(values, before + 1, between)

    given = {head: with_missing(values) for head, values in table.given.items()}
    return replace(table, given=given), len(before)
