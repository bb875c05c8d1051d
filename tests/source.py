"""Reads the project's own source and documents: what is public, how big it is, what it points at."""

from __future__ import annotations

import ast
import bisect
import builtins
import functools
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

Function = ast.FunctionDef | ast.AsyncFunctionDef

# Lines of code: docstrings, comments, blank lines and imports cost a reader little and do not count.
MOST_LINES_IN_FILE = 400
MOST_LINES_IN_FUNCTION = 50
MOST_ARGUMENTS = 7
MOST_METHODS = 12
SECTIONS = ("Parameters", "Returns", "Yields", "Raises", "Warns", "Attributes")


@dataclass(frozen=True)
class Definition:
    """A function, method or class that is public by its name and the names around it."""

    name: str
    node: Function | ast.ClassDef
    line: int


@dataclass(frozen=True)
class Lines:
    """Numbers of the lines of a module by what stands there; a string that is a statement is a docstring."""

    total: int
    docstrings: frozenset[int]
    imports: frozenset[int]
    code: tuple[int, ...]

    def code_of(self, node: ast.AST) -> int:
        """Count the lines of code of a definition, from ``def`` or ``class`` on, inner ones included."""
        first, last = node.lineno, node.end_lineno  # type: ignore[attr-defined]
        return bisect.bisect_right(self.code, last) - bisect.bisect_left(self.code, first)


def parse(file: Path) -> ast.Module:
    """Parse a file, once for each of its versions; nobody changes a tree."""
    return _parsed(file, file.stat().st_mtime_ns)


@functools.lru_cache(maxsize=600)
def _parsed(file: Path, changed: int) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"), filename=str(file))


def walk(tree: ast.AST) -> Iterable[ast.AST]:
    """Return all nodes; those of a module are listed once."""
    return _listed(tree) if isinstance(tree, ast.Module) else ast.walk(tree)


@functools.lru_cache(maxsize=600)
def _listed(tree: ast.Module) -> tuple[ast.AST, ...]:
    nodes: list[ast.AST] = [tree]
    for node in nodes:  # it grows meanwhile
        nodes += children(node)
    return tuple(nodes)


def children(node: ast.AST) -> list[ast.AST]:
    """Return the nodes directly below, without ``Load`` and ``Store``; twice as fast as those of ast."""
    below: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, list):
            below += [item for item in value if isinstance(item, ast.AST)]
        elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
            below.append(value)
    return below


def forget() -> None:
    """Let go of the trees, which together take hundreds of megabytes."""
    _parsed.cache_clear()
    _listed.cache_clear()


def lines_of(file: Path, nodes: Iterable[ast.AST] | None = None) -> Lines:
    """Sort the lines of a file; with its nodes (imports and expressions) where it was read already."""
    text = file.read_text(encoding="utf-8").splitlines()
    docstrings: set[int] = set()
    imported: set[int] = set()
    for node in walk(parse(file)) if nodes is None else nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            imported.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        elif isinstance(node, ast.Expr) and isinstance(getattr(node.value, "value", None), str):
            docstrings.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    filled = (n for n, line in enumerate(text, 1) if line.strip() and not line.lstrip().startswith("#"))
    code = tuple(n for n in filled if n not in docstrings and n not in imported)
    return Lines(len(text), frozenset(docstrings), frozenset(imported), code)


def is_private(name: str) -> bool:
    return name.startswith("_")


def public_definitions(tree: ast.Module) -> Iterator[Definition]:
    """Public functions and classes of a module, and the public methods of those classes."""
    for node in tree.body:
        if not isinstance(node, Function | ast.ClassDef) or is_private(node.name):
            continue
        yield Definition(node.name, node, node.lineno)
        for inner in node.body if isinstance(node, ast.ClassDef) else ():
            if isinstance(inner, Function) and not is_private(inner.name):
                yield Definition(f"{node.name}.{inner.name}", inner, inner.lineno)


def undocumented(file: Path) -> Iterator[str]:
    """Public definitions without a docstring; the module itself counts."""
    tree = parse(file)
    if not ast.get_docstring(tree):
        yield "line 1: the module has no docstring"
    for found in public_definitions(tree):
        if not ast.get_docstring(found.node) and not _speaks_for_another(found.node):
            yield f"line {found.line}: {found.name} has no docstring"


def untyped(file: Path) -> Iterator[str]:
    """Arguments and results of public functions without annotation; constructors count."""
    for found in public_definitions(parse(file)):
        methods = found.node.body if isinstance(found.node, ast.ClassDef) else [found.node]
        for node in methods:
            if not isinstance(node, Function) or (node is not found.node and node.name != "__init__"):
                continue
            names = [argument.arg for argument in arguments(node) if argument.annotation is None]
            if node.returns is None:
                names.append("the result")
            if names:
                yield f"line {node.lineno}: {found.name} has no type for {', '.join(names)}"


