"""Citation and guide for contributors say what is so."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from nlsdesign.foundation.locations import version
from tests import source


def test_the_citation_agrees_with_project_and_bibliography(root: Path) -> None:
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    top = dict(re.findall(r"^([a-z-]+): (.+)$", text, flags=re.MULTILINE))
    assert (top["cff-version"], top["title"], top["version"]) == ("1.2.0", project["name"], version())
    assert top["license"] == project["license"]
    assert re.findall(r"^  - name: (.+)$", text, flags=re.MULTILINE) == [
        a["name"] for a in project["authors"]
    ]
    sources = tomllib.loads(
        (root / "nlsdesign" / "foundation" / "bibliography.toml").read_text(encoding="utf-8")
    )["sources"]
    paper = sources["Austin et al. 2015"]
    reference = text.partition("\nreferences:\n")[2]
    families = re.findall(r"family-names: (.+)", reference)
    assert families == [author.partition(",")[0] for author in paper["authors"]]
    assert f"    title: {paper['title']}\n" in reference
    assert f"    year: {paper['year']}\n" in reference
    assert paper["published"] in reference


def test_what_the_guide_names_is_there(root: Path) -> None:
    guide = root / "CONTRIBUTING.md"
    text = guide.read_text(encoding="utf-8")
    assert list(source.broken_links(guide, root)) == []
    quoted = re.findall(r"`([^`\n]+)`", text)
    paths = [each for each in quoted if re.fullmatch(r"[a-z_]+(/[\w.]+)+|[\w]+\.toml", each)]
    assert len(paths) > 15
    assert [each for each in paths if not (root / each).exists()] == []
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    targets = {each.removeprefix("make ") for each in quoted if each.startswith("make ")}
    assert {"test", "lock"} <= targets
    assert [each for each in targets if not re.search(rf"^{each}:", makefile, flags=re.MULTILINE)] == []
    for limit in ("lines", "arguments", "methods"):
        assert limit in text


def test_an_altered_citation_is_noticed(root: Path) -> None:
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(rf"^version: {re.escape(version())}$", text, flags=re.MULTILINE)
    assert "doi" not in text.lower(), "a DOI was added: check it, and put it into the bibliography too"


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_what_make_starts_may_keep_its_bytecode(root: Path, tmp_path: Path) -> None:
    """Else every process that a test starts compiles the libraries anew."""
    probe = tmp_path / "probe.mk"
    probe.write_text("include Makefile\nprobe:\n\t@echo \"it is '$$PYTHONDONTWRITEBYTECODE'\"\n")
    command = ["make", "--no-print-directory", "-f", str(probe), "probe"]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "MAKEFLAGS": ""}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "it is ''"), done.stderr
