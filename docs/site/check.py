"""What a built site must hold: every link inside resolves, and nothing is fetched from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from html import unescape
from pathlib import Path
from urllib.parse import unquote

_LOADED = {"script": "src", "img": "src", "iframe": "src", "source": "src", "object": "data"}
_STYLED = re.compile(r"url\(\s*['\"]?((?:https?:)?//[^'\")]+)|@import\s+['\"]?((?:https?:)?//[^'\"\s;]+)")


_TAG = re.compile(r"""<([a-zA-Z][\w-]*)((?:\s+[^\s"'>/=]+(?:\s*=\s*(?:"[^"]*"|'[^']*'|[^\s"'>]+))?)+)""")
_ATTRIBUTE = re.compile(r"""([^\s"'>/=]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s"'>]+))""")


class _Page:
    """Links, anchors and what is loaded of one page."""

    def __init__(self, text: str) -> None:
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.loaded: list[str] = []
        self.nameless: list[str] = []
        for tag, attributes in _TAG.findall(text):
            given = {name.lower(): unescape(a or b or c) for name, a, b, c in _ATTRIBUTE.findall(attributes)}
            self._note(tag.lower(), given)

    def _note(self, tag: str, given: dict[str, str]) -> None:
        """Note what a tag refers to."""
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        styled = tag == "link" and "stylesheet" in given.get("rel", "")
        if styled or given.get(_LOADED.get(tag, "")) is not None:
            self.loaded.append(given.get(_LOADED.get(tag, "href"), ""))
        if tag == "img" and not given.get("alt"):
            self.nameless.append(given.get("src", ""))


@cache
def _page(path: Path) -> _Page:
    return _Page(path.read_text(encoding="utf-8"))


def problems(site: Path) -> list[str]:
    """Return what is wrong with a built site, one line each.

    Parameters
    ----------
    site
        Folder with the pages.
    """
    _page.cache_clear()
    _file.cache_clear()
    named = [
        f"{path.relative_to(site)}: {problem}"
        for path in sorted(site.rglob("*.html"))
        for problem in _of_page(site, path)
    ]
    styles = [
        f"{path.relative_to(site)}: loads {a or b} from elsewhere"
        for path in sorted(site.rglob("*.css"))
        for a, b in _STYLED.findall(path.read_text(encoding="utf-8"))
    ]
    return named + styles


def _of_page(site: Path, path: Path) -> Iterator[str]:
    page = _page(path)
    for address in page.loaded:
        if re.match(r"(?:[a-z]+:)?//", address):
            yield f"loads {address} from elsewhere"
        elif not address.startswith("data:") and not _file(site, path.parent, address).is_file():
            yield f"loads {address}, which is not there"
    for address in page.nameless:
        yield f"picture {address} has no alternative text"
    for address in page.links:
        if re.match(r"[a-z][a-z0-9+.-]*:", address):
            continue
        name, _, anchor = address.partition("#")
        target = _file(site, path.parent, name) if name else path
        if not target.is_file():
            yield f"links to {address}, which is not there"
        elif anchor and target.suffix == ".html" and unquote(anchor) not in _page(target).anchors:
            yield f"links to {address}: no such place on that page"


@cache
def _file(site: Path, folder: Path, address: str) -> Path:
    name = unquote(address.partition("#")[0].partition("?")[0])
    target = (site / name.lstrip("/") if name.startswith("/") else folder / name).resolve()
    return target / "index.html" if target.is_dir() else target
