"""Things in an order, each with the interval in which it lies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ...foundation.errors import ValueRangeError
from .style import AFTER, INK, described, panels, styled

Interval = Sequence[float]
_MISSED = "missed"


@styled
def ranked_intervals(
    groups: Mapping[str, Mapping[str, Interval]], *, words: str, missed: Sequence[str] = ()
) -> Figure:
    """Draw panels of names in their order, best on top, each with an interval and a point in it.

    Parameters
    ----------
    groups
        By label of the axis: lower end, point and upper end by name, best first.
    words
        Alternative text: what the figure shows.
    missed
        Names without a number, which come last in every panel.

    Raises
    ------
    ValueRangeError
        If there are no groups, or an interval is not three ascending numbers.
    """
    if not groups:
        raise ValueRangeError("ranked intervals", "there are none to draw", next_step="leave this figure out")
    for label, rows in groups.items():
        for name, interval in rows.items():
            if len(interval) != 3 or not interval[0] <= interval[1] <= interval[2]:
                raise ValueRangeError(f"{label}: {name} {list(interval)}", "must be three ascending numbers")
    most = max(len(rows) for rows in groups.values()) + len(missed)
    columns = min(2, len(groups))
    lines = -(-len(groups) // columns)
    figure, axes = panels(lines, columns, height=lines * (0.75 + 0.22 * most))
    for _number, ((label, rows), each) in enumerate(zip(groups.items(), axes, strict=False)):
        places = -np.arange(len(rows) + len(missed), dtype=float)
        low, middle, high = np.array([list(interval) for interval in rows.values()]).reshape(-1, 3).T
        tone = AFTER.light
        each.hlines(places[: len(rows)], low, high, color=tone, linewidth=3.0)
        each.plot(middle, places[: len(rows)], linestyle="", marker="o", color=INK.light)
        for place in places[len(rows) :]:
            each.annotate(_MISSED, (0.02, place), xycoords=("axes fraction", "data"), va="center", fontsize=8)
        each.set_yticks(places, [*rows, *missed])
        each.set_ylim(places[-1] - 0.6, 0.6)
        each.grid(visible=False, axis="y")
        each.margins(x=0.05)
        each.set_xlabel(label)
    for unused in axes[len(groups) :]:
        unused.set_visible(False)
    return described(figure, words)
