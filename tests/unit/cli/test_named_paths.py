"""Options and arguments for files and folders: an empty name is none, and writes or reads nothing."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from nlsdesign.cli.main import program
from nlsdesign.cli.typed_values import NamedPath
from tests.command_line import Run, run
from tests.unit.cli.test_command_tree import tree

__all__ = ["run"]
DECK = "austin2015_soft_spring"
PARAMETERS = [
    (*path, each.name or "", each)
    for path, command in tree(program)
    for each in command.params
    if isinstance(each.type, click.Path)
]


def test_every_path_of_the_command_line_has_to_have_a_name() -> None:
    assert len(PARAMETERS) > 30
    assert [names for *names, each in PARAMETERS if not isinstance(each.type, NamedPath)] == []


@pytest.mark.parametrize("empty", ["", " "])
@pytest.mark.parametrize(
    ("words", "what", "example"),
    [
        (("deck", "copy", DECK), "OUT.TOML", "write for instance leg.toml"),
        (("design", "--deck", DECK, "--out"), "--out", "write for instance --out out/design"),
        (("study", "run", "hello", "--out"), "--out", "write for instance --out out/hello"),
        (("sweep", "none.toml", "--out"), "--out", "write for instance --out out/sweep"),
        (("export", "modelica", "--deck", DECK, "--out"), "--out", "write for instance --out my.mo"),
        (("compare", "out/a"), "FOLDER...", "write for instance out/design"),
        (("fit", "--deck", DECK, "--records"), "--records", "write for instance --records bench"),
        (("export", "check"), "FOLDER", "write for instance out/c"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_empty_name_is_refused_before_any_work(
    words: tuple[str, ...], what: str, example: str, empty: str, run: Run, tmp_path: Path
) -> None:
    status, out, err = run(*words, empty)
    assert (status, out) == (2, "")
    assert f"{what} '{empty}': names no" in err
    assert example in err
    assert list(tmp_path.iterdir()) == []


def test_the_current_folder_can_be_named(run: Run, tmp_path: Path) -> None:
    status, out, _ = run("export", "c", "--deck", DECK, "--out", ".", "--dry-run")
    assert status == 0
    assert "would write: observer.h" in out
