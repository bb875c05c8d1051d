"""The pages of ``docs/tutorial``: files, commands and what they print, run in order in one folder.

A page is Markdown with four kinds of blocks. ``<!-- file: NAME -->`` before a block says that the reader
saves it; ``sh`` is typed; ``python`` is tried in an interpreter that was started in the folder; ``text``
shows lines that the block before has printed, in their order, others may stand between them; ``…`` in a
line stands for anything.

``python -m tests.tutorial --write`` runs all pages, writes the numbers that come now into them, copies the
figures that they show, and writes the notebook anew.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "tutorial"
NOTEBOOK = "tutorial.ipynb"
FENCE = re.compile(
    r"(?:^<!-- file: (?P<file>[\w./-]+) -->\n)?^```(?P<kind>\w+)\n(?P<text>.*?)^```$",
    flags=re.MULTILINE | re.DOTALL,
)
IMAGE = re.compile(r"!\[[^\]]*\]\((?P<shown>figures/[\w.-]+)\)<!-- from (?P<made>[\w./-]+) -->")
NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?!\w)")
TOLERANCE = 0.05
"""Relative; other versions of numerical libraries move last digits of optimised and fitted numbers."""


@dataclass(frozen=True)
class Block:
    """One block of a page, where it stands in the text of the page, and the file that it is saved as."""

    kind: str
    text: str
    file: str
    start: int
    end: int

    @property
    def commands(self) -> list[str]:
        """Lines of a shell block, each with what a backslash at its end continues."""
        return [line for line in self.text.replace("\\\n", " ").splitlines() if line.strip()]


def pages() -> list[Path]:
    """The pages in the order in which they are read."""
    return sorted(FOLDER.glob("[0-9]*.md"))


def blocks(page: str) -> Iterator[Block]:
    """Yield the blocks of the text of a page."""
    for each in FENCE.finditer(page):
        yield Block(each["kind"], each["text"], each["file"] or "", each.start("text"), each.end("text"))


def call(words: list[str], folder: Path) -> str:
    """Run a program in a folder; returns what it printed, raises where its status is not zero."""
    root = FOLDER.parent.parent
    words = {"nlsdesign": [sys.executable, "-m", "nlsdesign"], "python": [sys.executable]}.get(
        words[0], [str((folder / words[0]).resolve()) if "/" in words[0] else words[0]]
    ) + words[1:]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"}
    # Readline sets the width of a terminal in processes that have none, so in the workers of a run of tests.
    environment.pop("COLUMNS", None)
    done = subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8", timeout=600
    )
    if done.returncode:
        raise AssertionError(f"{shlex.join(words)} ended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def carried_out(block: Block, folder: Path) -> str:
    """Do what a block says; returns what was printed."""
    if block.file:
        (folder / block.file).parent.mkdir(parents=True, exist_ok=True)
        (folder / block.file).write_text(block.text, encoding="utf-8")
        return ""
    if block.kind == "python":
        return call(["python", "-c", block.text], folder)
    return "".join(call(shlex.split(line), folder) for line in block.commands)


def differences(shown: str, printed: str) -> Iterator[str]:
    """Yield the lines of a text block that were not printed in this order, or with other numbers."""
    rest = [" ".join(line.split()) for line in printed.splitlines()]
    for wanted in (" ".join(line.split()) for line in shown.splitlines() if line.strip()):
        place = next((k for k, line in enumerate(rest) if agrees(wanted, line)), None)
        if place is None:
            alike = next((line for line in rest if _form(wanted).fullmatch(line)), "no such line")
            yield f"'{wanted}' was not printed; {alike}"
        else:
            rest = rest[place + 1 :]


def agrees(wanted: str, line: str) -> bool:
    """Tell whether a printed line is the one that is wanted, its numbers up to the tolerance."""
    match = _form(wanted).fullmatch(line)
    if not match:
        return False
    numbers = [float(n.replace("−", "-")) for n in NUMBER.findall(wanted)]
    now = [float(n.replace("−", "-")) for n in match.groups()]
    return all(abs(a - b) <= TOLERANCE * max(abs(a), abs(b)) for a, b in zip(numbers, now, strict=True))


def _form(wanted: str) -> re.Pattern[str]:
    """Return the form of a line: any numbers in the place of its numbers."""
    pieces = re.split(f"({NUMBER.pattern}|…)", wanted)
    made = [
        ".*?" if p == "…" else f"({NUMBER.pattern})" if NUMBER.fullmatch(p) else re.escape(p) for p in pieces
    ]
    return re.compile("".join(made))


def renewed(shown: str, printed: str) -> str:
    """Return a text block with the numbers that were printed now."""
    rest = [" ".join(line.split()) for line in printed.splitlines()]
    lines = []
    for wanted in shown.splitlines():
        form = _form(" ".join(wanted.split()))
        found = next(((k, m) for k, line in enumerate(rest) if (m := form.fullmatch(line))), None)
        if found is not None:
            now = iter(found[1].groups())
            wanted = NUMBER.sub(lambda _, now=now: next(now), wanted)
            rest = rest[found[0] + 1 :]
        lines.append(wanted)
    return "\n".join(lines) + "\n"


def run_page(page: Path, folder: Path, *, write: bool = False) -> list[str]:
    """Run the blocks of a page; returns what differs from what it shows."""
    text = page.read_text(encoding="utf-8")
    printed, wrong, changes = "", [], []
    for block in blocks(text):
        if block.kind != "text" or block.file:
            printed = carried_out(block, folder)
            continue
        wrong += [f"{page.name}: {each}" for each in differences(block.text, printed)]
        changes.append((block, renewed(block.text, printed)))
    for image in IMAGE.finditer(text):
        if not (folder / image["made"]).is_file():
            wrong.append(f"{page.name}: {image['made']} was not written")
        elif write:
            (FOLDER / image["shown"]).parent.mkdir(exist_ok=True)
            shutil.copyfile(folder / image["made"], FOLDER / image["shown"])
    if write:
        for block, new in reversed(changes):
            text = text[: block.start] + new + text[block.end :]
        page.write_text(text, encoding="utf-8")
        _, wrong = None, [each for each in wrong if "no such line" in each or "was not written" in each]
    return wrong


def notebook() -> str:
    """Return all pages as one notebook (format 4.5), as text."""
    cells: list[Mapping[str, object]] = [_cell("code", START)]
    for page in pages():
        text, begin = page.read_text(encoding="utf-8"), 0
        for each in FENCE.finditer(text):
            if each["kind"] == "text" and not each["file"]:
                continue
            cells += _words(text[begin : each.start()])
            (block,) = blocks(each[0])
            cells.append(_cell("code", _code(block)))
            begin = each.end()
        cells += _words(text[begin:])
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"  # type: ignore[index]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


START = """# Written from the pages of this folder; change those. All files are made in a new folder.
import os, pathlib, sys

