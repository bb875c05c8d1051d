"""A command loads the libraries that it needs and no others."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from nlsdesign.cli.main import program

HEAVY = {"casadi", "numpy", "sympy", "control", "scipy", "matplotlib", "fmpy", "jinja2"}
DECK = "austin2015_figure_consistent"
SLOW_PARTS = {f"scipy.{part}" for part in (
    "signal", "stats", "integrate", "ndimage", "interpolate", "optimize", "sparse", "special",
)}  # fmt: skip
"""Of SciPy, up to half a second each, which SciPy loads at their first use."""
AT_THE_END = f"""
import atexit, sys
atexit.register(lambda: print(
    *{{name.partition(".")[0] for name in sys.modules}}, *({SLOW_PARTS!r} & set(sys.modules)), file=sys.stderr
))
"""
COMMAND = "from nlsdesign.cli.main import main; sys.argv = ['nlsdesign', *{words!r}]; main()"
Loaded = Callable[..., tuple[set[str], str]]


@pytest.fixture
def loaded(root: Path, tmp_path: Path) -> Loaded:
    """Run code in a process of its own; returns the packages loaded at its end, and the output."""

    def call(code: str, **environment: str) -> tuple[set[str], str]:
        done = subprocess.run(
            [sys.executable, "-c", AT_THE_END + code], capture_output=True, text=True, cwd=tmp_path,
            timeout=120, env={**os.environ, "PYTHONPATH": str(root), **environment},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return set(done.stderr.splitlines()[-1].split()), done.stdout

    return call


def commands() -> list[tuple[str, ...]]:
    """Every command of the program, those inside groups too."""
    inner = {name: getattr(command, "commands", {}) for name, command in program.commands.items()}
    return [(name, *below) for name, group in inner.items() for below in [(), *((one,) for one in group)]]


SHOWN = {
    ("--help",): "Design workbench",
    ("--version",): "nlsdesign",
    ("study", "list"): "austin2015",
    ("deck", "list"): "austin2015",
    ("parts",): "CoulombFriction",
    ("materials",): "PMC-770",
    ("materials", "PMC-770"): "ultimate_stress",
}


def test_lists_and_the_help_of_every_command_load_no_library(loaded: Loaded) -> None:
    """One process asks for all, as each takes a third of a second to begin; it names who loads a library."""
    asked = commands()
    assert {("deck", "check"), ("export", "fmu"), ("study", "run"), ("diagnose",)} <= set(asked)
    wanted = SHOWN | {(*words, "--help"): "Usage:" for words in asked}
    modules, shown = loaded(
        f"""
from click.testing import CliRunner
from nlsdesign.cli.main import program
for words, part in {wanted!r}.items():
    done = CliRunner().invoke(program, words)
    assert done.exit_code == 0 and part in done.output, (words, done.output)
    assert not (late := {HEAVY!r} & set(sys.modules)), (words, late)
print(len({wanted!r}))
"""
    )
    assert "click" in modules
    assert int(shown) == len(wanted) > 40


def test_completion_in_the_shell_loads_no_library(loaded: Loaded) -> None:
    typed = {"_NLSDESIGN_COMPLETE": "bash_complete", "COMP_WORDS": "nlsdesign de", "COMP_CWORD": "1"}
    modules, offered = loaded(
        "from nlsdesign.cli.main import program; program(prog_name='nlsdesign')", **typed
    )
    assert {"plain,deck", "plain,design"} <= set(offered.split())
    assert not modules & HEAVY


NOT_NEEDED = {
    ("deck", "check", DECK): {"sympy", "control", "matplotlib", "fmpy", "jinja2", *SLOW_PARTS},
    ("deck", "show", DECK): {"sympy", "control", "matplotlib", "fmpy", "jinja2"},
    ("parts", "CoulombFriction"): {"scipy", "sympy", "control", "matplotlib", "fmpy", "jinja2"},
    ("analyse", "--deck", "austin2015_soft_spring", "--count", "2", "--out", "out"): {
        "sympy",
        "control",
        "fmpy",
    },
}


# What the rooms load that analyse uses: test_a_room_loads_sympy_and_python_control_only_when_it_uses_them.
@pytest.mark.long_cases("deck show", "analyse --deck")
@pytest.mark.parametrize("words", NOT_NEEDED, ids=lambda words: " ".join(words[:2]))
def test_a_command_does_not_load_what_it_does_not_use(loaded: Loaded, words: tuple[str, ...]) -> None:
    modules, shown = loaded(COMMAND.format(words=words))
    assert shown.strip()
    assert "casadi" in modules
    assert not modules & NOT_NEEDED[words]


THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@pytest.mark.parametrize(
    ("given", "used"),
    [({}, ["1"] * 4), ({"OMP_NUM_THREADS": "3"}, ["3", "None", "None", "None"])],
    ids=["nothing is said", "the environment says"],
)
def test_linear_algebra_has_one_thread_unless_the_environment_says_how_many(
    root: Path, given: dict[str, str], used: list[str]
) -> None:
    """Before NumPy is loaded, which reads the number once."""
    code = f"""
import os, sys
sys.argv = ["nlsdesign", "--version"]
from nlsdesign.__main__ import main
main()
print("numpy" in sys.modules, *[os.environ.get(name) for name in {THREADS!r}])
"""
    environment = {n: v for n, v in os.environ.items() if n not in THREADS} | given
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120,
        env={**environment, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert done.stdout.split()[-5:] == ["False", *used], done.stderr


@pytest.mark.long_cases("cam-actuator")
@pytest.mark.parametrize("deck", ["cam-actuator", "test_rig"])
def test_the_live_page_answers_before_any_numerical_library_is_loaded(loaded: Loaded, deck: str) -> None:
    ended = """
import nlsdesign.live.server as server
server.asyncio.run = lambda run: run.close()
"""
    modules, _ = loaded(ended + COMMAND.format(words=["serve", deck, "--no-browser"]))
    assert "uvicorn" in modules
    assert not modules & HEAVY


@pytest.mark.slow
def test_a_room_loads_sympy_and_python_control_only_when_it_uses_them(loaded: Loaded) -> None:
    """What all rooms together have not loaded, none of them has."""
    rooms = ("report", "discrepancy", "observer", "control", "analysis")
    modules, _ = loaded("import nlsdesign as nls\n" + "\n".join(f"nls.{room}" for room in rooms))
    assert "casadi" in modules
    assert not modules & {"sympy", "control"}
