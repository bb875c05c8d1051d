"""Digest of the code that decides a diagnosis: of syntax trees, without comments and docstrings."""

from __future__ import annotations

import ast
import functools
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DECIDING = ("nlsdesign/bench", "nlsdesign/components", "nlsdesign/model")
"""The diagnosis and the fits, the laws that they try, and how a machine becomes equations."""
COUNTED = re.compile(r"^Counted with the code `([0-9a-f]{12})`", re.MULTILINE)


@functools.cache
def digest(root: Path = ROOT) -> str:
    """Return twelve digits that change when code that decides changes, and not with a comment or a docstring.

    Parameters
    ----------
    root
        Of the checkout.
    """
    whole = hashlib.sha256()
    for folder in DECIDING:
        for file in sorted((root / folder).rglob("*.py")):
            whole.update(file.relative_to(root).as_posix().encode())
            whole.update(shape(file.read_text(encoding="utf8")).encode())
    return whole.hexdigest()[:12]


def shape(text: str) -> str:
    """Return the syntax tree of a module as text, without docstrings and places; the same for every Python.

    Parameters
    ----------
    text
        Of the module.
    """
    return "".join(_written(ast.parse(text)))


def _written(node: Any) -> Iterator[str]:
    if isinstance(node, ast.AST):
        yield f"({type(node).__name__}"
        for field, value in ast.iter_fields(node):
            if field == "body" and isinstance(
                node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
            ):
                value = value[1:] if ast.get_docstring(node, clean=False) is not None else value
            # Later Pythons have fields more, which are empty for what is written here.
            if value is not None and value != [] and field not in ("kind", "type_comment"):
                yield f" {field}="
                yield from _written(value)
        yield ")"
    elif isinstance(node, list):
        for item in node:
            yield from _written(item)
    else:
        yield repr(node)


def counted_with(page: Path) -> list[str]:
    """Return the digests of the code that a page says it was counted with.

    Parameters
    ----------
    page
        Written by ``benchmarks.discrepancy_score``.
    """
    return COUNTED.findall(page.read_text(encoding="utf8"))
