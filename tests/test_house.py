"""The house holds no more than its budget; and the counters notice what they count."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import source
from tests.house import budget
from tests.house.counts import counted, plan
from tests.house.findings import findings
from tests.house.modules import Module, exported_by, modules
from tests.house.repetitions import pairs, sources
from tests.house.walks import Names, stays

# --- the house as it is ---------------------------------------------------------------------------


def test_no_figure_is_above_its_budget(root: Path) -> None:
    bounds = budget.read(root)
    found = list(budget.exceeded(budget.measured(root, bounds), bounds["figures"]))
    assert not found, "\n" + "\n".join(found)


def test_every_budget_of_code_is_argued_in_the_changelog(root: Path) -> None:
    changelog = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    found = list(budget.unargued(budget.read(root)["figures"], changelog))
    assert not found, "\n" + "\n".join(found)


def test_every_figure_of_the_budget_is_still_counted(root: Path) -> None:
    """A room that is gone, or a journey without a figure, would be bounded by nothing."""
    bounds = budget.read(root)
    titles = {module.room for module in modules(root / bounds["package"])} | set(bounds["beside"])
    titles |= {walk["title"] for walk in bounds["walk"]} | {budget.WHOLE}
    assert titles == set(bounds["figures"])
    assert all((root / folder).is_dir() for folder in bounds["found_by_being_there"])


# --- the counters notice --------------------------------------------------------------------------

SAMPLE = {
    "__init__": '"""Front."""\nfrom .low.law import Law\n__all__ = ["Law", "force"]',
    "low/__init__": "",
    "low/law": '''
"""Laws."""
import math
from ..base import number

class Law:
    """Of force.

    Parameters
    ----------
    stiffness
        Of the spring.
    """
    stiffness: float
    """In N/m."""

    def force(self, x: float) -> float:
        # Hooke
        return self.stiffness * _half(x)

class Inner:
    """Not exported.

    Parameters
    ----------
    a
        Number.

    Returns
    -------
    float
        Number.
    """

def _half(x: float) -> float:
    return 0.5 * x
''',
    "base": "def number() -> None: ...",
}


def build(folder: Path, files: dict[str, str]) -> list[Module]:
    for name, text in files.items():
        file = (folder / "sample" / name).with_suffix(".py")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.lstrip("\n") + "\n", encoding="utf-8")
    return modules(folder / "sample")


def test_figures_of_a_package(tmp_path: Path) -> None:
    every = build(tmp_path, SAMPLE)
    assert counted(every, exported_by(every)) == {
        "files": 4,
        "lines": 3 + 1 + 36 + 1,
        "code": 9,
        "docstrings": 22,
        "imports": 3,
        "median": 1,
        "small": 2,
        "classes": 2,
        "dataclasses": 0,
        "functions": 3,
        "exported": 2,
        "private": 1,
        "once": 1,
        "thin": 1,
        "sections": 8,
    }
    assert plan(tmp_path / "sample") == (3, 2, 3)
    assert [module.room for module in every] == ["sample", "sample", "low", "low"]


HELPER = "def _part():\n    a = 1\n    return a\n"


@pytest.mark.parametrize(
    ("text", "once", "thin"),
    [
        (HELPER + "x = _part()", 1, 1),
        (HELPER + "x = _part() + _part()", 0, 0),
        (HELPER.replace("    a", "    b = 2\n    a") + "x = _part()", 1, 0),
        (HELPER.replace("    a", "    # why\n\n    a") + "x = _part()", 1, 1),
        (HELPER + "x = sorted(y, key=_part)", 1, 0),
        ("@cache\n" + HELPER + "x = _part()", 1, 0),
        (HELPER.replace("return a", "return _part()"), 1, 0),
        ("class A:\n    def _part(self): ...\n    def f(self): return self._part()", 1, 0),
        (HELPER.replace("_part", "part") + "x = part()", 0, 0),
        (HELPER.replace("_part", "__part__") + "x = __part__()", 0, 0),
    ],
)
def test_helpers_that_are_called_once(tmp_path: Path, text: str, once: int, thin: int) -> None:
    every = build(tmp_path, {"a": text})
    figures = counted(every, frozenset())
    assert (figures["once"], figures["thin"]) == (once, thin)


SIX = "".join(f"x{i} = {i}\n" for i in range(6))


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        (SIX, SIX, [(6, 1)]),
        (SIX, SIX.replace("x3", "y"), []),
        (SIX, SIX.replace("\n", "  # why\n", 1), []),
        (SIX, SIX.replace("x3 ", "# why\n\n)\n    x3  "), [(6, 1)]),
        (SIX + "y = 0\n" + SIX, SIX, [(6, 2)]),
        (SIX + "y = 0\n", SIX + "y = 0\n", [(7, 1)]),
        ("from a import b\n" + SIX, "from a import b\n" + SIX, [(6, 1)]),
        (SIX.partition("\n")[2], SIX.partition("\n")[2], []),
    ],
)
def test_places_written_twice(tmp_path: Path, first: str, second: str, found: list[tuple[int, int]]) -> None:
    build(tmp_path, {"a": first, "b": second})
    across = [pair for pair in pairs(sources(tmp_path)) if pair.left[0] != pair.right[0]]
    assert [(pair.lines, pair.runs) for pair in across] == found


def test_a_run_is_not_a_pair_with_itself(tmp_path: Path) -> None:
    build(tmp_path, {"a": "x = 1\n" * 11})
    assert pairs(sources(tmp_path)) == []
    build(tmp_path, {"a": "x = 1\n" * 12})
    assert len(pairs(sources(tmp_path))) == 1


def test_what_stands_in_many_places_is_a_form(tmp_path: Path) -> None:
    build(tmp_path, {f"a{i}": SIX for i in range(8)})
    assert len(pairs(sources(tmp_path))) == 8 * 7 / 2
    build(tmp_path, {"a8": SIX})
    assert pairs(sources(tmp_path)) == []


JOURNEY = {
    "__init__": "from .start import begin",
    "start": """
