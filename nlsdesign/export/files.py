"""Fixed C shells, and atomic writing of several files."""

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


def filled(name: str, values: Mapping[str, str]) -> str:
    """Return a shell with its ``@name@`` placeholders replaced.

    Parameters
    ----------
    name
        File name in ``nlsdesign/export/shells``.
    values
        Text by name of the placeholder.
    """
    text = shell(name)
    for placeholder, value in values.items():
        text = text.replace(f"@{placeholder}@", value)
    return text


def write_all(texts: Mapping[Path, str]) -> None:
    """Write several files; none is replaced before all of them are written as temporary files.

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
