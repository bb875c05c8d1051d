"""Points of a sweep on a page: a table of some, and the row of each that a figure shows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, ClassVar
from urllib.parse import quote

from ...foundation.errors import visible
from .html import Html
from .sections import PagePosition, Section, TableSection


@dataclass(frozen=True, eq=False)
class PointTableSection(Section):
    """A table of points, each with its deck; and what the page shows of any point that is chosen in a figure.

    Parameters
    ----------
    table
        One row per point of ``points``, without the number of the point.
    points
        Numbers of the points in the table.
    decks
        Path of the deck of a point, from the folder of the page, by number; for points beyond the table too.
    rows
        For each point that a figure shows its values, by number: ``status``, ``reason``, ``values``.
    columns
        Name and unit of each of the values.
    command
        What writes the deck of a point that has none yet; ``POINT`` stands for its number.
    elsewhere
        Where the rows of points stand that are not on the page.
    """

    table: TableSection
    points: Sequence[int]
    _: KW_ONLY
    decks: Mapping[int, str] = field(default_factory=dict)
    rows: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    columns: Sequence[tuple[str, str]] = ()
    command: str = ""
    elsewhere: str = ""
    template: ClassVar[str] = "points.html"
    script: ClassVar[str] = "points.js"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the cells, the links, and the rows as JSON that no name can break out of."""
        inner = dict(self.table.content(place))
        for row, number in zip(inner["rows"], self.points, strict=True):
            row["point"] = number
            row["deck"] = quote(self.decks[number]) if number in self.decks else ""
        content = {
            "columns": [[visible(name), unit] for name, unit in self.columns],
            "rows": {str(number): row for number, row in self.rows.items()},
            "decks": {str(number): quote(path) for number, path in self.decks.items()},
            "command": visible(self.command),
            "elsewhere": self.elsewhere,
        }
        text = json.dumps(content, separators=(",", ":"))
        for letter in "<>&":  # they stand in texts only, where JSON may write any letter by its number
            text = text.replace(letter, f"\\u{ord(letter):04x}")
        return {**inner, "data": Html(text), "key": place.key, "elsewhere": self.elsewhere}
