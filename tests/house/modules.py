"""The modules of a package as they are counted: lines, definitions, private functions, exported names."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tests import source
from tests.source import Function

LEAST_LINES_OF_FUNCTION = 4
LEAST_LINES_OF_FILE = 30

_SECTION = re.compile(r"^(?:Parameters|Returns|Yields|Raises)\n-+\n(?:(?!\w[^\n]*\n---).*\n?)*", re.MULTILINE)


@dataclass(frozen=True)
class Helper:
    """A private function or method with its lines of code and the lines of its module that name it."""

    node: Function
    code: int
    uses: tuple[int, ...]
    thin: bool  # called once, with fewer than the least lines of code, and nothing asks for a function


@dataclass(frozen=True)
class Module:
    """One file of a package, its path within the project, and the folder below the package it is in."""

    file: Path
    path: str
    room: str

    @property
    def name(self) -> str:
        """Dotted, as it is imported."""
        return self.path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")

    @cached_property
    def tree(self) -> ast.Module:
        return source.parse(self.file)

    @cached_property
    def lines(self) -> source.Lines:
        return source.lines_of(self.file, self.of_kind(ast.Import, ast.ImportFrom, ast.Expr))

    @cached_property
    def exported(self) -> frozenset[str]:
        """Names in ``__all__``."""
        lists = (node for node in self.tree.body if isinstance(node, ast.Assign))
        named = (node.value for node in lists if "__all__" in map(ast.unparse, node.targets))
        words = (
            inner.value for value in named for inner in ast.walk(value) if isinstance(inner, ast.Constant)
        )
        return frozenset(word for word in words if isinstance(word, str))

    @cached_property
    def nodes(self) -> dict[type[ast.AST], list[Any]]:
        found: dict[type[ast.AST], list[Any]] = {}
        for node in source.walk(self.tree):
            found.setdefault(type(node), []).append(node)
        return found

    def of_kind(self, *kinds: type[ast.AST]) -> list[Any]:
        return [node for kind in kinds for node in self.nodes.get(kind, ())]

    @cached_property
    def outgrown(self) -> list[str]:
        """Say what is beyond the bounds of a file, function, list of arguments or class."""
        definitions = self.of_kind(ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
        return list(source.outgrown(definitions, self.lines))

    @property
    def is_small(self) -> bool:
        """Tell whether it has fewer than the least lines of code and is no front of a folder."""
        front = self.file.stem in ("__init__", "__main__")
        return not front and len(self.lines.code) < LEAST_LINES_OF_FILE

    @cached_property
    def helpers(self) -> list[Helper]:
        """Private functions and methods; a property and its setter, which share a name, are one."""
        uses: dict[str, list[ast.AST]] = {}
        for node in self.of_kind(ast.Name, ast.Attribute):
            uses.setdefault(getattr(node, "id", "") or getattr(node, "attr", ""), []).append(node)
        called = {id(node.func) for node in self.of_kind(ast.Call)}  # type: ignore[attr-defined]
        found = {}
        for node in self.of_kind(ast.FunctionDef, ast.AsyncFunctionDef):
            if isinstance(node, Function) and re.match(r"_(?!_)", node.name):
                code, named = self.lines.code_of(node), uses.get(node.name, [])
                lines = tuple(sorted(place.lineno for place in named))  # type: ignore[attr-defined]
                recursive = any(node.lineno <= line <= (node.end_lineno or 0) for line in lines)
                free = node in self.tree.body and not node.decorator_list and not recursive
                once = len(named) == 1 and id(named[0]) in called
                found[node.name] = Helper(node, code, lines, free and once and code < LEAST_LINES_OF_FUNCTION)
        return list(found.values())

    def definitions(self) -> Iterator[tuple[str, Function | ast.ClassDef]]:
        """Functions and classes of the module and their methods, named ``Class.method``."""
        waiting: list[tuple[str, ast.Module | ast.ClassDef]] = [("", self.tree)]
        for prefix, around in waiting:
            for node in around.body:
                if isinstance(node, Function | ast.ClassDef):
                    yield prefix + node.name, node
                if isinstance(node, ast.ClassDef):
                    waiting.append((f"{prefix}{node.name}.", node))


def sections(node: Function | ast.ClassDef) -> list[str]:
    """Parameters, Returns, Yields and Raises of a docstring, each from its head to its last line."""
    return [found[0].rstrip() for found in _SECTION.finditer((ast.get_docstring(node) or "") + "\n")]


def modules(package: Path) -> list[Module]:
    """All modules of a package; those that are in no folder have the package as their room."""
    found = []
    for file in sorted(package.rglob("*.py")):
        inner = file.relative_to(package).parts
        room = inner[0] if len(inner) > 1 else package.name
        found.append(Module(file, file.relative_to(package.parent).as_posix(), room))
    return found


def exported_by(modules: Iterable[Module]) -> frozenset[str]:
    return frozenset[str]().union(*(module.exported for module in modules))
