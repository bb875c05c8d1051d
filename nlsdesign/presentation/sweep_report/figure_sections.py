"""Sections with the figures that show all points of a sweep: the front, and all columns at once."""

from __future__ import annotations

import numpy as np

from ...sweeps.preferences import NearIsBetter
from ..figures.answers_against import MOST_PANELS, answers_against
from ..figures.parallel_coordinates import MOST_COORDINATES, parallel_coordinates
from ..report import FigureSection, Section
from .page_content import PageContent, listed_names
from .shown_points import shown_column, shown_unit


def front_sections(content: PageContent) -> list[Section]:
    """Return the figure of the front, none without two directions."""
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
