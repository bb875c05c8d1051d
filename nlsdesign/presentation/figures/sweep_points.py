"""Points of a sweep as figures draw them: in kinds, each with a look, each a link to its row."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ...foundation.arrays import Array, Indices, Mask
from ...foundation.errors import visible
from ...foundation.quantity import typeset_unit
from .style import AFTER, DASHES, HOLDS, LIMIT, MUTED, PURPLE

_LINES = 6


class ShownColumn(NamedTuple):
    """One column of a sweep as a figure shows it.

    Parameters
    ----------
    name
        Full name.
    unit
        Of the values; empty for words and counts.
    values
        One for each point: numbers, or words.
    """

    name: str
    unit: str
    values: NDArray[Any]

    @property
    def words(self) -> bool:
        """Whether the values are words."""
        return self.values.dtype.kind not in "fiub"

    @property
    def label(self) -> str:
        """Name and unit on one line."""
        unit = typeset_unit(self.unit or "1")
        return shortened(self.name, 60) + (f" in {unit}" if unit else "")

    def numbers(self) -> Array:
        """Return the values, words as the number of their place in the alphabet."""
        if not self.words:
            return self.values.astype(float)
        return np.unique(self.values.astype(str), return_inverse=True)[1].ravel().astype(float)


@dataclass(frozen=True, eq=False)
class PointKinds:
    """What the points of a figure are.

    Parameters
    ----------
    points
        Numbers of the points, shape (n,).
    front, missed, failed
        Which no other betters, which keep not all requirements, which have no answer; no point is two of
        them.
    """

    points: NDArray[np.int64]
    front: Mask
    missed: Mask
    failed: Mask

    def groups(self) -> Iterator[PointGroup]:
        """Yield the kinds that there are, those to be drawn on top last."""
        others = ~(self.front | self.missed | self.failed)
        tone = MUTED if np.any(self.front) else AFTER
        for label, rows, colour, dash, marker, strong in (
            ("failed", self.failed, PURPLE, DASHES[2], "x", False),
            ("misses a requirement", self.missed, LIMIT, DASHES[1], "D", False),
            ("other points" if np.any(self.front) else "points", others, tone, DASHES[0], "o", False),
            ("on the front", self.front, HOLDS, DASHES[0], "s", True),
        ):
            if np.any(rows):
                yield PointGroup(label, np.flatnonzero(rows), colour.light, dash, marker, strong)


class PointGroup(NamedTuple):
    """Points of one kind."""

    label: str
    rows: Indices
    color: str
    dash: Any
    marker: str
    strong: bool


def links(points: NDArray[np.int64]) -> list[str]:
    """Return the link of each point on its page."""
    return [f"#point-{number}" for number in points.tolist()]


def scatter_points(axes: Axes, across: Array, up: Array, *, kinds: PointKinds, small: bool = False) -> None:
    """Draw points in their kinds, each a link; those without a finite place are left out."""
    size = 0.4 if small else 1.0
    for group in kinds.groups():
        rows = group.rows[np.isfinite(across[group.rows]) & np.isfinite(up[group.rows])]
        if not len(rows):
            continue
        drawn = axes.scatter(
            across[rows], up[rows], marker=group.marker, label=group.label, zorder=3 if group.strong else 2,
            **_mark_look(group, size),
        )  # fmt: skip
        drawn.set_urls(links(kinds.points[rows]))


def _mark_look(group: PointGroup, size: float) -> dict[str, Any]:
    """Return size and colours of the marks of a group: outlines only where they are no results to choose."""
    if group.strong:
        return {"s": 22.0, "facecolors": group.color, "linewidths": 0.0}
    if group.marker == "o":
        return {"s": 9.0 * size, "facecolors": group.color, "linewidths": 0.0, "alpha": 0.7}
    if group.marker == "x":
        return {"s": 14.0 * size, "color": group.color, "linewidths": 0.9}
    return {
        "s": 9.0 * size, "facecolors": "none", "edgecolors": group.color, "linewidths": 0.9, "alpha": 0.7,
    }  # fmt: skip


def shortened(text: str, most: int) -> str:
    """Return a text with its control characters written out and its middle cut where it is long."""
    plain = " ".join(visible(text).split())
    return plain if len(plain) <= most else f"{plain[: most // 3]}…{plain[-(2 * most // 3 - 1) :]}"


def in_lines(name: str, letters: int = 15) -> str:
    """Return a name on several short lines, broken behind dots where there are some."""
    lines: list[str] = []
    for piece in shortened(name, 80).replace(".", ".\n").replace("_", "_\u200b").split("\n"):
        if lines and len(lines[-1]) + len(piece) <= letters and "\u200b" not in lines[-1]:
            lines[-1] += piece
        else:
            lines += textwrap.wrap(piece.replace("\u200b", " \u200b"), letters + 1) or [piece]
    clean = [line.replace(" \u200b", "").replace("\u200b", "").strip() for line in lines]
    return "\n".join(clean if len(clean) <= _LINES else [*clean[: _LINES - 1], "…" + clean[-1]])
