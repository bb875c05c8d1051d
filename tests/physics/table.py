"""The table of independent roads: for each component two ways to a number, and the law between them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import NamedTuple

from nlsdesign.components import Part


class Row(NamedTuple):
    """What proves the physics of one component.

    ``test`` is ``file.py::test_name`` in this folder; an earlier row may carry the same test.
    """

    component: type[Part]
    law: str
    roads: tuple[str, str]
    test: str


def rows() -> list[Row]:
    """All rows, over all groups."""
    here = Path(__file__).parent
    names = sorted(path.stem for path in here.glob("table_*.py"))
    return [row for name in names for row in importlib.import_module(f"tests.physics.{name}").ROWS]
