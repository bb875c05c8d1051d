"""Commands that are printed as the next step can be copied into a shell, whatever names hold."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from nlsdesign.cli.bench import as_read
from nlsdesign.foundation.errors import typed_command
from tests.command_line import Run, run

__all__ = ["run"]
LINEAR = "austin2015_stiff_spring"
NAME = "mein Gelenk ä (2).toml"


def following(out: str) -> list[str]:
    """Return the words of the command that is printed as the next one."""
    (line,) = [each for each in out.splitlines() if "next: " in each]
    return shlex.split(line.partition("next: ")[2])


def test_the_deck_that_was_made_is_the_deck_of_the_next_command(run: Run) -> None:
    _, out, _ = run("deck", "copy", LINEAR, NAME)
    assert following(out) == ["nlsdesign", "deck", "check", NAME]
    _, out, _ = run("deck", "new", f"new {NAME}", "--template", "geared-joint", "--yes")
    assert following(out) == ["nlsdesign", "deck", "check", f"new {NAME}"]


def test_packages_of_this_run_are_those_of_the_next(run: Run) -> None:
    Path("own laws.py").touch()
    _, out, _ = run("--with", "own laws.py", "deck", "copy", LINEAR, "leg.toml")
    assert following(out) == ["nlsdesign", "--with", "own laws.py", "deck", "check", "leg.toml"]


def test_records_are_read_again_as_they_were() -> None:
    assert as_read(Path("columns of bench.toml"), ("last*", "x")) == [
        *("--hold-out", "last*", "--hold-out", "x"),
        *("--mapping", "columns of bench.toml"),
    ]
    assert as_read(None, ()) == []


def test_windows_takes_double_quotes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nlsdesign.foundation.errors.os.name", "nt")
    assert typed_command("nlsdesign", "deck", "check", "my leg.toml") == 'nlsdesign deck check "my leg.toml"'
