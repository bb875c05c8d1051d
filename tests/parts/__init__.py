"""Instances of each component in each of its readings; the conformance test reads them."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from nlsdesign.components import Part


def examples() -> list[Part]:
    """Return one instance of each component and reading: of the groups, and of tests that bring their own."""
    names = [f"{__name__}.{module.name}" for module in pkgutil.iter_modules(__path__)]
    tests = (Path(__file__).parents[1] / "physics").glob("test_*.py")
    names += [f"tests.physics.{p.stem}" for p in tests if "\nEXAMPLES" in p.read_text(encoding="utf-8")]
    return [part for name in sorted(names) for part in importlib.import_module(name).EXAMPLES]
