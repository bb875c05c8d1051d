"""Names say one thing each: no class or file name with two meanings, no private dialect, units typeset.

Each rule runs once per room, so that a failure names the room that breaks it.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from nlsdesign.foundation.errors import UnitError
from nlsdesign.foundation.quantity import parse_unit
from tests import source

ROOMS = (
    *("foundation", "components", "model", "simulation", "design", "feedback", "bench", "export"),
    *("sweeps", "presentation", "live", "cli", "top", "models", "studies"),
)
"""The rooms of the package; ``top`` are the modules beside them, ``models`` and ``studies`` other folders."""

DIALECT = frozenset(
    {
        "astray",
        "bent",
        "crew",
        "dear",
        "few",
        "found",
        "gone",
        "grain",
        "mine",
        "play",
        "rough",
        "said",
        "sketch",
        "suspicion",
        "told",
        "trial",
        "valley",
        "wild",
        "word",
        "worth",
    }
)
"""Names that do not say what a variable holds."""

SAME_NAME = {
    # A command has the name of the room or module that it runs.
    "cli": {"cosimulate", "design", "export", "sweep"},
    # An effect of the catalogue has the name of the part that it adds.
    "bench/discrepancy/effects": {"friction"},
}
"""Files that may have the name of another file or room: the same thing, seen by another room."""

UNIT_IN_ASCII = re.compile(r"\b[mkM]?N\*m|\bkg\*m|\bPa\*s|\bN\*s|\bm\^\d|\bs\^-?\d")
"""Units that people read are typeset: N·m, kg·m², Pa·s."""
QUOTED = re.compile(r"'[^']*'|`[^`]*`|\"[^\"]*\"")
"""Quoted in a text stands what a person may write for the machine."""


# --- what is read ---------------------------------------------------------------------------------


def sources_of(root: Path, room: str) -> list[Path]:
    """Python files of a room."""
    package = root / "nlsdesign"
    if room == "top":
        return sorted(package.glob("*.py"))
    folder = root / room if room in ("models", "studies") else package / room
    files = sorted(folder.rglob("*.py"))
    assert files, f"no Python files in {folder}"
    return files


@pytest.fixture(autouse=True, scope="module")
def trees() -> Iterator[None]:
    yield
    source.forget()


def room_of(file: Path, root: Path) -> str:
    parts = file.relative_to(root).parts
    if parts[0] != "nlsdesign":
        return parts[0]
    return parts[1] if len(parts) > 2 else "top"


def assigned(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Names of variables, arguments, functions and classes of a module, without leading underscores."""
    for node in source.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name) | ast.MatchAs(name=str(name)):
                pass
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.ExceptHandler(name=str(name)):
                pass
            case _:
                continue
        yield getattr(node, "lineno", 0), name.lstrip("_").lower()


def dialect(tree: ast.AST) -> list[str]:
    return [f"line {line}: {name}" for line, name in assigned(tree) if name in DIALECT]


def classes(files: list[Path], root: Path) -> dict[str, list[Path]]:
    """Files by the name of the public classes that they define."""
    places: dict[str, list[Path]] = defaultdict(list)
    for file in files:
        for node in source.parse(file).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(file.relative_to(root))
    return places


def modules(files: list[Path], root: Path) -> dict[str, list[Path]]:
    """Files by name; those that are the same thing seen by another room are left out."""
    places: dict[str, list[Path]] = defaultdict(list)
    for file in files:
        folder = file.parent.relative_to(root / "nlsdesign").as_posix()
        if file.stem not in {"__init__", "__main__"} | SAME_NAME.get(folder, set()):
            places[file.stem].append(file.relative_to(root))
    return places


def twice(places: Mapping[str, list[Path]], root: Path, room: str) -> list[str]:
    """Names of several files, one of which is of this room."""
    return [
        f"{name}: {', '.join(str(file) for file in files)}"
        for name, files in sorted(places.items())
        if len(files) > 1 and any(room_of(root / file, root) == room for file in files)
    ]


def docstrings(tree: ast.Module) -> set[ast.AST]:
    """Docstrings, also those below a constant; they may show machine input."""
    return {
        node.value
        for node in source.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }


def is_unit(text: str) -> bool:
    """Tell whether a text is a unit; names in braces stand for units."""
    try:
        parse_unit(re.sub(r"\{\w+\}", "m", text))
    except UnitError:
        return False
    return True


def units_in_ascii(tree: ast.Module) -> list[str]:
    """Texts with a unit in ASCII, but for those that are a unit and nothing else, which the machine reads."""
    pieces = {piece for node in source.walk(tree) if isinstance(node, ast.JoinedStr) for piece in node.values}
    left_out = docstrings(tree)
    return [
        f"line {node.lineno}: {node.value.strip()!r}"
        for node in source.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and node not in left_out
        and UNIT_IN_ASCII.search(QUOTED.sub("", node.value))
        and (" " in node.value if node in pieces else not is_unit(node.value))
    ]


