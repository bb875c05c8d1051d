"""Who made an FMU, when, and from which deck."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from ...foundation.errors import ExportError, ValueRangeError
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
        As text; without a licence that of the shells is named.
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
