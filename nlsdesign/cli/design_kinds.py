"""What a design can be asked for: targets, limits and goals with their fields, as in a design file."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any

import click

from .output import show_json, show_table

KINDS = ("targets", "limits", "goals")
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*)\n(?P<text>(?:[ ]{4}.*\n?|\n(?=[ ]{4}))+)", re.MULTILINE)

_MARKED = re.compile(r":\w+:`~?([^`]+)`")


def show_kinds(what: str, as_json: bool) -> None:
    """Print the targets, limits or goals that a design file can name."""
    known = design_kinds(what)
    if as_json:
        show_json(known)
        return
    rows = []
    for name, content in known.items():
        rows.append((name, "", "", content["meaning"]))
        for field, about in content["fields"].items():
            rows.append(("", field, str(about["default"]) if about["optional"] else "", about["meaning"]))
    show_table(f"{what.capitalize()} of a design", ("name", "field", "default", "meaning"), rows)
    option = {"targets": "--target", "limits": "--limit", "goals": "--goal"}[what]
    table = "target" if what == "targets" else what
    click.echo(
        f"on the command line: {option} 'NAME = {{field = \"number unit\", ...}}'; in a design file the same "
        f"line stands below [{table}]"
    )


def design_kinds(what: str) -> dict[str, dict[str, Any]]:
    """Return meaning and fields of what a design file can name, by name."""
    from ..design import Goal, Limit, Target, TaskTarget
    from ..design.jobs.job_file import kinds

    base: type = {"targets": Target, "limits": Limit, "goals": Goal}[what]
    known = kinds(base) | ({"TaskTarget": TaskTarget} if what == "targets" else {})
    return {
        name: {"meaning": _summary(kind), "fields": _fields(kind)} for name, kind in sorted(known.items())
    }


def _summary(kind: type) -> str:
    return _plain((inspect.getdoc(kind) or "").split("\n\n")[0])


def _plain(text: str) -> str:
    """Return a text of a docstring on one line, without marks."""
    return " ".join(_MARKED.sub(lambda each: each[1].rpartition(".")[2], text).replace("``", "").split())


def _fields(kind: type) -> dict[str, dict[str, Any]]:
    meanings: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        meanings |= _documented(each)
    result = {}
    for field in dataclasses.fields(kind):
        if not field.init:
            continue
        given, made = field.default, field.default_factory
        optional = given is not dataclasses.MISSING or made is not dataclasses.MISSING
        default = given if given is not dataclasses.MISSING else "as declared" if optional else None
        plain = default if isinstance(default, (int, float, str, type(None))) else str(default)
        result[field.name] = {
            "meaning": meanings.get(field.name, ""), "optional": optional, "default": plain,
        }  # fmt: skip
    return result


def _documented(kind: type) -> dict[str, str]:
    """Return what the docstring of a class says of its parameters."""
    text = inspect.cleandoc(kind.__dict__.get("__doc__") or "")
    _, mark, section = text.partition("Parameters\n----------\n")
    section = re.split(r"\n\n(?=\w[\w ]*\n-{3,})", section)[0] + "\n"
    meanings = {}
    for match in _FIELD.finditer(section) if mark else ():
        for name in match["names"].split(", "):
            meanings[name] = _plain(match["text"])
    return meanings
