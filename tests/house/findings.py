"""The places behind the figures, a line each."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests import source
from tests.house.modules import LEAST_LINES_OF_FILE, Module, exported_by, sections
from tests.house.repetitions import pairs, sources

# A description that hardly says more than the name: one or two words, or up to four that begin so.
_EMPTY = re.compile(r"(Of|As|From|For)( \S+){1,3}|\S+( \S+)?")


def findings(root: Path, modules: Sequence[Module], room: str) -> Iterator[str]:
    """Everything that is to be looked at in a room, or in the modules below a path that begins so."""
    exported = exported_by(modules)
    below = room.rstrip("/") + "/"
    chosen = [module for module in modules if room == module.room or module.path.startswith(below)]
    for module in chosen:
        found = [*_shape(module), *_helpers(module), *_docstrings(module, exported)]
        yield from (f"{module.path}:{line} {text}" for line, text in sorted(found))
    paths = {module.file for module in chosen}
    for pair in pairs(sources(root)):
        (left, first, last), (right, start, end) = pair.left, pair.right
        if left in paths or right in paths:
            more = f" (and {pair.runs - 1} more runs)" if pair.runs > 1 else ""
            places = f"{left.relative_to(root)}:{first}-{last} - {pair.lines} equal lines in "
            yield f"{places}{right.relative_to(root)}:{start}-{end}{more}"
    yield from unused_exports(root, modules, chosen)


def unused_exports(root: Path, modules: Sequence[Module], chosen: Sequence[Module]) -> Iterator[str]:
    """Exported names that no document, study, model, front door or other room has a word of."""
    folders = [root / name for name in ("docs", "studies", "models", "examples")]
    texts = [
        root / "README.md",
        *root.glob("*/__init__.pyi"),
        *(f for top in folders for f in top.rglob("*.*")),
    ]
    for module in chosen:
        files = [*texts, *(other.file for other in modules if other.room != module.room)]
        words: set[str] = set()
        for file in files if module.exported else ():
            if file.suffix in (".py", ".pyi", ".md", ".ipynb"):
                words.update(re.findall(r"\w+", file.read_text(encoding="utf-8")))
        for name in sorted(module.exported - words):
            yield f"{module.path}:1 {name} - exported, and no document, study or other room names it"


def _shape(module: Module) -> Iterator[tuple[int, str]]:
    for text in module.outgrown:
        line, _, what = text.removeprefix("line ").partition(": ")
        yield int(line), f"- {what}"
    if module.is_small:
        yield 1, f"- the file has {len(module.lines.code)} lines of code, fewer than {LEAST_LINES_OF_FILE}"


def _helpers(module: Module) -> Iterator[tuple[int, str]]:
    for helper in module.helpers:
        name, uses = helper.node.name, len(helper.uses)
        if uses == 1:
            what = f"{helper.code} lines of code" + (", a slice" if helper.thin else "")
            yield helper.node.lineno, f"{name} - used once, line {helper.uses[0]}; {what}"
        elif not uses:
            yield helper.node.lineno, f"{name} - not used in its module"


def _docstrings(module: Module, exported: frozenset[str]) -> Iterator[tuple[int, str]]:
    for name, node in module.definitions():
        text, parts = ast.get_docstring(node) or "", sections(node)
        if name.partition(".")[0] not in exported:
            if parts:
                lines = sum(len(part.splitlines()) for part in parts)
                yield node.lineno, f"{name} - not exported, {lines} lines of sections"
            continue
        public = not any(source.is_private(part) for part in name.split("."))
        if public and not text:
            yield node.lineno, f"{name} - exported, without a docstring"
        elif public and source.signature(node) and not source.documented(text, "Parameters"):
            yield node.lineno, f"{name} - exported, without the section Parameters"
        for entry, description in re.findall(r"^(\S.*)\n    (.+)$", "\n".join(parts), flags=re.MULTILINE):
            if _EMPTY.fullmatch(description):
                yield node.lineno, f"{name} - says of {entry.partition(' : ')[0]} only '{description}'"
