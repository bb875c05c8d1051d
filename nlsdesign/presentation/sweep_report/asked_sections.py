"""Sections on what was asked of a sweep, how far it is, and why points failed."""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np

from ...foundation.quantity import three_digits, typeset_unit, with_unit
from ...sweeps import SweepColumn, SweepTable
from ...sweeps.ranked_points import RankedPoints
from ..report import KeyNumber, NumbersSection, Section, TableSection
from .shown_points import shown_column, shown_unit

_MOST_REASONS: Final = 25
_LONGEST: Final = 300


def point_list(points: list[int], most: int = 6) -> str:
    """Return the first numbers of points as text."""
    return ", ".join(map(str, points[:most])) + (", …" if len(points) > most else "")


def asked_sections(table: SweepTable, ranked: RankedPoints) -> list[Section]:
    """Return the sections in the order of the page."""
    return [_numbers(table, ranked), _axes(table), *_directions(table, ranked), *_failures(table)]


def _numbers(table: SweepTable, ranked: RankedPoints) -> Section:
    done, failed = int(np.sum(table.done)), int(np.sum(ranked.failed))
    numbers = [
        KeyNumber("points with answers", str(done), _of_asked(table)),
        KeyNumber("points that failed", str(failed), "their reasons stand below" if failed else ""),
    ]
    if ranked.requirements:
        numbers.append(KeyNumber("points that miss a requirement", str(int(np.sum(ranked.missed)))))
    if np.any(ranked.incomplete):
        count = int(np.sum(ranked.incomplete))
        numbers.append(KeyNumber("points without a finite answer to compare", str(count), "not on the front"))
    if ranked.preferences:
        among = int(np.sum(ranked.compared))
        numbers.append(
            KeyNumber("points on the front", str(len(ranked.front)), f"of {among} that were compared")
        )
    return NumbersSection("In short", tuple(numbers))


def _of_asked(table: SweepTable) -> str:
    """Return how far the sweep is: a page of one that is not finished must say so."""
    asked = table.about.get("points")
    if isinstance(asked, int) and asked > len(table):
        return f"of {len(table)} so far; {asked} are asked for, so all that follows is of a part of them"
    return f"of {len(table)}"


def _axes(table: SweepTable) -> Section:
    rows = tuple((axis.name, axis.kind.replace("_", " ") or "–", *_range(table, axis), axis.description)
                 for axis in table.axes)  # fmt: skip
    caption = "Axes of the sweep: what was changed, how the values were chosen, and what stands in the table."
    return TableSection(
        "What was changed", ("axis", "chosen as", "values", "range", "what it is"), rows, caption=caption
    )


def _range(table: SweepTable, axis: SweepColumn) -> tuple[str, str]:
    """Return how many different values an axis has, and from where to where."""
    column = shown_column(table, axis)
    distinct = np.unique(column.values[~_missing(column.values)])
    if column.words:
        names = ", ".join(distinct.tolist()[:8]) + (", …" if len(distinct) > 8 else "")
        return str(len(distinct)), names[:_LONGEST] or "–"
    if not len(distinct):
        return "0", "–"
    ends = dict.fromkeys(three_digits(float(end)) for end in (distinct[0], distinct[-1]))
    text = with_unit(" to ".join(ends), column.unit or "1")
    if axis.lower is not None and axis.upper is not None:
        factor = shown_unit(axis.unit)[1]
        asked = " to ".join(three_digits(end * factor) for end in (axis.lower, axis.upper))
        width = abs(axis.upper - axis.lower) * factor
        if abs(axis.lower * factor - distinct[0]) + abs(axis.upper * factor - distinct[-1]) > 0.02 * width:
            text += f" (asked: {with_unit(asked, column.unit or '1')})"
    return str(len(distinct)), text


def _missing(values: np.ndarray) -> np.ndarray:
    return np.isnan(values) if values.dtype.kind == "f" else np.zeros(len(values), dtype=bool)


def _directions(table: SweepTable, ranked: RankedPoints) -> list[Section]:
    rows = [(each.answer, each.words(table.column(each.answer).unit), "–") for each in ranked.preferences]
    rows += [
        (each.answer, f"must be {each.words(table.column(each.answer).unit)}", str(count))
        for each, count in zip(ranked.requirements, ranked.misses, strict=True)
    ]
    if not rows:
        return []
    caption = (
        "A point is on the front where no other point that was compared is at least as good in all of these "
        "answers and better in one. Points that failed, that miss a requirement, or whose answer is no "
        "finite number are not compared."
    )
    return [
        TableSection(
            "What is better", ("answer", "direction", "points that miss it"), tuple(rows), caption=caption
        )
    ]


def _failures(table: SweepTable) -> list[Section]:
    failed = np.flatnonzero(~table.done)
    if not len(failed):
        return []
    reasons = [" ".join(str(table.values["reason"][row]).split()) or "no reason is stated" for row in failed]
    groups = Counter(reasons)
    examples: dict[str, list[int]] = {}
    for row, reason in zip(failed.tolist(), reasons, strict=True):
        examples.setdefault(reason, []).append(int(table.values["point"][row]))
    ordered = groups.most_common()
    rows = [
        (str(count), _cut(reason), point_list(examples[reason])) for reason, count in ordered[:_MOST_REASONS]
    ]
    rest = ordered[_MOST_REASONS:]
    if rest:
        count = sum(each for _, each in rest)
        rows.append((str(count), f"{len(rest)} further reasons, see the table of all points", ""))
    caption = (
        f"{len(failed)} of {len(table)} points failed, grouped by reason. They are results of no figure."
    )
    return [TableSection("Points that failed", ("points", "reason", "numbers"), tuple(rows), caption=caption)]


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def unit_of(column: SweepColumn) -> str:
    """Return the unit of a column as people read it, with a word before it, or nothing."""
    unit = typeset_unit(shown_unit(column.unit)[0] or "1")
    return f" in {unit}" if unit else ""
