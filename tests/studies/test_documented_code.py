"""The Python that the documents show runs as it stands."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

PYTHON = re.compile(r"^```python\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


def run_blocks(document: Path) -> list[dict[str, Any]]:
    """Run each block of Python in a document; returns the names that each has bound."""
    ran = []
    for text in PYTHON.findall(document.read_text(encoding="utf-8")):
        names: dict[str, Any] = {"__name__": "documented"}
        exec(compile(text, document.name, "exec", dont_inherit=True), names)
        ran.append(names)
    return ran


def test_the_readme_designs_observes_and_exports(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (names,) = run_blocks(root / "README.md")
    assert "cam" in capsys.readouterr().out, "the circuit is not printed"
    assert names["design"].rms < 1e-3, "N·m, of a target of 5 N·m"
    written = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert "out/plant.fmu" in written
    assert {name.rpartition(".")[2] for name in written if name.startswith("out/controller/")} == {"c", "h"}


# The blocks of the tutorial build on one another: tests/studies/test_tutorial.py runs them in order.
DOCS = Path(__file__).resolve().parents[2] / "docs"
SHOWING = [
    path.relative_to(DOCS).as_posix()
    for path in sorted(DOCS.rglob("*.md"))
    if path.parent.name != "tutorial" and "```python" in path.read_text(encoding="utf-8")
]


def test_some_documents_show_code() -> None:
    assert len(SHOWING) > 5


def names_read(text: str) -> Iterator[tuple[str, ...]]:
    """Yield each chain of attributes in a text, ``nls.observer.CascadeGain`` as three names."""
    for node in ast.walk(ast.parse(text)):
        chain: list[str] = []
        while isinstance(node, ast.Attribute):
            chain.insert(0, node.attr)
            node = node.value
        if chain and isinstance(node, ast.Name):
            yield (node.id, *chain)


def missing_names(text: str, names: dict[str, Any]) -> list[str]:
    """Execute the imports of a block of Python; return what it reads of a module that is not there."""
    tree = ast.parse(text)
    tree.body = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    exec(compile(tree, "imports", "exec", dont_inherit=True), names)
    lacking = []
    for first, *rest in names_read(text):
        value = names.get(first)
        for name in rest:
            if not isinstance(value, ModuleType):
                break
            if not hasattr(value, name):
                lacking.append(".".join((first, *rest)))
                break
            value = getattr(value, name)
    return lacking


# Some documents run in the quick run; that what the others import is there, this tells of all.
@pytest.mark.parametrize("document", SHOWING)
def test_what_the_documents_name_exists(document: str) -> None:
    names: dict[str, Any] = {}
    for text in PYTHON.findall((DOCS / document).read_text(encoding="utf-8")):
        assert missing_names(text, names) == []


def test_a_name_that_does_not_exist_is_noticed() -> None:
    assert missing_names("import math\nx = math.pi + math.tau.real\n", {}) == []
    assert missing_names("import math\nprint(math.pie)\n", {}) == ["math.pie"]
    with pytest.raises(ImportError):
        missing_names("from math import pie\n", {})


@pytest.mark.long_cases(
    "how_to/analyse_over_the_angle.md",
    "how_to/sweep_designs.md",
    "how_to/use_the_fmus.md",
    "how_to/run_many_at_once.md",
    "asked_elsewhere.md",
    "certificates.md",
    "how_to/both_strokes_and_losses.md",
    "how_to/calibrate_on_the_bench.md",
    "how_to/watch_in_use.md",
    "how_to/choose_a_torque_controller.md",
    "how_to/co_simulate.md",
    "how_to/design_a_cam.md",
    "how_to/drawing_for_the_workshop.md",
    "how_to/follow_with_a_roller.md",
    "how_to/judge_a_torque_loop.md",
    "how_to/own_board.md",
    "how_to/own_study.md",
    "how_to/pareto_front.md",
    "how_to/pull_a_coil.md",
    "how_to/spring_beside_the_drive.md",
    "how_to/read_a_sweep.md",
    "how_to/tolerances_and_trim.md",
    "observers.md",
    "targets.md",
)
@pytest.mark.parametrize("document", SHOWING)
def test_the_code_in_the_other_documents_runs(
    document: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = (DOCS / document).read_text(encoding="utf-8").count("```python")
    assert len(run_blocks(DOCS / document)) == shown


def test_the_bench_of_the_page_on_records_stays_within_its_cam(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (names,) = run_blocks(DOCS / "how_to" / "records_from_a_bench.md")
    end = names["rig"].quantities()["spring.cam.last_angle"].number
    assert 0.8 * end < abs(names["run"]["motor.angle"]).max() < end


def test_a_block_that_fails_is_noticed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "```sh\nfalse\n```\n```python\nx = 1\n```\n```python\nassert x == 1\n```\n", encoding="utf-8"
    )
    with pytest.raises(NameError):
        run_blocks(page)
