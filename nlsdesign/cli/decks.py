"""``nlsdesign deck``: check and show decks."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..deck import deck_names, load_deck
from ..errors import NlsError
from ..locations import bundled
from ..quantity import Quantity, sources, with_unit
from .output import examples, json_option, show_json, show_table
from .overwriting import out_file_option

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly

_file = click.Path(path_type=Path, dir_okay=False, exists=True)


@click.group()
def deck() -> None:
    """Check and show decks: every number with value, unit, source and spread."""


@deck.command("list", epilog=examples("nlsdesign deck list", "nlsdesign deck list --json"))
@json_option
def list_decks(as_json: bool) -> None:
    """List the decks that come with the project."""
    rows = [(n, load_deck(n).description) for n in deck_names()]
    if as_json:
        show_json(dict(rows))
        return
    show_table("Decks", ("name", "description"), rows)


@deck.command(
    epilog=examples(
        "nlsdesign deck check austin2015_figure_consistent", "nlsdesign deck check my.toml --json"
    )
)
@click.argument("deck_name", metavar="DECK")
@json_option
def check(deck_name: str, as_json: bool) -> None:
    """Name every problem with line and column, and the share of numbers that are only assumed."""
    from ..components.assembly.deck_writer import deck_problems, declare

    read = load_deck(deck_name)
    problems = deck_problems(read) or _model_problems(declare(read))
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


def _model_problems(assembly: Assembly) -> list[NlsError]:
    """Return what shows only when the equations are written, such as a sensor of a missing signal."""
    from ..model import flatten

    try:
        flatten(assembly)
    except NlsError as error:
        return [error]
    return []


@deck.command(
    epilog=examples("nlsdesign deck show austin2015_figure_consistent", "nlsdesign deck show my.toml --json")
)
@click.argument("deck_name", metavar="DECK")
@json_option
def show(deck_name: str, as_json: bool) -> None:
    """Draw the parts and list the numbers."""
    from ..components.assembly.deck_writer import declare

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


@deck.command("from-rig", epilog=examples("nlsdesign deck from-rig rig.toml cam.csv --out my_rig.toml"))
@click.argument("rig_toml", metavar="RIG.TOML", type=_file)
@click.argument("cam_csv", metavar="CAM.CSV", type=_file)
@out_file_option(None, "Deck to write.")
@json_option
def from_rig(rig_toml: Path, cam_csv: Path, out: Path, as_json: bool) -> None:
    """Write the deck of a practice rig from what its makers declare: numbers, and a table of the cam."""
    from ..components.assembly.deck_writer import write_deck

    assembly = bundled("models", "test_rig").test_rig_deck(rig_toml, cam_csv)
    write_deck(assembly, out)
    numbers = len(assembly.quantities())
    if as_json:
        show_json({"file": out, "numbers": numbers})
        return
    click.echo(f"written: {out}, {numbers} numbers; next: nlsdesign diagnose --deck {out}")


def _short(given: Quantity) -> str:
    return str(given) if len(given.values) < 8 else with_unit(f"{len(given.values)} numbers in", given.unit)
