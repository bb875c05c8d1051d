"""Sections of the page of a sweep: what was asked, all points at once, each answer alone, and surfaces."""

from __future__ import annotations

from collections import Counter
from typing import Any, Final, NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import three_digits, typeset_unit, with_unit
from ...sweeps import SweepColumn, SweepTable
from ...sweeps.answer_statistics import AnswerSurface, BoundedQuantile, answer_quantiles, answer_surface
from ...sweeps.preferences import RankedPoints
from ..figures.sweep_figures import (
    MOST_COORDINATES,
    MOST_PANELS,
    ShownColumn,
    SurfacePanel,
    answer_histograms,
    answers_against,
    parallel_coordinates,
    response_surfaces,
    sensitivity_bars,
)
from ..report import FigureSection, KeyNumber, NumbersSection, Section, TableSection, TextSection
from .shown_points import PageContent, listed_names, shown_column, shown_unit

_MOST_REASONS: Final = 25
_LONGEST: Final = 300


def point_list(points: list[int], most: int = 6) -> str:
    """Return the first numbers of points as text."""
    return ", ".join(map(str, points[:most])) + (", …" if len(points) > most else "")


def asked_sections(table: SweepTable, ranked: RankedPoints) -> list[Section]:
    """Return the sections in the order of the page."""
    rows = tuple(
        (axis.name, axis.kind.replace("_", " ") or "–", *_range(table, axis), axis.description)
        for axis in table.axes
    )
    caption = "Axes of the sweep: what was changed, how the values were chosen, and what stands in the table."
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
    summary = NumbersSection("In short", tuple(numbers))
    return [
        summary,
        TableSection(
            "What was changed", ("axis", "chosen as", "values", "range", "what it is"), rows, caption=caption
        ),
        *_directions(table, ranked),
        *_failures(table),
    ]


def _of_asked(table: SweepTable) -> str:
    """Return how far the sweep is: a page of one that is not finished must say so."""
    asked = table.about.get("points")
    if isinstance(asked, int) and asked > len(table):
        return f"of {len(table)} so far; {asked} are asked for, so all that follows is of a part of them"
    return f"of {len(table)}"


def _range(table: SweepTable, axis: SweepColumn) -> tuple[str, str]:
    """Return how many different values an axis has, and from where to where."""
    column = shown_column(table, axis)
    given = column.values
    distinct = np.unique(given[~np.isnan(given)] if given.dtype.kind == "f" else given)
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
        (
            str(count),
            reason if len(reason) <= _LONGEST else reason[: _LONGEST - 1] + "…",
            point_list(examples[reason]),
        )
        for reason, count in ordered[:_MOST_REASONS]
    ]
    rest = ordered[_MOST_REASONS:]
    if rest:
        count = sum(each for _, each in rest)
        rows.append((str(count), f"{len(rest)} further reasons, see the table of all points", ""))
    caption = (
        f"{len(failed)} of {len(table)} points failed, grouped by reason. They are results of no figure."
    )
    return [TableSection("Points that failed", ("points", "reason", "numbers"), tuple(rows), caption=caption)]


def unit_of(column: SweepColumn) -> str:
    """Return the unit of a column as people read it, with a word before it, or nothing."""
    unit = typeset_unit(shown_unit(column.unit)[0] or "1")
    return f" in {unit}" if unit else ""


def front_sections(content: PageContent) -> list[Section]:
    """Return the figure of the front, none without two directions."""
    preferences = content.ranked.preferences[: MOST_PANELS + 1]
    if len(preferences) < 2 or not np.any(content.ranked.compared):
        return []
    table, shown = content.table, content.shown
    columns = [shown_column(table, table.column(each.answer), shown.rows) for each in preferences]
    wanted = [
        None if each.value is None else each.value * shown_unit(table.column(each.answer).unit)[1]
        for each in preferences
    ]
    directions = "; ".join(f"`{p.answer}`: {p.words(table.column(p.answer).unit)}" for p in preferences)
    front, among = len(content.ranked.front), int(np.sum(content.ranked.compared))
    hidden = len(content.ranked.preferences) - len(preferences)
    failed = int(np.sum(content.ranked.failed))
    caption = " ".join(filter(None, (
        f"{directions}. {front} of {among} compared points are on the front.",
        f"{failed} points failed and have no place here." if failed else "",
        f"{hidden} further directions count for the front and are not drawn." if hidden else "",
        "With more than two directions a point of the front need not lie at the edge of one panel."
        if len(content.ranked.preferences) > 2 else "",
        shown.rule,
    )))  # fmt: skip
    figure = answers_against(
        columns, shown.kinds, wanted=wanted,
        words=f"Answers of {len(shown.rows)} points against each other, {front} of them on the front.",
    )  # fmt: skip
    means = "Between points of the front lies no design that was computed; the line only leads the eye."
    return [FigureSection("Front", figure, caption=caption, means=means, data=content.points_file)]


