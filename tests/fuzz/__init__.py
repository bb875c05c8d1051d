"""Mutated decks, records, FMUs and command lines: a user never sees a traceback, a hang or a half file.

``python -m tests.fuzz --help`` runs them in any number; ``tests/unit/test_fuzz*.py`` runs the same code with
a fixed seed, and every case that was ever red by name.
"""

from __future__ import annotations

from .cases import Family


def family_names() -> tuple[str, ...]:
    """Return the kinds of cases."""
    return ("decks", "records", "fmus", "commands", "interrupts")


def family_of(name: str) -> Family:
    """Return a kind of cases by its name; only its own libraries are loaded."""
    if name == "decks":
        from .decks import Decks

        return Decks()
    if name == "records":
        from .records import Records

        return Records()
    if name == "fmus":
        from .fmus import Fmus

        return Fmus()
    if name == "commands":
        from .commands import Commands

        return Commands()
    from .interrupts import Interrupts

    return Interrupts()
