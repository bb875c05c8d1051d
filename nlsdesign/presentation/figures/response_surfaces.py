"""Answers of a sweep over two of its axes, as steps of one colour with contour lines, and the points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from .number_text import compact
from .style import AFTER, INK, described, panels, styled
from .sweep_points import PointKinds, ShownColumn, scatter_points

_STEPS = 7


class SurfacePanel(NamedTuple):
    """One answer over two axes.

    Parameters
    ----------
    title
        Answer with its unit.
    across, up
        Axes, values at the points.
    kinds
        What the points are.
    nodes
        Nodes of the surface across and up, in the units of the axes; ``None`` where only points are drawn.
    values
        Of the answer at the nodes, shape (up, across); not a number where nothing is drawn.
    """

    title: str
    across: ShownColumn
    up: ShownColumn
    kinds: PointKinds
    nodes: tuple[Array, Array] | None
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
        panel.set_title(surface.title)
        panel.set_xlabel(surface.across.label)
        panel.set_ylabel(surface.up.label)
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
