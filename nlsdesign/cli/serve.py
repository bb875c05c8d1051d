"""``nlsdesign serve``: the live page, on which a design follows the mouse."""

from __future__ import annotations

from pathlib import Path

import click

from .output import DECK_HELP, examples, json_option, show_json


@click.command(
    epilog=examples(
        "nlsdesign serve",
        "nlsdesign serve austin2015_soft_spring --no-browser",
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
    """Serve a page on which a design follows the mouse, to this machine only, until interrupted.

    DECK is a file, or the name of one that comes with the project; without it the page begins with its
    gallery. The address holds a random token, without which nothing is answered.
    """
    from ..live.server import serve as run

    if deck_name:
        from ..components.assembly.deck_writer import declare
        from ..deck import load_deck

        declare(load_deck(deck_name))  # a deck that cannot be read ends the command, not the page
        if Path(deck_name).exists():
            deck_name = str(Path(deck_name).resolve())

    def ready(address: str) -> None:
        if as_json:
            show_json({"address": address})
        else:
            click.echo(f"The live page is at {address}\nCtrl-C ends it.")
        if not no_browser:
            click.launch(address)

    packages = tuple(context.find_root().params.get("packages", ()))
    run(deck_name, host=host, port=port, packages=packages, ready=ready)
