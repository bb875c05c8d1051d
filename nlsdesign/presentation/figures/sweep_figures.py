"""Figures of a sweep: histograms, points, parallel coordinates, surfaces, shares of variance.

Points come in kinds, each with a look of its own, and each point is a link to its row.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ...foundation.arrays import Array, Indices, Mask
from ...foundation.errors import ValueRangeError, visible
from ...foundation.quantity import typeset_unit
from .style import (
    AFTER,
    BEFORE,
    DASHES,
    HOLDS,
    INK,
    LIMIT,
    MUTED,
    PURPLE,
    SURFACE,
    compact,
    described,
    legend,
    panels,
    styled,
)

_LINES = 6


class ShownColumn(NamedTuple):
    """One column of a sweep as a figure shows it."""

    name: str  # full name
    unit: str  # of the values; empty for words and counts
    values: NDArray[Any]  # one for each point: numbers, or words

    @property
    def words(self) -> bool:
        """Whether the values are words."""
        return self.values.dtype.kind not in "fiub"

    @property
    def label(self) -> str:
        """Name and unit on one line."""
        unit = typeset_unit(self.unit or "1")
        return shortened(self.name, 60) + (f" in {unit}" if unit else "")

    def numbers(self) -> Array:
        """Return the values, words as the number of their place in the alphabet."""
        if not self.words:
            return self.values.astype(float)
        return np.unique(self.values.astype(str), return_inverse=True)[1].ravel().astype(float)


@dataclass(frozen=True, eq=False)
class PointKinds:
    """What the points of a figure are."""

    points: NDArray[np.int64]  # numbers of the points, shape (n,)
    # front, missed, failed: on which no other improves, which keep not all requirements, which have no
    # answer; no point is two of them
    front: Mask
    missed: Mask
    failed: Mask

    def groups(self) -> Iterator[PointGroup]:
        """Yield the kinds that there are, those to be drawn on top last."""
        others = ~(self.front | self.missed | self.failed)
        tone = MUTED if np.any(self.front) else AFTER
        for label, rows, colour, dash, marker, strong in (
            ("failed", self.failed, PURPLE, DASHES[2], "x", False),
            ("misses a requirement", self.missed, LIMIT, DASHES[1], "D", False),
            ("other points" if np.any(self.front) else "points", others, tone, DASHES[0], "o", False),
            ("on the front", self.front, HOLDS, DASHES[0], "s", True),
        ):
            if np.any(rows):
                yield PointGroup(label, np.flatnonzero(rows), colour.light, dash, marker, strong)


class PointGroup(NamedTuple):
    """Points of one kind."""

    label: str
    rows: Indices
    color: str
    dash: Any
    marker: str
    strong: bool


def links(points: NDArray[np.int64]) -> list[str]:
    """Return the link of each point on its page."""
    return [f"#point-{number}" for number in points.tolist()]


def scatter_points(axes: Axes, across: Array, up: Array, *, kinds: PointKinds, small: bool = False) -> None:
    """Draw points in their kinds, each a link; those without a finite place are left out."""
    size = 0.4 if small else 1.0
    for group in kinds.groups():
        rows = group.rows[np.isfinite(across[group.rows]) & np.isfinite(up[group.rows])]
        if not len(rows):
            continue
        drawn = axes.scatter(
            across[rows], up[rows], marker=group.marker, label=group.label, zorder=3 if group.strong else 2,
            **_mark_look(group, size),
        )  # fmt: skip
        drawn.set_urls(links(kinds.points[rows]))


def _mark_look(group: PointGroup, size: float) -> dict[str, Any]:
    """Return size and colours of the marks of a group: outlines only where they are no results to choose."""
    if group.strong:
        return {"s": 22.0, "facecolors": group.color, "linewidths": 0.0}
    if group.marker == "o":
        return {"s": 9.0 * size, "facecolors": group.color, "linewidths": 0.0, "alpha": 0.7}
    if group.marker == "x":
        return {"s": 14.0 * size, "color": group.color, "linewidths": 0.9}
    return {
        "s": 9.0 * size, "facecolors": "none", "edgecolors": group.color, "linewidths": 0.9, "alpha": 0.7,
    }  # fmt: skip


def shortened(text: str, most: int) -> str:
    """Return a text with its control characters written out and its middle cut where it is long."""
    plain = " ".join(visible(text).split())
    return plain if len(plain) <= most else f"{plain[: most // 3]}…{plain[-(2 * most // 3 - 1) :]}"


def in_lines(name: str, letters: int = 15) -> str:
    """Return a name on several short lines, broken behind dots where there are some."""
    lines: list[str] = []
    for piece in shortened(name, 80).replace(".", ".\n").replace("_", "_\u200b").split("\n"):
        if lines and len(lines[-1]) + len(piece) <= letters and "\u200b" not in lines[-1]:
            lines[-1] += piece
        else:
            lines += textwrap.wrap(piece.replace("\u200b", " \u200b"), letters + 1) or [piece]
    clean = [line.replace(" \u200b", "").replace("\u200b", "").strip() for line in lines]
    return "\n".join(clean if len(clean) <= _LINES else [*clean[: _LINES - 1], "…" + clean[-1]])


_MOST_BARS = 40


MarkedQuantile = tuple[float, float, float, float]
"""Share of the values below it, value, and bounds in the unit of the column, drawn where they are numbers."""


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
        panel.set(xlabel=column.label, ylabel="points in %")
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
    for number, (share, value, *limits) in enumerate(marks):
        height = top * (1.06 + 0.09 * number)
        if not np.isfinite(value):
            continue
        known = [b if np.isfinite(b) else value for b in limits]
        bounds = known
        if any(np.isfinite(limits)):
            # A side without a bound is open: it goes on to the edge, dotted.
            ends = panel.get_xlim()
            bounds = [b if np.isfinite(b) else end for b, end in zip(limits, ends, strict=True)]
            panel.plot(bounds, [height, height], color=BEFORE.light, linewidth=1.2, linestyle=(0, (1, 1.5)))
        panel.plot(known, [height, height], color=BEFORE.light, linewidth=2.4, solid_capstyle="butt")
        panel.plot([value], [height], color=INK.light, marker="|", markersize=7.0)
        panel.annotate(
            f"{100 * share:g} %", (bounds[1], height), xytext=(4, 0), textcoords="offset points",
            va="center", fontsize=7.5,
        )  # fmt: skip


MOST_PANELS = 4


@styled
def answers_against(
    columns: Sequence[ShownColumn], kinds: PointKinds, *, wanted: Sequence[float | None], words: str
) -> Figure:
    """Draw the first answer over each of the others; the points of the front of two are joined.

    ``wanted``: of each column the value that is wanted, drawn as a line; ``None`` where it has a direction
    only.
    """
    if not 2 <= len(columns) <= MOST_PANELS + 1:
        rule = f"has {len(columns)} answers; two to {MOST_PANELS + 1} can be drawn"
        raise ValueRangeError("a front", rule, next_step="choose some of them")
    others = columns[1:]
    wide = min(2, len(others))
    rows = -(-len(others) // wide)
    figure, axes = panels(rows, wide, height=3.5 * rows)
    up = columns[0].numbers()
    for number, (column, panel) in enumerate(zip(others, axes, strict=False)):
        across = column.numbers()
        if len(columns) == 2:
            x, y = across[kinds.front], up[kinds.front]
            order = np.argsort(x, kind="stable")
            panel.plot(x[order], y[order], color=HOLDS.light, linewidth=1.0, alpha=0.6, zorder=1)
        scatter_points(panel, across, up, kinds=kinds)
        for value, draw in ((wanted[0], panel.axhline), (wanted[number + 1], panel.axvline)):
            if value is not None:
                draw(value, color=INK.light, linewidth=0.9, linestyle=(0, (1.2, 1.2)), label="wanted")
        panel.set(xlabel=column.label, ylabel=columns[0].label)
        panel.margins(0.06)
        if number == 0:
            legend(panel)
    for unused in axes[len(others) :]:
        unused.set_visible(False)
    return described(figure, words)


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


_STEPS = 7


class SurfacePanel(NamedTuple):
    """One answer over two axes."""

    title: str  # answer with its unit
    # across, up: axes, values at the points
    across: ShownColumn
    up: ShownColumn
    kinds: PointKinds  # what the points are
    # nodes: nodes of the surface across and up, in the units of the axes; None where only points are drawn
    nodes: tuple[Array, Array] | None
    # values: of the answer at the nodes, shape (up, across); not a number where nothing is drawn
    values: Array | None


@styled
def response_surfaces(surfaces: Sequence[SurfacePanel], *, words: str) -> Figure:
    """Draw answers over two axes each; the darker, the larger."""
    if not surfaces:
        raise ValueRangeError(
            "response surfaces", "there are none to draw", next_step="leave this figure out"
        )
    wide = min(2, len(surfaces))
    rows = -(-len(surfaces) // wide)
    figure, axes = panels(rows, wide, height=3.6 * rows)
    for surface, panel in zip(surfaces, axes, strict=False):
        if surface.nodes is not None and surface.values is not None:
            _contours(panel, *surface.nodes, surface.values)
        scatter_points(panel, surface.across.numbers(), surface.up.numbers(), kinds=surface.kinds, small=True)
        panel.set(title=surface.title, xlabel=surface.across.label, ylabel=surface.up.label)
        panel.grid(visible=False)
        panel.margins(0.03)
    for unused in axes[len(surfaces) :]:
        unused.set_visible(False)
    return described(figure, words)


def _contours(panel: Axes, across: Array, up: Array, values: Array) -> None:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        return
    levels = np.linspace(low, high, _STEPS + 1)
    held = np.ma.masked_invalid(values)
    for number in range(_STEPS):
        # One tone of growing strength, so that it follows the colours of the page.
        panel.contourf(
            across, up, held, levels=[levels[number], levels[number + 1]], colors=[AFTER.light],
            alpha=0.07 + 0.68 * number / (_STEPS - 1), extend="neither", antialiased=False,
        )  # fmt: skip
    lines = panel.contour(across, up, held, levels=levels[1:-1], colors=[INK.light], linewidths=0.6, zorder=4)
    panel.clabel(lines, fmt=lambda value: compact(float(value), 3), fontsize=7.5, colors=INK.light, zorder=5)


VarianceShare = tuple[str, float, float, float, float]
"""Axis, and the share of the variance that it causes alone and with others, each with half its interval."""


@styled
def sensitivity_bars(shares: Mapping[str, Sequence[VarianceShare]], *, words: str) -> Figure:
    """Draw for each answer the axes in their order, with the share of each and its interval."""
    if not shares or not all(shares.values()):
        raise ValueRangeError("sensitivity", "there is none to draw", next_step="leave this figure out")
    most = max(len(rows) for rows in shares.values())
    wide = min(2, len(shares))
    rows = -(-len(shares) // wide)
    figure, axes = panels(rows, wide, height=rows * (1.15 + 0.3 * most))
    for number, ((answer, each), panel) in enumerate(zip(shares.items(), axes, strict=False)):
        _draw(panel, each)
        panel.set(title=shortened(answer, 50), xlabel="share of the variance in %")
        if number == 0:
            legend(panel)
    for unused in axes[len(shares) :]:
        unused.set_visible(False)
    return described(figure, words)


def _draw(panel: Axes, shares: Sequence[VarianceShare]) -> None:
    places = -np.arange(len(shares), dtype=float)
    first, first_error, total, total_error = (
        100.0 * np.array([list(each[1:]) for each in shares], dtype=float).T
    )
    both = bool(np.any(np.isfinite(total)))
    height = 0.36 if both else 0.55
    shift = 0.19 if both else 0.0
    sets = [("first order", first, first_error, AFTER.light, "", shift)]
    if both:
        sets.append(("total, with interactions", total, total_error, BEFORE.light, "//", -shift))
    for label, values, errors, colour, hatch, moved in sets:
        panel.barh(
            places + moved, np.nan_to_num(values), height=height, color=colour, alpha=0.8, hatch=hatch,
            edgecolor=SURFACE.light if hatch else "none", label=label,
        )  # fmt: skip
        panel.hlines(places + moved, values - errors, values + errors, color=INK.light, linewidth=1.4)
    panel.set_yticks(places, [shortened(axis, 34) for axis, *_ in shares])
    panel.set_ylim(places[-1] - 0.6, 0.6)
    panel.set_xlim(min(0.0, float(np.nanmin(first - first_error))) - 1.0, None)
    panel.axvline(0.0, color=INK.light, linewidth=0.8)
    panel.grid(visible=False, axis="y")
