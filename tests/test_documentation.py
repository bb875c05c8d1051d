"""What the project says of itself holds: docstrings, types, links, claims, sizes; the checks would notice."""

from __future__ import annotations

import functools
import importlib
import inspect
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

import nlsdesign as nls
from nlsdesign.components import component_classes
from tests import source
from tests.import_graph import modules

PRODUCT = ("nlsdesign", "models", "studies")
TEXTS = (*PRODUCT, "tests", "docs", "examples", "benchmarks", "requirements", ".ci")
DOCUMENTS = ("architecture.md", "conventions.md", "claims.md", "known_gaps.md")

# Put together here so that this file does not contain what it looks for.
MACHINE = re.compile(r"(?<![\w.~*-])/(?:" + "|".join(["work", "root"]) + r")/|\.\./" + "shared")
SCRATCH = re.compile(r"(?<![\w.~*-])/" + r"tmp/")


@pytest.fixture(autouse=True, scope="module")
def trees() -> Iterator[None]:
    yield
    source.forget()


def python_files(root: Path, *folders: str) -> list[Path]:
    found = [file for folder in folders for file in sorted((root / folder).rglob("*.py"))]
    assert len(found) >= len(folders), f"no Python files in {folders}"
    return found


def public_files(root: Path) -> list[Path]:
    """Modules of the package whose name, and the names of the packages around, are public."""
    kept = {"__init__", "__main__"}
    return [
        file
        for file in python_files(root, "nlsdesign")
        if not any(
            part.startswith("_") and part not in kept for part in file.relative_to(root).with_suffix("").parts
        )
    ]


