"""The examples in docstrings run and give what they say."""

from __future__ import annotations

import doctest
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import models
import nlsdesign


def modules() -> Iterator[str]:
    """Modules whose text has an example."""
    for package in (nlsdesign, models):
        root = Path(package.__path__[0])
        for path in sorted(root.rglob("*.py")):
            if path.name != "__main__.py" and ">>>" in path.read_text(encoding="utf-8"):
                parts = path.relative_to(root.parent).with_suffix("").parts
                yield ".".join(parts[:-1] if path.name == "__init__.py" else parts)


def examples() -> Iterator[doctest.DocTest]:
    for name in modules():
        module = importlib.import_module(name)
        finder = doctest.DocTestFinder(exclude_empty=True)
        # Only what the module itself defines; a name that it exports is tested where it stands.
        yield from (found for found in finder.find(module, name) if found.examples)


FOUND = {found.name: found for found in examples()}


@pytest.mark.parametrize("name", FOUND)
def test_the_example_gives_what_it_says(name: str) -> None:
    told: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(FOUND[name], out=told.append)
    assert result.failed == 0, "".join(told)


def test_the_laws_and_the_rooms_have_examples() -> None:
    rooms = {name.split(".")[1] for name in FOUND if name.startswith("nlsdesign.")}
    assert {"components", "model"} <= rooms
    assert len(FOUND) >= 15
