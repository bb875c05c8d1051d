"""What the figures of the page of a sweep are made from."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...sweeps import SweepColumn, SweepTable
from ...sweeps.ranked_points import RankedPoints
from ...sweeps.sensitivity import AnswerSensitivity
from .shown_points import ShownPoints


def listed_names(names: list[str], most: int = 8) -> str:
    """Return names as text, the first of them."""
    return ", ".join(f"`{name}`" for name in names[:most]) + (", …" if len(names) > most else "")


class PageContent(NamedTuple):
    """What the figures of a page are made from."""

    table: SweepTable
    ranked: RankedPoints
    shown: ShownPoints
    answers: tuple[str, ...]
    sensitivities: dict[str, AnswerSensitivity]
    points_file: Path

    def varies(self, column: SweepColumn) -> bool:
        """Tell whether a column has two different values."""
        return self.distinct(column) > 1

    def distinct(self, column: SweepColumn) -> int:
        """Return how many different values a column has, those that are finite or words."""
        values = np.asarray(self.table.values[column.name])
        return len(np.unique(values[np.isfinite(values)] if values.dtype.kind == "f" else values.astype(str)))

    def varying_axes(self) -> list[SweepColumn]:
        """Return the axes that have two different values."""
        return [axis for axis in self.table.axes if self.varies(axis)]
