"""The table of independent roads is complete, and each of its tests exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from nlsdesign.components import NeoHooke, Yeoh
from nlsdesign.foundation.extensions import extended_by
from tests.documented_law import documented_law
from tests.parts import declarable
from tests.physics.table import Row, rows

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def is_about(file: Path, component: type) -> bool:
    """Whether a test can know a component: it, what it imports from tests, or a deck it loads names it."""
    text = file.read_text(encoding="utf-8")
    helpers = [
        ROOT / name.replace(".", "/") for name in re.findall(r"^from (tests[\w.]*) import", text, re.M)
    ]
    read = [each / "__init__.py" if each.is_dir() else each.with_suffix(".py") for each in helpers]
    read += [ROOT / "models" / "decks" / f"{name}.toml" for name in re.findall(r'load_deck\("(\w+)"', text)]
    function = re.sub(r"(?<!^)(?=[A-Z])", "_", component.__name__).lower()
    wanted = re.compile(rf"\b({component.__name__}|{function})\b")
    return any(wanted.search(each) for each in (text, *(p.read_text(encoding="utf-8") for p in read)))


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
    before = without_two_roads()
    with extended_by(documented_law(tmp_path)):
        assert set(without_two_roads()) - set(before) == {"WireBundle"}


def test_every_row_names_a_test_that_exists_and_asserts() -> None:
    for row in rows():
        file, _, name = row.test.partition("::")
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        (found,) = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.name == name]
        assert any(isinstance(n, ast.Assert) for n in ast.walk(found)), row.test


def test_every_row_names_a_test_of_its_component(tmp_path: Path) -> None:
    foreign = {row.component.__name__: row.test for row in rows() if not is_about(_file(row), row.component)}
    assert not foreign, "these tests never see the component: name one that does"
    kept = tmp_path / "test_other.py"
    kept.write_text("from nlsdesign.components import Yeoh\n", encoding="utf-8")
    assert is_about(kept, Yeoh)
    assert not is_about(kept, NeoHooke)


def _file(row: Row) -> Path:
    return HERE / row.test.partition("::")[0]
