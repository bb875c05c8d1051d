"""The list of pages beside each page, and stems of words for the search, worked out once: an extension.

Furo asks for the whole list anew for every page, which took a third of the time of the site. Pages of one
folder have the same list but for the marks on the page itself and on what it hangs from.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from furo.navigation import get_navigation_tree
from sphinx.search import languages
from sphinx.search.en import SearchEnglish

_LEVEL = re.compile(r"<(/?)(ul|li)\b[^>]*>")
_BOX = ' class="toctree-checkbox"'


class _English(SearchEnglish):
    """English, of which each word is looked at once."""

    def __init__(self, options: dict[str, str]) -> None:
        super().__init__(options)
        self.stem = cache(super().stem)  # type: ignore[method-assign]


def marked(tree: str, link: str) -> str:
    """Return the list of pages with the entry of a link, and what it hangs from, marked as Furo does.

    Parameters
    ----------
    tree
        As Furo returns it for no page of its own.
    link
        Of the page, relative to its folder.
    """
    plain = f'<a class="reference internal" href="{link}">'
    end = tree.find(plain)
    if end < 0:
        return tree
    above: list[re.Match[str]] = []
    for tag in _LEVEL.finditer(tree, 0, end):
        if tag[1]:
            above.pop()
        else:
            above.append(tag)
    here = tree[end:].replace(plain, '<a class="current reference internal" href="#">', 1)
    for tag in reversed(above):
        start = tree[tag.end() : end] + here
        if tag[2] == "ul":
            here, end = '<ul class="current">' + start, tag.start()
            continue
        name = re.sub(r"(toctree-l\d+)", r"\1 current", tag[0])
        if tag is above[-1]:
            name = name.replace('">', ' current-page">')
        here, end = (
            name + (start.replace(_BOX, ' checked=""' + _BOX, 1) if "has-children" in name else start),
            tag.start(),
        )
    return tree[:end] + here


def setup(app: Any) -> dict[str, bool]:
    """Take the place of what Furo does for each page; called by Sphinx."""
    languages["en"] = _English

    @cache
    def pages(folder: str) -> str:
        everything = {"collapse": False, "titles_only": True, "maxdepth": -1, "includehidden": True}
        listed: str = get_navigation_tree(app.builder._get_local_toctree(f"{folder}_", **everything))
        return listed

    def before(_: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
        context["toctree"] = lambda **_: ""

    def after(_: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
        folder = page[: page.rfind("/") + 1]
        link = app.builder.get_relative_uri(f"{folder}_", page)
        context["furo_navigation_tree"] = marked(pages(folder), link)

    app.connect("html-page-context", before, priority=400)
    app.connect("html-page-context", after, priority=600)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
