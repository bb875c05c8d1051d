"""Benchmarks run on any processor of the platform, and say which tool failed and how."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import _page, elf_bounds, observer_step
from benchmarks._suite import SUITE, Benchmark, Promise
from benchmarks._tools import run_tool
from nlsdesign.export.compilation.cross_compiler import ALL_PLATFORMS, PLATFORMS, compile_library

# What the compilers define for instructions that not every processor of the kind has.
NATIVE = """
#if defined(__AVX__) || defined(__AVX2__) || defined(__FMA__) || defined(__AVX512F__)
#error instructions of newer x86-64 processors
#endif
#if defined(__ARM_FEATURE_SVE) || defined(__ARM_FEATURE_SVE2)
#error instructions of newer Arm processors
#endif
__attribute__((visibility("default"))) int portable(void);
int portable(void) { return 1; }
"""


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_the_observer_by_hand_has_the_guards_of_the_generated_one(tmp_path):
    """Once it had those of an earlier state, and the ratio of instructions compared two observers."""
    observer_step.prepare(tmp_path)
    sides = [
        run_tool([str(observer_step.compiled(tmp_path, ["gcc"], side, guarded=True))]).stdout.split()
        for side in ("by_hand", "generated")
    ]
    (by_hand, words), (generated, expected) = sides
    assert float(by_hand) == pytest.approx(float(generated), rel=1e-9)
    assert words == expected


# Code that is placed behind a return and goes back is no loop; the second function counts down in one.
CODE = """
00000000 <straight>:
   0:\t2800      \tcmp\tr0, #0
   2:\td001      \tbeq.n\t8 <straight+0x8>
   4:\t3001      \tadds\tr0, #1
   6:\tbd10      \tpop\t{r4, pc}
   8:\t2001      \tmovs\tr0, #1
   a:\te7fb      \tb.n\t4 <straight+0x4>

0000000c <counting>:
   c:\t3801      \tsubs\tr0, #1
   e:\td1fd      \tbne.n\tc <counting>
  10:\t4770      \tbx\tlr