def documents(root: Path) -> list[Path]:
    return [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md"))]


def text_files(root: Path) -> Iterator[tuple[str, str]]:
    """Path within the project and content of every text that may be committed."""
    inner = (file for folder in TEXTS for file in sorted((root / folder).rglob("*")))
    top = (
        file for file in sorted(root.iterdir()) if not file.name.startswith(".") or file.name == ".gitignore"
    )
    for file in (*top, *inner):
        if file.is_file() and "__pycache__" not in file.parts:
            content = file.read_bytes()
            if b"\0" not in content:
                yield file.relative_to(root).as_posix(), content.decode("utf-8", errors="replace")


def unproven_claims(text: str, root: Path) -> Iterator[str]:
    """Rows of the table ``| claim | test |`` that do not name a test that exists."""
    rows = [line.strip() for line in text.splitlines() if line.strip().startswith("|")]
    for row in rows[2:]:  # the first two are the head and the rule below it
        claim, _, tests = row.strip("|").rpartition("|")
        names = re.findall(r"([\w./-]+\.py)::([\w:]+)", tests)
        if not names:
            yield f"{claim.strip()}: names no test"
        for file, test in names:
            if not (root / file).is_file():
                yield f"{claim.strip()}: there is no file {file}"
            elif test not in source.tests_in(root / file):
                yield f"{claim.strip()}: there is no test {test} in {file}"


def machine_paths(name: str, text: str) -> Iterator[str]:
    """Paths of somebody's machine; in tests a literal below the system's scratch folder may be an example."""
    patterns = [MACHINE] if name.startswith("tests/") else [MACHINE, SCRATCH]
    if not any(pattern.search(text) for pattern in patterns):
        return
    for number, line in enumerate(text.splitlines(), start=1):
        if any(pattern.search(line) for pattern in patterns):
            yield f"{name}, line {number}: {line.strip()[:100]}"


def expect_none(root: Path, files: Iterable[Path], check: Callable[[Path], Iterable[str]]) -> None:
    found = [f"{file.relative_to(root)}: {what}" for file in files for what in check(file)]
    assert not found, "\n" + "\n".join(found)


# --- the project as it is -------------------------------------------------------------------------


def test_everything_public_has_a_docstring(root: Path) -> None:
    expect_none(root, public_files(root), source.undocumented)


def test_everything_public_is_typed(root: Path) -> None:
    expect_none(root, public_files(root), source.untyped)


@functools.cache
def exported(root: Path) -> dict[Path, set[str]]:
    """Functions and classes that users are offered, by file.

    They stand in the ``__all__`` of a room, at the front door or in a room of it without ``__all__``, or are
    laws, which are found by being there; and so is what such a class inherits from.
    """
    named = [
        n for n, file in modules(root / "nlsdesign").items() if "\n__all__ = [" in file.read_text("utf-8")
    ]
    front = [getattr(nls, name) for name in dir(nls)]
    rooms = [*map(importlib.import_module, named), *filter(inspect.ismodule, front)]
    offered = [getattr(room, name) for room in rooms for name in public_names(room)]
    offered += [*front, *component_classes().values()]
    found: dict[Path, set[str]] = {}
    for thing in (kind for each in offered for kind in (each.__mro__ if inspect.isclass(each) else [each])):
        module = sys.modules.get(getattr(thing, "__module__", ""))
        if hasattr(thing, "__qualname__") and getattr(module, "__file__", None):
            found.setdefault(Path(module.__file__), set()).add(thing.__qualname__)
    return found


def public_names(room: ModuleType) -> list[str]:
    """Names in ``__all__``, or else those without an underscore that are defined there."""
    own = [n for n, thing in vars(room).items() if getattr(thing, "__module__", None) == room.__name__]
    return getattr(room, "__all__", [n for n in own if not source.is_private(n)])


def test_docstrings_agree_with_signatures_and_exceptions(root: Path) -> None:
    exceptions, offered = source.exceptions_of(python_files(root, "nlsdesign")), exported(root)
    assert exceptions["unknown_name"] == "UnknownNameError"
    expect_none(
        root,
        python_files(root, *PRODUCT),
        lambda file: source.mismatched(file, exceptions, offered.get(file, ())),
    )


def test_only_what_is_exported_has_sections(root: Path) -> None:
    offered = exported(root)
    assert "flatten" in offered[root / "nlsdesign" / "model" / "flatten.py"]
    expect_none(
        root, python_files(root, *PRODUCT), lambda file: source.overdocumented(file, offered.get(file, ()))
    )


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_document_is_there(root: Path, name: str) -> None:
    assert (root / "docs" / name).read_text(encoding="utf-8").startswith("# ")


def test_links_resolve(root: Path) -> None:
    expect_none(root, documents(root), lambda file: source.broken_links(file, root))


def test_each_claim_names_its_test(root: Path) -> None:
    text = (root / "docs" / "claims.md").read_text(encoding="utf-8")
    assert re.search(r"^\|\s*claim\s*\|\s*test\s*\|$", text, flags=re.MULTILINE | re.IGNORECASE)
    assert text.count("\n|") >= 3, "the table of claims is empty"
    expect_none(root, [root / "docs" / "claims.md"], lambda file: unproven_claims(text, root))


def test_no_path_of_a_machine(root: Path) -> None:
    texts = dict(text_files(root))
    assert {"Makefile", "pyproject.toml", ".ci/run", "nlsdesign/foundation/errors.py"} <= set(texts)
    found = [line for name, text in texts.items() for line in machine_paths(name, text)]
    assert not found, "\n" + "\n".join(found)


# --- the checks notice ----------------------------------------------------------------------------

SAMPLE = '''
"""Module."""
def good(a: int, /, b: int, *c: int, d: int = 1, **e: int) -> None:
    """Do."""
def bad(a, *b, c: int, **d): ...
def _private(a): ...
class Law:
    """Law."""
    def __init__(self, a): ...
    def force(self, x: float) -> float: ...
    @overload
    def rate(self, x: int) -> int: ...
    @size.setter
    def size(self, value: float) -> None: ...
    def _hidden(self): ...
class _Private:
    def method(self, a): ...
'''


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    file = tmp_path / "sample.py"
    file.write_text(SAMPLE, encoding="utf-8")
    return file


def test_a_missing_docstring_is_caught(sample: Path) -> None:
    assert list(source.undocumented(sample)) == [
        "line 5: bad has no docstring",
        "line 10: Law.force has no docstring",
    ]
    sample.write_text("x = 1", encoding="utf-8")
    assert list(source.undocumented(sample)) == ["line 1: the module has no docstring"]


def test_a_missing_type_is_caught(sample: Path) -> None:
    assert list(source.untyped(sample)) == [
        "line 5: bad has no type for a, b, d, the result",
        "line 9: Law has no type for a, the result",
    ]


DOCUMENTED = '''
class Law(Base):
    """Law.

    Parameters
    ----------
    name, of
        What.

    Raises
    ------
    ValueError
        Where it is made.
    """
    name: str
    stiffness: Quantity = parameter("N/m", "Described here.")
    of: str = ""
    kind: ClassVar[str] = "law"
    _hidden: int = 0
    def __post_init__(self):
        if self.name:
            raise ValueError("name")
def force(a, /, b: int, *rest: int, c=1, **more):
    """Force.

    Parameters
    ----------
    a, b
        Numbers.
    *rest : int
        More.
    c
        Last.
    **more
        Others.

    Returns
    -------
    float

    Raises
    ------
    UnknownNameError
        By a function that returns it.
    OSError
        From below.
    """
    def inner():
        raise KeyError("not of force itself")
    raise unknown_name("b")
@click.command()
def shown(a):
    """Its docstring is a help text."""
    raise ValueError("a")
'''


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("", "", None),
        ("name, of", "of, name", "Law documents the parameters ['of', 'name'], the signature has ['name',"),
        ("    name, of", "    name", "Law documents the parameters ['name'], the signature has ['name',"),
        ("    a, b\n", "    a, d\n", "force documents the parameters ['a', 'd', 'rest', 'c', 'more'], "
                                   "the signature has ['a', 'b', 'rest', 'c', 'more']"),
        ("    ValueError\n", "    TypeError\n", "Law raises ValueError, which its docstring does not list"),
        ("    OSError", "    OSEror", "force lists OSEror, which is no exception"),
        ('raise unknown_name("b")', "raise RuntimeError(b)", "force raises RuntimeError, which its"),
        ("    UnknownNameError", "    NlsError", "force raises UnknownNameError, which its"),
    ],
)  # fmt: skip
def test_a_docstring_that_disagrees_is_caught(
    root: Path, sample: Path, old: str, new: str, complaint: str | None
) -> None:
    assert old in DOCUMENTED
    sample.write_text(DOCUMENTED.replace(old, new, 1), encoding="utf-8")
    exceptions = source.exceptions_of([root / "nlsdesign" / "foundation" / "errors.py"])
    caught = [line.partition(": ")[2] for line in source.mismatched(sample, exceptions, {"Law", "force"})]
    assert [line[: len(complaint)] for line in caught] == [complaint] if complaint else caught == []