pathlib.Path("finger").mkdir(exist_ok=True)
os.chdir("finger")
os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]"""


def _code(block: Block) -> str:
    if block.file:
        return f"%%writefile {block.file}\n{block.text}".rstrip("\n")
    if block.kind == "python":
        return block.text.rstrip("\n")
    return "\n".join("!" + " ".join(line.split()) for line in block.commands)


def _words(text: str) -> list[Mapping[str, object]]:
    """Return the cell of a piece of prose; none where there is none."""
    shown = re.sub(r"(?<=\))<!-- from .*? -->", "", text)
    shown = re.sub(r"^```text\n.*?^```$\n?", "", shown, flags=re.MULTILINE | re.DOTALL)
    return [_cell("markdown", shown.strip())] if shown.strip() else []


def _cell(kind: str, text: str) -> dict[str, object]:
    more: dict[str, object] = {"execution_count": None, "outputs": []} if kind == "code" else {}
    return {"cell_type": kind, "id": "", "metadata": {}, **more, "source": text.splitlines(keepends=True)}


def main() -> int:
    """Run all pages in an empty folder; print what differs and how long it took."""
    options = argparse.ArgumentParser()
    options.add_argument("--write", action="store_true", help="Write numbers, figures and the notebook anew.")
    options.add_argument("--folder", type=Path, help="Empty folder to run in, which is kept.")
    given = options.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for page in pages():
            begin, used = time.monotonic(), sum(os.times()[2:4])
            wrong += run_page(page, folder, write=given.write)
            spent = sum(os.times()[2:4]) - used
            print(f"{page.name}: {time.monotonic() - begin:.1f} s, {spent:.1f} s of processor", flush=True)
    if given.write:
        (FOLDER / NOTEBOOK).write_text(notebook(), encoding="utf-8")
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
