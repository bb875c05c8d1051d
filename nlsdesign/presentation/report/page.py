"""The report as one self-contained HTML file: no network, no font, no library."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from ...foundation.errors import ExportError, ValueRangeError, visible
from ...foundation.locations import version
from ...foundation.text_files import write_text
from ..figures.style import TONES
from .sections import Chapter, Html, PagePosition, Section, breakable, prose, words

_PAGE_TONES = {
    "page": ("#f4f6f8", "#0e1217"),
    "card": ("#ffffff", "#171c23"),
    "accent": ("#00598c", "#7cc4f5"),
    "soft": ("#e9eef3", "#222a33"),
    "warn": ("#fff4d6", "#3a2f10"),
}


def write_report(
    path: Path, *sections: Section, title: str, abstract: str = "", facts: Mapping[str, str] | None = None
) -> Path:
    """Write a report and return its file, which appears whole or not at all.

    Parameters
    ----------
    path
        File to write, ending in ``.html``.
    *sections
        In reading order. Sections that follow a :class:`Chapter` belong to it.
    title
        Heading of the page.
    abstract
        Paragraphs below the heading.
    facts
        Short texts by name for the line below, for instance the deck.

    Raises
    ------
    ExportError
        If the file cannot be written, or a file that a section links does not exist.
    ValueRangeError
        If there is no section.
    """
    path = Path(path)
    text = report_text(path.parent, sections, title=title, abstract=abstract, facts=facts)
    try:
        write_text(path, text)
    except OSError as error:
        raise ExportError(
            str(path), f"cannot be written ({error.strerror})", next_step="name another folder"
        ) from error
    return path


def report_text(
    folder: Path,
    sections: Iterable[Section],
    *,
    title: str,
    abstract: str = "",
    facts: Mapping[str, str] | None = None,
) -> str:
    """Return a report as text; the same for the same sections."""
    pieces = list(sections)
    entries = _entries(folder, pieces)
    script = "\n".join(
        _source(name)
        for name in dict.fromkeys(["report.js", *[section.script for section in pieces if section.script]])
    )
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    light, dark = (
        {
            **{tone.name: (tone.light, tone.dark)[i] for tone in TONES},
            **{n: c[i] for n, c in _PAGE_TONES.items()},
        }
        for i in (0, 1)
    )
    page: str = _environment().get_template("page.html").render(
        title=title, abstract=abstract, facts=facts or {}, entries=entries, version=version(),
        light=light, dark=dark, script=Html(script), script_digest=digest,
    )  # fmt: skip
    return visible(page)


def _entries(folder: Path, sections: list[Section]) -> list[dict[str, Any]]:
    if not sections:
        raise ValueRangeError("report", "has no section", next_step="give write_report at least one")
    entries, inside = [], False
    for number, section in enumerate(sections, start=1):
        place = PagePosition(f"s{number}", folder)
        chapter = isinstance(section, Chapter)
        inside = inside or chapter
        entries.append(
            {
                "title": section.title,
                "template": section.template,
                "key": place.key,
                "level": 2 if chapter or not inside else 3,
                "content": section.content(place),
            }
        )
    return entries


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader(__package__), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["prose"] = prose
    environment.filters["words"] = words
    environment.filters["breakable"] = breakable
    return environment


def _source(name: str) -> str:
    environment = _environment()
    loader = environment.loader
    if loader is None:
        raise ExportError(f"template '{name}'", "has no loader")
    return loader.get_source(environment, name)[0]
