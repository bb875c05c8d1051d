"""Sections of a report: chapters, texts, figures, tables, key numbers and lists of files.

The report as one self-contained HTML file: no network, no font, no library.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any, ClassVar, NamedTuple
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from ...foundation.errors import ExportError, ValueRangeError, visible
from ...foundation.locations import version
from ...foundation.quantity import typeset_number
from ...foundation.text_files import write_text
from ...foundation.work_sharing import parallel_map
from ..figures import Figure, inline_svg
from ..figures.style import TONES, alternative_text, compact
from ..figures.svg import figure_data
from ..figures.telephone import for_telephone

_CODE = re.compile(r"`([^`\n]+)`")
_DOTS = re.compile(r"(?<=[a-z\]])\.(?=[a-z])|(?<=\w)_(?=\w)|(?<=[a-z])(?=[A-Z][a-z]{3})")
"""Dots within a hierarchical name, underscores, and ends of words in a compound: there a line may break."""


class Html(str):
    """Text that is HTML already; templates escape every other text."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return the text unchanged, so that templates do not escape it."""
        return str(self)


def words(text: str) -> Html:
    """Return plain text as HTML, escaped; names between backticks are set as code.

    Examples
    --------
    >>> words("`a.b` < 3")
    '<code>a.b</code> &lt; 3'
    """
    return Html(_CODE.sub(r"<code>\1</code>", escape(text)))


def breakable(text: Html) -> Html:
    """Return HTML in which a line may break behind the dots and underscores of names.

    Examples
    --------
    >>> breakable(words("`a.b` of 1.5"))
    '<code>a.<wbr>b</code> of 1.5'
    """
    return Html(_DOTS.sub(r"\g<0><wbr>", text))


def prose(text: str) -> Html:
    """Return paragraphs as HTML; empty lines separate them."""
    paragraphs = [part.strip() for part in re.split(r"\n\s*\n", text) if part.strip()]
    return Html("\n".join(f"<p>{words(part)}</p>" for part in paragraphs))


_NO_LETTERS = re.compile(r"[^a-z0-9]+")
_KEPT = ",:[]{}()/ "
"""Characters that need no escape in such a link; each escape would take three."""


class DataLink(NamedTuple):
    """A link that holds a file or leads to one."""

    name: str  # of the file, when it is saved
    link: str  # the whole content, or the path of the file from the page
    words: str = "Data of this figure (JSON)"  # what is to be had there


def file_link(file: Path, folder: Path) -> DataLink:
    """Return a link to the file that holds the numbers behind a figure."""
    relative = Path(os.path.relpath(file, folder)).as_posix()
    return DataLink(
        file.name, quote(relative), f"Data behind this figure, all points ({file.suffix[1:].upper()})"
    )


def data_link(figure: Figure, title: str) -> DataLink | None:
    """Return the numbers that a figure shows as a link that holds them; none where it shows none."""
    content = figure_data(figure)
    if not content["panels"]:
        return None
    name = _NO_LETTERS.sub("_", title.lower()).strip("_")[:60] or "figure"
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    return DataLink(f"{name}.json", f"data:application/json;charset=utf-8,{quote(text, safe=_KEPT)}")


Cell = str | int | float

_NUMBER = re.compile(r"^(± )?\(?[−+-]?\d[\d.]*( ± \d[\d.]*\)?)?(·10[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)?( ?%)?$")


@dataclass(frozen=True)
class PagePosition:
    """Position of a section on the page."""

    key: str  # identifier that no other section of the page uses; identifiers inside start with it
    folder: Path  # folder of the report, for relative links
    narrow: bool = True  # whether figures are drawn a second time, for a telephone and for paper

    def inner(self, number: int) -> PagePosition:
        """Return the place of a section inside this one."""
        return replace(self, key=f"{self.key}-{number}")


@dataclass(frozen=True, eq=False)
class Section(ABC):
    """A piece of a report with a heading.

    Parameters
    ----------
    title
        Heading; plain text.
    """

    title: str
    template: ClassVar[str]
    script: ClassVar[str] = ""
    """File of the templates that the page needs for it, once however often the section stands there."""

    @abstractmethod
    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return what the template of the section shows.

        Parameters
        ----------
        place
            Position of the section.
        """


@dataclass(frozen=True, eq=False)
class Chapter(Section):
    """A heading above the sections that follow it, with a short text.

    Parameters
    ----------
    text
        Paragraphs, separated by empty lines; names between backticks.
    """

    text: str = ""
    template: ClassVar[str] = "chapter.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the text."""
        return {"text": self.text}


