"""The parts that a deck can name, read from their files: a list needs no numerical library."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

_FOLDER = Path(__file__).parents[1] / "components"
_KINDS = {
    "Element": "element", "Body": "body", "Transmission": "gear", "Cam": "cam", "Sensor": "sensor",
    "DrivePart": "drive",
}  # fmt: skip
"""Kind of a part by the class that it descends from."""
_BEGINNINGS = {"Part", "Tie"}
"""From which parts descend, and which are none themselves."""


@dataclass(frozen=True)
class _Written:
    """A class as it is written: what it descends from, what it leaves open, and what it gives."""

    bases: tuple[str, ...]
    text: str
    abstract: frozenset[str]
    given: frozenset[str]

    @classmethod
    def of(cls, node: ast.ClassDef) -> _Written:
        """Return what a definition says."""
        methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
        abstract = {each.name for each in methods if "abstractmethod" in map(_name, each.decorator_list)}
        given = {each.name for each in methods} - abstract
        for each in node.body:
            if isinstance(each, ast.Assign):
                given |= set(map(_name, each.targets))
            elif isinstance(each, ast.AnnAssign) and each.value is not None:
                given.add(_name(each.target))
        text = ast.get_docstring(node, clean=False) or ""
        return cls(tuple(map(_name, node.bases)), text, frozenset(abstract), frozenset(given))


def listed_parts() -> dict[str, tuple[str, str]]:
    """Return kind and law of each part of the package that can be declared, by name."""
    nodes = (node for file in sorted(_FOLDER.rglob("*.py")) for node in ast.parse(file.read_bytes()).body)
    classes = {node.name: _Written.of(node) for node in nodes if isinstance(node, ast.ClassDef)}
    kinds = {}
    for name in sorted(classes):
        line = _line(name, classes)
        left_open: frozenset[str] = frozenset()
        for each in (classes[base] for base in reversed(line) if base in classes):
            left_open = left_open - each.given | each.abstract
        if name[0] == "_" or name in _BEGINNINGS or "Part" not in line or left_open:
            continue
        text = next((classes[base].text for base in line if base in classes and classes[base].text), "")
        kinds[name] = kind_of(line), first_paragraph(text)
    return kinds


def kind_of(line: tuple[str, ...]) -> str:
    """Return the kind of a part by the names of all classes that it descends from."""
    return next(kind for base, kind in _KINDS.items() if base in line)


def first_paragraph(text: str) -> str:
    """Return the first paragraph of a docstring in one line."""
    return inspect.cleandoc(text).split("\n\n")[0].replace("\n", " ")


def _name(node: ast.expr) -> str:
    """Return the last name of an expression: of ``a.B[c]`` it is ``B``."""
    while isinstance(node, ast.Subscript | ast.Call):
        node = node.value if isinstance(node, ast.Subscript) else node.func
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _line(name: str, classes: Mapping[str, _Written]) -> tuple[str, ...]:
    """Return a class and all that it descends from, each before its own bases."""
    below = [
        each for base in (classes[name].bases if name in classes else ()) for each in _line(base, classes)
    ]
    # A base that several share stands where it comes last.
    return (name, *reversed(dict.fromkeys(reversed(below))))
