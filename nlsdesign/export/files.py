"""Reading the fixed shells and writing several results whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from ..writing import draft


def shell(name: str) -> str:
    """Return the text of a fixed shell.

    Parameters
    ----------
    name
        File name in ``nlsdesign/export/shells``.
    """
    return (files(__package__) / "shells" / name).read_text(encoding="utf-8")


def filled(name: str, words: Mapping[str, str]) -> str:
    """Return a shell with its ``@word@`` marks replaced.

    Parameters
    ----------
    name
        File name in ``nlsdesign/export/shells``.
    words
        Replacement by word.
    """
    text = shell(name)
    for word, replacement in words.items():
        text = text.replace(f"@{word}@", replacement)
    return text


def write_all(texts: Mapping[Path, str]) -> None:
    """Write several files; none is touched before all of them could be written beside their place.

    Parameters
    ----------
    texts
        Content by path.
    """
    if not texts:
        return
    (path, text), *rest = texts.items()
    with draft(path) as name:
        name.write_text(text, encoding="utf-8", newline="\n")
        write_all(dict(rest))
