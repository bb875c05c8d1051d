"""What holds for every command: help with examples that are right, JSON, exit status, completion."""

from __future__ import annotations

import ast
import inspect
import json
import os
import shlex
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from nlsdesign.cli.main import program
from nlsdesign.cli.studies import study_names
from nlsdesign.components import declare
from nlsdesign.foundation.deck import deck_names, load_deck
from nlsdesign.model import flatten
from nlsdesign.model.roles import series_cam
from tests.command_line import Run, run

__all__ = ["run"]
Path_ = tuple[str, ...]


def tree(command: click.Command, path: Path_ = ()) -> Iterator[tuple[Path_, click.Command]]:
    """Every command of the program with its words, groups too."""
    yield path, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from tree(inner, (*path, name))


def runs(command: click.Command) -> bool:
    """Tell whether a command does something by itself: a group does so only where it takes a deck."""
    return not isinstance(command, click.Group) or any(p.name == "deck_name" for p in command.params)


COMMANDS = dict(tree(program))
WORKING = {path: command for path, command in COMMANDS.items() if runs(command)}


def examples_of(command: click.Command) -> list[list[str]]:
    """Return the words of each example in a help text, behind the name of the program."""
    text = (command.epilog or "").replace("\\\n", " ")
    lines = [line.strip() for line in text.splitlines()]
    return [shlex.split(line.partition(" > ")[0])[1:] for line in lines if line.startswith("nlsdesign ")]


def test_the_tree_is_whole() -> None:
    assert {
        ("simulate",),
        ("observer",),
        ("observer", "verify"),
        ("export", "c"),
        ("analyse", "loop"),
    } <= set(WORKING)
    assert ("export",) not in WORKING


@pytest.mark.parametrize("path", WORKING, ids=" ".join)
def test_a_command_prints_json_and_every_option_has_a_text(path: Path_) -> None:
    options = [each for each in WORKING[path].params if isinstance(each, click.Option)]
    assert any("--json" in each.opts for each in options)
    assert [each.opts[0] for each in options if not (each.help or "").strip()] == []
    hidden = [
        each.opts[0] for each in options
        if not (each.is_flag or each.required or each.multiple or each.default is None or each.show_default)
        and "default" not in (each.help or "") and type(each.default).__name__ in ("str", "int", "float")
        and each.default != ""
    ]  # fmt: skip
    assert hidden == [], "the default is not said"


@pytest.mark.parametrize("path", WORKING, ids=" ".join)
def test_every_example_is_one_of_its_command_and_is_understood(
    path: Path_, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("rig.toml", "cam.csv"):  # some arguments are files that must exist
        (tmp_path / name).touch()
    examples = examples_of(WORKING[path])
    assert examples, "shows no example"
    for words in examples:
        command, context, rest = program, click.Context(program, info_name="nlsdesign"), list(words)
        reached: list[str] = []
        while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
            reached.append(rest[0])
            command = command.commands[rest[0]]  # type: ignore[assignment]
            rest = rest[1:]
        if reached == ["analyse"]:
            command = COMMANDS["analyse", "angle"]  # type: ignore[assignment]
            reached.append("angle")
        assert tuple(reached) == path, words
        made = command.make_context(reached[-1], rest, parent=context)
        assert made.args == []


QUICK = [
    words
    for command in WORKING.values()
    for words in examples_of(command)
    if words[0] in ("parts", "materials", "completion")
    or words[:2] in (["deck", "list"], ["design", "--list"])
]


def test_the_deck_in_the_example_of_serve_has_a_cam_to_design() -> None:
    """The page would begin with another deck."""
    decks = [words[1] for words in examples_of(WORKING[("serve",)]) if len(words) > 1 and "." not in words[1]]
    assert decks
    for deck in decks:
        assert series_cam(flatten(declare(load_deck(deck)))).name


@pytest.mark.parametrize("words", QUICK, ids=" ".join)
def test_quick_examples_run(words: list[str], run: Run) -> None:
    status, out, err = run(*words)
    assert (status, err) == (0, "")
    assert out.strip()
    if "--json" in words:
        assert json.loads(out)


def test_a_help_text_is_no_wider_than_80_columns() -> None:
    for path, command in COMMANDS.items():
        text = command.get_help(
            click.Context(command, info_name=" ".join(("nlsdesign", *path)), terminal_width=80)
        )
        wide = [line for line in text.splitlines() if len(line) > 80]
        assert wide == [], path


@pytest.mark.parametrize(
    "path", [path for path, command in COMMANDS.items() if isinstance(command, click.Group)]
)
def test_the_summary_of_a_command_fits_into_its_line(path: Path_) -> None:
    group = COMMANDS[path]
    listed = group.get_help(click.Context(group, info_name="nlsdesign", terminal_width=80)).partition(
        "Commands:"
    )[2]
    assert listed
    assert [line for line in listed.partition("Examples:")[0].splitlines() if line.endswith("...")] == []


def test_the_lists_of_a_design_are_those_of_the_library(run: Run) -> None:
    from nlsdesign.design import Goal, Limit
    from nlsdesign.design.jobs.job_file import kinds

    for what, base in (("limits", Limit), ("goals", Goal)):
        listed = json.loads(run("design", "--list", what, "--json")[1])
        assert set(listed) == set(kinds(base))
        fields = {
            f"{name}.{f}": about for name, each in listed.items() for f, about in each["fields"].items()
        }
        lacking = [name for name, about in fields.items() if not about["meaning"]]
        assert lacking == []
        assert "`" not in json.dumps(listed)
    assert listed["LeastSize"]["fields"]["weight"]["default"] == 1.0
    _, out, _ = run("design", "--list", "targets")
    assert "TaskTarget" in out
    assert "Torque in N·m at the last angle" in out
    status, _, err = run("design")
    assert status == 2
    assert "Missing option '--deck'" in err


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("deck", "list"), 0),
        (("deck", "list", "--jsn"), 2),
        (("deck", "show", "none"), 2),
        (("nothing",), 2),
        (("completion", "tcsh"), 2),
        (("simulate", "--deck", "none", "--stop", "1 s"), 2),
        (("--help",), 0),
    ],
)
def test_the_exit_status_is_that_of_the_page(words: tuple[str, ...], status: int, run: Run) -> None:
    assert run(*words)[0] == status


