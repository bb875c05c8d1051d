"""Histograms of the answers of a sweep, with quantiles and what is known of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...foundation.errors import ValueRangeError
from .style import AFTER, BEFORE, INK, described, panels, styled
from .sweep_points import ShownColumn

_MOST_BARS = 40


class MarkedQuantile(NamedTuple):
    """A quantile in a histogram.

    Parameters
    ----------
    share
        Of the values below it.
    value, lower, upper
        In the unit of the column; bounds that are not a number are not drawn.
    """

    share: float
    value: float
    lower: float
    upper: float


@styled
def answer_histograms(
    columns: Sequence[ShownColumn], quantiles: Sequence[Sequence[MarkedQuantile]], *, words: str
) -> Figure:
    """Draw a histogram of each answer; above it its quantiles, each with the interval in which it lies."""
    if not columns or any(not len(column.values) for column in columns):
        raise ValueRangeError("histograms", "have nothing to show", next_step="leave this figure out")
    wide = min(2, len(columns))
    rows = -(-len(columns) // wide)
    figure, axes = panels(rows, wide, height=2.5 * rows)
    for column, marks, panel in zip(columns, quantiles, axes, strict=False):
        _bars(panel, column)
        panel.margins(x=0.02)
        panel.set_xlim(*panel.get_xlim())
        _marks(panel, marks)
        panel.set_xlabel(column.label)
        panel.set_ylabel("points in %")
        panel.xaxis.set_major_locator(MaxNLocator(nbins=5))
    for unused in axes[len(columns) :]:
        unused.set_visible(False)
    return described(figure, words)


def _bars(panel: Axes, column: ShownColumn) -> None:
    values = column.numbers()
    low, high = float(values.min()), float(values.max())
    if not high - low > 1e-12 * max(abs(low), abs(high)):
        room = 0.05 * abs(low) or 1.0
        panel.bar([low], [100.0], width=0.2 * room, color=AFTER.light, alpha=0.75)
        panel.set_xlim(low - room, low + room)
        return
    # The rule of Freedman and Diaconis, within what can be told apart.
    inner = float(np.subtract(*np.quantile(values, [0.75, 0.25])))
    width = 2.0 * inner / len(values) ** (1.0 / 3.0)
    count = int(np.clip(np.ceil((high - low) / width) if width > 0.0 else _MOST_BARS, 5, _MOST_BARS))
    counts, edges = np.histogram(values, bins=count, range=(low, high))
    panel.bar(
        edges[:-1],
        100.0 * counts / len(values),
        width=np.diff(edges),
        align="edge",
        color=AFTER.light,
        alpha=0.75,
    )


def _marks(panel: Axes, marks: Sequence[MarkedQuantile]) -> None:
    top = panel.get_ylim()[1]
    panel.set_ylim(0.0, top * (1.12 + 0.09 * len(marks)))
    for number, mark in enumerate(marks):
        height = top * (1.06 + 0.09 * number)
        if not np.isfinite(mark.value):
            continue
        known = [b if np.isfinite(b) else mark.value for b in (mark.lower, mark.upper)]
        bounds = known
        if np.isfinite(mark.lower) or np.isfinite(mark.upper):
            # A side without a bound is open: it goes on to the edge, dotted.
            ends = panel.get_xlim()
            bounds = [
                b if np.isfinite(b) else end for b, end in zip((mark.lower, mark.upper), ends, strict=True)
            ]
            panel.plot(bounds, [height, height], color=BEFORE.light, linewidth=1.2, linestyle=(0, (1, 1.5)))
        panel.plot(known, [height, height], color=BEFORE.light, linewidth=2.4, solid_capstyle="butt")
        panel.plot([mark.value], [height], color=INK.light, marker="|", markersize=7.0)
        panel.annotate(
            f"{100 * mark.share:g} %", (bounds[1], height), xytext=(4, 0), textcoords="offset points",
            va="center", fontsize=7.5,
        )  # fmt: skip
