"""Curves over any quantity, for calculations that have no figure of their own."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from .lines import thinned
from .style import described, legend, log_axis, look, panels, styled

Curve = tuple[Array, Array]


@styled
def curves(
    lines: Mapping[str, Curve], *, across: str, up: str, words: str, logarithmic: bool = False
) -> Figure:
    """Draw curves over a common quantity.

    Parameters
    ----------
    lines
        Abscissa and ordinate by label, each of shape (n,); fewer than 40 points are drawn as points too.
    across, up
        Labels of the axes, with units.
    words
        Alternative text: what the figure shows.
    logarithmic
        Whether the abscissa is logarithmic.

    Raises
    ------
    ValueRangeError
        If there are no curves.
    """
    if not lines:
        raise ValueRangeError("curves", "there are none to draw", next_step="leave this figure out")
    figure, (axes,) = panels(1, height=3.0)
    for number, (label, (x, y)) in enumerate(lines.items()):
        tone, dash, point = look(number)
        marker = point if len(x) < 40 else ""
        axes.plot(*thinned(x, y), color=tone, linestyle=dash, marker=marker, label=label, linewidth=1.4)
    if logarithmic:
        log_axis(axes, abscissa=True)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.margins(x=0.02)
    legend(axes, columns=3)
    return described(figure, words)
