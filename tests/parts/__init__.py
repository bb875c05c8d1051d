"""One instance of each component, by group; the conformance test and the table of roads read them."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from nlsdesign.components import Part


def examples() -> dict[type[Part], Part]:
    """Return an instance of each component by its class: of the groups, and of tests that bring their own."""
    names = [f"{__name__}.{module.name}" for module in pkgutil.iter_modules(__path__)]
    tests = (Path(__file__).parents[1] / "physics").glob("test_*.py")
    names += [f"tests.physics.{p.stem}" for p in tests if "\nEXAMPLES" in p.read_text(encoding="utf-8")]
    found: dict[type[Part], Part] = {}
    for name in sorted(names):
        found |= importlib.import_module(name).EXAMPLES
    return found
