"""``nlsdesign deck``: check and show decks."""

from __future__ import annotations

import sys

import click

from ..components.declare import deck_problems, declare
from ..deck import deck_names, load_deck
from ..quantity import Quantity, sources
from .output import json_option, show_json, show_table


@click.group()
def deck() -> None:
    """Check and show decks: every number with value, unit, source and spread."""


@deck.command("list")
def list_decks() -> None:
    """List the decks that come with the project."""
    show_table("Decks", ("name", "description"), [(n, load_deck(n).description) for n in deck_names()])


@deck.command()
@click.argument("deck_name", metavar="DECK")
@json_option
def check(deck_name: str, as_json: bool) -> None:
    """Name every problem with line and column, and the share of numbers that are only assumed."""
    read = load_deck(deck_name)
    problems = deck_problems(read)
    if problems:
        for problem in problems:
            click.echo(f"error: {problem}", err=True)
        sys.exit(2)
    shares = sources(declare(read).quantities())
    if as_json:
        show_json({"deck": read.name, "numbers": len(declare(read).quantities()), **shares})
        return
    click.echo(f"{read.path.name}: no problem in {len(declare(read).quantities())} numbers, "
               f"{100 * shares['assumed']:.0f} % of them only assumed")  # fmt: skip


@deck.command()
@click.argument("deck_name", metavar="DECK")
@json_option
def show(deck_name: str, as_json: bool) -> None:
    """Draw the parts and list the numbers."""
    assembly = declare(load_deck(deck_name))
    numbers = assembly.quantities()
    if as_json:
        show_json(
            {
                n: {"value": q.value, "unit": q.unit, "source": q.source, "spread": q.spread}
                for n, q in numbers.items()
            }
        )
        return
    click.echo(str(assembly) + "\n")
    rows = [
        (n, _short(q), f"± {100 * q.spread:.0f} %" if q.spread else "", q.source) for n, q in numbers.items()
    ]
    show_table("Numbers", ("name", "value", "spread", "source"), rows)


def _short(given: Quantity) -> str:
    return str(given) if len(given.values) < 8 else f"{len(given.values)} numbers in {given.unit}"
