"""The table of independent roads is complete, and each of its tests exists."""

from __future__ import annotations

import ast
from pathlib import Path

from nlsdesign.foundation.extensions import extended_by
from tests.documented_law import documented_law
from tests.parts import declarable
from tests.physics.table import rows

HERE = Path(__file__).parent


def without_two_roads() -> list[str]:
    """Names of the components of which no row of the table says how they are proved."""
    proved = {row.component for row in rows()}
    return [kind.__name__ for kind in declarable() if kind not in proved]


def test_every_component_has_two_roads_that_must_agree() -> None:
    missing = without_two_roads()
    assert not missing, f"{', '.join(missing)}: no second road; add a row to a tests/physics/table_*.py"
    assert {row.component for row in rows()} <= set(declarable())
    for row in rows():
        assert row.law, row
        assert len(set(row.roads)) == 2, row


def test_a_law_without_a_second_road_is_noticed(tmp_path: Path) -> None:
    with extended_by(documented_law(tmp_path)):
        assert without_two_roads() == ["WireBundle"]


def test_every_row_names_a_test_that_exists_and_asserts() -> None:
    for row in rows():
        file, _, name = row.test.partition("::")
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        (found,) = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.name == name]
        assert any(isinstance(n, ast.Assert) for n in ast.walk(found)), row.test