def coordinate_sections(content: PageContent) -> list[Section]:
    """Return the parallel coordinates of axes and answers."""
    table, shown = content.table, content.shown
    axes, answers = content.varying_axes(), [table.column(name) for name in content.answers]
    same = [column.name for column in (*table.axes, *answers) if not content.varies(column)]
    answers = [column for column in answers if content.varies(column)]
    axes.sort(key=lambda axis: -_importance(content, axis.name))
    room = max(MOST_COORDINATES - len(answers), MOST_COORDINATES // 2)
    drawn_axes = axes[:room]
    drawn_answers = answers[: MOST_COORDINATES - len(drawn_axes)]
    columns = [shown_column(table, column, shown.rows) for column in (*drawn_axes, *drawn_answers)]
    left = len(axes) + len(answers) - len(columns)
    if len(columns) < 2 or not len(shown.rows):
        return []
    caption = " ".join(filter(None, (
        "Each line is a point; each column has its own scale, from its least to its largest number. "
        "The line of a point that failed ends with the last axis.",
        "Axes are in the order of their largest share of the variance."
        if len(axes) > 1 and any(_importance(content, axis.name) for axis in axes) else "",
        f"{left} further columns are left out." if left else "",
        f"The same at all points: {listed_names(same)}." if same else "",
        shown.rule,
    )))  # fmt: skip
    figure = parallel_coordinates(
        columns, shown.kinds, axis_count=len(drawn_axes),
        words=f"Parallel coordinates of {len(shown.rows)} points over {', '.join(c.name for c in columns)}.",
    )  # fmt: skip
    return [FigureSection("All columns at once", figure, caption=caption, data=content.points_file)]


def _importance(content: PageContent, axis: str) -> float:
    shares = [
        np.nanmax([each.first, each.total])
        for result in content.sensitivities.values()
        for each in result.indices
        if each.axis == axis and np.isfinite(each.first)
    ]
    return float(max(shares, default=0.0))


MOST_HISTOGRAMS = 8
_MOST_SHARES = 10
_DRAWN_AT_RANDOM = {"random", "sobol", "latin_hypercube"}
_DRAWS = (
    "Intervals are order statistics: they hold for independent draws of any continuous distribution. A Sobol "
    "sequence or a Latin hypercube covers the axes more evenly than draws do. Quantiles are those of the "
    "distribution that the axes were drawn from, not of machines that are built."
)
_NO_DRAWS = (
    "Points of a grid, a list, a Saltelli plan or samples that are crossed are no independent draws: there "
    "is no probability behind these shares, or less than their number says, so no interval is given."
)
_SHARES = (
    "The share of the variance of an answer that an axis causes over the range that was swept; another range "
    "gives other shares."
)
_STROKES = (
    " Black strokes are 95 % intervals; a share whose interval holds zero is not shown to differ from it."
)


class _Distribution(NamedTuple):
    """Finite values of one answer, its quantiles, and what is to be said of the others."""

    column: ShownColumn
    quantiles: list[BoundedQuantile]
    remark: str


def histogram_sections(content: PageContent) -> list[Section]:
    """Return histograms and quantiles of the answers, and the quantiles as a table."""
    # Whether all axes were drawn at once: samples that are crossed repeat their values.
    axes = content.varying_axes()
    count = len(content.table)
    bounded = all(
        axis.kind in _DRAWN_AT_RANDOM and 2 * len(np.unique(content.table.values[axis.name])) > count
        for axis in axes
    )
    names = content.answers[:MOST_HISTOGRAMS]
    everything = [_distribution(content, name, bounded=bounded) for name in names]
    drawn = [each for each in everything if len(np.unique(each.column.values)) > 1]
    remarks = [each.remark for each in everything if each.remark]
    left = len(content.answers) - len(names)
    caption = " ".join(filter(None, (
        f"Answers of {int(np.sum(content.table.done))} points, also of those that miss a requirement. Black "
        "strokes are quantiles,",
        "bars around them their 95 % intervals." if bounded else "of the points that were asked for.",
        *remarks, f"{left} further answers are left out." if left > 0 else "",
    )))  # fmt: skip
    if not drawn:
        return [TextSection("How the answers are distributed", " ".join(remarks))] if remarks else []
    words = "Histograms of " + ", ".join(each.column.name for each in drawn) + " with their quantiles."
    figure = answer_histograms(
        [each.column for each in drawn], [each.quantiles for each in drawn], words=words
    )
    rows = tuple(row for each in drawn for row in _quantile_rows(each))
    heads = ("answer", "share below", "quantile", "lower bound", "upper bound", "unit")
    return [
        FigureSection("How the answers are distributed", figure, caption=caption,
                      assumed=_DRAWS if bounded else _NO_DRAWS),
        TableSection("Quantiles", heads, rows, folded=True,
                     caption="Quantiles of each answer; no bound where the points are too few for one."),
    ]  # fmt: skip


def _distribution(content: PageContent, name: str, *, bounded: bool) -> _Distribution:
    column = shown_column(content.table, content.table.column(name))
    values = column.numbers()[content.table.done]
    finite = values[np.isfinite(values)]
    quantiles = answer_quantiles(values)
    if not bounded:
        quantiles = [each._replace(lower=float("nan"), upper=float("nan")) for each in quantiles]
    remark = _not_finite(name, values) if len(finite) < len(values) else ""
    if len(finite) and np.ptp(finite) == 0.0:
        same = with_unit(three_digits(float(finite[0])), column.unit or "1")
        remark = f"`{name}` is {same} at all points where it is finite. {remark}".strip()
    return _Distribution(ShownColumn(column.name, column.unit, finite), quantiles, remark)


def _quantile_rows(each: _Distribution) -> list[tuple[Any, ...]]:
    unit = typeset_unit(each.column.unit or "1")
    return [
        (
            each.column.name,
            f"{100 * q.share:g} %",
            *("–" if np.isnan(v) else v for v in (q.value, q.lower, q.upper)),
            unit,
        )
        for q in each.quantiles
    ]


def _not_finite(name: str, values: Array) -> str:
    missing, infinite = int(np.sum(np.isnan(values))), int(np.sum(np.isinf(values)))
    parts = [f"{missing} times not a number"] if missing else []
    parts += [f"{infinite} times infinite (in the quantiles, not in the bars)"] if infinite else []
    return f"`{name}` of points with answers is {' and '.join(parts)}."


def sensitivity_sections(content: PageContent) -> list[Section]:
    """Return the shares of the variance that the axes cause, or why there are none."""
    results = content.sensitivities
    shown = {name: each for name, each in results.items() if each.indices}
    refused = tuple((name, each.refusal) for name, each in results.items() if not each.indices)
    sections: list[Section] = []
    if shown:
        remarks = dict.fromkeys(remark for each in shown.values() for remark in each.remarks)
        errors = [
            error for each in shown.values() for i in each.indices for error in (i.first_error, i.total_error)
        ]
        have_intervals = any(np.isfinite(error) and error > 0.0 for error in errors)
        leading = "; ".join(f"{name}: {each.indices[0].axis}" for name, each in shown.items())
        shares_figure = sensitivity_bars(
            {name: each.indices[:_MOST_SHARES] for name, each in shown.items()},
            words=f"Shares of the variance of the answers by axis. Largest, {leading}.",
        )
        groups: dict[tuple[str, int], list[str]] = {}
        for name, each in shown.items():
            groups.setdefault((each.method, each.points), []).append(name)
        sentences = [
            f"{listed_names(names)}: {method}, from {points} points."
            for (method, points), names in groups.items()
        ]
        if any(len(each.indices) > _MOST_SHARES for each in shown.values()):
            sentences.append(f"The {_MOST_SHARES} largest of each are drawn.")
        sections.append(
            FigureSection(
                "What causes the differences", shares_figure, caption=" ".join(sentences),
                means=_SHARES + (_STROKES if have_intervals else ""),
                assumed=" ".join(["Axes are independent.", *(f"{r[0].upper()}{r[1:]}." for r in remarks)]),
            )
        )  # fmt: skip
    if refused:
        caption = "Answers for which no share of the variance is given, and why."
        sections.append(TableSection("No sensitivity", ("answer", "reason"), refused, caption=caption))
    return sections


MOST_SURFACES = 4


def surface_sections(content: PageContent) -> list[Section]:
    """Return the surfaces of the first answers over the two axes that matter most for each."""
    axes = content.varying_axes()
    numbers = [axis for axis in axes if not shown_column(content.table, axis).words]
    if len(numbers) < 2:
        return []
    panels: list[SurfacePanel] = []
    sentences: list[str] = []
    for name in content.answers:
        if len(panels) == MOST_SURFACES:
            break
        answer = content.table.column(name)
        if content.distinct(answer) < 3:  # yes or no is no surface
            continue
        across, up, why = _axes_for(content, name, numbers)
        columns = [shown_column(content.table, each) for each in (across, up, answer)]
        values = np.where(content.table.done, columns[2].numbers(), np.nan)
        surface = answer_surface(
            columns[0].numbers(), columns[1].numbers(), values, others_vary=len(axes) > 2
        )
        panels.append(_panel(content, columns, surface))
        sentences.append(f"`{name}`: {_sentence(surface, columns[2], why)}")
    if not panels:
        return []
    failed = int(np.sum(content.ranked.failed))
    words = "Answers over two axes: " + ", ".join(each.title for each in panels) + "."
    caption = "\n\n".join([
        "The darker, the larger; numbers stand at the contour lines; nothing is drawn outside the points."
        + (f" {failed} failed points stand as crosses and are part of no surface." if failed else ""),
        *sentences, *([content.shown.rule] if content.shown.rule else []),
    ])  # fmt: skip
    means = (
        "The error is that on points which were left out when the surface was made; where less than a tenth "
        "of the variance of the answers is predicted, only the points are drawn."
    )
    return [
        FigureSection(
            "Answers over two axes", response_surfaces(panels, words=words), caption=caption, means=means
        )
    ]


def _axes_for(
    content: PageContent, answer: str, numbers: list[SweepColumn]
) -> tuple[SweepColumn, SweepColumn, str]:
    """Return the two axes of numbers that cause most of an answer, and how they were chosen."""
    if len(numbers) == 2:
        return numbers[0], numbers[1], ""
    result = content.sensitivities.get(answer)
    shares = {each.axis: np.nanmax([each.first, each.total]) for each in result.indices} if result else {}
    if not shares:
        return (
            numbers[0],
            numbers[1],
            "the first two axes of numbers, for the shares of the variance are not known",
        )
    ordered = sorted(numbers, key=lambda axis: -shares.get(axis.name, 0.0))
    return ordered[0], ordered[1], "the two axes with the largest shares of its variance"


def _panel(content: PageContent, columns: list[ShownColumn], surface: AnswerSurface | str) -> SurfacePanel:
    rows = content.shown.rows
    across, up = (ShownColumn(each.name, each.unit, each.values[rows]) for each in columns[:2])
    drawn = surface if isinstance(surface, AnswerSurface) and surface.predicts else None
    return SurfacePanel(
        columns[2].label, across, up, content.shown.kinds,
        None if drawn is None else (drawn.across, drawn.up), None if drawn is None else drawn.values,
    )  # fmt: skip


def _sentence(surface: AnswerSurface | str, answer: ShownColumn, why: str) -> str:
    head = f"over {why}; " if why else ""
    if isinstance(surface, str):
        return f"{head}no surface: {surface}."
    error, deviation = (
        with_unit(three_digits(value), answer.unit or "1") for value in (surface.error, surface.deviation)
    )
    outside = (
        f" {surface.unpredicted} points at the edge could not be left out, so nothing is said of them."
        if surface.unpredicted else ""
    )  # fmt: skip
    if np.isnan(surface.error):
        return (
            f"{head}{surface.method}; no point could be left out, so nothing is known of its error and it is "
            "not drawn."
        )
    if not surface.predicts:
        return (
            f"{head}{surface.method}; its error on left-out points is {error} rms and the deviation of "
            f"the answers {deviation}, so less than a tenth of their variance is predicted, and it is not "
            f"drawn.{outside}"
        )  # fmt: skip
    # Never rounded up to all of it.
    share = "more than 99.9 %" if surface.explained > 0.999 else f"{100.0 * surface.explained:.1f} %"
    return (
        f"{head}{surface.method}; error on left-out points {error} rms, with a deviation of the answers of "
        f"{deviation} ({share} of the variance is predicted).{outside}"
    )  # fmt: skip