"""


def test_loops_and_the_deepest_chain_of_calls_are_found():
    assert elf_bounds.loops(CODE) == 1
    assert elf_bounds.loops(CODE.partition("0000000c")[0]) == 0
    frames, calls = (
        {"step": 40, "take": 24, "advance": 88},
        [("step", "take"), ("step", "advance"), ("take", "memset")],
    )
    assert elf_bounds.chain(frames, calls, "step") == (128, {"take", "advance", "memset"})


@pytest.mark.parametrize("compiler", observer_step.compilers())
def test_programs_for_valgrind_have_no_instructions_of_this_machine_alone(compiler, tmp_path):
    (tmp_path / "portable.c").write_text(NATIVE)
    command = [*observer_step.compilers()[compiler], "-c", str(tmp_path / "portable.c")]
    done = subprocess.run([*command, "-o", str(tmp_path / "portable.o")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.long_cases("aarch64-linux", "aarch64-darwin", "x86_64-darwin")
@pytest.mark.parametrize("name", ALL_PLATFORMS)
def test_libraries_have_no_instructions_of_this_machine_alone(name, tmp_path):
    where = PLATFORMS[name]
    (tmp_path / "portable.c").write_text(NATIVE)
    assert compile_library(
        [tmp_path / "portable.c"], tmp_path / f"portable{where.extension}", platform=where
    ).exists()


def test_a_tool_that_dies_fails_or_is_missing_is_named_with_what_it_said():
    died = "import os, signal; os.kill(os.getpid(), signal.SIGILL)"
    with pytest.raises(SystemExit, match="died of SIGILL"):
        run_tool([sys.executable, "-c", died])
    failed = "import sys; sys.stderr.write('no such table\\n'); sys.exit(3)"
    with pytest.raises(SystemExit, match="failed with exit status 3; it said: no such table"):
        run_tool([sys.executable, "-c", failed])
    with pytest.raises(SystemExit, match="no-such-tool cannot be started: No such file"):
        run_tool(["no-such-tool"])


def test_a_benchmark_that_ends_with_a_sentence_has_it_on_the_page(monkeypatch, tmp_path, capsys):
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "benchmarks" / "__init__.py").touch()
    (tmp_path / "benchmarks" / "stand_in.py").write_text("raise SystemExit('valgrind died of SIGILL')\n")
    monkeypatch.setattr(benchmarks, "fingerprint", lambda benchmark: benchmark.command)
    monkeypatch.setattr(benchmarks, "ROOT", tmp_path)
    monkeypatch.setattr(benchmarks._suite, "SUITE", (stand_in(),))
    monkeypatch.setattr(_page, "SUITE", (stand_in(),))
    page = tmp_path / "page.md"
    assert benchmarks.main(["--results", str(tmp_path / "out"), "--page", str(page)]) == 1
    assert "valgrind died of SIGILL" in capsys.readouterr().out
    assert "Not measured: valgrind died of SIGILL" in page.read_text(encoding="utf-8")


# What a tool says and what becomes of it are tried quickly above, one after the other.
@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="a shell script stands for the tool")
def test_a_tool_that_dies_under_a_benchmark_is_a_sentence_and_no_traceback(tmp_path, monkeypatch, capsys):
    valgrind = tmp_path / "valgrind"
    valgrind.write_text("#!/bin/sh\nkill -ILL $$\n")
    valgrind.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    given = ["observer_step", "--results", str(tmp_path / "out"), "--page", str(tmp_path / "page.md")]
    assert benchmarks.main(given) == 1
    assert "valgrind died of SIGILL" in capsys.readouterr().out
    assert "Not measured: valgrind died of SIGILL" in (tmp_path / "page.md").read_text(encoding="utf-8")


TWICE = Promise("times as long", r"ratio ([\d.]+)", least=2.0)


def stand_in(**changed):
    """A benchmark of which only what it prints matters."""
    return replace(Benchmark("stand_in", "A stand-in", "nobody", (TWICE,)), **changed)


@pytest.fixture
def suite(monkeypatch, tmp_path):
    """Runs one stand-in that prints the text; returns exit status, number of runs so far, and the page."""
    calls = []

    def call(text, *options, end=0, **changed):
        def started(benchmark, limit, key):
            calls.append(benchmark.name)
            return benchmarks.result(text, "it failed" if end else "", 1.0, key)

        monkeypatch.setattr(benchmarks, "run", started)
        monkeypatch.setattr(benchmarks._suite, "SUITE", (stand_in(**changed),))
        monkeypatch.setattr(_page, "SUITE", (stand_in(**changed),))
        status = benchmarks.main(["--results", str(tmp_path), "--page", str(tmp_path / "page.md"), *options])
        return status, len(calls), (tmp_path / "page.md").read_text(encoding="utf-8")

    monkeypatch.setattr(benchmarks, "fingerprint", lambda benchmark: benchmark.command)
    return call


def test_a_promise_is_read_from_what_was_printed_and_judged(suite):
    status, _, page = suite("ratio 3.5\nratio 2.5\n")
    assert status == 0
    assert "| A stand-in: times as long | at least 2 | 2.5 to 3.5 | yes |" in page
    status, _, page = suite("ratio 3.5\nratio 1.5\n", "--again")
    assert status == 1
    assert "| 1.5 to 3.5 | NO |" in page
    assert "ratio 1.5\n```" in page


def test_what_was_measured_is_not_measured_again_unless_asked_or_changed(suite):
    assert suite("ratio 3")[:2] == (0, 1)
    assert suite("ratio 4")[:2] == (0, 1)
    assert suite("ratio 4", "--again")[:2] == (0, 2)
    assert suite("ratio 4", arguments=("--longer",))[:2] == (0, 3)


def test_a_missing_peer_is_passed_over_with_the_reason_and_a_failure_is_one(suite):
    status, calls, page = suite("", modules=("no_such_library",), programs=("no-such-tool",))
    assert (status, calls) == (0, 0)
    assert "| not installed: no-such-tool, no_such_library |" in page
    status, _, page = suite("", end=1)
    assert status == 1
    assert "Not measured: it failed." in page


def test_an_interrupted_run_says_how_to_go_on(suite, monkeypatch, capsys, tmp_path):
    suite("ratio 3")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(benchmarks, "run", interrupted)
    given = ["--again", "--results", str(tmp_path), "--page", str(tmp_path / "page.md")]
    assert benchmarks.main(given) == benchmarks.INTERRUPTED
    assert "the same command goes on" in capsys.readouterr().out


def test_a_benchmark_that_takes_too_long_is_stopped(monkeypatch, tmp_path):
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "benchmarks" / "__init__.py").touch()
    (tmp_path / "benchmarks" / "stand_in.py").write_text("import time\nprint('begun')\ntime.sleep(60)\n")
    monkeypatch.setattr(benchmarks, "ROOT", tmp_path)
    found = benchmarks.run(stand_in(), 2.0, "")
    assert (found["output"], found["reason"]) == ("begun\n", "stopped after 2 s")


def test_the_page_of_the_project_has_every_promise(root):
    page = (root / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    for each in SUITE:
        assert f"Command: `{each.command}`." in page
        for promise in each.promises:
            assert f"| {each.title}: {promise.words} | {promise.promised()} |" in page
