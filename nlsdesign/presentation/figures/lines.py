"""Lines reduced to the points that a figure can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...foundation.arrays import Array, Indices

COLUMNS, ROWS = 700, 400
"""Finest grid that a full-width panel can show on paper and on screen."""


def thinned(x: ArrayLike, y: ArrayLike, *, columns: int = COLUMNS) -> tuple[Array, Array]:
    """Return a line with fewer points that looks the same.

    Over an ascending x each of ``columns`` intervals keeps its first, last, lowest and highest point, so no
    peak is lost. Otherwise (a loop) points are left out that fall into the same cell of the figure as the one
    before. Short lines come back as they are.

    ``x``, ``y``: shape (n,); NaN in y interrupts the line. Result: x and y of shape (m,), m ≤ n, points of
    the given line in the given order.
    """
    abscissa, ordinate = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(abscissa) <= 2 * columns:
        return abscissa, ordinate
    keep = (
        _envelope(abscissa, ordinate, columns)
        if np.all(np.diff(abscissa) > 0.0)
        else _cells(abscissa, ordinate)
    )
    return abscissa[keep], ordinate[keep]


def _envelope(x: Array, y: Array, columns: int) -> Indices:
    edges = np.searchsorted(x, np.linspace(x[0], x[-1], columns + 1)[1:-1])
    parts = [part for part in np.split(np.arange(len(x)), edges) if len(part)]
    kept: set[int] = set()
    for part in parts:
        kept |= {int(part[0]), int(part[-1])}
        if np.all(np.isnan(y[part])):
            continue
        kept |= {int(part[np.nanargmin(y[part])]), int(part[np.nanargmax(y[part])])}
        kept |= {int(item) for item in part[np.isnan(y[part])][:1]}
    return np.array(sorted(kept), dtype=np.intp)


def _cells(x: Array, y: Array) -> Indices:
    columns = [_cell(x, COLUMNS), _cell(y, ROWS)]
    moved = np.any(np.diff(np.array(columns), axis=1) != 0, axis=0)
    return np.flatnonzero(np.concatenate([[True], moved]))


def _cell(values: Array, count: int) -> NDArray[np.int64]:
    low, span = np.nanmin(values), np.ptp(values[np.isfinite(values)]) or 1.0
    share = np.nan_to_num((values - low) / span, nan=-1.0)
    return np.asarray(np.round(share * count), dtype=np.int64)
