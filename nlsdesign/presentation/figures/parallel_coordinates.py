"""Parallel coordinates: each point of a sweep is a line across axes of its own scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_unit
from .number_text import compact
from .style import INK, MUTED, SURFACE, described, legend, panels, styled
from .sweep_points import PointKinds, ShownColumn, in_lines, links, shortened

MOST_COORDINATES = 12
_MOST_NAMES = 8


@styled
def parallel_coordinates(
    columns: Sequence[ShownColumn], kinds: PointKinds, *, axis_count: int, words: str
) -> Figure:
    """Draw each point as a line across the columns, each on its own scale, from least to largest.

    A line stops where a point has no finite number: a point that failed ends with the last axis.

    ``axis_count``: how many of the columns are axes; a line divides them from the answers.
    """
    if not 2 <= len(columns) <= MOST_COORDINATES:
        rule = f"has {len(columns)} columns; two to {MOST_COORDINATES} can be drawn"
        raise ValueRangeError("parallel coordinates", rule, next_step="choose some of them")
    heads = [in_lines(column.name, min(15, 160 // len(columns))) for column in columns]
    lines = 1 + max(head.count("\n") for head in heads)
    figure, (axes,) = panels(1, height=3.9 + 0.16 * lines)
    places = np.array([_scaled(axes, number, column) for number, column in enumerate(columns)]).T
    for group in kinds.groups():
        drawn = [_segment(places[row]) for row in group.rows]
        # Many lines on top of each other stay legible where each is faint.
        least = 0.07 if group.marker == "o" else 0.35
        faint = float(np.clip(40.0 / max(1, len(group.rows)), least, 0.6))
        width, strength = (1.7, 0.95) if group.strong else (0.7, faint)
        collection = LineCollection(
            drawn, colors=group.color, linewidths=width, alpha=strength, linestyles=[group.dash],
            zorder=3 if group.strong else 2, urls=links(kinds.points[group.rows]), label=f"_{group.label}",
        )  # fmt: skip
        axes.add_collection(collection, autolim=False)
        axes.add_line(
            Line2D([], [], color=group.color, linestyle=group.dash, linewidth=1.7, label=group.label)
        )
    axes.set_xlim(-0.45, len(columns) - 0.55)
    axes.set_ylim(-0.09, 1.09)
    axes.set_yticks([])
    axes.set_xticks(range(len(columns)), heads, fontsize=8.0 if len(columns) < 9 else 7.2)
    axes.tick_params(axis="x", length=0.0, pad=16.0)
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    if 0 < axis_count < len(columns):
        axes.axvline(axis_count - 0.5, color=MUTED.light, linewidth=0.8, linestyle=(0, (2, 3)))
    axes.set_title("Axes, then answers" if 0 < axis_count < len(columns) else "Columns")
    legend(axes)
    return described(figure, words)


def _scaled(axes: Axes, number: int, column: ShownColumn) -> Array:
    """Draw the scale of one column and return the places of its values, from 0 to 1."""
    values = column.numbers()
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    axes.plot([number, number], [0.0, 1.0], color=INK.light, linewidth=0.8, zorder=4)
    # Halves before the difference, so that the largest numbers that there are do not overflow.
    span = 0.5 * high - 0.5 * low
    places = np.full(len(values), np.nan)
    inside = np.isfinite(values)
    places[inside] = (0.5 * values[inside] - 0.5 * low) / span if span > 0.0 else 0.5
    for place, text in _ends(column, low, high, span):
        below = place == 0.0
        shift = -4 if below else 4 if place == 1.0 else 0
        axes.annotate(
            text, (number, place), xytext=(0 if shift else 4, shift), textcoords="offset points",
            ha="center" if shift else "left", va="top" if below else "bottom" if shift else "center",
            fontsize=7.5, color=INK.light, zorder=5,
            bbox={"facecolor": SURFACE.light, "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
        )  # fmt: skip
    return places


def _ends(column: ShownColumn, low: float, high: float, span: float) -> list[tuple[float, str]]:
    """Return what stands at which place of a scale."""
    unit = typeset_unit(column.unit or "1")
    if column.words:
        names = np.unique(column.values.astype(str)).tolist()
        if len(names) == 1:
            return [(0.5, shortened(names[0], 16))]
        shown = range(len(names)) if len(names) <= _MOST_NAMES else (0, len(names) - 1)
        return [(k / (len(names) - 1), shortened(names[k], 16)) for k in shown]
    if span <= 0.0:
        finite = np.any(np.isfinite(column.numbers()))
        return [(0.5, f"{compact(low)} {unit}".strip() if finite else "no number")]
    return [(0.0, compact(low)), (1.0, f"{compact(high)} {unit}".strip())]


def _segment(places: Array) -> Array:
    """Return the line of one point up to its first value that is no finite number."""
    missing = np.flatnonzero(~np.isfinite(places))
    count = int(missing[0]) if len(missing) else len(places)
    line = np.column_stack([np.arange(count, dtype=float), places[:count]])
    if count == 1:  # a short stroke, so that it is seen
        return np.vstack([line, line + np.array([0.12, 0.0])])
    return line
