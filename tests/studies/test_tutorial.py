"""The tutorial: every file, command and printed number of its pages, in order, in an empty folder."""

from __future__ import annotations

import json
import shlex
from itertools import pairwise
from pathlib import Path

import pytest

from tests import tutorial
from tests.command_line import Run, run, two_machines
from tests.undrawn import undrawn

__all__ = ["run", "two_machines", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
SMALLER = {
    "nlsdesign design": ["--draws", "0", "--starts", "1"],
    "nlsdesign simulate": ["--dry-run"],
    "nlsdesign analyse": ["--dry-run"],
    "nlsdesign observer": ["--kind", "cascade"],
    "nlsdesign export c": ["--kind", "cascade"],
}
"""Options that make a command quicker; those of the page are kept and stand before them."""
LEFT_OUT = (
    "nlsdesign export fmu",
    "nlsdesign cosimulate",
    "nlsdesign diagnose",
    "out/c_again",
    "export check",
)
"""What only the slow test runs: it needs FMUs or a diagnosis."""


@pytest.mark.slow
def test_the_pages_print_what_they_show(tmp_path: Path) -> None:
    wrong = [each for page in tutorial.pages() for each in tutorial.run_page(page, tmp_path)]
    assert not wrong, "\n".join(wrong)


def quick_words(line: str) -> tuple[list[str], bool]:
    """Return the words of a command with smaller settings, and whether it is as the page has it."""
    words = shlex.split(line)
    more = next((options for begin, options in SMALLER.items() if line.startswith(begin)), [])
    return words + more, not more


@pytest.mark.slow
@pytest.mark.usefixtures("two_machines")
def test_the_commands_and_scripts_work_with_smaller_settings(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("ziglang")
    compared = 0
    for page in tutorial.pages()[:8]:
        printed, as_shown = "", False
        for block in tutorial.blocks(page.read_text(encoding="utf-8")):
            if block.kind == "text" and not block.file:
                wrong = list(tutorial.differences(block.text, printed)) if as_shown else []
                assert not wrong, (page.name, wrong)
                compared += as_shown
            elif block.file:
                tutorial.carried_out(block, tmp_path)
            elif block.kind == "python":
                if "loop.csv" not in block.text:
                    exec(compile(block.text, page.name, "exec", dont_inherit=True), {"__name__": "tutorial"})
                    printed, as_shown = capsys.readouterr().out, True
                else:
                    as_shown = False
            else:
                printed, as_shown = "", True
                for line in block.commands:
                    words, same = quick_words(line)
                    as_shown = as_shown and same and not line.startswith(LEFT_OUT)
                    if line.startswith(LEFT_OUT):
                        continue
                    if words[0] == "nlsdesign":
                        status, out, err = run(*words[1:])
                        assert status == 0, (line, err)
                        printed += out
                    elif words[-1].endswith(".py") and words[-1] != "bench.py":
                        as_shown = False  # the default observer takes seconds to design
                    else:
                        printed += tutorial.call(words, tmp_path)
    assert compared >= 5, "the pages show nothing that this test compares"
    heads = (tmp_path / "records" / "run1.csv").read_text(encoding="utf-8").splitlines()[0]
    assert heads == "t_s,current_A,angle_rad,force_N"


def test_the_notebook_is_that_of_the_pages(tmp_path: Path) -> None:
    text = (tutorial.FOLDER / tutorial.NOTEBOOK).read_text(encoding="utf-8")
    assert text == tutorial.notebook(), "python -m tests.tutorial --write makes it anew"
    cells = json.loads(text)["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"][1:]
    shown = [
        block
        for page in tutorial.pages()
        for block in tutorial.blocks(page.read_text(encoding="utf-8"))
        if block.kind != "text" or block.file
    ]
    assert len(code) == len(shown)
    for cell, block in zip(code, shown, strict=True):
        if block.kind == "sh":
            lines = [shlex.split(line[1:]) for line in cell.splitlines()]
            assert lines == [shlex.split(line) for line in block.commands]
        else:
            written = cell.removeprefix(f"%%writefile {block.file}\n") if block.file else cell
            assert written == block.text.rstrip("\n")


def test_the_pages_follow_one_another_and_show_their_figures() -> None:
    pages = tutorial.pages()
    assert [int(page.name[0]) for page in pages] == list(range(1, 10))
    for page, following in pairwise(pages):
        last = page.read_text(encoding="utf-8").splitlines()[-1]
        assert last.startswith("Next: [")
        assert last.endswith(f"({following.name}).")
    shown = [m["shown"] for page in pages for m in tutorial.IMAGE.finditer(page.read_text(encoding="utf-8"))]
    assert len(shown) >= 2
    assert all((tutorial.FOLDER / name).is_file() for name in shown)


@pytest.mark.parametrize(
    ("shown", "printed", "agrees"),
    [
        ("a 1.00 b", "first\n  a   1.02  b\n", True),
        ("a 1.00 b", "a 1.2 b\n", False),
        ("a 1 b", "a 1 b c\n", False),
        ("a 1 …", "a 1.01 b c\n", True),
        ("x\ny", "y\nx\n", False),
        ("-2 1/s", "2 1/s", False),
        ("−2e-3 m", "-2.01e-3 m", True),
        ("0 → 1", "0 → 1.04", True),
        ("run5 is 3", "run6 is 3", False),
    ],
)
def test_a_line_that_was_not_printed_is_noticed(shown: str, printed: str, agrees: bool) -> None:
    assert (not list(tutorial.differences(shown, printed))) == agrees


def test_numbers_are_written_anew_and_words_are_kept() -> None:
    printed = "verdict   met\nerror     3.25 mN·m of 7 runs\n"
    assert tutorial.renewed("error 1 mN·m …\nlost 5\n", printed) == "error 3.25 mN·m …\nlost 5\n"


@pytest.mark.slow
def test_a_command_that_fails_is_noticed(tmp_path: Path) -> None:
    page = tmp_path / "1_page.md"
    page.write_text("```sh\nnlsdesign deck check no_such_deck\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="ended with 2"):
        tutorial.run_page(page, tmp_path)