@dataclass(frozen=True, eq=False)
class TextSection(Section):
    """Text, and text in a fixed-width font such as the drawing of an assembly.

    Parameters
    ----------
    text
        Paragraphs, separated by empty lines; names between backticks.
    drawing
        Shown as it stands, in a fixed-width font.
    """

    text: str = ""
    drawing: str = ""
    template: ClassVar[str] = "text.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return text and drawing."""
        return {"text": self.text, "drawing": self.drawing}


@dataclass(frozen=True, eq=False)
class FoldedSection(Section):
    """Sections that stay closed until the reader opens them; on paper they are open.

    Parameters
    ----------
    parts
        In reading order.
    caption
        What they show, in one line; by default their headings.
    """

    parts: tuple[Section, ...]
    caption: str = ""
    template: ClassVar[str] = "folded.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the headings and contents of the parts."""
        caption = self.caption or "; ".join(part.title for part in self.parts)
        return {"caption": caption, "parts": inner_sections(self.parts, place)}


def inner_sections(parts: Sequence[Section], place: PagePosition) -> list[dict[str, Any]]:
    """Return what ``inner.html`` shows of sections within one."""
    return [
        {
            "title": part.title,
            "template": part.template,
            "key": place.inner(i).key,
            **part.content(place.inner(i)),
        }
        for i, part in enumerate(parts, start=1)
    ]


@dataclass(frozen=True, eq=False)
class FigureSection(Section):
    """A figure with a caption: what is seen, what it means, what is assumed.

    Parameters
    ----------
    figure
        From :mod:`nlsdesign.presentation.figures` or any other matplotlib figure.
    caption
        What is seen.
    means, assumed
        What it means, and what was assumed.
    alternative
        Alternative text; by default the one attached to the figure.
    data
        File with the numbers behind it; by default the page holds those that are drawn.

    Raises
    ------
    ValueRangeError
        If there is no alternative text.
    """

    figure: Figure
    _: KW_ONLY
    caption: str
    means: str = ""
    assumed: str = ""
    alternative: str = ""
    data: Path | None = None
    template: ClassVar[str] = "figure.html"

    def __post_init__(self) -> None:
        if not (self.alternative or alternative_text(self.figure)):
            raise ValueRangeError(
                f"figure '{self.title}'", "has no alternative text for readers who cannot see it",
                next_step="give alternative=\"...\", or draw it with nlsdesign.presentation.figures",
            )  # fmt: skip

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the figure as inline SVG, drawn for a desk and for a telephone or paper, and its texts."""
        svg = Html(inline_svg(self.figure, place.key, alternative=self.alternative))
        narrow = Html("")
        # Points that lead to their design stay on a figure that is moved sideways.
        if place.narrow and "<a " not in svg:
            small = for_telephone(self.figure)
            narrow = Html(inline_svg(small, f"{place.key}-narrow", alternative=self.alternative))
        data = data_link(self.figure, self.title) if self.data is None else file_link(self.data, place.folder)
        return {
            "svg": svg, "narrow": narrow, "data": data, "caption": self.caption, "means": self.means,
            "assumed": self.assumed,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class TableSection(Section):
    """A table.

    Parameters
    ----------
    columns
        Headings.
    rows
        Texts and numbers; numbers are shown with four digits. Columns of numbers are aligned to the right.
    caption
        What it shows.
    marked
        Numbers of the highlighted rows.
    folded
        Whether it is closed until the reader opens it; for long tables.

    Raises
    ------
    ValueRangeError
        If a row has not as many cells as there are columns.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    _: KW_ONLY
    caption: str = ""
    marked: frozenset[int] = frozenset()
    folded: bool = False
    template: ClassVar[str] = "table.html"

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueRangeError(
                    f"table '{self.title}', row {number}",
                    f"has {len(row)} cells for {len(self.columns)} columns",
                )

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the cells as text, each with whether it is a number."""
        texts = [
            [compact(cell, 4) if isinstance(cell, float) else str(cell) for cell in row] for row in self.rows
        ]
        right = [_is_numeric([row[i] for row in texts]) for i in range(len(self.columns))]
        rows = [
            {"cells": list(zip(row, right, strict=True)), "marked": i in self.marked}
            for i, row in enumerate(texts)
        ]
        head = list(zip(self.columns, right, strict=True))
        return {
            "title": self.title, "head": head, "rows": rows, "caption": self.caption, "folded": self.folded,
        }  # fmt: skip


def _is_numeric(texts: list[str]) -> bool:
    return any(_NUMBER.match(text) for text in texts) and all(
        _NUMBER.match(text) or text in ("", "–") for text in texts
    )


@dataclass(frozen=True)
class KeyNumber:
    """One number that summarises a result.

    Parameters
    ----------
    label
        What it is.
    value
        Number with unit, as text.
    note
        Value for comparison, or the condition under which it holds.
    before
        The same number before, or of what it is compared with; shown with an arrow in front.
    """

    label: str
    value: str
    note: str = ""
    before: str = ""


@dataclass(frozen=True, eq=False)
class NumbersSection(Section):
    """Key numbers in large letters.

    Parameters
    ----------
    numbers
        In the order of reading.
    """

    numbers: tuple[KeyNumber, ...]
    template: ClassVar[str] = "numbers.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the numbers."""
        return {"numbers": self.numbers}


