"""One instance of each component, by group; the conformance test and the table of roads read them."""

from __future__ import annotations

import importlib
import pkgutil

from nlsdesign.components import Part


def examples() -> dict[type[Part], Part]:
    """Return an instance of each component by its class, over all groups."""
    found: dict[type[Part], Part] = {}
    for module in pkgutil.iter_modules(__path__):
        found |= importlib.import_module(f"{__name__}.{module.name}").EXAMPLES
    return found
