"""``nlsdesign export check``: whether the files in a folder belong together, and to a deck."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from .named_paths import NamedPath
from .output import DECK_HELP, examples, json_option, show_json, show_table

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
    from ..export import read_exports
    from ..foundation.deck import load_deck

    exports = read_exports(folder, reference=deck_digest(declare(load_deck(deck_name))) if deck_name else "")
    status = UNREADABLE if exports.problems else TOGETHER if exports.together else APART
    judged = [(str(file.path.relative_to(folder)), file, why)
              for file, why in zip(exports.files, exports.apart, strict=True)]  # fmt: skip
    if as_json:
        rows = [{**asdict(file), "path": path, "belongs": not why, "why": why} for path, file, why in judged]
        show_json({"folder": folder, "deck": exports.reference, "status": status,
                   "together": exports.together, "files": rows,
                   "unreadable": [str(problem) for problem in exports.problems]})  # fmt: skip
        return status
    if judged:
        show_table(
            str(folder),
            ("file", "kind", "deck", "digest", "state"),
            [(path, file.kind, file.deck, file.short, why or "belongs") for path, file, why in judged],
        )
    for sentence in exports.findings():
        click.echo(sentence)
    return status
