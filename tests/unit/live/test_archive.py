"""Archives of the live page: what was saved comes back, and what is damaged is refused in words."""

from __future__ import annotations

import random

import pytest

from nlsdesign.foundation.errors import DeckError
from nlsdesign.live.saved import MEMBERS, SavedDesign, archived, unarchived

SAVED = SavedDesign(*(f'name = "{name}"\n' * 40 for name in MEMBERS))


def test_what_was_saved_comes_back() -> None:
    assert unarchived(archived(SAVED)) == SAVED


def test_a_damaged_archive_is_refused_or_read_and_raises_nothing_else() -> None:
    sound, chance, refused = archived(SAVED), random.Random(1), 0
    for _ in range(2000):
        damaged = bytearray(sound)
        for _ in range(chance.randint(1, 4)):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        try:
            unarchived(bytes(damaged))
        except DeckError:
            refused += 1
    assert refused > 1000


def test_what_is_no_archive_is_named() -> None:
    wrong = archived(SAVED).replace(b"PK\x05\x06", b"PK\x05\x07")
    with pytest.raises(DeckError, match="is no archive that the live page has written"):
        unarchived(wrong)
