"""Reads from the source, without running it, which module of a package imports what."""

from __future__ import annotations

import ast
import functools
import graphlib
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.source import children, parse


@dataclass(frozen=True)
class Import:
    """One import statement, at module level or lazy (inside a function)."""

    source: str
    target: str
    line: int
    lazy: bool

    def __str__(self) -> str:
        return f"{self.source}, line {self.line}, imports {self.target}"


def modules(package: Path) -> dict[str, Path]:
    """Dotted name and file of every module; a package carries the name of its folder."""
    found = {}
    for file in sorted(package.rglob("*.py")):
        parts = (package.name, *file.relative_to(package).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def imports(package: Path) -> list[Import]:
    """All imports in all modules: also lazy ones, those for type checking, and ``import_module("...")``."""
    files = modules(package)
    return list(_imports_as_of(tuple((name, file, file.stat().st_mtime_ns) for name, file in files.items())))


@functools.lru_cache(maxsize=2)
def _imports_as_of(files: tuple[tuple[str, Path, int], ...]) -> tuple[Import, ...]:
    """The same, read once for files that have not changed."""
    known = {name: file for name, file, _ in files}
    return tuple(found for source, file in known.items() for found in _imports_of(source, file, known))


def cycles(edges: Iterable[tuple[str, str]]) -> list[str]:
    """One cycle for each depth at which there is one: among the packages first, among modules last."""
    edges = list(edges)
    depth = max((name.count(".") + 1 for edge in edges for name in edge), default=0)
    found = []
    for parts in range(2, depth + 1):
        graph: dict[str, set[str]] = {}
        for source, target in edges:
            here, there = (".".join(name.split(".")[:parts]) for name in (source, target))
            if here != there:
                graph.setdefault(here, set()).add(there)
        try:
            graphlib.TopologicalSorter(graph).prepare()
        except graphlib.CycleError as error:
            # The sorter lists importer after imported; reversed it reads "a imports b imports a".
            cycle = " -> ".join(reversed(error.args[1]))
            if cycle not in found:
                found.append(cycle)
    return found


def _imports_of(source: str, file: Path, known: dict[str, Path]) -> Iterator[Import]:
    package = source if file.name == "__init__.py" else source.rpartition(".")[0]
    for node, lazy in _importing(parse(file)):
        for target in _targets(node, package, known):
            yield Import(source, target, getattr(node, "lineno", 0), lazy)


@functools.lru_cache(maxsize=600)
def _importing(tree: ast.Module) -> tuple[tuple[ast.AST, bool], ...]:
    """Return what may import, and whether it does so inside a function; a tree is walked once."""
    functions = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
    waiting: deque[tuple[ast.AST, bool]] = deque([(tree, False)])
    result = []
    while waiting:
        node, lazy = waiting.popleft()
        if isinstance(node, ast.Import | ast.ImportFrom | ast.Call):
            result.append((node, lazy))
        inside = lazy or isinstance(node, functions)
        waiting.extend((child, inside) for child in children(node))
    return tuple(result)


def _targets(node: ast.AST, package: str, known: dict[str, Path]) -> Iterator[str]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield alias.name
            if alias.asname is None and "." in alias.name:
                yield alias.name.partition(".")[0]  # this is the name that the statement binds
    elif isinstance(node, ast.ImportFrom):
        base = absolute("." * node.level + (node.module or ""), package)
        for alias in node.names:
            inner = f"{base}.{alias.name}"
            yield inner if inner in known else base
    elif isinstance(node, ast.Call) and node.args:
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        argument = node.args[0]
        if name in ("import_module", "__import__") and isinstance(argument, ast.Constant):
            yield absolute(str(argument.value), package)


def absolute(name: str, package: str) -> str:
    """Resolve leading dots: one stands for the package of the module, each further one for its parent."""
    tail = name.lstrip(".")
    dots = len(name) - len(tail)
    if dots == 0:
        return tail
    parts = package.split(".")
    base = ".".join(parts[: len(parts) - dots + 1])
    return f"{base}.{tail}" if tail else base
