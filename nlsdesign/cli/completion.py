"""``nlsdesign completion``: the script by which a shell completes commands, decks, materials and studies."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from typing import Any

import click
from click.shell_completion import CompletionItem, ShellComplete, get_completion_class

from ..foundation.deck import deck_names, template_names
from ..foundation.locations import folder
from .options import json_option
from .output import examples, show_json
from .studies import study_names

INSTALL = {
    "bash": "nlsdesign completion bash > ~/.local/share/bash-completion/completions/nlsdesign",
    "zsh": "nlsdesign completion zsh > ~/.zfunc/_nlsdesign, with fpath+=~/.zfunc and autoload -Uz compinit; "
    "compinit in ~/.zshrc",
    "fish": "nlsdesign completion fish > ~/.config/fish/completions/nlsdesign.fish",
}
COMPLETE = "_NLSDESIGN_COMPLETE"
"""Variable by which a shell asks for completions, whatever the program is started by."""


@click.command(epilog=examples("nlsdesign completion bash", "nlsdesign completion zsh --json"))
@click.argument("shell", type=click.Choice(list(INSTALL)))
@json_option
@click.pass_context
def completion(context: click.Context, /, shell: str, as_json: bool) -> None:
    """Print the completion script of a shell. It completes commands, options, decks, materials, studies.

    A comment on top says where to put it; it takes effect in a new shell.
    """
    kind = get_completion_class(shell)
    assert kind is not None, "click knows each of these shells"
    # The class for bash asks the bash of this machine for its version; the script may be for another one.
    script = ShellComplete.source(kind(context.find_root().command, {}, "nlsdesign", COMPLETE))
    # The script for zsh is known by its first line.
    first, mark, rest = script.partition("\n") if script.startswith("#compdef") else ("", "", script)
    if as_json:
        show_json({"shell": shell, "install": INSTALL[shell], "script": script})
        return
    click.echo(f"{first}{mark}# To install: {INSTALL[shell]}\n{rest}")


def _materials() -> list[str]:
    with (folder("models") / "materials.toml").open("rb") as stream:
        return sorted(name for name, each in tomllib.load(stream).items() if isinstance(each, dict))


_NAMES: dict[str, tuple[Callable[[], list[str]], bool]] = {
    "DECK": (deck_names, True),
    "MATERIAL": (_materials, False),
    "STUDY": (lambda: study_names(), True),
    "TEMPLATE": (template_names, False),
}
"""What gives the names, and whether a file can be given as well, by the word that stands in a help text."""


def complete_names(program: click.Group) -> None:
    """Complete the names of decks, materials, studies and templates in all parameters of a program."""
    for command in _commands(program):
        for parameter in command.params:
            kind = (parameter.metavar or "").strip("[]")
            if parameter.name == "material":
                kind = "MATERIAL"
            if kind in _NAMES:
                parameter._custom_shell_complete = _completer(*_NAMES[kind])


def _commands(command: click.Command) -> Iterator[click.Command]:
    yield command
    for inner in getattr(command, "commands", {}).values():
        yield from _commands(inner)


def _completer(names: Callable[[], list[str]], files: bool) -> Any:
    def complete(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
        # The scripts begin anew at a mark for files, so that stands first.
        items = [CompletionItem(begun, type="file")] if files else []
        return items + [CompletionItem(name) for name in names() if name.startswith(begun)]

    return complete