def misshapen(file: Path) -> Iterator[str]:
    """Files, functions, argument lists and classes that have outgrown the limits above."""
    nodes = list(walk(parse(file)))
    yield from outgrown(nodes, lines_of(file, nodes))


def outgrown(nodes: Iterable[ast.AST], lines: Lines) -> Iterator[str]:
    """Say the same of a file that was read already: of its functions and classes."""
    if len(lines.code) > MOST_LINES_IN_FILE:
        yield f"line 1: the file has {len(lines.code)} lines of code, limit {MOST_LINES_IN_FILE}"
    for node in nodes:
        if isinstance(node, Function):
            length, count = lines.code_of(node), len(arguments(node))
            if length > MOST_LINES_IN_FUNCTION:
                most = f"limit {MOST_LINES_IN_FUNCTION}"
                yield f"line {node.lineno}: {node.name} has {length} lines of code, {most}"
            if count > MOST_ARGUMENTS:
                yield f"line {node.lineno}: {node.name} has {count} arguments, limit {MOST_ARGUMENTS}"
        elif isinstance(node, ast.ClassDef):
            # A property and its setter, or the overloads of one method, share one name and count once.
            methods = {inner.name for inner in node.body if isinstance(inner, Function)}
            if len(methods) > MOST_METHODS:
                yield f"line {node.lineno}: {node.name} has {len(methods)} methods, limit {MOST_METHODS}"


def arguments(node: Function) -> list[ast.arg]:
    """All arguments but ``self`` and ``cls``."""
    every = node.args
    listed = [*every.posonlyargs, *every.args]
    if listed and listed[0].arg in ("self", "cls"):
        listed = listed[1:]
    return [*listed, *every.kwonlyargs, *(one for one in (every.vararg, every.kwarg) if one)]


def tests_in(file: Path) -> set[str]:
    """Names of the tests in a file as pytest writes them: ``test_a`` or ``TestB::test_a``."""
    found = set()
    for node in parse(file).body:
        if isinstance(node, Function):
            found.add(node.name)
        elif isinstance(node, ast.ClassDef):
            found |= {f"{node.name}::{inner.name}" for inner in node.body if isinstance(inner, Function)}
    return {name for name in found if name.rpartition("::")[2].startswith("test")}


def broken_links(document: Path, root: Path) -> Iterator[str]:
    """Relative links of a Markdown document whose file or heading does not exist in the project."""
    text = document.read_text(encoding="utf-8")
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"`[^`\n]*`", "`code`", text)
    links = re.findall(r"\]\(\s*<?([^)>\s]+)>?[^)]*\)", text)
    links += re.findall(r"^\s*\[[^\]]+\]:\s*<?([^>\s]+)", text, flags=re.MULTILINE)
    links += re.findall(r"(?:src|href)=[\"']([^\"']+)[\"']", text)
    for link in links:
        if re.match(r"[a-z][a-z0-9+.-]*:", link):
            continue
        name, _, heading = link.partition("#")
        target = (document.parent / name).resolve() if name else document
        if not target.exists() or not target.is_relative_to(root):
            yield f"{link}: there is no such file in the project"
        elif heading and target.suffix == ".md" and heading not in headings(target):
            yield f"{link}: there is no such heading"


def headings(document: Path) -> set[str]:
    """The anchors that a Markdown viewer makes of the headings."""
    found = re.findall(r"^#+\s+(.*?)\s*$", document.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in found}


def mismatched(file: Path, exceptions: Mapping[str, str], exported: Container[str]) -> Iterator[str]:
    """Docstrings of public definitions that disagree with the code about parameters or exceptions.

    An exported function documents its parameters, the same names in the same order; classes and methods,
    many of which do what their base says, are compared where they have the section. What is exported lists
    below ``Raises`` every class that the body itself raises, and only classes that exist.

    Parameters
    ----------
    file
        Module.
    exceptions
        What may be raised: name of a class, or of a function that returns an exception, and the class.
    exported
        Functions and classes of the module that users are offered.
    """
    for definition in public_definitions(parse(file)):
        text = ast.get_docstring(definition.node)
        if not text or _speaks_for_another(definition.node) or _is_command(definition.node):
            continue
        where = f"line {definition.line}: {definition.name}"
        offered = definition.name.partition(".")[0] in exported
        written, actual = documented(text, "Parameters"), signature(definition.node)
        asked = definition.name in exported and isinstance(definition.node, Function)
        if written != actual and (written or asked):
            yield f"{where} documents the parameters {written}, the signature has {actual}"
        if not offered:
            continue
        listed, raised = documented(text, "Raises"), raises(definition.node, exceptions)
        for name in raised:
            if name not in listed:
                yield f"{where} raises {name}, which its docstring does not list"
        for name in listed:
            if name not in exceptions.values():
                yield f"{where} lists {name}, which is no exception"


