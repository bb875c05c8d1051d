"""The table of independent roads: for each component two ways to a number, and the law between them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import NamedTuple

from nlsdesign.components import Part

HERE = Path(__file__).parent


class Row(NamedTuple):
    """What proves the physics of one component.

    ``test`` is ``file.py::test_name`` in this folder; an earlier row may carry the same test.
    """

    component: type[Part]
    law: str
    roads: tuple[str, str]
    test: str


def rows() -> list[Row]:
    """All rows: of the groups, and of tests that bring a row of their own."""
    names = sorted(p.stem for p in HERE.glob("table_*.py"))
    names += sorted(p.stem for p in HERE.glob("test_*.py") if "\nROWS" in p.read_text(encoding="utf-8"))
    return [row for name in names for row in importlib.import_module(f"tests.physics.{name}").ROWS]
