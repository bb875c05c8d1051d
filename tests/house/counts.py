"""The figures of a package and of its rooms, each with its definition."""

from __future__ import annotations

import ast
import graphlib
import statistics
from collections.abc import Sequence
from pathlib import Path

from tests import import_graph
from tests.house.modules import LEAST_LINES_OF_FILE, LEAST_LINES_OF_FUNCTION, Module, exported_by, sections

DEFINITIONS = {
    "files": "modules",
    "lines": "all lines of them",
    "code": "lines without docstrings (all strings that are statements), blank lines, comments and imports",
    "docstrings": "lines of docstrings",
    "imports": "lines of import statements",
    "median": "median lines of code of a file",
    "small": f"files with fewer than {LEAST_LINES_OF_FILE} lines of code, without __init__ and __main__",
    "classes": "classes",
    "dataclasses": "classes with the decorator dataclass",
    "functions": "functions and methods, nested ones too",
    "exported": "names in an __all__, each once",
    "private": "functions and methods whose name begins with one underscore",
    "once": "of these, named at one place in their module",
    "thin": f"of these, called, below {LEAST_LINES_OF_FUNCTION} lines of code, no method, not decorated",
    "sections": "lines of Parameters, Returns, Raises in docstrings of what is not exported",
}


def counted(modules: Sequence[Module], exported: frozenset[str]) -> dict[str, int]:
    """Count what is in these modules of a package that exports these names."""
    classes = [node for module in modules for node in module.of_kind(ast.ClassDef)]
    functions = [node for module in modules for node in module.of_kind(ast.FunctionDef, ast.AsyncFunctionDef)]
    helpers = [helper for module in modules for helper in module.helpers]
    inside = [
        text
        for module in modules
        for name, node in module.definitions()
        if name.partition(".")[0] not in exported
        for text in sections(node)
    ]
    return {
        "files": len(modules),
        "lines": sum(m.lines.total for m in modules),
        "code": sum(len(m.lines.code) for m in modules),
        "docstrings": sum(len(m.lines.docstrings) for m in modules),
        "imports": sum(len(m.lines.imports) for m in modules),
        "median": round(statistics.median(len(m.lines.code) for m in modules)),
        "small": sum(m.is_small for m in modules),
        "classes": len(classes),
        "dataclasses": sum("dataclass" in map(_decorator, node.decorator_list) for node in classes),
        "functions": len(functions),
        "exported": len(exported_by(modules)),
        "private": len(helpers),
        "once": sum(len(helper.uses) == 1 for helper in helpers),
        "thin": sum(helper.thin for helper in helpers),
        "sections": sum(len(text.splitlines()) for text in inside),
    }


def plan(package: Path) -> tuple[int, int, int]:
    """Count rooms (folders and modules directly below the package), arrows between them, and floors."""
    known = import_graph.modules(package)
    graph: dict[str, set[str]] = {_room(name): set() for name in known}
    for found in import_graph.imports(package):
        if found.target in known and _room(found.target) != _room(found.source):
            graph[_room(found.source)].add(_room(found.target))
    floors: dict[str, int] = {}
    for room in graphlib.TopologicalSorter(graph).static_order():
        floors[room] = 1 + max((floors[below] for below in graph[room]), default=0)
    return len(graph), sum(map(len, graph.values())), max(floors.values())


def _room(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def _decorator(node: ast.expr) -> str:
    return ast.unparse(node).partition("(")[0].rpartition(".")[2]
