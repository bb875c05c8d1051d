"""``nlsdesign export check``: whether the files in a folder belong together, and to a deck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .named_paths import NamedPath
from .output import DECK_HELP, examples, json_option, show_json, show_table

if TYPE_CHECKING:
    from .exported_files import ExportedFile

TOGETHER, APART, UNREADABLE = 0, 1, 2
"""Exit status."""


@click.command(
    "check",
    epilog=examples(
        "nlsdesign export check out/fmu",
        "nlsdesign export check out/c --deck austin2015_figure_consistent --json",
    ),
)
@click.argument("folder", type=NamedPath(example="out/c"))
@click.option("--deck", "deck_name", default=None, metavar="DECK", help=DECK_HELP)
@json_option
def check_exports(folder: Path, deck_name: str | None, as_json: bool) -> int:
    """Say whether C files, Modelica texts, FMUs and decks in a folder belong together, and to a deck.

    Exit status 0 if all do and none was edited, 1 if not, 2 if a file cannot be read.
    """
    from ..components.assembly.deck_writer import deck_digest, declare
    from ..foundation.deck import load_deck
    from ..foundation.errors import ExportError
    from .exported_files import exported_files

    reference = deck_digest(declare(load_deck(deck_name))) if deck_name else ""
    files, problems = exported_files(folder)
    if not files and not problems:
        raise ExportError(str(folder), "holds no C file, Modelica text, FMU or deck of this package")
    apart = _apart(files, reference)
    status = UNREADABLE if problems else APART if any(apart) else TOGETHER
    sentences = [*map(str, problems), *_relations(files), _verdict(files, reference, status, any(apart))]
    if as_json:
        show_json(_content(folder, reference, files, apart, status) | {"unreadable": [*map(str, problems)]})
        return status
    rows = [
        (str(each.path.relative_to(folder)), each.kind, each.deck, each.short, state or "belongs")
        for each, state in zip(files, apart, strict=True)
    ]
    if rows:
        show_table(str(folder), ("file", "kind", "deck", "digest", "state"), rows)
    for sentence in sentences:
        click.echo(sentence)
    return status


def _apart(files: Sequence[ExportedFile], reference: str) -> list[str]:
    """Return for each file why it does not belong, empty where it does."""
    groups = {each.short for each in files}
    wanted = reference or (files[0].digest if len(groups) == 1 else "")
    return [(each.edited and f"edited: {each.edited}") or _foreign(each, wanted) for each in files]


def _foreign(file: ExportedFile, wanted: str) -> str:
    if not file.digest:
        return "names no deck"
    if not wanted:
        return "one of several decks"
    # Some files have the first digits of a digest only.
    same = wanted.startswith(file.digest) or file.digest.startswith(wanted)
    return "" if same else "another deck"


def _relations(files: Sequence[ExportedFile]) -> list[str]:
    """Return sentences on decks that were made from one another."""
    names = {each.short: each.deck for each in files if each.deck}
    pairs = {(each.short, each.parent[:12]) for each in files if each.parent[:12] in names}
    return [f"{names.get(new, new)} was made from {names[old]}." for new, old in sorted(pairs)]


def _verdict(files: Sequence[ExportedFile], reference: str, status: int, apart: bool) -> str:
    decks = len({each.short for each in files})
    if not apart:
        which = f"the deck {reference[:12]}" if reference else f"one deck, {files[0].short}" if files else ""
        all_ = f"All {len(files)} files that can be read" if status else f"All {len(files)} files"
        return f"{all_} belong to {which}." if files else "Nothing could be read."
    words = f"to the deck {reference[:12]}" if reference else "together"
    count = f"; they are of {decks} decks" if decks > 1 else ""
    return f"Not all of {len(files)} files belong {words}{count}."


def _content(
    folder: Path, reference: str, files: Sequence[ExportedFile], apart: Sequence[str], status: int
) -> dict[str, Any]:
    rows = [
        {**asdict(each), "path": str(each.path.relative_to(folder)), "belongs": not why, "why": why}
        for each, why in zip(files, apart, strict=True)
    ]
    return {"folder": folder, "deck": reference, "status": status, "together": status == TOGETHER,
            "files": rows}  # fmt: skip
