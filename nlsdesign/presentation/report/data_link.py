"""The numbers behind a figure, as a link that holds them."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from ..figures import Figure
from ..figures.figure_data import figure_data

_NO_LETTERS = re.compile(r"[^a-z0-9]+")
_KEPT = ",:[]{}()/ "
"""Characters that need no escape in such a link; each escape would take three."""


class DataLink(NamedTuple):
    """A link that holds a file or leads to one.

    Parameters
    ----------
    name
        Of the file, when it is saved.
    link
        The whole content, or the path of the file from the page.
    words
        What is to be had there.
    """

    name: str
    link: str
    words: str = "Data of this figure (JSON)"


def file_link(file: Path, folder: Path) -> DataLink:
    """Return a link to the file that holds the numbers behind a figure."""
    relative = Path(os.path.relpath(file, folder)).as_posix()
    return DataLink(
        file.name, quote(relative), f"Data behind this figure, all points ({file.suffix[1:].upper()})"
    )


def data_link(figure: Figure, title: str) -> DataLink | None:
    """Return the numbers that a figure shows as a link that holds them; none where it shows none."""
    content = figure_data(figure)
    if not content["panels"]:
        return None
    name = _NO_LETTERS.sub("_", title.lower()).strip("_")[:60] or "figure"
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    return DataLink(f"{name}.json", f"data:application/json;charset=utf-8,{quote(text, safe=_KEPT)}")
