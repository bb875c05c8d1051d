"""Pages of the commands, made from the program itself."""

from __future__ import annotations

import inspect
import re
from html import escape
from pathlib import Path
from typing import Any

import click

from nlsdesign.cli.main import program

from . import markup


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return one page for each top command and one that lists them.

    Parameters
    ----------
    root, folder
        Of the project and of the staged sources; not needed here.
    """
    top = {name: command for name, command in sorted(program.commands.items())}
    made = {f"reference/commands/{name}.md": _page(name, command) for name, command in top.items()}
    rows = [
        [
            f'<a href="{path[1]}.html#{_place(path)}"><code>{" ".join(path)}</code></a>',
            escape(command.get_short_help_str(200)),
        ]
        for name, each in top.items()
        for path, command in _tree(("nlsdesign", name), each)
    ]
    entries = "\n".join(top)
    made["reference/commands/index.md"] = (
        "# Commands\n\nMade from the program, as `--help` shows them. Exit status 0: done; 1: a finding; "
        "2: bad input, one message; 130: interrupted.\n\n"
        + markup.table(("command", "what it does"), rows, caption="All commands")
        + f"```{{toctree}}\n:hidden:\n\n{entries}\n```\n"
    )
    return made


def _tree(path: tuple[str, ...], command: click.Command) -> list[tuple[tuple[str, ...], click.Command]]:
    inner = sorted(command.commands.items()) if isinstance(command, click.Group) else []
    return [(path, command), *(row for name, each in inner for row in _tree((*path, name), each))]


def _place(path: tuple[str, ...]) -> str:
    return "-".join(path)


def _page(name: str, command: click.Command) -> str:
    return f"# nlsdesign {name}\n\n" + "".join(
        _command(path, each) for path, each in _tree(("nlsdesign", name), command)
    )


def _command(path: tuple[str, ...], command: click.Command) -> str:
    context = click.Context(command, info_name=" ".join(path))
    heading = f"## {' '.join(path)}\n\n" if len(path) > 2 else ""
    usage = " ".join([" ".join(path), *command.collect_usage_pieces(context)])
    text = markup.anchor(_place(path)) + heading + markup.code(usage, "text") + _help(command.help or "")
    rows = [_row(each, context) for each in command.get_params(context)]
    rows = [row for row in rows if row]
    if rows:
        caption = f"Arguments and options of {' '.join(path)}"
        text += markup.table(("argument", "default", "meaning"), rows, caption=caption)
    shown = _examples(command.epilog or "")
    return text + (("<p>Examples</p>\n\n" + markup.code(shown, "console")) if shown else "")


def _help(text: str) -> str:
    shown = []
    for paragraph in inspect.cleandoc(text).split("\n\n"):
        if paragraph.startswith("\b"):
            shown.append(markup.code(paragraph.removeprefix("\b"), "text"))
        else:
            shown.append(f"<p>{markup.inline(' '.join(paragraph.split()))}</p>\n\n")
    return "".join(shown)


def _examples(epilog: str) -> str:
    lines = [line.strip() for line in epilog.replace("\b", "").splitlines()]
    return "\n".join(line for line in lines if line and not re.fullmatch(r"Examples?:", line))


def _row(parameter: click.Parameter, context: click.Context) -> list[str]:
    metavar = parameter.make_metavar(context)
    if isinstance(parameter, click.Argument):
        return [f"<code>{escape(metavar)}</code>", "" if not parameter.required else "required", ""]
    assert isinstance(parameter, click.Option)
    names = ", ".join([*parameter.opts, *parameter.secondary_opts])
    if isinstance(parameter.type, click.Choice):
        metavar = "CHOICE"
    shown = names if parameter.is_flag else f"{names} {metavar}"
    if parameter.hidden or "--help" in parameter.opts:
        return []
    help_text = markup.inline(" ".join((parameter.help or "").split()))
    choices = ""
    if isinstance(parameter.type, click.Choice):
        choices = (
            " One of " + ", ".join(f"<code>{escape(str(c))}</code>" for c in parameter.type.choices) + "."
        )
    return [f"<code>{escape(shown)}</code>", _default(parameter, context), help_text + choices]


def _default(parameter: click.Option, context: click.Context) -> str:
    if parameter.required:
        return "required"
    value: Any = parameter.get_default(context, call=False)
    if (
        parameter.is_flag
        or value is None
        or callable(value)
        or value in ((), [], "")
        or "UNSET" in repr(value).upper()
    ):
        return ""
    if isinstance(value, tuple | list):
        value = " ".join(str(each) for each in value)
    return f"<code>{escape(str(value))}</code>"
