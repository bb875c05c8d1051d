"""The catalogue of missing effects, in tables: each row is an effect, and makes assemblies that have it.

A row, or a function with a rank, is found by standing in a module of this room; it needs to be in no list.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator

from ...errors import unknown_name
from .candidate import Candidate, EffectFunction, Unknown, wrapped
from .effect import Edit, Effect, Form, Ranked, ranked


def _rows() -> Iterator[Effect | Ranked]:
    for listed in pkgutil.iter_modules(__path__, f"{__name__}."):
        module = importlib.import_module(listed.name)
        yield from (value for value in vars(module).values() if isinstance(value, Effect | Ranked))


def catalogue() -> tuple[Effect | Ranked, ...]:
    """Return the effects of all modules of this room, in the order of their ranks.

    The order decides between effects that the records cannot tell apart.
    """
    by_name = {row.__name__: row for row in _rows()}
    return tuple(sorted(by_name.values(), key=lambda row: row.rank))


ALL: tuple[Effect | Ranked, ...] = catalogue()


def __getattr__(name: str) -> Effect | Ranked:
    """Return an effect of the catalogue by its identifier."""
    for row in ALL:
        if row.__name__ == name:
            return row
    if name.startswith("__"):
        raise AttributeError(name)
    raise AttributeError(str(unknown_name("effect", name, [row.__name__ for row in ALL])))


__all__ = [
    "ALL",
    "Candidate",
    "Edit",
    "Effect",
    "EffectFunction",
    "Form",
    "Ranked",
    "Unknown",
    "catalogue",
    "ranked",
    "wrapped",
]
