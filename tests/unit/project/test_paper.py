"""Our paper: what a journal asks of its form, and nothing in it that no command makes."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path

import pytest

from docs.site import paper

CITED = re.compile(r"@([\w-]+)")
SECTIONS = ("Summary", "Statement of need", "State of the field", "Software design", "References")


@pytest.fixture(scope="module")
def text() -> str:
    return (paper.PAPER / "paper.md").read_text("utf-8")


@pytest.fixture(scope="module")
def entries() -> dict[str, str]:
    """Each entry of the bibliography by its key."""
    whole = (paper.PAPER / "paper.bib").read_text("utf-8")
    found = re.findall(r"^@\w+\{([\w-]+),\n(.*?)^\}", whole, re.M | re.S)
    assert len(found) == len(dict(found)) == whole.count("\n@") + 1
    return dict(found)


def parts(text: str) -> tuple[str, str]:
    """Front matter and body."""
    _, front, body = re.split(r"^---\n", text, maxsplit=2, flags=re.M)
    return front, body


def test_the_front_matter_has_what_the_journal_asks_for(text: str) -> None:
    front, _ = parts(text)
    for key in ("title", "tags", "authors", "affiliations", "date", "bibliography"):
        assert re.search(rf"^{key}:", front, re.M), key
    assert front.count("  - name: ") >= 2
    assert "bibliography: paper.bib" in front


def test_it_has_the_sections_and_is_short(text: str) -> None:
    _, body = parts(text)
    headings = re.findall(r"^# (.+)$", body, re.M)
    assert [name for name in headings if name in SECTIONS] == list(SECTIONS)
    assert len(body.split()) <= 1000


def test_every_citation_is_an_entry_and_every_entry_is_cited(text: str, entries: dict[str, str]) -> None:
    _, body = parts(text)
    assert set(CITED.findall(body)) == set(entries)


def test_an_entry_that_the_package_cites_too_says_the_same(root: Path, entries: dict[str, str]) -> None:
    file = root / "nlsdesign" / "foundation" / "bibliography.toml"
    ours = tomllib.loads(file.read_text("utf-8"))["sources"].values()
    by_title = {plain(each["title"]): each for each in ours}
    both = 0
    for entry in entries.values():
        title = re.search(r"^  title = \{(.*)\},?$", entry, re.M)
        assert title
        same = by_title.get(plain(title[1]))
        if same is not None:
            both += 1
            assert f"year = {{{same['year']}}}" in entry
            assert same.get("doi", "") in entry
            assert all(name.partition(",")[0] in entry for name in same["authors"])
    assert both >= 3


def plain(title: str) -> str:
    return re.sub(r"[{}]", "", title).casefold()


def test_every_picture_stands_there_and_no_other(text: str) -> None:
    shown = paper.pictures(text)
    assert shown
    assert {file.name for file in paper.PAPER.iterdir()} == {"paper.md", "paper.bib", *shown}


# That the studies still make what the figures show: test_austin2015_closed_loop.py and test_fig8.py.
@pytest.mark.slow
def test_every_picture_is_one_that_the_command_makes(text: str) -> None:
    sections = paper.figures_of_2015(fast=True)
    assert {Path(picture).stem for picture in paper.pictures(text)} <= set(sections)
    # Each figure that is claimed stands beside what was published of it.
    for section in sections.values():
        labels = {text for axes in section.figure.axes for text in axes.get_legend_handles_labels()[1]}
        marks = any(
            line.get_marker() not in ("None", "", None) for a in section.figure.axes for line in a.lines
        )
        assert marks or any("measured" in label or "°" in label for label in labels), section.title


def test_numbers_in_it_are_claimed_by_a_study_or_stand_in_the_counts(root: Path, text: str) -> None:
    claimed = tomllib.loads((root / "studies" / "expected.toml").read_text("utf-8"))
    assert f"{claimed['austin2015']['fig8_rms_error_Nm']['value']:.3f} N·m rms" in text
    loops = claimed["austin2015_closed_loop"]
    worst = max(loops[f"fig9_to_2_Hz_{spring}_percent"]["value"] for spring in ("nonlinear", "soft", "stiff"))
    assert f"within {math.ceil(worst)} % up to 2 Hz" in text
    counted = (root / "docs" / "others_methods.md").read_text("utf-8").splitlines()
    totals = {
        line.split("|")[1].strip(): sum(map(int, re.findall(r"(\d+)/\d+ \(", line.partition(" of 48 ")[0])))
        for line in counted
        if line.startswith("| ") and " of 48 |" in line
    }
    for name, said in (
        ("nlsdesign", "the diagnosis has {} right"),
        ("CMA-ES", "CMA-ES fits of each candidate have {} right"),
        ("least squares", "least squares {}"),
        ("sparse regression", "sparse regression {}"),
    ):
        total = next(value for method, value in totals.items() if method.startswith(name))
        assert said.format(total) in " ".join(text.split()), name
