"""Output of commands: a short table for people, JSON for scripts."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table.

    Parameters
    ----------
    title
        Heading.
    columns
        Headings of the columns.
    rows
        Text of the cells.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", header_style="bold", box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*row)
    # A piped table is not wrapped at 80 columns.
    width = None if Console().is_terminal else 160
    Console(highlight=False, markup=False, width=width).print(table)


def show_json(content: Mapping[str, Any]) -> None:
    """Print a mapping as JSON.

    Parameters
    ----------
    content
        Numbers, texts and lists by name.
    """
    click.echo(json.dumps(content, indent=2, ensure_ascii=False, default=_plain))


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


def examples(*lines: str) -> str:
    """Return the epilog of a help text that shows commands, each on its line.

    Parameters
    ----------
    lines
        Whole commands, as they are typed.
    """
    # Click fills paragraphs anew unless they begin with this mark.
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


def out_option(default: str = "out") -> Callable[[F], F]:
    """Return the option ``--out``.

    Parameters
    ----------
    default
        Folder if none is given.
    """
    kind = click.Path(path_type=Path, file_okay=False)
    text = "Folder for all files that are written."
    return click.option(
        "--out", type=kind, default=default, show_default=True, help=text, callback=_can_be_made
    )


def _can_be_made(_: click.Context, __: click.Parameter, folder: Path) -> Path:
    """Refuse, before any work, a folder that could not be written into; it is made with its first file."""
    try:
        place = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    except OSError as error:
        raise click.BadParameter(f"{folder} cannot be made: {error.strerror}") from None
    if not place.is_dir():
        raise click.BadParameter(f"{folder} cannot be made: {place} is a file")
    if not os.access(place, os.W_OK | os.X_OK):
        raise click.BadParameter(f"{folder} cannot be made: {place} is not writable")
    return folder


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
