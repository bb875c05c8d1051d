"""The parts that a deck can name, read from their files: a list needs no numerical library."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping
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

    name: str
    bases: tuple[str, ...]
    text: str
    abstract: frozenset[str]
    given: frozenset[str]


def listed_parts() -> dict[str, tuple[str, str]]:
    """Return kind and law of each part of the package that can be declared, by name."""
    classes = {each.name: each for file in sorted(_FOLDER.rglob("*.py")) for each in _classes(file)}
    found = {}
    for name in sorted(classes):
        line = _line(name, classes)
        if name[0] == "_" or name in _BEGINNINGS or "Part" not in line or _open(line, classes):
            continue
        text = next((classes[each].text for each in line if each in classes and classes[each].text), "")
        found[name] = kind_of(line), first_paragraph(text)
    return found


def kind_of(line: tuple[str, ...]) -> str:
    """Return the kind of a part by the names of all classes that it descends from."""
    return next(kind for base, kind in _KINDS.items() if base in line)


def first_paragraph(text: str) -> str:
    """Return the first paragraph of a docstring in one line."""
    return inspect.cleandoc(text).split("\n\n")[0].replace("\n", " ")


def _classes(file: Path) -> Iterator[_Written]:
    for node in ast.parse(file.read_bytes()).body:
        if isinstance(node, ast.ClassDef):
            methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
            left = {each.name for each in methods if "abstractmethod" in map(_name, each.decorator_list)}
            given = {each.name for each in methods} - left
            for each in node.body:
                if isinstance(each, ast.Assign):
                    given |= {_name(target) for target in each.targets}
                elif isinstance(each, ast.AnnAssign) and each.value is not None:
                    given.add(_name(each.target))
            bases = tuple(map(_name, node.bases))
            text = ast.get_docstring(node, clean=False) or ""
            yield _Written(node.name, bases, text, frozenset(left), frozenset(given))


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


def _open(line: tuple[str, ...], classes: Mapping[str, _Written]) -> bool:
    """Tell whether something that a class descends from asks for what none before it gives."""
    given: set[str] = set()
    for each in (classes[name] for name in line if name in classes):
        if each.abstract - given:
            return True
        given |= each.given
    return False
