"""The list of parts, which is read from files, is that of the classes that are there."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from nlsdesign.cli import look_up
from nlsdesign.components import Cam, DrivePart, Element, Sensor, component_classes
from nlsdesign.components.mechanics.bodies import Body
from nlsdesign.components.mechanics.gear import Transmission

KINDS = {
    "element": Element, "body": Body, "gear": Transmission, "cam": Cam, "sensor": Sensor, "drive": DrivePart,
}  # fmt: skip


def test_what_is_read_from_files_is_what_python_knows() -> None:
    found = look_up.listed_parts()
    known = component_classes()
    assert set(found) == set(known)
    assert len(found) > 80
    for name, (kind, law) in found.items():
        assert issubclass(known[name], KINDS[kind]), name
        assert law == " ".join((inspect.getdoc(known[name]) or "").partition("\n\n")[0].splitlines()), name


FILE = """
from abc import abstractmethod
class Element(Part):
    '''An element.'''
    @property
    @abstractmethod
    def order(self): ...
    @abstractmethod
    def law(self): ...
class Left(Element[int]):
    order = 1
class Right(Element):
    '''Right.

    More.'''
    def law(self): ...
class Both(Left, core.Right): ...
class _Hidden(Both): ...
class Again(Both):
    '''Again
    asked for.'''
    @abstractmethod
    def law(self): ...
class NoPart:
    order = 1
"""


def test_what_leaves_something_open_is_hidden_or_is_no_part_is_not_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "parts.py").write_text(FILE)
    monkeypatch.setattr(look_up, "_FOLDER", tmp_path)
    assert look_up.listed_parts() == {"Both": ("element", "Right.")}
