"""The sources of the site in one folder: pages of ``docs``, and pages made from the package."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

from . import (
    api,
    bibliography,
    catalogue,
    commands,
    diagrams,
    gallery,
    landing,
    listings,
    materials,
    parts,
)

_LINK = re.compile(r"(?<!!)\[(?P<text>[^\]\n]+)\]\((?P<address>[^)\s]+)\)")
_FENCE = re.compile(r"^(?P<mark>```+|~~~+)(?P<kind>[^\n]*)\n(?P<body>.*?)^(?P=mark)[ \t]*$", re.M | re.S)
_OWN = "site"
"""Folder of ``docs`` that holds this program and the pages that only the site has."""
_SENT = "paper"
"""Folder of ``docs`` whose text is sent to a journal: it is no page of the site."""
_APART = (_OWN, _SENT)

Pages = dict[str, str]
"""Text of pages by path below the staged folder."""


def stage(root: Path, folder: Path) -> set[str]:
    """Write all sources and return the files of the project that they link to."""
    linked: set[str] = set()
    pages = {_named(name): _text(root, root / "docs" / name, linked) for name in _written(root)}
    pages["changelog.md"] = _text(root, root / "CHANGELOG.md", linked, at="docs/changelog.md")
    own = root / "docs" / _OWN / "pages"
    for path in sorted(own.rglob("*.md")):
        name = path.relative_to(own).as_posix()
        pages[name] = _text(root, path, linked, at=f"docs/{name}")
    pages |= _contents(pages)
    pages["index.md"] = pages["index.md"].replace("MORE", "\n".join(_unlisted(pages)))
    pages["index.md"] = landing.with_picture(pages["index.md"])
    for name, text in pages.items():
        _write(folder / name, text)
    for path in sorted((root / "docs").rglob("*")):
        name = path.relative_to(root / "docs")
        if path.is_file() and path.suffix not in {".md", ".py", ".pyc"} and name.parts[0] not in _APART:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, folder / name)
    for make in (commands, parts, materials, catalogue, bibliography, api, gallery):
        for name, text in make.pages(root, folder).items():
            _write(folder / name, text)
    return linked


def _written(root: Path) -> list[str]:
    docs = root / "docs"
    names = (path.relative_to(docs) for path in sorted(docs.rglob("*.md")))
    return [name.as_posix() for name in names if name.parts[0] not in _APART]


def _named(name: str) -> str:
    """Return the name of a page in the site: a README is the first page of its folder."""
    return re.sub(r"README\.md$", "index.md", name)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _text(root: Path, path: Path, linked: set[str], *, at: str = "") -> str:
    """Return a page with links out of ``docs`` turned to listings and drawings made of diagrams."""
    page = Page(root, path, root / at if at else path, linked)
    pieces: list[str] = []
    last, text = 0, path.read_text(encoding="utf-8")
    for fence in _FENCE.finditer(text):
        pieces.append(page.linked_anew(text[last : fence.start()]))
        drawn = diagrams.drawing(fence["body"]) if fence["kind"].strip() == "mermaid" else fence.group()
        pieces.append(drawn)
        last = fence.end()
    return "".join(pieces) + page.linked_anew(text[last:])


@dataclass(frozen=True)
class Page:
    """Links of one page of the project.

    Parameters
    ----------
    root
        Of the project.
    path
        Where the page is read.
    place
        Where it would stand in ``docs`` of the project, as in the site.
    linked
        Files of the project that are linked to; grows.
    """

    root: Path
    path: Path
    place: Path
    linked: set[str]

    def linked_anew(self, text: str) -> str:
        """Return text with the links that the site needs.

        Parameters
        ----------
        text
            Without blocks of code.
        """
        return _LINK.sub(self._replaced, text)

    def _replaced(self, link: re.Match[str]) -> str:
        address, _, fragment = link["address"].partition("#")
        own = self.root / "docs" / _OWN
        if not address or re.match(r"[a-z][a-z0-9+.-]*:", address) or self.path.is_relative_to(own):
            return link.group()
        target = (self.path.parent / address).resolve()
        docs = self.root / "docs"
        known = {
            self.root / "README.md": docs / "index.md",
            self.root / "CHANGELOG.md": docs / "changelog.md",
        }
        if target in known or (target.is_relative_to(docs) and not target.is_relative_to(docs / _SENT)):
            shown = _named(os.path.relpath(known.get(target, target), self.place.parent))
            return f"[{link['text']}]({shown}{'#' * bool(fragment)}{fragment})"
        if not target.is_file():
            return link["text"]
        name = target.relative_to(self.root).as_posix()
        self.linked.add(name)
        listing = os.path.relpath(docs / "listings" / f"{name}.html", self.place.parent)
        text = re.sub(r"`([^`]+)`", lambda code: f"<code>{escape(code[1])}</code>", link["text"])
        return f'<a href="{listing}{listings.anchor(fragment)}">{text}</a>'


def _contents(pages: Pages) -> Pages:
    """Return the pages that list the tutorial and the questions that docs answer."""
    tutorial = sorted(n for n in pages if n.startswith("tutorial/") and not _is_front(n))
    how_to = sorted(n for n in pages if n.startswith("how_to/") and not _is_front(n))
    front = next((n for n in pages if n.startswith("tutorial/") and _is_front(n)), None)
    made = {"how_to/index.md": "# How to\n\nOne question a page; every block of code runs in a test.\n\n"
            + "".join(_entries(how_to, pages)) + "\n" + toctree(how_to, inside="how_to")}  # fmt: skip
    text = pages[front] if front else "# Tutorial\n\nFrom an empty folder to an actuator on the bench.\n\n"
    if not front:
        text += "".join(_entries(tutorial, pages))
    if "{toctree}" not in text:
        text += "\n\n" + toctree(tutorial, inside="tutorial")
    return made | {"tutorial/index.md": text}


def _unlisted(pages: Pages) -> list[str]:
    """Return the pages at the top that no table of contents has: new ones are shown without further work."""
    tables = "\n".join(re.findall(r"```\{toctree\}(.*?)```", "\n".join(pages.values()), re.S))
    listed = set(re.findall(r"^(?:\.\./)?(\w+)$", tables, re.M))
    top = sorted(name.removesuffix(".md") for name in pages if "/" not in name)
    return [name for name in top if name not in listed | {"index"}]


def _is_front(name: str) -> bool:
    return name.rpartition("/")[2] in {"index.md", "README.md"}


def _entries(names: list[str], pages: Pages) -> Iterator[str]:
    for name in names:
        title = re.search(r"^# (.+)$", pages[name], re.M)
        yield f"- [{title[1] if title else name}]({name.rpartition('/')[2]})\n"


def toctree(names: list[str], *, inside: str = "") -> str:
    """Return a hidden table of contents.

    Parameters
    ----------
    names
        Paths of pages below the staged folder.
    inside
        Folder of the page that holds it.
    """
    entries = "\n".join(os.path.relpath(name, inside or ".").removesuffix(".md") for name in names)
    return f"```{{toctree}}\n:hidden:\n\n{entries}\n```\n"
