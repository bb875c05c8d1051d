"""Pages of the studies: text of their docstrings, figures that a command made, numbers that they claim."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

from nlsdesign.cli.studies import claims, load_study, study_names

from . import collect, markup


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return one page for each study and one that shows them all."""
    made = collect.read_made()
    names = study_names()
    shown = {f"gallery/{name}.md": _study(root, name, made.get(name, {})) for name in names}
    cards = "".join(_card(root, name) for name in names)
    entries = "\n".join(names)
    return shown | {
        "gallery/index.md": "# Gallery\n\nDesign studies that come with the project; "
        "`nlsdesign study run NAME` runs one and writes its report. Numbers that a study claims are held by "
        "tests; figures were made by `make gallery`, each page says when.\n\n"
        f'<div class="cards">\n{cards}</div>\n\n```{{toctree}}\n:hidden:\n\n{entries}\n```\n'
    }


def title(name: str) -> str:
    """Return the first sentence of a study.

    Parameters
    ----------
    name
        Of the study.
    """
    return " ".join((load_study(name).__doc__ or name).split("\n\n")[0].split()).rstrip(".")


def _svg(root: Path, name: str, number: int) -> str:
    file = root / "docs" / "gallery" / f"{name}-{number}.svg"
    # Blank lines would end a block of HTML in Markdown.
    return re.sub(r"\n\s*\n", "\n", file.read_text(encoding="utf-8")).strip() if file.is_file() else ""


def _card(root: Path, name: str) -> str:
    # Identifiers must be unique on the page; the same figure stands on the page of the study alone.
    link = f'<a href="{name}.html"><strong>{name}</strong></a>'
    return f"<div><p>{link}</p><p>{markup.inline(title(name))}</p>{_svg(root, name, 1)}</div>\n"


def _study(root: Path, name: str, made: dict[str, object]) -> str:
    paragraphs = (load_study(name).__doc__ or "").split("\n\n")[1:]
    text = (
        f"# {name}\n\n" + f"<p>{markup.inline(title(name))}.</p>\n\n" + markup.prose("\n\n".join(paragraphs))
    )
    text += markup.code(f"nlsdesign study run {name}", "console")
    titles, captions = made.get("titles", []), made.get("captions", [])
    assert isinstance(titles, list)
    assert isinstance(captions, list)
    for number, (head, caption) in enumerate(zip(titles, captions, strict=True), start=1):
        svg = _svg(root, name, number)
        text += f"## {head}\n\n" + markup.plot(svg, escape(caption))
    if made:
        by, using = escape(str(made["command"])), escape(str(made["with"]))
        text += f'<p class="facts">Made on {made["date"]} by <code>{by}</code> with {using}.</p>\n\n'
    rows = [
        [markup.breakable(key), f"{c.value:g} ± {c.tolerance:g}", escape(c.unit), markup.inline(c.why)]
        for key, c in claims(name).items()
    ]
    if rows:
        columns = ("number", "value", "unit", "what the tolerance covers")
        text += "## What it claims\n\n" + markup.table(
            columns, rows, caption=f"Claims of {name}, held by tests"
        )
    return text