def test_an_exported_function_documents_its_parameters(sample: Path) -> None:
    sample.write_text('def force(a):\n    """Force."""\n    raise ValueError("a")\n', encoding="utf-8")
    exceptions = {"ValueError": "ValueError"}
    assert list(source.mismatched(sample, exceptions, ())) == []
    assert list(source.mismatched(sample, exceptions, {"force"})) == [
        "line 1: force documents the parameters [], the signature has ['a']",
        "line 1: force raises ValueError, which its docstring does not list",
    ]


def test_a_section_of_what_is_not_exported_is_caught(sample: Path) -> None:
    sample.write_text(DOCUMENTED, encoding="utf-8")
    assert list(source.overdocumented(sample, {"Law", "force"})) == []
    assert [line.partition(": ")[2] for line in source.overdocumented(sample, ())] == [
        "Law is not exported and has a section Raises",
        *(f"force is not exported and has a section {name}" for name in ("Parameters", "Returns", "Raises")),
    ]
    section = "Do.\n\n      Returns\n      -------\n      int"
    within = f'class Law:\n  def _force(self):\n    def inner():\n      """{section}"""\n'
    sample.write_text(within, encoding="utf-8")
    assert list(source.overdocumented(sample, {"Law"})) == [
        "line 3: Law._force._.inner is not exported and has a section Returns"
    ]


