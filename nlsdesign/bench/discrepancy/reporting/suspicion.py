"""Why records or deck are suspect, in words."""

from __future__ import annotations

from ..effects.plain_names import capitalised

LET_GO = (
    "Deck and records contradict each other",
    "With declared numbers let go the model explains the records better, so no effect is named; look at "
    "these numbers first, and whether the records are of this rig.",
)
"""Headline and explanation where other numbers explain the records: then these need not be suspect."""
CONTRADICTION = "deck and records contradict each other, so nothing is named"
"""Why an effect that explains much is not named all the same."""


def as_sentence(text: str) -> str:
    """Return a reason as a sentence or a question; the name of a file at its beginning stays as it is."""
    begins = text.split(maxsplit=1)[0].isalpha()
    sentence = (capitalised(text) if begins else text).rstrip(".")
    return sentence if sentence.endswith("?") else f"{sentence}."
