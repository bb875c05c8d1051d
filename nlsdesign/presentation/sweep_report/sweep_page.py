"""The page of a sweep, with the files beside it: all numbers as CSV, and the decks of the points shown."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...foundation.errors import MissingLibraryError, NlsError, typed_command, visible
from ...foundation.text_files import write_table, write_text
from ...sweeps import SweepTable
from ...sweeps.preferences import Preference, RankedPoints, Requirement, rank_points
from ...sweeps.sensitivity import AnswerSensitivity, sensitivity
from ...sweeps.sweep_table import point_deck_texts
from ..report import FileSection, Section, TableSection, TextSection, write_report
from ..report.tables import PointTableSection
from .shown_points import PageContent, named_columns, point_rows, shown_column, shown_points
from .sweep_sections import (
    asked_sections,
    coordinate_sections,
    front_sections,
    histogram_sections,
    point_list,
    sensitivity_sections,
    surface_sections,
    unit_of,
)

_NAMES = {
    "points": "points asked",
    "asked": "question, digest",
    "digest": "deck, digest",
    "plan": "points, digest",
}
POINTS_FILE = "points.csv"
DECKS_FOLDER = "point_decks"
"""Not that of the decks that were swept, so that the page may stand in the folder of the sweep."""


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
    return written, [
        f"no deck for point{'s' if len(numbers) > 1 else ''} {point_list(numbers, most=5)}: {reason}"
        for reason, numbers in remarks.items()
    ]


def about_of(table: SweepTable) -> dict[str, str]:
    """Return what the sweep says of itself, in texts by name."""
    result = {}
    for name, value in table.about.items():
        if name in ("format", "columns") or value in (None, "", [], {}):
            continue
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        result[_NAMES.get(name, name.replace("_", " "))] = text if len(text) <= 200 else text[:197] + "..."
    return result


PAGE_FILE = "sweep.html"
MOST_DECKS = 50
_MOST_SENSITIVITIES, _MOST_AXES = 6, 8
_MET = "met"
_ABSTRACT = (
    "What was asked, which points failed, which are best where it is stated what is better, and how the "
    "answers depend on the axes. Figures are in units that people read, the table of all points in SI."
)
_FACTS = ("deck", "deck, digest", "question", "version", "seed", "points asked")


class SweepPage(NamedTuple):
    """What was written."""

    page: Path
    points: Path  # table of all points, as CSV
    decks: dict[int, Path]  # decks of the points in the table of the page, by number
    # front: numbers of the points on which no other improves, the best in the first direction first
    front: tuple[int, ...]
    remarks: tuple[str, ...]  # what the reader should know, one sentence each


def write_sweep_report(
    table: SweepTable,
    out: Path | str,
    *,
    preferences: Sequence[Preference] = (),
    requirements: Sequence[Requirement] | None = None,
    source: Path | str = "FOLDER",
) -> SweepPage:
    """Write the page of a sweep, finished or not: what was asked, failures, best points, figures, decks.

    Parameters
    ----------
    table
        Of the sweep.
    out
        Folder for ``sweep.html``, ``points.csv`` and the decks of the points in its table.
    preferences
        Which values of which answers are better. Without them no point is called better than another.
    requirements
        What an answer must keep, so that a point is no miss; by default that ``met`` is one, where there is
        such an answer.
    source
        Folder of the sweep, for the command that the page names.

    Raises
    ------
    UnknownNameError
        If a preference or requirement names no answer.
    ValueRangeError
        If one answer has two directions.
    ExportError
        If a file cannot be written.
    """
    folder = Path(out)
    if requirements is None:
        requirements = usual_requirements(table)
    answers = {column.name: np.asarray(table.values[column.name], dtype=float) for column in table.answers}
    ranked = rank_points(answers, table.done, preferences=preferences, requirements=requirements)
    listed, notes = _listed_rows(table, ranked)
    remarks: list[str] = []
    points_file = folder / POINTS_FILE
    write_table(points_file, _rows(table))
    numbers = [int(table.values["point"][row]) for row in listed[:MOST_DECKS]]
    decks, missing = write_decks(table, numbers, folder)
    remarks += missing
    names = tuple(dict.fromkeys([*ranked.judged, *(column.name for column in table.answers)]))
    sensitivities, refusal = _sensitivities(table, answers, names)
    remarks += refusal
    content = PageContent(table, ranked, shown_points(table, ranked), names, sensitivities, points_file)
    best = _best(content, listed, notes, decks=decks, source=str(source))
    listed_files = {points_file: "all points: axes, answers, status and reason, in SI"}
    if decks:
        about_decks = f"decks behind {len(decks)} points, which every command takes"
        listed_files[folder / DECKS_FOLDER] = about_decks
    files = FileSection("Files", listed_files, caption="Written beside this page.")
    page = _written(content, folder / PAGE_FILE, best=best, files=files, remarks=remarks)
    front = tuple(int(table.values["point"][row]) for row in ranked.front)
    return SweepPage(
        page, points_file, {n: folder / name for n, name in decks.items()}, front, tuple(remarks)
    )


def _written(
    content: PageContent, path: Path, *, best: Section, files: Section, remarks: Sequence[str]
) -> Path:
    """Write the page and return its path."""
    table = content.table
    about = {name: visible(text) for name, text in about_of(table).items()}
    sections: list[Section] = [
        *asked_sections(table, content.ranked),
        best,
        *front_sections(content),
        *coordinate_sections(content),
        *sensitivity_sections(content),
        *surface_sections(content),
        *histogram_sections(content),
        *([TextSection("Remarks", "\n\n".join(remarks))] if remarks else []),
        files,
        TableSection(
            "Where it comes from", ("what", "as the sweep states it"), tuple(about.items()),
            folded=True, caption="What the sweep states of itself.",
        ),
    ]  # fmt: skip
    deck = str(table.about.get("deck", "")) or "a deck"
    # A text for the head of the page; of a digest its beginning, the whole stands at the end.
    facts = {
        name: (text[:12] if len(text) == 64 and not text.strip("0123456789abcdef") else text)
        for name, text in about.items()
        if name in _FACTS
    }
    title = f"{visible(deck)}: {len(table)} points"
    return write_report(path, *sections, title=title, abstract=_ABSTRACT, facts=facts)


def usual_requirements(table: SweepTable) -> list[Requirement]:
    """Return what a point must keep where nothing is stated: a design must have met its target."""
    return [Requirement.at_least(_MET, 1.0)] if any(each.name == _MET for each in table.answers) else []


def _sensitivities(
    table: SweepTable, answers: dict[str, Any], names: tuple[str, ...]
) -> tuple[dict[str, AnswerSensitivity], list[str]]:
    axes = {axis.name: np.asarray(table.values[axis.name]) for axis in table.axes}
    chosen = {name: answers[name] for name in names[:_MOST_SENSITIVITIES]}
    try:
        kinds = {axis.name: axis.kind for axis in table.axes}
        shares = sensitivity(axes, chosen, table.done, kinds=kinds)
    except MissingLibraryError as error:
        return {}, [f"No shares of the variance: {error}"]
    left = len(names) - len(chosen)
    remarks = (
        [f"Shares of the variance are given for the first {len(chosen)} answers; {left} are left out."]
        if left
        else []
    )
    return {each.answer: each for each in shares}, remarks


def _listed_rows(table: SweepTable, ranked: RankedPoints) -> tuple[list[int], dict[int, str]]:
    """Return the rows of the table of the page, and without directions what each has least or most of."""
    if ranked.preferences:
        return ranked.front.tolist(), {}
    notes: dict[int, list[str]] = {}
    good = np.flatnonzero(ranked.compared)
    for column in table.answers[:_MOST_AXES]:
        values = np.asarray(table.values[column.name], dtype=float)[good]
        finite = np.flatnonzero(np.isfinite(values))
        if len(finite) and np.ptp(values[finite]) > 0.0:
            for place, what in ((np.argmin(values[finite]), "least"), (np.argmax(values[finite]), "largest")):
                notes.setdefault(int(good[finite[place]]), []).append(f"{what} {column.name}")
    return list(notes), {row: ", ".join(each) for row, each in notes.items()}


def _best(
    content: PageContent, listed: list[int], notes: dict[int, str], *, decks: dict[int, str], source: str
) -> PointTableSection:
    """Return the table of the best points, with the rows of all that figures show."""
    table, ranked = content.table, content.ranked
    rows = np.array(listed[:MOST_DECKS], dtype=np.intp)
    names = ranked.judged or content.answers[:_MOST_AXES]
    columns = [table.column(name) for name in names] + content.varying_axes()[:_MOST_AXES]
    shown = [shown_column(table, column, rows) for column in columns]
    cells = tuple(
        (*([notes[row]] if notes else []), *(_cell(each.values[k]) for each in shown))
        for k, row in enumerate(rows.tolist())
    )
    heads = (*(["why it is here"] if notes else []), *(column.name + unit_of(column) for column in columns))
    title = "Best points" if ranked.preferences else "Points at the ends"
    inner = TableSection(title, heads, cells, caption=_caption(content, len(listed)))
    points = [int(table.values["point"][row]) for row in rows]
    folder = content.points_file.parent
    command = typed_command("nlsdesign", "report", source, "--deck-of", "POINT", "--out", folder)
    return PointTableSection(
        title, inner, points, decks=decks, rows=point_rows(table, ranked, content.shown),
        columns=named_columns(table), command=command,
        elsewhere=f"All rows stand in {content.points_file.name}.",
    )  # fmt: skip


def _cell(value: Any) -> str | float:
    return float(value) if isinstance(value, float | np.floating) else visible(str(value))


def _caption(content: PageContent, count: int) -> str:
    ranked = content.ranked
    if not np.any(ranked.compared):
        return "No point has answers that can be compared."
    if not ranked.preferences:
        return (
            "No direction was stated, so no point is called better than another: these have the least and "
            "the largest of each answer. `--smaller`, `--larger` and `--near` state what is better."
        )
    if len(ranked.preferences) == 1:
        return "The best in the one direction that was stated; several where they are equal."
    more = f" The first {MOST_DECKS} of {count}." if count > MOST_DECKS else ""
    return f"Points on the front, the best in `{ranked.preferences[0].answer}` first.{more}"
