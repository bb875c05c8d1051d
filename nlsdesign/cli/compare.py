"""``nlsdesign compare``: folders of designs or diagnoses side by side on one page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError
from .options import json_option
from .output import examples, show_json, show_table
from .overwriting import out_option
from .typed_values import NamedPath

if TYPE_CHECKING:
    from ..presentation.report import ComparedResult

_SOURCES = ("design", "verdict")


@click.command(
    epilog=examples(
        "nlsdesign compare out/design_a out/design_b",
        "nlsdesign compare out/monday out/friday out/design/model.toml --out out/compared --json",
    )
)
@click.argument("results", nargs=-1, required=True, metavar="FOLDER...", type=NamedPath(example="out/design"))
@out_option("out/comparison", writes=("report.html", "comparison.json"))
@json_option
def compare(results: tuple[Path, ...], out: Path, as_json: bool) -> None:
    """Compare designs or diagnoses. Key figures, torque curves, errors, effects, numbers that differ.

    Each FOLDER is what `nlsdesign design` or `nlsdesign diagnose` wrote (model.toml with design.json or
    verdict.json), or a deck (a .toml file).
    """
    if len(results) < 2:
        raise click.UsageError("one result cannot be compared; name two folders or more")
    from ..foundation.text_files import write_text
    from ..presentation.report import differing_numbers, key_figures, write_comparison

    labels = _labels(results)
    compared = [_read(path, label) for path, label in zip(results, labels, strict=True)]
    figures, numbers = key_figures(compared), differing_numbers(compared)
    page = write_comparison(out / "report.html", compared)
    content: dict[str, Any] = {
        "results": dict(zip(labels, map(str, results), strict=True)),
        "key_figures": {name: dict(zip(labels, row, strict=True)) for name, row in figures.items()},
        "numbers_that_differ": {name: dict(zip(labels, row, strict=True)) for name, row in numbers.items()},
    }
    write_text(out / "comparison.json", json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    if as_json:
        show_json(content | {"files": [page, out / "comparison.json"]})
        return
    show_table("Side by side", ("", *labels), [(name, *row) for name, row in figures.items()])
    click.echo(f"{len(numbers)} numbers differ; they stand on the page")
    click.echo(f"report: {page}")


def _labels(paths: tuple[Path, ...]) -> list[str]:
    """Return the last steps of each path, as many as make them different."""
    steps = [path.absolute().parts for path in paths]
    for count in range(1, max(map(len, steps)) + 1):
        labels = ["/".join(each[-count:]) for each in steps]
        if len(set(labels)) == len(labels):
            return labels
    twice = next(path for path in paths if paths.count(path) > 1)
    raise NlsError(f"'{twice}'", "is named twice", next_step="name each result once")


def _read(path: Path, label: str) -> ComparedResult:
    """Read a folder or a deck."""
    from ..components import declare
    from ..foundation.deck import load_deck
    from ..model import flatten
    from ..presentation.report import ComparedResult

    if path.suffix == ".toml":
        deck, contents = path, {}
    else:
        deck = path / "model.toml"
        if not deck.is_file():
            raise NlsError(
                str(path), "holds no model.toml" if path.is_dir() else "is no folder",
                next_step="name a folder that nlsdesign design or diagnose wrote, or a deck (.toml)",
            )  # fmt: skip
        contents = {name: _content(path / f"{name}.json") for name in _SOURCES}
    assembly = declare(load_deck(deck))
    return ComparedResult(label, flatten(assembly), numbers=assembly.quantities(), **contents)


def _content(file: Path) -> dict[str, Any]:
    """Read a file of JSON; empty where there is none."""
    if not file.exists():
        return {}
    step = "write it again with nlsdesign design or diagnose"
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise NlsError(str(file), f"cannot be read as JSON: {error}", next_step=step) from None
    if not isinstance(content, dict):
        raise NlsError(str(file), "holds no names with values", next_step=step)
    return content
