"""Tables fit the terminal, lose nothing, and break no word of a head."""

from __future__ import annotations

import json
import os
import pty
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from nlsdesign.cli.output import head_count, show_table, table_lines

WORDS = ("rms", "condition", "N·m", "spring.rubber.relaxing", "0.25", "assumed:", "two", "at", "42", "±", "5")


def drawn(seed: int) -> tuple[list[str], list[list[str]]]:
    """Return heads and cells drawn by chance, some with spaces, some empty, some of two lines."""
    chance = random.Random(seed)

    def text(most: int) -> str:
        words = [chance.choice(WORDS) for _ in range(chance.randint(0, most))]
        return chance.choice((" ", "\n")).join(words[:2]) + "".join(f" {word}" for word in words[2:])

    count = chance.randint(1, 8)
    heads = [text(3) or "head" for _ in range(count)]
    return heads, [[text(9) for _ in range(count)] for _ in range(chance.randint(0, 6))]


@pytest.mark.parametrize("width", [30, 44, 80, 120, 160])
def test_no_line_is_longer_than_the_terminal_and_no_word_is_lost_or_broken(width: int) -> None:
    stacked = 0
    for seed in range(200):
        heads, rows = drawn(seed)
        lines = table_lines(heads, rows, width=width)
        assert all(len(line) <= width for line in lines), lines
        shown = Counter(" ".join(lines).split())
        cells = Counter(word for row in rows for cell in row for word in cell.split())
        assert not cells - shown, "a word of a cell is lost or broken"
        stacked += head_count(heads, rows, width=width) == 0
    assert 0 < stacked < 200, "both forms were seen"


def test_columns_stand_below_their_heads_and_long_texts_wrap() -> None:
    rows = [("inertia", "0.05", "from the data sheet of the motor"), ("gear", "4", "counted")]
    lines = table_lines(("name", "value", "source"), rows, width=36)
    assert lines == [
        "name     value  source",
        "inertia  0.05   from the data sheet",
        "                of the motor",
        "gear     4      counted",
    ]
    assert table_lines(("name", "value", "source"), rows, width=24)[:4] == [
        "inertia", "  value: 0.05", "  source: from the data", "    sheet of the motor"
    ]  # fmt: skip
    assert table_lines(("angle\n[deg]", "gain"), [("10", "3")], width=80) == [
        "angle",
        "[deg]  gain",
        "10     3",
    ]


def test_control_characters_do_not_reach_the_terminal() -> None:
    (_, line) = table_lines(("name",), [("\x1b]0;title\x07\x1b[2J\r",)], width=80)
    assert line == "\\x1b]0;title\\x07\\x1b[2J\\x0d"


def on_a_terminal(root: Path, columns: int, **environment: str) -> str:
    """Run ``nlsdesign deck list`` on a terminal of that width and return what it shows."""
    ours, its = pty.openpty()
    given = {**os.environ, "PYTHONPATH": str(root), "COLUMNS": str(columns), "TERM": "xterm", **environment}
    call = [sys.executable, "-m", "nlsdesign", "deck", "list"]
    done = subprocess.run(call, stdout=its, stderr=its, env=given, timeout=120, check=False)
    os.close(its)
    shown = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:
            break
        if not part:
            break
        shown += part
    os.close(ours)
    assert done.returncode == 0
    return shown.decode().replace("\r\n", "\n")


@pytest.mark.skipif(sys.platform == "win32", reason="has no pseudo terminal")
def test_heads_are_bold_on_a_terminal_unless_it_is_asked_not_to_be(root: Path) -> None:
    plain = on_a_terminal(root, 80, NO_COLOR="1")
    assert "\x1b" not in plain
    assert max(map(len, plain.splitlines())) <= 80
    assert "\x1b[1mname" in on_a_terminal(root, 80, NO_COLOR="")


def test_what_is_piped_has_no_escapes_and_is_wide(root: Path) -> None:
    given = {n: v for n, v in os.environ.items() if n not in ("COLUMNS", "NO_COLOR")} | {
        "PYTHONPATH": str(root)
    }
    call = [sys.executable, "-m", "nlsdesign", "deck", "list"]
    done = subprocess.run(call, capture_output=True, text=True, env=given, timeout=120, check=True)
    assert "\x1b" not in done.stdout
    assert 80 < max(map(len, done.stdout.splitlines())) <= 160
    done = subprocess.run(
        [*call, "--json"], capture_output=True, text=True, env=given, timeout=120, check=True
    )
    assert json.loads(done.stdout)
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("given", "bold"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False), ({"NO_COLOR": ""}, True)],
)
def test_heads_are_bold_where_a_terminal_can_and_nobody_minds(
    given: dict[str, str], bold: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr("click.echo", print)  # click itself takes the marks out of what is no terminal
    show_table("", ("name",), [("value",)])
    assert ("\x1b[1mname" in capsys.readouterr().out) is bold
