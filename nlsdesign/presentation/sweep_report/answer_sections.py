"""Sections on each answer of a sweep alone: how it is distributed, and which axes cause its differences."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import three_digits, typeset_unit, with_unit
from ...sweeps.answer_quantiles import BoundedQuantile, answer_quantiles
from ...sweeps.sensitivity import AnswerSensitivity
from ..figures import Figure
from ..figures.answer_histograms import MarkedQuantile, answer_histograms
from ..figures.sensitivity_bars import VarianceShare, sensitivity_bars
from ..figures.sweep_points import ShownColumn
from ..report import FigureSection, Section, TableSection, TextSection
from .page_content import PageContent, listed_names
from .shown_points import shown_column

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
    bounded = _are_draws(content)
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
    marks = [[MarkedQuantile(*each) for each in one.quantiles] for one in drawn]
    words = "Histograms of " + ", ".join(each.column.name for each in drawn) + " with their quantiles."
    figure = answer_histograms([each.column for each in drawn], marks, words=words)
    rows = tuple(row for each in drawn for row in _quantile_rows(each))
    heads = ("answer", "share below", "quantile", "lower bound", "upper bound", "unit")
    return [
        FigureSection("How the answers are distributed", figure, caption=caption,
                      assumed=_DRAWS if bounded else _NO_DRAWS),
        TableSection("Quantiles", heads, rows, folded=True,
                     caption="Quantiles of each answer; no bound where the points are too few for one."),
    ]  # fmt: skip


def _are_draws(content: PageContent) -> bool:
    """Return whether all axes were drawn at once; samples that are crossed repeat their values."""
    axes = content.varying_axes()
    count = len(content.table)
    return all(
        axis.kind in _DRAWN_AT_RANDOM and 2 * len(np.unique(content.table.values[axis.name])) > count
        for axis in axes
    )


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
        (each.column.name, f"{100 * q.share:g} %", *(_bound(v) for v in (q.value, q.lower, q.upper)), unit)
        for q in each.quantiles
    ]


def _bound(value: float) -> float | str:
    return "–" if np.isnan(value) else value


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
        sections.append(
            FigureSection(
                "What causes the differences", _shares_figure(shown), caption=_methods(shown),
                means=_SHARES + (_STROKES if _have_intervals(shown) else ""),
                assumed=" ".join(["Axes are independent.", *(f"{r[0].upper()}{r[1:]}." for r in remarks)]),
            )
        )  # fmt: skip
    if refused:
        caption = "Answers for which no share of the variance is given, and why."
        sections.append(TableSection("No sensitivity", ("answer", "reason"), refused, caption=caption))
    return sections


def _have_intervals(shown: dict[str, AnswerSensitivity]) -> bool:
    errors = [
        error for each in shown.values() for i in each.indices for error in (i.first_error, i.total_error)
    ]
    return any(np.isfinite(error) and error > 0.0 for error in errors)


def _methods(shown: dict[str, AnswerSensitivity]) -> str:
    groups: dict[tuple[str, int], list[str]] = {}
    for name, each in shown.items():
        groups.setdefault((each.method, each.points), []).append(name)
    sentences = [
        f"{listed_names(names)}: {method}, from {points} points."
        for (method, points), names in groups.items()
    ]
    if any(len(each.indices) > _MOST_SHARES for each in shown.values()):
        sentences.append(f"The {_MOST_SHARES} largest of each are drawn.")
    return " ".join(sentences)


def _shares_figure(shown: dict[str, AnswerSensitivity]) -> Figure:
    shares = {
        name: [VarianceShare(i.axis, i.first, i.first_error, i.total, i.total_error) for i in each.indices]
        for name, each in shown.items()
    }
    leading = "; ".join(f"{name}: {each.indices[0].axis}" for name, each in shown.items())
    return sensitivity_bars(
        {name: rows[:_MOST_SHARES] for name, rows in shares.items()},
        words=f"Shares of the variance of the answers by axis. Largest, {leading}.",
    )
