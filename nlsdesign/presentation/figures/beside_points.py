"""Simulated curves beside points from elsewhere, over frequency, in several panels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from .style import described, legend, log_axis, look, panels, styled

Curve = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class PointPanel:
    """One panel: curves, and points of the same colour where the labels agree.

    Parameters
    ----------
    title
        What is shown.
    up
        Label of the ordinate, with unit.
    curves
        Abscissa and ordinate by label, shape (n,) each; a value that is not a number interrupts the curve and
        has a cross at the lower edge.
    points
        Abscissa and ordinate by label.
    logarithmic
        Whether the ordinate is logarithmic.

    Raises
    ------
    ValueRangeError
        If points have no curve of the same label.
    """

    title: str
    up: str
    curves: Mapping[str, Curve]
    points: Mapping[str, Curve]
    logarithmic: bool = False

    def __post_init__(self) -> None:
        for label in self.points:
            if label not in self.curves:
                raise ValueRangeError(
                    f"points '{label}'", f"have no curve; the curves are {', '.join(self.curves)}",
                    next_step="give points and curve the same label",
                )  # fmt: skip


@styled
def curves_beside_points(shown: Sequence[PointPanel], *, across: str, words: str, columns: int = 1) -> Figure:
    """Draw curves as lines and points as hollow marks, over a logarithmic abscissa.

    Parameters
    ----------
    shown
        Row by row.
    across
        Label of the abscissa, with unit.
    words
        Alternative text: what the figure shows.
    columns
        Panels side by side.

    Raises
    ------
    ValueRangeError
        If there are no panels.
    """
    if not shown:
        raise ValueRangeError("panels", "there are none to draw", next_step="leave this figure out")
    rows = -(-len(shown) // columns)
    figure, axes = panels(rows, columns, height=0.6 + 2.6 * rows, sharex=True)
    for axis, panel in zip(axes, shown, strict=False):
        for number, (label, (x, y)) in enumerate(panel.curves.items()):
            tone, dash, point = look(number)
            axis.plot(
                x, y, color=tone, linestyle=dash, label=label, linewidth=1.4, markersize=2.0, marker="."
            )
            lost = x[~np.isfinite(y)]
            axis.plot(
                lost, np.full(len(lost), 0.04 + 0.06 * number), transform=axis.get_xaxis_transform(),
                color=tone, linestyle="none", marker="x", markeredgewidth=1.6,
            )  # fmt: skip
            if label in panel.points:
                axis.plot(*panel.points[label], color=tone, linestyle="none", marker=point, fillstyle="none")
        if panel.logarithmic:
            log_axis(axis)
        axis.set_title(panel.title)
        axis.set_ylabel(panel.up)
        axis.margins(x=0.03)
        log_axis(axis, abscissa=True)
    for axis in axes[-columns:]:
        axis.set_xlabel(across)
    for axis in axes[:columns]:
        legend(axis)
    return described(figure, words)
