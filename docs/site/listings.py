"""Source files that pages link to, as pages with numbered lines."""

from __future__ import annotations

import os
from collections.abc import Iterable
from html import escape
from pathlib import Path

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{name}</title><style>{style}</style></head>
<body><p><a href="{home}">nlsdesign</a> / {name}</p><main>{code}</main></body></html>
"""
_STYLE = """
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 1rem; overflow-wrap: anywhere; }}
main {{ overflow-x: auto; }}
pre {{ font: 13px/1.45 ui-monospace, monospace; margin: 0; }}
.linenos {{ opacity: .7; padding-right: 1em; }}
span:has(> a:target), a:target {{ background: #ffd54a55; }}
{light}
@media (prefers-color-scheme: dark) {{ body {{ background: #131416; color: #cfd0d0; }} a {{ color: #7ab7ff; }}
{dark} }}
"""


def write_listings(root: Path, folder: Path, names: Iterable[str]) -> None:
    """Write one page for each file.

    Parameters
    ----------
    root
        Of the project.
    folder
        Where to write.
    names
        Paths in the project.
    """
    from pygments import highlight
    from pygments.formatters import HtmlFormatter
    from pygments.lexers import TextLexer, get_lexer_for_filename
    from pygments.util import ClassNotFound

    shown = HtmlFormatter(
        linenos="inline", lineanchors="L", anchorlinenos=True, style="a11y-high-contrast-light"
    )
    dark = HtmlFormatter(style="a11y-high-contrast-dark").get_style_defs(".highlight")
    style = _STYLE.format(light=shown.get_style_defs(".highlight"), dark=dark)
    for name in sorted(set(names)):
        try:
            lexer = get_lexer_for_filename(name)
        except ClassNotFound:
            lexer = TextLexer()
        page = folder / f"{name}.html"
        page.parent.mkdir(parents=True, exist_ok=True)
        home = os.path.relpath(folder.parent / "index.html", page.parent)
        code = highlight((root / name).read_text(encoding="utf-8"), lexer, shown)
        page.write_text(_PAGE.format(name=escape(name), style=style, home=home, code=code), encoding="utf-8")


def anchor(fragment: str) -> str:
    """Return the anchor of a line; ``L12`` as source viewers write it is ``L-12`` here.

    Parameters
    ----------
    fragment
        May be empty.
    """
    return f"#L-{fragment[1:]}" if fragment[:1] == "L" and fragment[1:].isdigit() else ""
