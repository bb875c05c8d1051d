"""The same figure drawn for a narrow screen: panels below each other, names and titles on several lines."""

from __future__ import annotations

import copy
import re
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from .style import legend, styled

WIDTH = 4.9
"""In inches: letters of 9 pt are then as high on a page 350 px wide."""
_TITLE, _NAME = 48, 20
"""Letters of a title, and of a name beside an axis, that stand in one line."""
_BREAKS = re.compile(r"(?<=[a-z][._])(?=[a-z])")


@styled
def for_telephone(figure: Figure) -> Figure:
    """Return a copy of a figure for a narrow screen; the given one stays as it is."""
    narrow = copy.deepcopy(figure)
    wide, height = figure.get_size_inches()
    specs = [(each, each.get_subplotspec()) for each in narrow.axes if each.get_visible()]
    panels = [axes for axes, spec in specs if spec]
    columns = max((spec.get_gridspec().ncols for _, spec in specs if spec), default=1)
    if columns > 1:
        grid = narrow.add_gridspec(len(panels), 1)
        for row, axes in enumerate(panels):
            axes.set_subplotspec(grid[row])
            axes.tick_params(labelleft=True, labelbottom=True)
    to_scale = any(axes.get_aspect() != "auto" for axes in panels)
    height *= 1.0 if columns == 1 else columns if to_scale else 0.65 * columns
    if to_scale:
        words = 0.4 + 0.4 * len(panels)
        height = words + (height - words) * min(1.0, columns * WIDTH / wide)  # words stay as high as they are
    names = max((_wrap_names(axes.yaxis) for axes in panels), default=1)
    narrow.set_size_inches(WIDTH, height * (1.0 + 0.3 * (names - 1)))
    for axes in panels:
        axes.tick_params(left=False, bottom=False)  # a tenth of the drawing, and the grid shows them
        _wrap_words(axes)
    return narrow


def _wrap_names(axis: Axis) -> int:
    """Put long names beside an axis on several lines; return the largest number of lines."""
    names = [text.get_text() for text in axis.get_majorticklabels()]
    if max(map(len, names), default=0) <= _NAME or not any(name[:1].isalpha() for name in names):
        return 1
    lines = [fill(_BREAKS.sub(" ", name), _NAME) for name in names]
    axis.set_ticks(axis.get_majorticklocs(), lines)
    return 1 + max(line.count("\n") for line in lines)


def _wrap_words(axes: Axes) -> None:
    """Break title and labels of a panel into lines, and put its legend into as many columns as fit."""
    axes.set(xlabel=fill(axes.get_xlabel(), 56), ylabel=fill(axes.get_ylabel(), 28))
    axes.set_title(fill(axes.get_title(loc="left"), _TITLE if axes.get_aspect() == "auto" else 28))
    handles, labels = axes.get_legend_handles_labels()
    if axes.get_legend() is None or not handles:
        return
    longest = max(map(len, labels))
    for handle, label in zip(handles, labels, strict=True):
        handle.set_label(fill(label, _TITLE))
    legend(axes, columns=max(1, int((72.0 * WIDTH - 60.0) / (4.9 * longest + 45.0))))
