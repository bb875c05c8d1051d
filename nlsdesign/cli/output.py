"""Output of commands: tables that fit a terminal, JSON for scripts, commands that come next, warnings."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from ..foundation.errors import typed_command, visible

WIDE = 160
"""Width of a table that is not shown on a terminal."""


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table."""
    on_terminal, width = sys.stdout.isatty(), line_width()
    lines = table_lines(columns, rows, width=width)
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    bold = head_count(columns, rows, width=width) if on_terminal and not plain else 0
    if title:
        click.echo("\n".join(textwrap.wrap(title, width)))
    for number, line in enumerate(lines):
        click.echo(click.style(line, bold=True) if number < bold else line)


def line_width() -> int:
    """Return the width of what is printed; a pipe is no narrow screen, unless COLUMNS says so."""
    if sys.stdout.isatty():
        return shutil.get_terminal_size((80, 24)).columns
    given = os.environ.get("COLUMNS", "")
    return (int(given) if given.isdigit() else 0) or WIDE


def show_json(content: Mapping[str, Any]) -> None:
    """Print a mapping as JSON, which has no number that is not finite: null stands there."""
    text = json.dumps(content, default=lambda v: v.tolist() if hasattr(v, "tolist") else str(v))
    valid = json.loads(text, parse_constant=lambda constant: None)
    click.echo(json.dumps(valid, indent=2, ensure_ascii=False))


def show_lines(lines: Iterable[object]) -> None:
    """Print a line for each."""
    for line in lines:
        click.echo(str(line))


def show_written(as_json: bool, sentences: Sequence[str], files: Sequence[Path], **more: Any) -> None:
    """Print what was written, after sentences on it; or all of it as JSON."""
    if as_json:
        show_json({"sentences": list(sentences), **more, "files": list(files)})
        return
    show_lines(sentences)
    click.echo(f"written: {', '.join(map(str, files))}")


def warn(remarks: Iterable[str]) -> None:
    """Print remarks where they do not mix with what a command prints for others to read."""
    for remark in remarks:
        click.echo(f"warning: {visible(remark)}", err=True)


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


GAP = 2
"""Columns between two cells."""
_LONGEST_WORD = 46
"""A longer word, such as a path, may be broken."""
_NARROWEST_TEXT = 14
_NUMBER = re.compile(r"^[-+±]?\s?[\d.,]+([eE][-+]?\d+)?( ?%)?$|^(inf|nan|-|–)?$")
_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]")


def table_lines(columns: Sequence[str], rows: Sequence[Sequence[str]], *, width: int) -> list[str]:
    """Return the lines of a table, heads first; rows are stacked where the columns do not fit.

    ``columns``: heads; may have several lines.
    """
    heads = [_shown(head) for head in columns]
    cells = [[_shown(cell) for cell in row] for row in rows]
    widths = _widths(heads, cells, width)
    if widths is None:
        return _stacked(heads, cells, width)
    lines = _side_by_side(heads, widths, bottom=True)
    for row in cells:
        lines += _side_by_side(row, widths)
    return lines


def head_count(columns: Sequence[str], rows: Sequence[Sequence[str]], *, width: int) -> int:
    """Return how many of the lines of :func:`table_lines` are heads: none where rows are stacked."""
    heads = [_shown(head) for head in columns]
    widths = _widths(heads, [[_shown(cell) for cell in row] for row in rows], width)
    return 0 if widths is None else len(_side_by_side(heads, widths, bottom=True))


def _shown(text: str) -> str:
    """Return a text without control characters, which could move the cursor of a terminal."""
    return _CONTROL.sub(lambda each: f"\\x{ord(each[0]):02x}", str(text))


def _widths(heads: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """Return the widths of the columns, ``None`` where they do not fit side by side."""
    room = width - GAP * (len(heads) - 1)
    natural, least = [], []
    for number, head in enumerate(heads):
        cells = [row[number] for row in rows]
        natural.append(max((len(line) for text in (head, *cells) for line in text.split("\n")), default=1))
        # A line may break neither words nor a number and what follows it.
        texts = (head, *cells)
        pieces = [piece for text in texts for piece in ([text] if _NUMBER.match(text) else text.split())]
        longest = max((min(len(piece), _LONGEST_WORD) for piece in pieces), default=1)
        wraps = any(" " in cell.strip() for cell in cells)
        least.append(min(natural[-1], max(longest, _NARROWEST_TEXT if wraps else 1)))
    if sum(natural) <= room:
        return natural
    if sum(least) > room:
        return None
    # The widest column gives way first, none below its longest word.
    widths = list(natural)
    while sum(widths) > room:
        widest = max((w, i) for i, w in enumerate(widths) if w > least[i])[1]
        widths[widest] -= 1
    return widths


def _side_by_side(cells: Sequence[str], widths: Sequence[int], *, bottom: bool = False) -> list[str]:
    blocks = [_wrapped(cell, width) for cell, width in zip(cells, widths, strict=True)]
    height = max(map(len, blocks), default=1)
    blocks = [[""] * (height - len(b)) + b if bottom else b + [""] * (height - len(b)) for b in blocks]
    gap = " " * GAP
    return [
        gap.join(block[line].ljust(width) for block, width in zip(blocks, widths, strict=True)).rstrip()
        for line in range(height)
    ]


def _wrapped(text: str, width: int) -> list[str]:
    return [
        part
        for line in text.split("\n")
        for part in textwrap.wrap(line, max(width, 1), break_on_hyphens=False)
    ] or [""]


def _stacked(heads: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """Return one block for each row: its first cell, and below it a line for each further cell."""
    names = [" ".join(head.split()) for head in heads]
    lines = []
    for row in rows:
        first = f"{names[0]}: {row[0]}" if _NUMBER.match(row[0]) else row[0]
        lines += _wrapped(first, width)
        for name, cell in zip(names[1:], row[1:], strict=True):
            text = f"{name}: {' '.join(cell.split())}" if cell else ""
            lines += textwrap.wrap(
                text, max(width, 12), initial_indent="  ", subsequent_indent=4 * " ", break_on_hyphens=False
            )
    return lines
