"""Answers of a sweep over two of its axes, with the error of each surface on points that it has not seen."""

from __future__ import annotations

import numpy as np

from ...foundation.quantity import three_digits, with_unit
from ...sweeps import SweepColumn
from ...sweeps.answer_surface import AnswerSurface, answer_surface
from ..figures.response_surfaces import SurfacePanel, response_surfaces
from ..figures.sweep_points import ShownColumn
from ..report import FigureSection, Section
from .page_content import PageContent
from .shown_points import shown_column

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
    return (
        f"{head}{surface.method}; error on left-out points {error} rms, with a deviation of the answers of "
        f"{deviation} ({_share(surface.explained)} of the variance is predicted).{outside}"
    )  # fmt: skip


def _share(value: float) -> str:
    """Return a share as text that is never rounded up to all of it."""
    return "more than 99.9 %" if value > 0.999 else f"{100.0 * value:.1f} %"
