"""``nlsdesign deck``: begin, copy, check and show decks."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation.deck import (
    commands_named_in,
    deck_names,
    load_deck,
    read_deck,
    template_names,
    template_text,
)
from ..foundation.errors import NlsError
from ..foundation.locations import bundled
from ..foundation.quantity import sources, with_unit
from ..foundation.text_files import write_text
from .deck_new import force_option, new, refuse_to_replace, shown_command
from .options import json_option, machine_of
from .output import examples, line_width, next_command, show_json, show_table
from .overwriting import out_file_option
from .typed_values import NamedPath

if TYPE_CHECKING:
    from ..components import Assembly

_file = NamedPath(dir_okay=False, exists=True)
_LONG_ROW = 8
"""Numbers of a row from which they are counted and not listed."""


@click.group()
def deck() -> None:
    """Begin, copy, check and show decks. A deck gives value, unit, source and spread of each number."""


deck.add_command(new)


@deck.command("list", epilog=examples("nlsdesign deck list", "nlsdesign deck list --json"))
@json_option
def list_decks(as_json: bool) -> None:
    """List decks of the project and templates of `deck new`."""
    decks = {name: load_deck(name) for name in deck_names()}
    texts = {name: template_text(name) for name in template_names()}
    templates = {name: read_deck(text, Path(f"{name}.toml")) for name, text in texts.items()}
    if as_json:
        show_json({
            "decks": {n: {"description": d.description, "file": d.path} for n, d in decks.items()},
            "templates": {
                n: {"description": t.description, "ready_for": commands_named_in(texts[n])}
                for n, t in templates.items()
            },
        })  # fmt: skip
        return
    show_table("Decks", ("name", "description"), [(n, d.description) for n, d in decks.items()])
    rows = [(n, t.description) for n, t in templates.items()]
    show_table("Templates, for nlsdesign deck new --template", ("name", "description"), rows)


@deck.command("copy", epilog=examples("nlsdesign deck copy austin2015_figure_consistent leg.toml"))
@click.argument("deck_name", metavar="DECK")
@click.argument("out", metavar="OUT.TOML", type=NamedPath(dir_okay=False, example="leg.toml"))
@force_option
@json_option
def copy_deck(deck_name: str, out: Path, force: bool, as_json: bool) -> None:
    """Copy a deck into a file of one's own. It may be one that comes with the project; comments are kept."""
    read = load_deck(deck_name)
    if out.suffix != ".toml":
        raise click.BadParameter(f"'{out}' does not end with .toml", param_hint="OUT.TOML")
    refuse_to_replace(out, force)
    write_text(out, read.path.read_text(encoding="utf-8-sig"))
    if as_json:
        show_json({"file": out, "deck": read.name})
        return
    click.echo(f"written: {out}; next: {next_command('deck', 'check', out)}")


@deck.command(
    epilog=examples(
        "nlsdesign deck check austin2015_figure_consistent", "nlsdesign deck check my.toml --json"
    )
)
@click.argument("deck_name", metavar="DECK")
@json_option
def check(deck_name: str, as_json: bool) -> None:
    """Name problems, likely slips and the commands it is ready for. Problems have line and column.

    Exit status 2 if the deck has a problem; a command that it is not ready for, or a warning, is none.
    """
    from ..components import deck_digest, deck_problems, deck_remarks, declare
    from ..regeneration import range_remarks, readiness

    read = load_deck(deck_name)
    problems = deck_problems(read) or _model_problems(machine := declare(read))
    if problems:
        for problem in problems:
            click.echo(f"error: {problem}", err=True)
        sys.exit(2)
    shares, commands = sources(machine.quantities()), readiness(machine)
    remarks = [*deck_remarks(machine), *range_remarks(machine)]
    if as_json:
        show_json({
            "deck": read.name, "digest": deck_digest(machine), "numbers": len(machine.quantities()), **shares,
            "warnings": remarks,
            "commands": {
                each.command: {"ready": each.ready, "reason": str(each.reason) if each.reason else None}
                for each in commands
            },
        })  # fmt: skip
        return
    click.echo(f"{read.path.name}: no problem in {len(machine.quantities())} numbers, "
               f"{100 * shares['assumed']:.0f} % of them only assumed")  # fmt: skip
    for remark in remarks:
        click.echo(f"warning: {remark}")
    ready = [shown_command(each.command) for each in commands if each.ready]
    click.echo(f"ready for: {', '.join(ready) or 'no command'}")
    reasons: dict[str, list[str]] = {}
    for each in commands:
        if not each.ready:
            reasons.setdefault(str(each.reason), []).append(each.command)
    if reasons:
        rows = [(", ".join(names), reason) for reason, names in reasons.items()]
        show_table("Not ready for", ("command", "why, and what to do"), rows)


def _model_problems(assembly: Assembly) -> list[NlsError]:
    """Return what shows only when the equations are written, such as a sensor of a missing signal."""
    from ..model import flatten

    try:
        flatten(assembly)
    except NlsError as error:
        return [error]
    return []


@deck.command(epilog=examples("nlsdesign deck show my.toml", "nlsdesign deck show my.toml --toml"))
@click.argument("deck_name", metavar="DECK")
@click.option("--toml", "as_toml", is_flag=True, help="Print the file as it stands, with its comments.")
@json_option
def show(deck_name: str, as_toml: bool, as_json: bool) -> None:
    """Draw the parts and list the numbers."""
    if as_toml:
        if as_json:
            raise click.UsageError("--toml and --json exclude each other; give one")
        click.echo(load_deck(deck_name).path.read_text(encoding="utf-8-sig"), nl=False)
        return
    from ..components import draw

    assembly = machine_of(deck_name)
    numbers = assembly.quantities()
    if as_json:
        show_json(
            {
                n: {"value": q.value, "unit": q.unit, "source": q.source, "spread": q.spread_data}
                for n, q in numbers.items()
            }
        )
        return
    title = f"{assembly.name}: {assembly.description}".rstrip(": ")
    click.echo(draw(title, assembly.parts, width=line_width()) + "\n")
    rows = []
    for name, given in numbers.items():
        row = with_unit(f"{len(given.values)} numbers in", given.unit)
        shown = str(given) if len(given.values) < _LONG_ROW else row
        rows.append((name, shown, given.spread_text, given.source))
    show_table("Numbers", ("name", "value", "spread", "source"), rows)


@deck.command("from-rig", epilog=examples("nlsdesign deck from-rig rig.toml cam.csv --out my_rig.toml"))
@click.argument("rig_toml", metavar="RIG.TOML", type=_file)
@click.argument("cam_csv", metavar="CAM.CSV", type=_file)
@out_file_option(None, "Deck to write.")
@json_option
def from_rig(rig_toml: Path, cam_csv: Path, out: Path, as_json: bool) -> None:
    """Write the deck of a practice rig. It is made from the declared numbers and a table of the cam."""
    from ..components import write_deck

    assembly = bundled("models", "test_rig").test_rig_deck(rig_toml, cam_csv)
    write_deck(assembly, out)
    numbers = len(assembly.quantities())
    if as_json:
        show_json({"file": out, "numbers": numbers})
        return
    following = next_command("diagnose", "--deck", out, "--records", "FOLDER")
    click.echo(f"written: {out}, {numbers} numbers; next: {following}")