# --- the rooms ------------------------------------------------------------------------------------


@pytest.mark.parametrize("room", ROOMS)
def test_no_variable_is_named_in_dialect(root: Path, room: str) -> None:
    problems = {
        str(file.relative_to(root)): names
        for file in sources_of(root, room)
        if (names := dialect(source.parse(file)))
    }
    assert not problems


@pytest.mark.parametrize("room", [room for room in ROOMS if room not in ("models", "studies")])
def test_no_public_class_name_is_defined_twice(root: Path, room: str) -> None:
    places = classes(sorted((root / "nlsdesign").rglob("*.py")), root)
    assert twice(places, root, room) == []


@pytest.mark.parametrize("room", [room for room in ROOMS if room not in ("models", "studies")])
def test_no_module_name_is_used_twice(root: Path, room: str) -> None:
    places = modules(sorted((root / "nlsdesign").rglob("*.py")), root)
    assert twice(places, root, room) == []


@pytest.mark.parametrize("room", ROOMS)
def test_units_that_people_read_are_typeset(root: Path, room: str) -> None:
    problems = {
        str(file.relative_to(root)): texts
        for file in sources_of(root, room)
        if (texts := units_in_ascii(source.parse(file)))
    }
    assert not problems


def test_units_in_documents_are_typeset(root: Path) -> None:
    """Outside of code, where a document shows what a person writes for a machine."""
    for file in (root / "README.md", *sorted((root / "docs").glob("*.md"))):
        prose = re.sub(r"```.*?```|`[^`]*`", "", file.read_text("utf-8"), flags=re.DOTALL)
        assert not UNIT_IN_ASCII.search(prose), file.name


def test_every_exception_is_used(root: Path) -> None:
    """An exception for a file that does not exist, or that shares its name with none, must go."""
    stems = [file.stem for file in (root / "nlsdesign").rglob("*.py")]
    folders = {folder.name for folder in (root / "nlsdesign").rglob("*") if folder.is_dir()}
    for folder, names in SAME_NAME.items():
        for name in names:
            assert (root / "nlsdesign" / folder / f"{name}.py").is_file(), f"{folder}/{name}.py"
            assert stems.count(name) > 1 or name in folders, f"{folder}/{name}.py shares its name with none"


# --- the rules notice -----------------------------------------------------------------------------


def test_dialect_is_caught() -> None:
    text = "found = 1\nfor _told in x: ...\ndef f(mine, *, good): ...\nwith a as (b, few): ...\nx.said = 1\n"
    text += "[word for word in y]\nfounded = 2\nf(told=3)\nwhile (gone := g()): ...\n"
    names = [problem.partition(": ")[2] for problem in dialect(ast.parse(text))]
    assert sorted(names) == ["few", "found", "gone", "mine", "told", "word"]


def test_a_name_with_two_meanings_is_caught(tmp_path: Path) -> None:
    package = tmp_path / "nlsdesign"
    for name, text in {
        "design/point.py": "class Point: ...\nclass _Rows: ...\n",
        "analysis/sweep.py": "class Point: ...\nclass _Rows: ...\n",
        "cli/sweep.py": "class Command: ...\n",
        "model/materials.py": "class Fit: ...\n",
        "figures/point.py": "",
    }.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text, encoding="utf-8")
    files = sorted(package.rglob("*.py"))
    assert [line.partition(":")[0] for line in twice(classes(files, tmp_path), tmp_path, "design")] == [
        "Point"
    ]
    assert twice(classes(files, tmp_path), tmp_path, "cli") == []
    assert [line.partition(":")[0] for line in twice(modules(files, tmp_path), tmp_path, "figures")] == [
        "point"
    ]
    assert twice(modules(files, tmp_path), tmp_path, "model") == []


@pytest.mark.parametrize(
    ("text", "caught"),
    [
        ('x = f"{x:.3g} N*m rms"', True),
        ('x = f"{x} mN*m"', True),
        ('x = "torque in N*m"', True),
        ('x = "an area in m^2"', True),
        ('Quantity(x, "N*m")', False),
        ('x = f"{unit}/s^2"', False),
        ('x = "{effort}*s^2/{motion}^2"', False),
        ('''x = "write for instance '5 N*m'"''', False),
        ('def f():\n    """Read 5 N*m."""', False),
        ('x = "torque in N·m"', False),
    ],
)
def test_a_unit_in_ascii_is_caught(text: str, caught: bool) -> None:
    assert bool(units_in_ascii(ast.parse(text))) is caught