@pytest.mark.parametrize(
    ("shell", "first"), [("bash", "# To install"), ("zsh", "#compdef nlsdesign"), ("fish", "# To")]
)
def test_the_script_of_a_shell_says_how_it_is_installed(shell: str, first: str, run: Run) -> None:
    status, out, err = run("completion", shell)
    assert (status, err) == (0, "")
    assert out.startswith(first)
    assert f"# To install: nlsdesign completion {shell} > " in out
    assert "_NLSDESIGN_COMPLETE" in out


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_commands_decks_and_studies(run: Run, root: Path, tmp_path: Path) -> None:
    (tmp_path / "completion.sh").write_text(run("completion", "bash")[1], encoding="utf-8")
    shim = tmp_path / "nlsdesign"
    shim.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m nlsdesign "$@"\n', encoding="utf-8")
    shim.chmod(0o755)
    given = {**os.environ, "PYTHONPATH": str(root), "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}

    def offered(*words: str) -> set[str]:
        typed = " ".join(f'"{word}"' for word in ("nlsdesign", *words))
        script = (
            "compopt() { :; }; source completion.sh; "
            f"COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _nlsdesign_completion nlsdesign; "
            'printf "%s\\n" "${COMPREPLY[@]}"'
        )
        done = subprocess.run(
            ["bash", "--norc", "-c", script], capture_output=True, text=True, cwd=tmp_path, env=given,
            timeout=60, check=True,
        )  # fmt: skip
        return set(done.stdout.split())

    assert {"deck", "design"} <= offered("de")
    assert offered("simulate", "--deck", "") >= set(deck_names())
    assert offered("study", "run", "") >= set(study_names())
    assert offered("materials", "PM") == {"PMC-770"}
    assert "--friction" in offered("simulate", "--fr")


@pytest.mark.parametrize("path", WORKING, ids=" ".join)
def test_a_command_reads_each_option_where_it_is(path: Path_) -> None:
    """An argument that is named does not stand among the others too."""
    callback = inspect.unwrap(WORKING[path].callback)  # type: ignore[arg-type]
    (function,) = ast.parse(textwrap.dedent(inspect.getsource(callback))).body
    assert isinstance(function, ast.FunctionDef)
    named = {each.arg for each in (*function.args.args, *function.args.kwonlyargs)}
    others = function.args.kwarg.arg if function.args.kwarg else None
    read = {
        node.slice.value
        for node in ast.walk(function)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
        and node.value.id == others and isinstance(node.slice, ast.Constant)
    }  # fmt: skip
    given = {parameter.name for parameter in WORKING[path].params}
    assert not read & named
    assert read <= given
