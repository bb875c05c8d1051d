"""Answers of a sweep against each other, with the points that no other betters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from .style import HOLDS, INK, described, legend, panels, styled
from .sweep_points import PointKinds, ShownColumn, scatter_points

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
            _joined(panel, across[kinds.front], up[kinds.front])
        scatter_points(panel, across, up, kinds=kinds)
        for value, draw in ((wanted[0], panel.axhline), (wanted[number + 1], panel.axvline)):
            if value is not None:
                draw(value, color=INK.light, linewidth=0.9, linestyle=(0, (1.2, 1.2)), label="wanted")
        panel.set_xlabel(column.label)
        panel.set_ylabel(columns[0].label)
        panel.margins(0.06)
        if number == 0:
            legend(panel)
    for unused in axes[len(others) :]:
        unused.set_visible(False)
    return described(figure, words)


def _joined(panel: Axes, across: Array, up: Array) -> None:
    order = np.argsort(across, kind="stable")
    panel.plot(across[order], up[order], color=HOLDS.light, linewidth=1.0, alpha=0.6, zorder=1)
