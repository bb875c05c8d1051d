"""Sections with the figures of a sweep, each with what it rests on in its caption."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..figures import (
    MarkedQuantile,
    ShownColumn,
    VarianceShare,
    answer_histograms,
    answers_against,
    parallel_coordinates,
    sensitivity_bars,
)
from ..figures.answers_against import MOST_PANELS
from ..figures.parallel_coordinates import MOST_COORDINATES
from ..report import FigureSection, Section, TableSection
from ..sweeps import Column, SweepTable
from ..sweeps.answer_quantiles import answer_quantiles
from ..sweeps.preferences import NearIsBetter
from ..sweeps.ranked_points import RankedPoints
from ..sweeps.sensitivity import AnswerSensitivity
from .shown_points import Shown, shown_column, shown_unit

MOST_HISTOGRAMS = 8
_DRAWN_AT_RANDOM = {"random", "sobol", "latin_hypercube"}


class PageContent(NamedTuple):
    """What the figures of a page are made from.

    Parameters
    ----------
    table
        Of the sweep.
    ranked
        Its points.
    shown
        Those that figures draw.
    answers
        Names of the answers in the order of the page: those that are compared first.
    sensitivities
        By answer, of the first answers.
    points_file
        Table of all points.
    """

    table: SweepTable
    ranked: RankedPoints
    shown: Shown
    answers: tuple[str, ...]
    sensitivities: dict[str, AnswerSensitivity]
    points_file: Path

    def varies(self, column: Column) -> bool:
        """Tell whether a column has two different values."""
        values = np.asarray(self.table.values[column.name])
        return (
            len(np.unique(values[np.isfinite(values)] if values.dtype.kind == "f" else values.astype(str)))
            > 1
        )

    def varying_axes(self) -> list[Column]:
        """Return the axes that have two different values."""
        return [axis for axis in self.table.axes if self.varies(axis)]


def front_sections(content: PageContent) -> list[Section]:
    """Return the figure of the front, none without two directions.

    Parameters
    ----------
    content
        Of the page.
    """
    preferences = content.ranked.preferences[: MOST_PANELS + 1]
    if len(preferences) < 2 or not np.any(content.ranked.compared):
        return []
    table, shown = content.table, content.shown
    columns = [shown_column(table, table.column(each.answer), shown.rows) for each in preferences]
    wanted = [
        each.value * shown_unit(table.column(each.answer).unit)[1] if isinstance(each, NearIsBetter) else None
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
    """Return the parallel coordinates of axes and answers.

    Parameters
    ----------
    content
        Of the page.
    """
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
        "Axes are in the order of their share of the variance, where it is known." if len(axes) > 1 else "",
        f"{left} further columns are left out." if left else "",
        f"The same at all points: {_listed(same)}." if same else "",
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


def _listed(names: list[str], most: int = 8) -> str:
    return ", ".join(f"`{name}`" for name in names[:most]) + (", …" if len(names) > most else "")


def histogram_sections(content: PageContent) -> list[Section]:
    """Return histograms and quantiles of the answers, and the quantiles as a table.

    Parameters
    ----------
    content
        Of the page.
    """
    table, good = content.table, content.table.done
    bounded = {axis.kind for axis in content.varying_axes()} <= _DRAWN_AT_RANDOM
    columns, marks, rows, remarks = [], [], [], []
    for name in content.answers[:MOST_HISTOGRAMS]:
        column = shown_column(table, table.column(name))
        values = column.numbers()[good]
        finite = values[np.isfinite(values)]
        if len(finite) < len(values):
            remarks.append(_not_finite(name, values))
        if not len(finite):
            continue
        quantiles = answer_quantiles(values)
        if not bounded:
            quantiles = [each._replace(lower=float("nan"), upper=float("nan")) for each in quantiles]
        columns.append(ShownColumn(column.name, column.unit, finite))
        marks.append([MarkedQuantile(*each) for each in quantiles])
        rows += [
            (name, f"{100 * q.share:g} %", q.value, *_bounds(q.lower, q.upper), column.unit)
            for q in quantiles
        ]
    if not columns:
        return []
    left = len(content.answers) - MOST_HISTOGRAMS
    points = f"{int(np.sum(good))} points with answers, also those that miss a requirement."
    caption = " ".join(filter(None, (
        f"Answers of {points} Black strokes are quantiles,",
        "bars around them their 95 % intervals." if bounded else "of the points that were asked for.",
        *remarks, f"{left} further answers are left out." if left > 0 else "",
    )))  # fmt: skip
    assumed = (
        "Intervals are order statistics: they hold for independent draws of any continuous distribution. A Sobol sequence or a "
        "Latin hypercube covers the axes more evenly than draws do. Quantiles are those of the distribution that the axes "
        "were drawn from, not of machines that are built."
        if bounded else
        "Points of a grid, a list or a Saltelli plan are no draws: there is no probability behind these shares, so no "
        "interval is given."
    )  # fmt: skip
    words = "Histograms of " + ", ".join(each.name for each in columns) + " with their quantiles."
    heads = ("answer", "share below", "quantile", "lower bound", "upper bound", "unit")
    return [
        FigureSection("How the answers are distributed", answer_histograms(columns, marks, words=words),
                      caption=caption, assumed=assumed),
        TableSection("Quantiles", heads, tuple(rows), caption="Quantiles of each answer; no bound where the points are too few "
                     "for one.", folded=True),
    ]  # fmt: skip


def _bounds(lower: float, upper: float) -> tuple[float | str, float | str]:
    low, high = (value if not np.isnan(value) else "–" for value in (lower, upper))
    return low, high


def _not_finite(name: str, values: np.ndarray) -> str:
    missing, infinite = int(np.sum(np.isnan(values))), int(np.sum(np.isinf(values)))
    parts = [f"{missing} not a number"] if missing else []
    parts += [f"{infinite} infinite (in the quantiles, not in the bars)"] if infinite else []
    return f"`{name}` of points with answers: {' and '.join(parts)}."


def sensitivity_sections(content: PageContent) -> list[Section]:
    """Return the shares of the variance that the axes cause, or why there are none.

    Parameters
    ----------
    content
        Of the page.
    """
    shown = {name: each for name, each in content.sensitivities.items() if each.indices}
    refused = {name: each for name, each in content.sensitivities.items() if not each.indices}
    sections: list[Section] = []
    if shown:
        methods = {each.method: [] for each in shown.values()}  # type: dict[str, list[str]]
        for name, each in shown.items():
            methods[each.method].append(name)
        caption = " ".join(
            f"{_listed(names)}: {method}, from {shown[names[0]].points} points."
            for method, names in methods.items()
        )
        remarks = list(dict.fromkeys(remark for each in shown.values() for remark in each.remarks))
        shares = {
            name: [
                VarianceShare(i.axis, i.first, i.first_error, i.total, i.total_error)
                for i in each.indices[:10]
            ]
            for name, each in shown.items()
        }
        leading = "; ".join(f"{name}: {each.indices[0].axis}" for name, each in shown.items())
        sections.append(
            FigureSection(
                "What causes the differences",
                sensitivity_bars(shares, words=f"Shares of the variance of the answers by axis. Largest, {leading}."),
                caption=caption + (" Ten axes of each are drawn." if any(len(e.indices) > 10 for e in shown.values()) else ""),
                means="The share of the variance of an answer that an axis causes over the range that was swept; another "
                "range gives other shares. Black strokes are 95 % intervals; a share whose interval holds zero is not shown "
                "to differ from it.",
                assumed="Axes are independent. " + (". ".join(r[0].upper() + r[1:] for r in remarks) + "." if remarks else ""),
            )
        )  # fmt: skip
    if refused:
        rows = tuple((name, each.refusal) for name, each in refused.items())
        caption = "Answers for which no share of the variance is given, and why."
        sections.append(TableSection("No sensitivity", ("answer", "reason"), rows, caption=caption))
    return sections