from . import tools
from .bench import Bench
from .record import Record
def begin(record: Record, other: int) -> None:
    tools.weigh(other)
    tools.weigh(record)
    tools.deeper(record.asked())
    again = record.halved()
    tools.weigh(again)
    bench = Bench(record)
    tools.weigh(bench)
    tools.count(record.size)
    if record.size > 1:
        raise tools.complaint(record)
    for row in record.rows:
        local(row)
    bench.show()
def local(row) -> None: ...
""",
    "tools": """
def weigh(x) -> float: return deeper(x)
def deeper(x) -> float: ...
def count(number: int) -> None: ...
def complaint(x) -> Exception: ...
""",
    "bench": """
from .tools import deeper
class Bench:
    def __init__(self, record):
        self.mine = record
        self.other = 1
        self.read()
    def read(self):
        deeper(self.mine)
        deeper(self.other)
    def show(self): deeper(self.mine)
""",
    "record": """
class Record:
    size: int
    def asked(self) -> float: ...
    def halved(self) -> "Record": ...
""",
}


def test_a_walk_follows_the_calls_that_hand_it_on(tmp_path: Path) -> None:
    names = Names(build(tmp_path, JOURNEY))
    steps = names.journey("sample.begin", "record")
    assert steps == [
        ("sample/start.py", "begin"),
        ("sample/tools.py", "weigh"),
        ("sample/tools.py", "deeper"),
        ("sample/tools.py", "weigh"),  # half of me; what it calls was walked before
        ("sample/bench.py", "__init__"),
        ("sample/bench.py", "read"),
        ("sample/tools.py", "deeper"),
        ("sample/start.py", "local"),
    ]
    files = ["start", "tools", "bench", "tools", "start"]
    assert stays(steps) == [f"sample/{name}.py" for name in files]
    assert [name for _, name in names.journey("sample.begin", "other")] == ["begin", "weigh", "deeper"]


def test_a_walk_goes_on_in_what_is_built_where_the_journey_says_so(tmp_path: Path) -> None:
    names = Names(build(tmp_path, JOURNEY))
    steps = [name for _, name in names.journey("sample.begin", "record", ["Bench"])]
    assert steps[4:] == ["__init__", "read", "deeper", "weigh", "local", "show", "deeper"]
    with pytest.raises(AssertionError, match="no class"):
        names.journey("sample.begin", "record", ["Bank"])
    with pytest.raises(AssertionError, match=r"there is no sample\.end"):
        names.journey("sample.end", "record")


def test_findings_name_their_places(tmp_path: Path) -> None:
    files = {
        **SAMPLE,
        "low/long": "def f():\n" + "    x = 1\n" * 50 + SIX,
        "low/again": SIX,
        "low/other": "def force(x):\n    ...",
    }
    every = build(tmp_path, files)
    assert list(findings(tmp_path, every, "low")) == [
        "sample/low/again.py:1 - the file has 6 lines of code, fewer than 30",
        "sample/low/law.py:1 - the file has 7 lines of code, fewer than 30",
        "sample/low/law.py:5 Law - says of stiffness only 'Of the spring.'",
        "sample/low/law.py:16 Law.force - exported, without a docstring",
        "sample/low/law.py:20 Inner - not exported, 8 lines of sections",
        "sample/low/law.py:34 _half - used once, line 18; 2 lines of code, a slice",
        "sample/low/long.py:1 - f has 51 lines of code, limit 50",
        "sample/low/other.py:1 - the file has 2 lines of code, fewer than 30",
        "sample/low/other.py:1 force - exported, without a docstring",
        "sample/low/again.py:1-6 - 6 equal lines in sample/low/long.py:52-57",
    ]
    assert list(findings(tmp_path, every, "sample/low/again.py/"))[:1] == []


# --- the budget bites -----------------------------------------------------------------------------


def test_a_room_that_grows_is_caught(tmp_path: Path) -> None:
    figures = budget.rooms(build(tmp_path, SAMPLE), ["sample/low/other"])
    assert figures["low"] == {"code": 7, "outgrown": 0, "thin": 1, "small": 1}
    assert budget.rooms(build(tmp_path, {}), ["sample/low/"])["low"]["small"] == 0
    assert list(budget.exceeded(figures, figures)) == []
    for name in ("code", "thin", "small"):
        less = {**figures, "low": {**figures["low"], name: figures["low"][name] - 1}}
        (line,) = budget.exceeded(figures, less)
        assert line.startswith(f"low: {name} {figures['low'][name]}, budget {figures['low'][name] - 1}; ")
    (line,) = budget.exceeded({"walk": {"stays": 2}}, {"walk": {"stays": 1}})
    assert "--walks" in line
    assert len(list(budget.exceeded(figures, {}))) == 5


def test_growth_needs_a_row_that_says_what_for() -> None:
    figures = {"low": {"code": 1500, "thin": 9}, "a walk": {"stays": 9}}
    table = "| room | lines of code | what for |\n| --- | --- | --- |\n"
    newest, oldest = "| low | 1,500 | Another law. |\n", "| low | 1,400 | Where it began. |\n"
    assert list(budget.unargued(figures, table + newest + oldest)) == []
    assert list(budget.unargued(figures, table + oldest + newest)) != []
    assert list(budget.unargued(figures, table + oldest)) != []
    assert list(budget.unargued(figures, table + newest.replace("Another law.", ""))) != []
    assert list(budget.unargued(figures, table + newest.replace("low", "high"))) != []
    whole = {budget.WHOLE: {"classes": 3}}
    assert list(budget.unargued(whole, table + "| the whole: classes | 3 | Forms of a spread. |\n")) == []
    assert list(budget.unargued(whole, table + "| the whole: classes | 2 | Forms of a spread. |\n")) != []


def test_figures_that_are_written_anew_do_not_rise() -> None:
    found = {"low": {"code": 12, "thin": 3}, "new": {"code": 1, "thin": 1}}
    figures = budget.lowered(found, {"low": {"code": 10, "thin": 2}, "gone": {"code": 5}})
    assert figures == {"low": {"code": 12, "thin": 2}, "new": {"code": 1, "thin": 1}}
    text = budget.written(figures, 'package = "sample"\n\n[figures]\n"gone" = { code = 5 }\n')
    assert text == (
        'package = "sample"\n\n[figures]\n"low" = { code = 12, thin = 2 }\n"new" = { code = 1, thin = 1 }\n'
    )


def test_code_is_what_remains_of_the_lines(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text(
        '"""A\n\nB."""\nimport a\nfrom b import (\n    c,\n)\n\n# why\nx = 1  # why\ny = """\ntext\n"""\n'
    )
    lines = source.lines_of(file)
    assert (lines.total, len(lines.docstrings), len(lines.imports), lines.code) == (
        13,
        3,
        4,
        (10, 11, 12, 13),
    )
