"""The command line as a test calls it, in an empty folder."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from nlsdesign.cli import main
from nlsdesign.feedback.control.evaluation import spread_margins
from nlsdesign.foundation.text_files import LIST_NAME

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run the command line in an empty folder; returns exit status, output and errors."""
    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["nlsdesign", *words])
        try:
            main()
            status = 0
        except SystemExit as leaving:
            status = int(leaving.code or 0)
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture
def two_machines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge margins over the spread on two machines and kick four, where their numbers are not looked at."""
    monkeypatch.setattr(spread_margins, "DRAWS", 2)
    monkeypatch.setattr(spread_margins, "KICKED", 4)


def files_in(folder: Path) -> list[str]:
    """Return the names of the files in a folder, without the list of what was written, sorted."""
    return sorted(each.name for each in folder.iterdir() if each.name != LIST_NAME)
