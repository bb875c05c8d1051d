"""Tables that fit a terminal: words stay whole; where columns do not fit side by side, rows are stacked."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

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
        pieces = [piece for text in (head, *cells) for piece in _unbroken(text)]
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


def _unbroken(text: str) -> list[str]:
    """Return what a line may not break: words, and a number with what follows it."""
    return [text] if _NUMBER.match(text) else text.split()


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
