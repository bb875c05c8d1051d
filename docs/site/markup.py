"""Markdown of the pages made from the package: tables, folded blocks, paragraphs of docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from html import escape

from nlsdesign.presentation.figures import Figure, inline_svg
from nlsdesign.presentation.figures.telephone import for_telephone

from . import formula

_SECTION = re.compile(r"^(Parameters|Returns|Raises|Examples|Yields|Notes)\n-+\n", re.M)


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, caption: str) -> str:
    """Return a table as HTML in a frame that scrolls by itself.

    Parameters
    ----------
    columns
        Headings.
    rows
        Cells, as HTML.
    caption
        What the table shows.
    """
    head = "".join(f'<th scope="col">{c}</th>' for c in columns)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return (
        f'<div class="table-wrapper"><table class="docutils"><caption>{caption}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>\n\n"
    )


def folded(summary: str, content: str) -> str:
    """Return content that opens on a click.

    Parameters
    ----------
    summary
        What stands there while it is closed.
    content
        Markdown.
    """
    return f"<details><summary>{summary}</summary>\n\n{content}\n\n</details>\n\n"


def drawings(figure: Figure, key: str) -> str:
    """Return a figure as SVG, drawn for a desk and for a telephone.

    Parameters
    ----------
    figure
        From :mod:`nlsdesign.presentation.figures`.
    key
        Identifier that no other figure of the page uses.
    """
    desk, telephone = inline_svg(figure, key), inline_svg(for_telephone(figure), f"{key}-narrow")
    return f'<div class="wide">{desk}</div><div class="narrow">{telephone}</div>'


def plot(svg: str, caption: str) -> str:
    """Return a figure with its caption.

    Parameters
    ----------
    svg
        As it stands in a page.
    caption
        HTML.
    """
    # A blank line would end a block of HTML in Markdown.
    whole = re.sub(r"\n\s*\n", "\n", svg)
    return f'<figure class="plot">{whole}<figcaption>{caption}</figcaption></figure>\n\n'


def breakable(name: str) -> str:
    """Return a name as code that may break after an underline.

    Parameters
    ----------
    name
        As in Python.
    """
    return f"<code>{escape(name).replace('_', '_<wbr>')}</code>"


def code(text: str, language: str) -> str:
    """Return a block of code.

    Parameters
    ----------
    text, language
        As in Markdown.
    """
    return f"```{language}\n{text.strip()}\n```\n\n"


def sections(documented: object) -> dict[str, str]:
    """Return the docstring of an object by section; what stands before them under the empty name.

    Parameters
    ----------
    documented
        Class or function.
    """
    pieces = _SECTION.split(inspect.getdoc(documented) or "")
    return {"": pieces[0].strip()} | dict(
        zip(pieces[1::2], (p.strip("\n") for p in pieces[2::2]), strict=True)
    )


def prose(text: str) -> str:
    """Return paragraphs of a docstring as HTML, formulas typeset, code in code.

    Parameters
    ----------
    text
        Without sections.
    """
    return (
        "\n\n".join(f"<p>{inline(' '.join(p.split()))}</p>" for p in text.split("\n\n") if p.strip()) + "\n\n"
    )


def inline(text: str) -> str:
    """Return one paragraph as HTML.

    Parameters
    ----------
    text
        With double backticks around code and roles of Sphinx around names.
    """
    pieces = re.split(r"(``[^`]+``|:\w+:`[^`]+`)", text)
    return "".join(_piece(each) for each in pieces)


def _piece(text: str) -> str:
    name = re.fullmatch(r":\w+:`~?([^`]+)`", text)
    if name:
        return f"<code>{escape(name[1].rpartition('.')[2])}</code>"
    if text.startswith("``"):
        return f"<code>{escape(text[2:-2])}</code>"
    space = (" " if text[:1] == " " else "", " " if text[-1:] == " " else "")
    return space[0] + formula.typeset(text) + (space[1] if text.strip() else "") if text else ""


def anchor(name: str) -> str:
    """Return a place that links can name.

    Parameters
    ----------
    name
        As in the address.
    """
    return f'<a id="{name}"></a>\n\n'
