"""Which deck a flat model comes from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Origin:
    """Name and content of the deck behind a model.

    Parameters
    ----------
    deck
        Name of the deck.
    digest
        SHA-256 of the deck as this package writes it, in hexadecimal digits: comments and the order of fields
        do not change it, each number, unit, source and spread does.
    """

    deck: str
    digest: str
