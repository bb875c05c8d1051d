"""The table of independent roads is complete, and each of its tests exists."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import nlsdesign.components as room
from nlsdesign.components import Part
from tests.physics.table import rows

HERE = Path(__file__).parent


def test_every_component_has_two_roads_that_must_agree() -> None:
    found = {c for c in vars(room).values() if inspect.isclass(c) and issubclass(c, Part)}
    public = {c for c in found if not inspect.isabstract(c) and c is not Part}
    assert {row.component for row in rows()} == public
    for row in rows():
        assert row.law, row
        assert len(set(row.roads)) == 2, row


def test_every_row_names_a_test_that_exists_and_asserts() -> None:
    for row in rows():
        file, _, name = row.test.partition("::")
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        (found,) = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.name == name]
        assert any(isinstance(n, ast.Assert) for n in ast.walk(found)), row.test
