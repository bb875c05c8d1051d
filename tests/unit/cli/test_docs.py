"""``nlsdesign docs`` finds the pages that are installed with the package."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

from tests.command_line import Run, run

__all__ = ["run"]


def test_every_page_is_listed_with_its_title(run: Run, root: Path) -> None:
    status, out, _ = run("docs", "--json")
    content = json.loads(out)
    pages = {f.relative_to(root / "docs").with_suffix("").as_posix() for f in (root / "docs").rglob("*.md")}
    pages = {name for name in pages if not name.startswith("site/")}
    assert (status, Path(content["folder"]), set(content["pages"])) == (0, root / "docs", pages)
    assert content["pages"]["conventions"] == "Conventions"
    status, out, _ = run("docs")
    assert status == 0
    assert all(any(line.split()[:1] == [name] for line in out.splitlines()) for name in pages)


def test_one_page_is_named_or_printed(run: Run, root: Path) -> None:
    file = root / "docs" / "how_to" / "design_a_cam.md"
    for name in ("design_a_cam", "how_to/design_a_cam", "design_a_cam.md"):
        assert run("docs", name) == (0, f"{file}\n", "")
    status, out, _ = run("docs", "design_a_cam", "--print")
    assert (status, out.strip()) == (0, file.read_text(encoding="utf-8").strip())


def test_a_misspelt_page_is_answered_with_the_nearest(run: Run) -> None:
    status, _, err = run("docs", "conventons")
    assert (status, "did you mean 'conventions'?" in err) == (2, True)


def test_a_page_is_printed_as_json_with_its_text(run: Run) -> None:
    status, out, _ = run("docs", "conventions", "--print", "--json")
    assert status == 0
    content = json.loads(out)
    assert content["text"] == Path(content["file"]).read_text(encoding="utf-8")
    assert "text" not in json.loads(run("docs", "conventions", "--json")[1])
    status, _, err = run("docs", "--print")
    assert (status, "--print needs a PAGE" in err) == (2, True)


def test_pages_are_for_readers_and_stand_by_folder(run: Run) -> None:
    names = list(json.loads(run("docs", "--json")[1])["pages"])
    assert [name for name in names if name.startswith("site/")] == []
    folders = [name.rpartition("/")[0] for name in names]
    assert len(list(itertools.groupby(folders))) == len(set(folders))
