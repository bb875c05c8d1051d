"""The catalogue of missing effects, in tables: each row is an effect, and makes assemblies that have it.

A row, or a function with a rank, is found by standing in a module of this room; it needs to be in no list.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType

from ....foundation.errors import ArrangementError, unknown_name
from ....foundation.extensions import extension_modules
from .candidate import Candidate, Unknown
from .effect import Edit, Effect, Form, Ranked, ranked


def _own() -> Iterator[ModuleType]:
    for listed in pkgutil.iter_modules(__path__, f"{__name__}."):
        yield importlib.import_module(listed.name)


def catalogue() -> tuple[Effect | Ranked, ...]:
    """Return the effects of all modules of this room, in the order of their ranks.

    Those of packages that the present block is extended by are among them. The order decides between effects
    that the records cannot tell apart.

    Raises
    ------
    ArrangementError
        If two effects have one name.
    """
    by_name: dict[str, Effect | Ranked] = {}
    for module in (*_own(), *extension_modules()):
        for row in vars(module).values():
            if isinstance(row, Effect | Ranked) and by_name.setdefault(row.__name__, row) is not row:
                rule = f"has an effect '{row.__name__}', and so has the catalogue"
                raise ArrangementError(module.__name__, rule, next_step="give it another identifier")
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
    "Form",
    "Ranked",
    "Unknown",
    "catalogue",
    "ranked",
]
