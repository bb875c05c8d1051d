"""Shares of the variance of answers that each axis of a sweep causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...foundation.errors import ValueRangeError
from .style import AFTER, BEFORE, INK, SURFACE, described, legend, panels, styled
from .sweep_points import shortened


class VarianceShare(NamedTuple):
    """Share of one axis.

    Parameters
    ----------
    axis
        Its name.
    first, first_error
        Share of the axis alone, and half of its interval.
    total, total_error
        The same with its interactions; not a number where there is none.
    """

    axis: str
    first: float
    first_error: float
    total: float
    total_error: float


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
        panel.set_title(shortened(answer, 50))
        panel.set_xlabel("share of the variance in %")
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
    panel.set_yticks(places, [shortened(each.axis, 34) for each in shares])
    panel.set_ylim(places[-1] - 0.6, 0.6)
    panel.set_xlim(min(0.0, float(np.nanmin(first - first_error))) - 1.0, None)
    panel.axvline(0.0, color=INK.light, linewidth=0.8)
    panel.grid(visible=False, axis="y")