def overdocumented(file: Path, exported: Container[str]) -> Iterator[str]:
    """Docstrings with sections that only what is exported has; of any class the fields may be documented."""
    for name, node in definitions(parse(file)):
        first, *inner = name.split(".")
        if (first in exported and not any(map(is_private, inner))) or _is_command(node):
            continue
        found = re.findall(
            rf"^({'|'.join(SECTIONS)})\n-+$", ast.get_docstring(node) or "", flags=re.MULTILINE
        )
        for section in found:
            if section not in ("Parameters", "Attributes") or not isinstance(node, ast.ClassDef):
                yield f"line {node.lineno}: {name} is not exported and has a section {section}"


def definitions(tree: ast.AST, within: str = "") -> Iterator[tuple[str, Function | ast.ClassDef]]:
    """All functions and classes with their dotted names; those inside a function stand below ``_``."""
    for node in children(tree):
        if isinstance(node, Function | ast.ClassDef):
            yield within + node.name, node
            inside = "" if isinstance(node, ast.ClassDef) else "_."
            yield from definitions(node, f"{within}{node.name}.{inside}")
        elif isinstance(node, ast.stmt | ast.excepthandler | ast.match_case):  # no expression defines any
            yield from definitions(node, within)


def documented(text: str, section: str) -> list[str]:
    """Return the names in a section of a docstring in numpy's style."""
    found = re.search(rf"^{section}\n-+\n(.*?)(?:\n\n[^\n]+\n---|\Z)", text, flags=re.MULTILINE | re.DOTALL)
    lines = found[1].splitlines() if found else []
    heads = [line.partition(" : ")[0] for line in lines if line[:1].strip()]
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def signature(node: Function | ast.ClassDef) -> list[str]:
    """Return the names that a call may give; of a class those of ``__init__``, or its fields."""
    if isinstance(node, Function):
        every = [*node.args.posonlyargs, *node.args.args, node.args.vararg, *node.args.kwonlyargs]
        names = [argument.arg for argument in (*every, node.args.kwarg) if argument]
        return names[1:] if names[:1] in (["self"], ["cls"]) else names
    for inner in node.body:
        if isinstance(inner, Function) and inner.name == "__init__":
            return signature(inner)
    fields = (inner for inner in node.body if isinstance(inner, ast.AnnAssign))
    return [
        field.target.id
        for field in fields
        if isinstance(field.target, ast.Name)
        and not is_private(field.target.id)
        and "ClassVar" not in ast.unparse(field.annotation)
        and "init=False" not in ast.unparse(field)
        and not _describes_itself(field)
    ]


def raises(node: Function | ast.ClassDef, exceptions: Mapping[str, str]) -> list[str]:
    """Return the classes that a body raises itself; of a class those that making an object raises."""
    if isinstance(node, ast.ClassDef):
        made = [n for n in node.body if isinstance(n, Function) and n.name in ("__init__", "__post_init__")]
        return sorted({name for inner in made for name in raises(inner, exceptions)})
    names = set()
    for inner in _own_statements(node):
        if isinstance(inner, ast.Raise) and isinstance(inner.exc, ast.Call):
            name = ast.unparse(inner.exc.func)
            if name in exceptions:
                names.add(exceptions[name])
    return sorted(names)


def exceptions_of(files: Iterable[Path]) -> dict[str, str]:
    """Built-in exceptions, those of the files, and the functions there that return one, with its class."""
    names = {name: name for name, kind in vars(builtins).items() if _is_exception(kind)}
    trees = [parse(file) for file in files]
    for node in (node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)):
        if any(ast.unparse(base) in names for base in node.bases):
            names[node.name] = node.name
    for node in (node for tree in trees for node in tree.body if isinstance(node, Function)):
        if node.returns and ast.unparse(node.returns) in names:
            names[node.name] = ast.unparse(node.returns)
    return names


def _is_exception(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseException)


def _is_command(node: ast.AST) -> bool:
    """The docstring of a command is what ``--help`` shows."""
    names = {ast.unparse(decorator) for decorator in getattr(node, "decorator_list", ())}
    return any(re.match(r"(\w+\.)?(command|group)\(", name) for name in names)


def _describes_itself(field: ast.AnnAssign) -> bool:
    """The numbers of a part carry unit, range and meaning in their declaration."""
    return isinstance(field.value, ast.Call) and ast.unparse(field.value.func) == "parameter"


def _own_statements(node: ast.AST) -> Iterator[ast.AST]:
    """Everything below a function but what stands in functions and classes inside it."""
    for inner in ast.iter_child_nodes(node):
        if not isinstance(inner, Function | ast.ClassDef | ast.Lambda):
            yield inner
            yield from _own_statements(inner)


def _speaks_for_another(node: ast.AST) -> bool:
    """Overloads and setters are documented where the function or property itself is."""
    names = {ast.unparse(decorator) for decorator in getattr(node, "decorator_list", ())}
    return any(name.rpartition(".")[2] in ("overload", "setter", "deleter") for name in names)
