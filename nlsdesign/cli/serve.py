"""``nlsdesign serve``: the live page, on which a design follows the mouse."""

from __future__ import annotations

from pathlib import Path

import click

from .options import json_option
from .output import examples, show_json


@click.command(
    epilog=examples(
        "nlsdesign serve",
        "nlsdesign serve austin2015_figure_consistent --no-browser",
        "nlsdesign serve my.toml --port 8123 --no-browser --json",
    )
)
@click.argument("deck_name", metavar="[DECK]", default="")
@click.option("--host", default="127.0.0.1", show_default=True, help="Loopback address to listen at.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, show_default=True,
              help="Port to listen at; 0 takes a free one.")  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Only print the address, open no browser.")
@json_option
@click.pass_context
def serve(
    context: click.Context, /, deck_name: str, host: str, port: int, no_browser: bool, as_json: bool
) -> None:
    """Serve a page on which a design follows the mouse. To this machine only, until interrupted.

    DECK is a file, or the name of a deck or template that comes with the project; without it the page begins
    with a template. The address holds a random token, without which nothing is answered.
    """
    from ..live import serve as run

    if deck_name:
        deck_name = _checked(deck_name)

    def ready(address: str) -> None:
        if as_json:
            show_json({"address": address})
        else:
            click.echo(f"The live page is at {address}\nCtrl-C ends it.")
        if not no_browser:
            click.launch(address)

    packages = tuple(context.find_root().params.get("packages", ()))
    run(deck_name, host=host, port=port, packages=packages, ready=ready)


def _checked(name: str) -> str:
    """Return a name that the page can begin with.

    A deck that cannot be read ends the command, not the page. What comes with the project is not read here:
    that takes libraries for which the page would have to wait.
    """
    from ..foundation.deck import deck_names, load_deck, template_names
    from ..foundation.errors import unknown_name

    bundled = (*deck_names(), *template_names())
    if name in bundled:
        return name
    if not name.endswith(".toml") and not Path(name).is_dir():
        raise unknown_name("deck", name, bundled)
    deck = load_deck(name)
    from ..components import declare

    declare(deck)
    return str(Path(name).resolve())
