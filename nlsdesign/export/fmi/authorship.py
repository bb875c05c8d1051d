"""Where an FMU comes from: who made it, when, and from which deck.

``documentation/origin.json`` holds the deck with all numbers, and a digest of every other file of the FMU.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

from ...foundation.deck import ParentDeck
from ...foundation.errors import ExportError, ValueRangeError
from ...foundation.locations import version
from ...model.flat import FlatModel
from ...model.origin import Origin

SHORT_DIGEST = 12
"""Digits of a deck's digest where the whole would be in the way."""

_LICENCE = (
    "Shells in C: MIT, see documentation/licenses/license.txt; equations and numbers: as the author of the "
    "model states"
)


@dataclass(frozen=True)
class Authorship:
    """What an FMU says of its author; everything may be left out.

    Parameters
    ----------
    author, copyright, licence
        As text; without a licence that of the templates is named.
    version
        Of the model; by default the first digits of the deck's digest.
    date
        Of the export, with a time zone. By default the time that ``SOURCE_DATE_EPOCH`` names, so that an
        archive can be made again bit by bit, and without it the present time.

    Raises
    ------
    ValueRangeError
        If the date has no time zone, or a text holds what is no character.
    """

    author: str = ""
    copyright: str = ""
    licence: str = ""
    version: str = ""
    date: datetime | None = None

    def __post_init__(self) -> None:
        if self.date is not None and self.date.tzinfo is None:
            raise ValueRangeError(
                f"date {self.date}", "has no time zone", next_step="give datetime(..., tzinfo=timezone.utc)"
            )

        for name in ("author", "copyright", "licence", "version"):
            text = getattr(self, name)
            if text != text.encode("utf-8", "replace").decode("utf-8"):
                raise ValueRangeError(
                    f"{name} {text!a}", "holds what is no character", next_step="give it in UTF-8"
                )

    def dated(self) -> Authorship:
        """Return the same with a date.

        Raises
        ------
        ExportError
            If ``SOURCE_DATE_EPOCH`` is no number of seconds.
        """
        if self.date is not None:
            return self
        named = os.environ.get("SOURCE_DATE_EPOCH")
        try:
            when = datetime.fromtimestamp(int(named), UTC) if named else datetime.now(UTC)
        except (ValueError, OverflowError, OSError):
            raise ExportError(
                f"SOURCE_DATE_EPOCH={named!r}",
                "must be a whole number of seconds since 1970-01-01",
                next_step="unset it, or set it to the output of `git log -1 --format=%ct`",
            ) from None
        return replace(self, date=when)

    def undated(self) -> Authorship:
        """Return the same without a date, for what must not change from day to day."""
        return replace(self, date=None)

    def attributes(self, origin: Origin | None) -> dict[str, str]:
        """Return the attributes of a model description.

        Parameters
        ----------
        origin
            Deck behind the model.
        """
        version = self.version or (origin.digest[:SHORT_DIGEST] if origin else "")
        texts: Mapping[str, str] = {
            "author": self.author,
            "version": version,
            "copyright": self.copyright,
            "license": self.licence or _LICENCE,
            "generationDateAndTime": self.stamp,
        }
        return {name: text for name, text in texts.items() if text}

    @property
    def stamp(self) -> str:
        """The date as FMI writes it, in UTC; empty without a date."""
        return self.date.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ") if self.date else ""


def described(description: str, origin: Origin | None) -> str:
    """Return the description of a model with its deck."""
    if origin is None:
        return description
    return f"{description} (deck {origin.deck}, SHA-256 {origin.digest[:SHORT_DIGEST]})"


ORIGIN_FILE = "documentation/origin.json"
ORIGIN_FORMAT = "nlsdesign origin 1"


def with_origin(model: FlatModel, contents: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the contents of an FMU with one file more, which says where they come from."""
    record = {
        "format": ORIGIN_FORMAT,
        "generator": f"nlsdesign {version()}",
        "model": model.name,
        "deck": _deck(model.origin) if model.origin else None,
        "files": {path: hashlib.sha256(contents[path]).hexdigest() for path in sorted(contents)},
    }
    text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
    return {**contents, ORIGIN_FILE: text.encode()}


def _deck(origin: Origin) -> dict[str, Any]:
    return {
        "name": origin.deck,
        "sha256": origin.digest,
        "changed": list(origin.changed),
        "parent": _parent(origin.parent),
        "numbers": {
            name: {"value": q.shown, "unit": q.unit, "source": q.source, "spread": q.spread_data}
            for name, q in origin.numbers.items()
        },
    }


def _parent(parent: ParentDeck | None) -> dict[str, Any] | None:
    if parent is None:
        return None
    words = {"name": parent.name, "sha256": parent.digest, "change": parent.change}
    return {**words, "parent": _parent(parent.parent)}
