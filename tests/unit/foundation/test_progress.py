"""Progress of long work: one line on a terminal, nothing elsewhere, and nothing left of it after an error."""

from __future__ import annotations

import io

import pytest

from nlsdesign.foundation.progress import Steps


class Terminal(io.StringIO):
    """What a person would look at."""

    def isatty(self) -> bool:
        return True

    @property
    def seen(self) -> list[str]:
        """The lines as they stand at the end: what was written over is gone."""
        return [line.split("\r")[-1].rstrip() for line in self.getvalue().split("\n")]


@pytest.fixture(autouse=True)
def narrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "30")


def test_a_step_shows_what_it_does_and_leaves_its_duration() -> None:
    terminal = Terminal()
    steps = Steps(terminal)
    with steps.step("fit"):
        steps.note("a note that is far longer than the terminal is wide")
        shown = terminal.getvalue().split("\r")[-1]
        steps.note("short")
        assert terminal.seen == ["fit: short"]
    assert shown == "fit: a note that is far longe", "no line is broken"
    with steps.step("export"):
        pass
    lines = [line.split(" s  ") for line in terminal.seen]
    assert [line[-1] for line in lines] == ["fit", "export", ""]
    assert all(float(line[0]) >= 0.0 for line in lines[:2])


def test_nothing_is_left_of_a_step_that_failed() -> None:
    terminal = Terminal()
    with pytest.raises(KeyboardInterrupt), Steps(terminal).step("fit"):
        raise KeyboardInterrupt
    assert terminal.seen == [""]


def test_a_file_gets_nothing() -> None:
    file = io.StringIO()
    steps = Steps(file)
    with steps.step("fit"):
        steps.note("half of it")
    steps.note("after it")
    assert file.getvalue() == ""
