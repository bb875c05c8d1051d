"""The catalogue of missing effects: each row is an effect, and makes assemblies that have it.

A row is found by standing in a module of this room; it needs to be in no list. The module may be called as
its row is: ``effects.NAME`` gives the row.
"""

from __future__ import annotations

import importlib
import pkgutil

from ....foundation.errors import ArrangementError, unknown_name
from ....foundation.extensions import extension_modules
from .effect import Candidate, Edit, Effect, Form, Unknown


def catalogue() -> tuple[Effect, ...]:
    """Return the effects of all modules of this room, in the order of their ranks.

    Those of packages that the present block is extended by are among them. The order decides between effects
    that the records cannot tell apart.

    Raises
    ------
    ArrangementError
        If two effects have one name.
    """
    by_name: dict[str, Effect] = {}
    listed = (importlib.import_module(m.name) for m in pkgutil.iter_modules(__path__, f"{__name__}."))
    for module in (*listed, *extension_modules()):
        for row in vars(module).values():
            if isinstance(row, Effect) and by_name.setdefault(row.identifier, row) is not row:
                rule = f"has an effect '{row.identifier}', and so has the catalogue"
                raise ArrangementError(module.__name__, rule, next_step="give it another identifier")
            # Importing a module makes it an attribute of its package, where it would hide a row of its name.
            if isinstance(row, Effect) and module.__name__.startswith(f"{__name__}."):
                globals()[row.identifier] = row
    return tuple(sorted(by_name.values(), key=lambda row: row.rank))


ALL: tuple[Effect, ...] = catalogue()


def __getattr__(name: str) -> Effect:
    """Explain that there is no such effect; those of the catalogue are attributes of this room."""
    if name.startswith("__"):
        raise AttributeError(name)
    raise AttributeError(str(unknown_name("effect", name, [row.identifier for row in ALL])))


__all__ = [
    "ALL",
    "Candidate",
    "Edit",
    "Effect",
    "Form",
    "Unknown",
    "catalogue",
]