@dataclass(frozen=True, eq=False)
class FileSection(Section):
    """Files that were written beside the report, with links relative to it.

    Parameters
    ----------
    files
        What each is, by path; folders too.
    caption
        What to do with them.
    """

    files: Mapping[Path, str] = field(default_factory=dict)
    _: KW_ONLY
    caption: str = ""
    template: ClassVar[str] = "files.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return name, link, size and description of each file.

        Raises
        ------
        ExportError
            If a file does not exist.
        """
        rows = []
        for path, what in self.files.items():
            if not path.exists():
                raise ExportError(
                    f"file '{path}' of the report", "does not exist", next_step="write it before the report"
                )
            relative = Path(os.path.relpath(path, place.folder)).as_posix() + ("/" if path.is_dir() else "")
            size = "" if path.is_dir() else _size(path.stat().st_size)
            rows.append({"name": relative, "link": quote(relative), "size": size, "what": what})
        return {"title": self.title, "rows": rows, "caption": self.caption}


def _size(count: int) -> str:
    for unit, factor in (("MB", 1e6), ("kB", 1e3)):
        if count >= factor:
            return f"{typeset_number(count / factor, 2 if count / factor < 100 else 3)} {unit}"
    return f"{count} B"


_PAGE_TONES = {
    "page": ("#f4f6f8", "#0e1217"),
    "card": ("#ffffff", "#171c23"),
    "accent": ("#00598c", "#7cc4f5"),
    "soft": ("#e9eef3", "#222a33"),
    "warn": ("#fff4d6", "#3a2f10"),
}


def write_report(
    path: Path, *sections: Section, title: str, abstract: str = "", facts: Mapping[str, str] | None = None,
    narrow: bool = True,
) -> Path:  # fmt: skip
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
    narrow
        Whether each figure is drawn a second time, for a telephone and for paper, which takes more than half
        of the time; without it figures are moved sideways there.

    Raises
    ------
    ExportError
        If the file cannot be written, or a file that a section links does not exist.
    ValueRangeError
        If there is no section.
    """
    path = Path(path)
    text = report_text(path.parent, sections, title=title, abstract=abstract, facts=facts, narrow=narrow)
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
    narrow: bool = True,
) -> str:
    """Return a report as text; the same for the same sections."""
    pieces = list(sections)
    if not pieces:
        raise ValueRangeError("report", "has no section", next_step="give write_report at least one")
    entries, inside = [], False
    places = [PagePosition(f"s{number}", folder, narrow) for number in range(1, len(pieces) + 1)]
    # Drawing the figures takes the time, so each core draws some of them.
    contents = parallel_map(lambda k: pieces[k].content(places[k]), len(pieces))
    for section, place, content in zip(pieces, places, contents, strict=True):
        chapter = isinstance(section, Chapter)
        inside = inside or chapter
        entries.append({
            "title": section.title, "template": section.template, "key": place.key,
            "level": 2 if chapter or not inside else 3, "content": content,
        })  # fmt: skip
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


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("nlsdesign.presentation.report"), autoescape=True, undefined=StrictUndefined,
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