@pytest.mark.parametrize(
    ("fits", "outgrown", "complaint"),
    [
        ('"""A."""\nimport a\n\n# b\n' + "x = 1\n" * 400, "x = 1\n" * 401, "has 401 lines of code"),
        (
            'def f():\n    """F."""\n\n    # why\n' + "    x = 1\n" * 49,
            "def f():\n" + "    x = 1\n" * 50,
            "f has 51 lines of code",
        ),
        (
            "class A:\n  def f(self, a, b, c, *, d, e, f, **g): ...",
            "class A:\n  def f(self, a, b, c, *d, e, f, g, h): ...",
            "f has 8 arguments",
        ),
        (
            "class A:\n" + "".join(f"  def m{i}(self): ...\n" for i in range(12)) + "  def m0(self): ...",
            "class A:\n" + "".join(f"  def m{i}(self): ...\n" for i in range(13)),
            "A has 13 methods",
        ),
    ],
)
def test_an_outgrown_shape_is_caught(sample: Path, fits: str, outgrown: str, complaint: str) -> None:
    sample.write_text(fits, encoding="utf-8")
    assert list(source.misshapen(sample)) == []
    sample.write_text(outgrown, encoding="utf-8")
    assert complaint in " ".join(source.misshapen(sample))


def test_a_broken_link_is_caught(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("# The cam, and its `law`\n", encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(
        "# Page\n[a](there.md) ![b](gone.png) [c](there.md#the-cam-and-its-law) [d](there.md#nowhere)\n"
        "[e](#page) [f](#gone) [g](https://example.org/x) `[h](code.md)` [i](../outside.md)\n"
        "```\n[j](code.md)\n```\n\n[k]: lost.md\n<img src='lost.svg'>\n",
        encoding="utf-8",
    )
    (tmp_path.parent / "outside.md").touch()
    found = [what.partition(":")[0] for what in source.broken_links(page, tmp_path)]
    assert found == ["gone.png", "there.md#nowhere", "#gone", "../outside.md", "lost.md", "lost.svg"]


def test_an_unproven_claim_is_caught(tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text("def test_x(): ...\nclass TestB:\n    def test_y(self): ...\n")
    table = (
        "| claim | test |\n| --- | --- |\n| one | `test_a.py::test_x`, `test_a.py::TestB::test_y[1]` |\n"
        "| two | test_a.py::test_z |\n| three | test_b.py::test_x |\n| four | tested by hand |\n"
    )
    assert list(unproven_claims(table, tmp_path)) == [
        "two: there is no test test_z in test_a.py",
        "three: there is no file test_b.py",
        "four: names no test",
    ]


def test_a_path_of_a_machine_is_caught() -> None:
    slash = "/"
    bad = [
        f"see {slash}work{slash}x",
        f"'{slash}root{slash}.cache'",
        f"..{slash}shared",
        f"{slash}tmp{slash}x",
    ]
    good = [
        f"framework{slash}work{slash}x",
        f"https:{slash}{slash}example.org{slash}root{slash}x",
        f"a{slash}tmp{slash}b",
        f".{slash}work{slash}x",
        f"shared{slash}x",
    ]
    assert list(machine_paths("docs/a.md", "\n".join(good))) == []
    assert len(list(machine_paths("docs/a.md", "\n".join(bad)))) == 4
    assert len(list(machine_paths("tests/unit/test_a.py", "\n".join(bad)))) == 3


def test_the_glossary_is_one_alphabetical_table(root: Path) -> None:
    glossary = (root / "docs" / "conventions.md").read_text("utf-8").partition("## Glossary\n")[2]
    rows = [line for line in glossary.splitlines() if line.startswith("| ")]
    assert rows[0] == "| term | meaning |"
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]
    assert all(len(row) == 2 and all(row) for row in cells)
    terms = [term for term, _ in cells]
    assert len(terms) > 50
    assert terms == sorted(set(terms), key=str.lower)


WALK_ROW = re.compile(r"\| ([a-z_/]+) \| \[`(\w+)`\]\(\.\./([\w/.]+)#L(\d+)\) \|")


def walks(text: str) -> list[list[tuple[str, str, str, int]]]:
    """The tables of room, name, file and line under the heading of the two walks."""
    section = text.partition("## Two walks\n")[2].partition("\n## ")[0]
    tables = [WALK_ROW.findall(table) for table in section.split("\n\n")]
    return [[(room, name, file, int(line)) for room, name, file, line in t] for t in tables if t]


def lost_lines(walk: list[tuple[str, str, str, int]], root: Path) -> Iterator[str]:
    """Rows whose line does not define the name."""
    for _, name, file, line in walk:
        lines = (root / file).read_text(encoding="utf-8").splitlines()
        if not re.search(rf"\b{name}\b", lines[line - 1] if line <= len(lines) else ""):
            places = [n for n, text in enumerate(lines, 1) if re.match(rf"\s*(def |class |){name}\b", text)]
            yield f"{file}, line {line}: '{name}' stands in line {places}"


def test_the_two_walks_name_the_lines_and_enter_no_room_twice(root: Path) -> None:
    tables = walks((root / "docs" / "architecture.md").read_text(encoding="utf-8"))
    assert [len(table) > 10 for table in tables] == [True, True]
    for table in tables:
        assert list(lost_lines(table, root)) == []
        rooms = [room.partition("/")[0] for room, *_ in table]
        entered = [room for number, room in enumerate(rooms) if number == 0 or rooms[number - 1] != room]
        assert len(entered) == len(set(entered)), entered


@pytest.mark.parametrize(
    ("page", "above", "room"),
    [
        ("decision.md", "| section | where |", "bench/discrepancy"),
        ("architecture.md", "| what the model holds |", "export/c"),
    ],
)
def test_tables_of_places_name_what_the_code_defines(root: Path, page: str, above: str, room: str) -> None:
    text = (root / "docs" / page).read_text(encoding="utf-8")
    rows = text[text.index(above) :].partition("\n\n")[0].splitlines()[2:]
    places = [place for row in rows for place in re.findall(r"`([\w./]+)`", row.rpartition(" | ")[2])]
    code = "".join(f.read_text("utf-8") for f in sorted((root / "nlsdesign" / room).rglob("*.py")))
    files = [place for place in places if place.endswith(".py")]
    names = [place.rpartition(".")[2] for place in places if place not in files]
    found = [p for p in files if any((root / "nlsdesign" / r / p).exists() for r in ("", room))]
    assert len(names) > 5
    assert found == files
    assert not [n for n in names if not re.search(rf"(def|class) {n}\b", code)]


def test_messages_that_are_explained_are_messages_of_the_package(root: Path) -> None:
    page = (root / "docs" / "when_it_says.md").read_text(encoding="utf-8")
    messages = [
        m for bold in re.findall(r"^\*\*(.*?)\*\*", page, re.MULTILINE) for m in re.findall(r"`(.*?)`", bold)
    ]
    assert len(messages) > 12
    sources = "\n".join(file.read_text(encoding="utf-8") for file in (root / "nlsdesign").rglob("*.py"))
    assert [message for message in messages if message not in sources] == []


def test_a_walk_that_lost_its_way_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("import b\n\n\ndef work() -> None: ...\n", encoding="utf-8")
    row = "## Two walks\n\n| room | where |\n| model | [`work`](../a.py#L{}) |\n"
    assert list(lost_lines(walks(row.format(4))[0], tmp_path)) == []
    assert list(lost_lines(walks(row.format(3))[0], tmp_path)) == ["a.py, line 3: 'work' stands in line [4]"]
