"""The examples in docstrings run and give what they say."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from collections.abc import Iterator

import pytest

import models
import nlsdesign


def modules() -> Iterator[str]:
    for package in (nlsdesign, models):
        yield package.__name__
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith("__main__"):
                yield found.name


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
