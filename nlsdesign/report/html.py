"""HTML from plain text."""

from __future__ import annotations

import re
from html import escape

_CODE = re.compile(r"`([^`\n]+)`")
_DOTS = re.compile(r"(?<=[a-z\]])(\.)(?=[a-z])")
"""Dots within a hierarchical name, behind which a line may break."""


class Html(str):
    """Text that is HTML already; templates escape every other text."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return the text unchanged, so that templates do not escape it."""
        return str(self)


def words(text: str) -> Html:
    """Return plain text as HTML, escaped; names between backticks are set as code.

    Parameters
    ----------
    text
        Plain text.

    Examples
    --------
    >>> words("`a.b` < 3")
    '<code>a.b</code> &lt; 3'
    """
    return Html(_CODE.sub(r"<code>\1</code>", escape(text)))


def breakable(text: Html) -> Html:
    """Return HTML in which a line may break behind the dots of hierarchical names.

    Parameters
    ----------
    text
        HTML.

    Examples
    --------
    >>> breakable(words("`a.b` of 1.5"))
    '<code>a.<wbr>b</code> of 1.5'
    """
    return Html(_DOTS.sub(r"\1<wbr>", text))


def prose(text: str) -> Html:
    """Return paragraphs as HTML; empty lines separate them.

    Parameters
    ----------
    text
        Plain text, as for :func:`words`.
    """
    paragraphs = [part.strip() for part in re.split(r"\n\s*\n", text) if part.strip()]
    return Html("\n".join(f"<p>{words(part)}</p>" for part in paragraphs))
