"""Places that are written twice to the letter.

Two places are a pair where at least six lines in a row are equal. White space is folded; passed over are
blank lines, comments, lines that open a docstring or an import, and lines of brackets and separators alone.
All runs that two files (or a file with itself) share are one pair. Six lines that stand in more than eight
places are a form, and no pair.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

LEAST_LINES = 6
MOST_PLACES = 8

_PASSED = {
    **dict.fromkeys((".py", ".pyi"), r"#|\"\"\"|(from|import)\b"),
    **dict.fromkeys((".c", ".h", ".hpp"), r"//|/?\*|#include"),
    **dict.fromkeys((".js", ".css"), r"//|/?\*|import\b"),
    **dict.fromkeys((".html", ".sh", ".mk"), r"#"),
}


@dataclass(frozen=True)
class Pair:
    """The longest run that two files share, with first and last line in each, and the number of runs."""

    left: tuple[Path, int, int]
    right: tuple[Path, int, int]
    lines: int
    runs: int


def read_lines(file: Path) -> list[tuple[int, str]]:
    """Number and text of the lines that are compared."""
    kept, passed = [], _PASSED[file.suffix]
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        text = " ".join(line.split())
        if re.search(r"[^\s{}()\[\];,:.]", text) and not re.match(passed, text):
            kept.append((number, text))
    return kept


_FOREIGN = "ros2_headers"
"""Files of others that tests compile with, unchanged."""


def sources(root: Path, *folders: str) -> list[Path]:
    """Program texts in these folders; all folders of the project if none is named."""
    tops = [root / name for name in folders] or [p for p in sorted(root.iterdir()) if p.name[0] not in "._"]
    files = (file for top in tops for file in ([top] if top.is_file() else sorted(top.rglob("*"))))
    elsewhere = {"out", _FOREIGN}
    return [f for f in files if f.suffix in _PASSED and f.is_file() and not elsewhere & set(f.parts)]


def pairs(files: Iterable[Path]) -> list[Pair]:
    """All pairs of places in these files, the longest first."""
    texts = {file: read_lines(file) for file in files}
    places: dict[tuple[str, ...], list[tuple[Path, int]]] = {}
    for file, lines in texts.items():
        words = [text for _, text in lines]
        for start in range(len(words) - LEAST_LINES + 1):
            places.setdefault(tuple(words[start : start + LEAST_LINES]), []).append((file, start))
    starts: dict[tuple[Path, Path], set[tuple[int, int]]] = {}
    for found in places.values():
        for (left, i), (right, j) in combinations(found, 2) if len(found) <= MOST_PLACES else ():
            if left != right or j - i >= LEAST_LINES:  # a run does not overlap itself
                starts.setdefault((left, right), set()).add((i, j))
    listed = [_pair(left, right, runs, texts) for (left, right), runs in starts.items()]
    return sorted(listed, key=lambda pair: (-pair.lines, str(pair.left), str(pair.right)))


def _pair(
    left: Path, right: Path, starts: set[tuple[int, int]], texts: dict[Path, list[tuple[int, str]]]
) -> Pair:
    """Join the windows of six lines that follow one another to runs, and name the longest."""
    runs = []
    for i, j in sorted(starts):
        if (i - 1, j - 1) not in starts:
            length = LEAST_LINES
            while (i + length - LEAST_LINES + 1, j + length - LEAST_LINES + 1) in starts:
                length += 1
            runs.append((length, i, j))
    length, i, j = max(runs)
    ends = [(f, texts[f][s][0], texts[f][s + length - 1][0]) for f, s in ((left, i), (right, j))]
    return Pair(ends[0], ends[1], length, len(runs))
