"""HTML from plain text."""

from __future__ import annotations

import re
from html import escape

_CODE = re.compile(r"`([^`\n]+)`")
_DOTS = re.compile(r"(?<=[a-z\]])(\.)(?=[a-z])|(?<=\w)(_)(?=\w)")
"""Dots within a hierarchical name and underscores, behind which a line may break."""


_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Characters that are not seen, or turn the direction of what follows."""


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


def visible(page: str) -> str:
    r"""Return a text in which control characters and marks of direction are written out, as ``\x1b``.

    Examples
    --------
    >>> print(visible("a" + chr(27) + "[31m"))
    a\x1b[31m
    """
    return _HIDDEN.sub(lambda match: match[0].encode("unicode_escape").decode(), page)


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
