"""Output of commands: a short table for people, JSON for scripts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click


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
