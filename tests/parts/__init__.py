"""Instances of each component in each of its readings; the conformance test reads them."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from nlsdesign.components import Part, Tie, component_classes
from nlsdesign.components.core.part_numbers import readings


def declarable() -> list[type[Part]]:
    """Return every component that can be declared: the list is that of the room, where laws are found."""
    return sorted({*component_classes().values(), Tie}, key=lambda kind: kind.__name__)


def examples() -> list[Part]:
    """Return one instance of each component and reading: of the groups, and of tests that bring their own."""
    names = [f"{__name__}.{module.name}" for module in pkgutil.iter_modules(__path__)]
    tests = (Path(__file__).parents[1] / "physics").glob("test_*.py")
    names += [f"tests.physics.{p.stem}" for p in tests if "\nEXAMPLES" in p.read_text(encoding="utf-8")]
    return [part for name in sorted(names) for part in importlib.import_module(name).EXAMPLES]


def missing_examples(kind: type[Part]) -> str:
    """Return what has still to be added for a component, in words; nothing if its examples are complete."""
    own = [part for part in examples() if type(part) is kind]
    if not own:
        return f"{kind.__name__} has no example: add one to EXAMPLES of a file in tests/parts"
    for field, kinds in readings(kind).items():
        without = [r.__name__ for r in kinds if r not in {type(getattr(part, field)) for part in own}]
        if without:
            return f"{kind.__name__} has no example with {field} = {' or '.join(without)} in tests/parts"
    return ""
