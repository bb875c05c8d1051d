"""Output of commands: a short table for people, JSON for scripts."""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from ..foundation.command_words import typed_command
from .terminal_tables import head_count, table_lines

WIDE = 160
"""Width of a table that is not shown on a terminal."""


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table."""
    on_terminal, width = sys.stdout.isatty(), line_width()
    lines = table_lines(columns, rows, width=width)
    bold = head_count(columns, rows, width=width) if on_terminal and _bold() else 0
    if title:
        click.echo("\n".join(textwrap.wrap(title, width)))
    for number, line in enumerate(lines):
        click.echo(click.style(line, bold=True) if number < bold else line)


def _bold() -> bool:
    """Tell whether a terminal shows heads in bold: it can, and nobody asked for plain text."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def line_width() -> int:
    """Return the width of what is printed; a pipe is no narrow screen, unless COLUMNS says so."""
    if sys.stdout.isatty():
        return shutil.get_terminal_size((80, 24)).columns
    return _columns() or WIDE


def _columns() -> int:
    given = os.environ.get("COLUMNS", "")
    return int(given) if given.isdigit() else 0


def show_json(content: Mapping[str, Any]) -> None:
    """Print a mapping as JSON."""
    click.echo(json.dumps(content, indent=2, ensure_ascii=False, default=_plain))


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


def show_written(as_json: bool, sentences: Sequence[str], files: Sequence[Path], **more: Any) -> None:
    """Print what was written, after sentences on it; or all of it as JSON."""
    if as_json:
        show_json({"sentences": list(sentences), **more, "files": list(files)})
        return
    for sentence in sentences:
        click.echo(sentence)
    click.echo(f"written: {', '.join(map(str, files))}")


def next_command(*words: object) -> str:
    """Return a command of this program as it can be copied, with the packages that this run was given."""
    context = click.get_current_context(silent=True)
    packages = () if context is None else context.find_root().params.get("packages") or ()
    given = [item for package in packages for item in ("--with", package)]
    return typed_command("nlsdesign", *given, *words)


def examples(*lines: str) -> str:
    """Return the epilog of a help text that shows commands, each on its line."""
    # Click fills paragraphs anew unless they begin with this mark.
    return "\b\nExamples:\n" + "\n".join(_continued(line) for line in lines)


_LINE = 78
"""Columns of a command in a help text."""


def _continued(line: str) -> str:
    """Return a command on lines that fit, each but the last with a mark that the shell reads on."""
    first, *others = line.split(" --")
    rows = [first]
    for added in (f" --{part}" for part in others):
        if len(rows[-1]) + len(added) > _LINE - 4:
            rows.append(f"     {added}")
        else:
            rows[-1] += added
    return "  " + " \\\n".join(rows)


spring_option = click.option(
    "--spring", default=None, metavar="PART", help="The series spring, where the deck leaves it open."
)
measured_option = click.option(
    "--measured",
    default=None,
    metavar="STATE",
    help="What is measured; by default the motion of the driven body.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
DECK_HELP = "Deck file, or the name of one that comes with the project."
deck_option = click.option("--deck", "deck_name", required=True, metavar="DECK", help=DECK_HELP)
