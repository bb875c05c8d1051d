"""A page to draw on in millimetres: lines, text, tables, and dimensions with arrows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ...foundation.arrays import Array
from .style import INK, MUTED

THICK, THIN = 1.0, 0.45
"""Widths of lines in points: visible edges, and all others."""
TEXT = 7.0
"""Height of letters in points, 2.5 mm."""
_INCH = 25.4
_ARROW = 2.2
_GAP = 0.8


class Sheet:
    """A page of a given size; (0, 0) is its lower left corner, lengths are mm on paper."""

    def __init__(self, width: float, height: float) -> None:
        self.figure = Figure(figsize=(width / _INCH, height / _INCH), dpi=72, layout="constrained")
        # The place of everything is given. Without a layout to replace, savefig would set the common one.
        self.figure.set_layout_engine("none")
        self.axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set(xlim=(0.0, width), ylim=(0.0, height))
        self.axes.set_axis_off()

    def line(self, *points: Sequence[float] | Array, width: float = THIN, **look: Any) -> None:
        """Draw straight lines through points."""
        x, y = np.array(points, dtype=float).T
        self.axes.plot(x, y, linewidth=width, **dict[str, Any](color=INK.light, solid_capstyle="butt") | look)

    def text(self, x: float, y: float, *, text: str, **look: Any) -> None:
        """Write text; by default from a point to the right, on its base line."""
        self.axes.text(x, y, text, **dict[str, Any](fontsize=TEXT, color=INK.light, va="baseline") | look)

    def box(self, x: float, y: float, *, width: float, height: float) -> None:
        """Draw the frame of a rectangle."""
        self.line((x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y))

    def area(self, points: Array, **look: Any) -> Polygon:
        """Draw a closed area and return it.

        ``points``: shape (n, 2).
        """
        patch = Polygon(points, closed=True, **{"linewidth": THICK, "edgecolor": INK.light, **look})
        self.axes.add_patch(patch)
        return patch

    def measure(self, start: Array, end: Array, *, text: str, away: float, upright: bool = False) -> None:
        """Draw a dimension between two points, level or upright."""
        level = not upright
        along = 0 if level else 1
        feet = [np.array([p[0], away] if level else [away, p[1]]) for p in (start, end)]
        for point, foot in zip((start, end), feet, strict=True):
            step = foot - point
            size = float(np.hypot(*step))
            if size > _GAP:
                self.line(point + step / size * _GAP, foot + step / size * _GAP, color=MUTED.light)
        low, high = sorted(feet, key=lambda foot: float(foot[along]))
        direction = np.eye(2)[along]
        # With too little room the arrows point inwards from outside.
        outside = high[along] - low[along] < 3.0 * _ARROW
        if outside:
            self.line(low - 2.5 * _ARROW * direction, high + 2.5 * _ARROW * direction)
        else:
            self.line(low, high)
        for foot, sign in ((low, 1.0), (high, -1.0)):
            self._arrow(foot, direction * (-sign if outside else sign))
        middle = (low + high) / 2.0
        if level:
            self.text(middle[0], middle[1] + 0.9, text=text, ha="center", va="bottom")
        elif outside:
            self.text(high[0] + 1.0, high[1] + 3.0 * _ARROW, text=text, ha="left", va="center")
        else:
            side, place = ("left", 0.9) if away > max(start[0], end[0]) else ("right", -0.9)
            self.text(middle[0] + place, middle[1], text=text, ha=side, va="center", rotation=90)

    def pointer(self, tip: Array, corner: Sequence[float], *, text: str) -> None:
        """Draw an arrow from a text to what it speaks of.

        ``corner``: where the line to the text bends; the text stands behind it, seen from the tip.
        """
        bend = np.array(corner, dtype=float)
        side = 1.0 if bend[0] >= tip[0] else -1.0
        self.line(tip, bend, (bend[0] + 3.0 * side, bend[1]))
        step = bend - tip
        self._arrow(tip, step / math.hypot(*step))
        self.text(
            bend[0] + 4.0 * side,
            bend[1],
            text=text,
            ha="left" if side > 0 else "right",
            va="center",
            linespacing=1.25,
        )

    def table(
        self, place: tuple[float, float], widths: Sequence[float], *,
        rows: Sequence[Sequence[str]], row: float = 4.3,
    ) -> float:  # fmt: skip
        """Draw a table, its first row as a head, and return the height of its lower edge.

        ``widths``: of the columns; the first is set left, the others right.
        """
        x, top = place
        for number, cells in enumerate(rows):
            base = top - (number + 1) * row + 1.3
            edge = x
            for column, (cell, width) in enumerate(zip(cells, widths, strict=True)):
                at, side = (edge + 1.2, "left") if column == 0 else (edge + width - 1.2, "right")
                self.text(at, base, text=cell, ha=side, weight="bold" if number == 0 else "normal")
                edge += width
            self.line((x, top - (number + 1) * row), (edge, top - (number + 1) * row),
                      width=THIN if number == 0 else 0.2)  # fmt: skip
        self.box(x, top - len(rows) * row, width=sum(widths), height=len(rows) * row)
        return top - len(rows) * row

    def _arrow(self, tip: Array, direction: Array) -> None:
        """Draw the head of an arrow whose line goes from the tip along the direction."""
        across = np.array([-direction[1], direction[0]]) * _ARROW / 6.0
        self.axes.fill(
            *np.array([tip, tip + _ARROW * direction + across, tip + _ARROW * direction - across]).T,
            color=INK.light, linewidth=0.0,
        )  # fmt: skip
