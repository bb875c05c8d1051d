"""``nlsdesign observer --certificate`` and ``observer verify``: what is proved, and checked again."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .named_paths import NamedPath
from .output import examples, json_option, show_json
from .units import Number

CERTIFICATE = "certificate.json"
"""File that is announced; the library is not loaded for it."""


def range_options(command: Any) -> Any:
    """Add the options for the ranges over which a bound on the torque is to hold.

    ``command``: gets ``angles``, ``speed`` and ``angle_error``; ``None`` where they are not given.
    """
    for option in (
        click.option("--angle-error", type=Number("rad"), help="Largest error of the measured angle; half a "
                     "count of the deck's encoder by default."),
        click.option("--speed", type=Number("rad/s"), help="Largest speed; 20 rad/s by default."),
        click.option("--angles", type=Number("rad"), nargs=2, metavar="LOW HIGH", help="Range of the angle, "
                     "such as --angles '-46 deg' '46 deg'; the whole table by default."),
    ):  # fmt: skip
        command = option(command)
    return command


def given_ranges(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the ranges that were given."""
    named = {name: options[name] for name in ("angles", "speed", "angle_error")}
    return {name: value for name, value in named.items() if value is not None}


@click.command(
    "verify",
    epilog=examples(
        "nlsdesign observer verify out/observer/certificate.json",
        "nlsdesign observer verify out/observer/certificate.json --deck my.toml --c out/observer --json",
    ),
)
@click.argument("certificate", type=NamedPath(dir_okay=False, example="out/observer/certificate.json"))
@click.option("--deck", "deck_name", metavar="DECK", help="Deck that should be the certified one.")
@click.option(
    "--c",
    "code",
    type=NamedPath(file_okay=False),
    help="Folder of the C files; they are written anew from the deck and compared.",
)
@json_option
def verify_certificate(certificate: Path, deck_name: str | None, code: Path | None, as_json: bool) -> None:
    """Check a certificate again, without the solver; exit status 1 where it does not hold."""
    from ..components.assembly.deck_writer import declare
    from ..export import export_c
    from ..feedback.observer import CodeToCompare, read_certificate, verify
    from ..foundation.deck import load_deck, read_deck
    from ..model import flatten

    proved, untouched = read_certificate(certificate)
    given = load_deck(deck_name).path.read_text(encoding="utf-8-sig") if deck_name else None
    name, text = proved.deck
    model = flatten(declare(read_deck(text, Path(f"{name}.toml")))) if text else None
    result = verify(
        proved, untouched=untouched, model=model, deck=given,
        code=None if code is None else CodeToCompare(code, export_c),
    )  # fmt: skip
    if as_json:
        checks = [{"name": c.name, "holds": c.holds, "detail": c.detail} for c in result.checks]
        show_json({"holds": result.holds, "statement": list(proved.statement), "checks": checks})
    else:
        for sentence in proved.statement:
            click.echo(sentence)
        click.echo(str(result))
        click.echo("the certificate holds" if result.holds else "the certificate DOES NOT HOLD")
    if not result.holds:
        sys.exit(1)
