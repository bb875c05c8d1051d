"""The numbers that a figure shows, read off its lines, bars and areas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import Collection, LineCollection, PathCollection, PolyCollection
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

_DIGITS = 5


def figure_data(figure: Figure) -> dict[str, Any]:
    """Return what a figure shows as numbers, for a file of JSON.

    The numbers are those that are drawn: long records are thinned as they are in the figure.

    Result: ``panels``: each with ``title``, ``x`` and ``y`` (labels of the axes, with units) and ``series``.
    A series has a ``label``, and ``x`` and ``y`` of equal length; a value that is not a number is ``None``.
    Lines across a panel have ``x`` or ``y`` alone.
    """
    panels = []
    for axes in figure.axes:
        series = [*_bars(axes), *_lines(axes), *_areas(axes)]
        if series:
            panels.append(
                {"title": axes.get_title(loc="left") or axes.get_title(), "x": _across(axes),
                 "y": axes.get_ylabel(), "series": series}
            )  # fmt: skip
    return {"panels": panels}


def _across(axes: Axes) -> str:
    """Return the label of the abscissa; panels that share it have it below the last one only."""
    shared = axes.get_shared_x_axes().get_siblings(axes)
    return next((each.get_xlabel() for each in (axes, *shared) if each.get_xlabel()), "")


def _lines(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for line in axes.lines:
        name = _name(line.get_label())
        x, y = (_column(values) for values in (line.get_xdata(), line.get_ydata()))
        if line.get_transform() == axes.transData:
            result.append({"label": name, "x": x, "y": y})
        elif name and line.get_transform() == axes.get_yaxis_transform(which="grid"):
            result.append({"label": name, "y": y[:1]})
        elif name and line.get_transform() == axes.get_xaxis_transform(which="grid"):
            result.append({"label": name, "x": x[:1]})
    return result


def _bars(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for bars in axes.containers:
        if not isinstance(bars, BarContainer):
            continue
        name = _name(bars.get_label())
        if bars.orientation == "horizontal":
            middles = [bar.get_y() + 0.5 * bar.get_height() for bar in bars.patches]
            sizes = _column([bar.get_x() + bar.get_width() for bar in bars.patches])
            result.append({"label": name, "x": sizes, "y": _ticks(axes.yaxis, middles)})
        else:
            middles = [bar.get_x() + 0.5 * bar.get_width() for bar in bars.patches]
            sizes = _column([bar.get_y() + bar.get_height() for bar in bars.patches])
            result.append({"label": name, "x": _ticks(axes.xaxis, middles), "y": sizes})
    return result


def _ticks(axis: Axis, places: list[float]) -> list[Any]:
    """Return what stands at the ticks nearest to places; the places themselves where these are numbers."""
    if not isinstance(axis.get_major_locator(), FixedLocator):
        return _column(places)
    ticks = np.asarray(axis.get_majorticklocs())
    words = [text.get_text() for text in axis.get_majorticklabels()]
    return [words[int(np.argmin(np.abs(ticks - place)))] for place in places]


def _areas(axes: Axes) -> list[dict[str, Any]]:
    result = []
    for each in axes.collections:
        name = _name(each.get_label())
        for points in _outlines(each):
            if len(points):
                result.append({"label": name, "x": _column(points[:, 0]), "y": _column(points[:, 1])})
    return result


def _outlines(collection: Collection) -> list[np.ndarray]:
    """Return the points of an area, of points, or the ends of short lines, all in one."""
    if isinstance(collection, PathCollection):
        return [np.asarray(collection.get_offsets(), dtype=float)]
    if isinstance(collection, LineCollection):
        segments = [np.asarray(each, dtype=float) for each in collection.get_segments()]
        return [np.concatenate(segments)] if segments else []
    if isinstance(collection, PolyCollection):
        return [np.asarray(path.vertices, dtype=float) for path in collection.get_paths()]
    return []


def _name(label: object) -> str:
    text = str(label or "")
    return "" if text.startswith("_") else text


def _column(values: Any) -> list[float | None]:
    numbers: Any = np.ravel(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan))
    return [float(f"{v:.{_DIGITS}g}") if math.isfinite(v) else None for v in numbers.tolist()]
