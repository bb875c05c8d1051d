"""The page of what is cited."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

from nlsdesign.foundation.bibliography import Reference, cited, origins, references

from . import markup


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return the page of all publications, each with a place that other pages link to.

    Parameters
    ----------
    root, folder
        Of the project and of the staged sources; not needed here.
    """
    entries = "".join(
        f'<dt id="{key_of(r)}">{escape(r.key)}</dt><dd>{_entry(r)}</dd>\n' for r in references().values()
    )
    rows = [[escape(name), escape(meaning)] for name, meaning in origins().items()]
    text = (
        "# Bibliography\n\nMade from `nlsdesign/foundation/bibliography.toml`. "
        "A DOI stands where it was checked.\n\n"
        f'<dl class="bibliography">\n{entries}</dl>\n\n## Origins that are no publication\n\n'
        + markup.table(("origin", "meaning"), rows, caption="What a source may begin with instead")
    )
    return {"bibliography.md": text}


def key_of(reference: Reference) -> str:
    """Return the place of a publication on its page.

    Parameters
    ----------
    reference
        Any of the bibliography.
    """
    return re.sub(r"\W+", "-", reference.key.lower()).strip("-")


def sources(text: str, *, up: str) -> str:
    """Return links to what a text cites; empty where it cites nothing.

    Parameters
    ----------
    text
        A docstring.
    up
        Way from the page to the top of the site, such as ``"../"``.
    """
    links = [f'<a href="{up}bibliography.html#{key_of(r)}">{escape(r.key)}</a>' for r in cited(text)]
    return f'<p class="sources">Sources: {", ".join(links)}</p>\n\n' if links else ""


def _entry(reference: Reference) -> str:
    text = escape(str(reference).partition(". https://doi.org/")[0])
    link = f"https://doi.org/{reference.doi}"
    return text + (f'. <a href="{link}">doi:{escape(reference.doi)}</a>' if reference.doi else "")
