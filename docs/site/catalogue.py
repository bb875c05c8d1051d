"""Pages of targets, limits and goals of a design, and of the effects that a diagnosis knows."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Mapping
from html import escape
from pathlib import Path

import nlsdesign.design as design
from nlsdesign.bench.discrepancy.effects import ALL, Effect
from nlsdesign.bench.discrepancy.effects.plain_names import capitalised, title
from nlsdesign.design.jobs.job_file import kinds

from . import bibliography, markup

_BASES: Mapping[str, tuple[type, str]] = {
    "targets": (design.Target, "The torque curve that a spring shall have."),
    "limits": (design.Limit, "What a design must keep; by default those of the declared cable and rubber."),
    "goals": (design.Goal, "What is made small, and traded by `nlsdesign design` with a front."),
    "goals_of_tasks": (design.TaskGoal, "What the curve for a task makes small, inside a `TaskTarget`."),
}  # fmt: skip


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return the page of what can be asked of a design, and the page of effects.

    Parameters
    ----------
    root, folder
        Of the project and of the staged sources; not needed here.
    """
    asked = "# Targets, limits and goals\n\n"
    asked += (
        "Made from the classes. In Python they are `nlsdesign.design.Name(field=…)`; in a design file "
        "(`nlsdesign design --task FILE`) "
        'one line `Name = {field = "number unit"}` below `[target]`, `[limits]` or `[goals]`. '
        "How they work together: [Design a cam](../how_to/design_a_cam.md).\n\n"
    )
    for name, (base, sentence) in _BASES.items():
        asked += f"## {capitalised(name.replace('_', ' '))}\n\n{sentence}\n\n"
        asked += "".join(_class(n, kind) for n, kind in kinds(base).items())
    return {"reference/targets_limits_goals.md": asked, "reference/effects.md": _effects()}


def _class(name: str, kind: type) -> str:
    written = markup.sections(kind)
    described: dict[str, str] = {}
    for each in reversed(kind.__mro__[:-1]):  # fields of a base are described there
        described |= documented(markup.sections(each).get("Parameters", ""))
    hints = typing.get_type_hints(kind)
    rows = [
        [
            f"<code>{field.name}</code>",
            escape(_shown(hints[field.name])),
            _default(field),
            markup.inline(described.get(field.name, "")),
        ]
        for field in dataclasses.fields(kind)
        if field.init
    ]
    table = (
        markup.table(("field", "kind", "default", "meaning"), rows, caption=f"Fields of {name}")
        if rows
        else ""
    )
    examples = written.get("Examples", "")
    shown = markup.code(examples, "pycon") if examples.lstrip().startswith(">>>") else ""
    return (
        markup.anchor(name) + f"### {name}\n\n" + markup.prose(written[""])
        + bibliography.sources(written[""], up="../") + table + shown
    )  # fmt: skip


def documented(section: str) -> dict[str, str]:
    """Return the meaning of each parameter of a section ``Parameters``.

    Parameters
    ----------
    section
        Names at the margin, meanings below them.
    """
    result: dict[str, str] = {}
    for block in re.split(r"\n(?=\S)", section):
        head, _, body = block.partition("\n")
        for name in head.partition(":")[0].split(","):
            result[name.strip()] = " ".join(body.split())
    return result


def _shown(hint: object) -> str:
    text = hint.__name__ if isinstance(hint, type) else str(hint)
    return re.sub(r"\b(?:nlsdesign|collections|typing|numpy)\.(?:\w+\.)*", "", text).replace(
        "Quantity | float", "number with unit"
    )


def _default(field: dataclasses.Field[object]) -> str:
    if field.default is not dataclasses.MISSING:
        text = repr(field.default)
        return f"<code>{escape(text)}</code>" if len(text) < 60 else "as declared"
    return "as declared" if field.default_factory is not dataclasses.MISSING else "required"


def _effects() -> str:
    text = (
        f"# Effects of the catalogue\n\nMade from the catalogue of {len(ALL)} effects that "
        "`nlsdesign diagnose` tries, in the order in which the first "
        "of several that records cannot tell apart is named. How one is chosen: "
        "[the decision rule](../decision.md); how often it is right: "
        "[how well the diagnosis does](../discrepancy.md).\n\n"
    )
    return text + "".join(_effect(row) for row in ALL)


def _effect(row: Effect) -> str:
    head = markup.anchor(row.__name__) + f"## {capitalised(title(row.__name__))}\n\n"
    rows = [[markup.inline(form.signature), markup.inline(form.source)] for form in row.forms]
    columns = ("what it leaves in records", "source")
    brings = "; ".join(dict.fromkeys(escape(form.brings) for form in row.forms if form.brings))
    adds = f'<p class="facts">Phenomenon that it adds: {brings}</p>\n\n' if brings else ""
    every = " ".join(form.source for form in row.forms)
    return (
        head + f"<p><code>{row.identifier}</code></p>\n\n" + markup.prose(inspect.cleandoc(row.description))
        + adds + markup.table(columns, rows, caption=f"Forms of {escape(title(row.identifier))}")
        + bibliography.sources(every, up="../")
    )  # fmt: skip
