"""The live page has the colours of the figures, on light and on dark screens, and no others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nlsdesign.presentation.figures.style import TONES

PAGE = ("page", "soft", "warn")
"""Colours of the page around its cards, which no figure has."""


@pytest.fixture(scope="module")
def folder(root: Path) -> Path:
    return root / "nlsdesign" / "live" / "page"


def test_the_page_has_the_colours_of_the_figures(folder: Path) -> None:
    style = (folder / "style.css").read_text(encoding="utf-8")
    blocks = re.findall(r":root \{(.*?)\}", style, flags=re.DOTALL)
    assert len(blocks) == 2, "one for light screens and one for dark ones"
    for block, theme in zip(blocks, ("light", "dark"), strict=True):
        assert f"color-scheme: {theme};" in block
        given = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", block))
        assert {name: given.pop(name) for name in PAGE}
        assert given == {tone.name: getattr(tone, theme) for tone in TONES}


def test_a_colour_is_written_in_one_place_only(folder: Path) -> None:
    """Elsewhere it is named; the shadow under a menu is no colour."""
    for file in sorted(folder.iterdir()):
        text = file.read_text(encoding="utf-8")
        if file.name == "style.css":
            text = re.sub(r":root \{.*?\}", "", text, flags=re.DOTALL).replace("#0003", "")
        if file.name != "icon.svg":  # a browser shows it outside of the page
            assert re.findall(r"#[0-9a-fA-F]{3,8}\b(?=[;\s\"'!])", text) == [], file.name
