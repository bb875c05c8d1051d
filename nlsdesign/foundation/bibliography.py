"""What is cited: the entries of ``bibliography.toml`` by the name under which texts cite them."""

from __future__ import annotations

import functools
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Reference:
    """A publication."""

    key: str  # as texts cite it, for instance "Hunt and Crossley 1975"
    authors: tuple[str, ...]  # family name first
    # title, published: what, and in which journal, conference or by which publisher
    title: str
    published: str
    year: int | None = None  # of publication; None for a standard that is cited as it stands
    number: str = ""  # of a report or standard, where there is one
    doi: str = ""  # digital object identifier, where there is one and it was checked

    def __str__(self) -> str:
        year = f" ({self.year})" if self.year else ""
        number = f" {self.number}" if self.number else ""
        link = f". https://doi.org/{self.doi}" if self.doi else ""
        return f"{'; '.join(self.authors)}{year}: {self.title}. {self.published}{number}{link}"


@functools.cache
def references() -> Mapping[str, Reference]:
    """Return all publications by key."""
    entries: Mapping[str, dict[str, Any]] = _tables()["sources"]
    return {k: Reference(k, **entry | {"authors": tuple(entry["authors"])}) for k, entry in entries.items()}


@functools.cache
def origins() -> Mapping[str, str]:
    """Return the origins that are no publication, such as virtual work, and what they mean."""
    return dict(_tables()["origins"])


def cited(text: str) -> list[Reference]:
    """Return the publications that a text cites, in the order of their first citation.

    ``text``: any; it may be broken into lines.
    """
    flat = " ".join(text.split())
    places = {key: re.search(rf"(?<!\w){re.escape(key)}(?!\w)", flat) for key in references()}
    standing = {key: place.start() for key, place in places.items() if place}
    return [references()[key] for key in sorted(standing, key=lambda key: standing[key])]


@functools.cache
def _tables() -> Mapping[str, Mapping[str, Any]]:
    path = Path(__file__).with_name("bibliography.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))
