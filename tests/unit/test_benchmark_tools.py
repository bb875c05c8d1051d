"""Benchmarks run on any processor of the platform, and say which tool failed and how."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import observer_step
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


@pytest.mark.parametrize("compiler", observer_step.compilers())
def test_programs_for_valgrind_have_no_instructions_of_this_machine_alone(compiler, tmp_path):
    (tmp_path / "portable.c").write_text(NATIVE)
    command = [*observer_step.compilers()[compiler], "-c", str(tmp_path / "portable.c")]
    done = subprocess.run([*command, "-o", str(tmp_path / "portable.o")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


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


@pytest.mark.skipif(os.name == "nt", reason="a shell script stands for the tool")
def test_a_tool_that_dies_under_a_benchmark_is_a_sentence_and_no_traceback(tmp_path, monkeypatch, capsys):
    valgrind = tmp_path / "valgrind"
    valgrind.write_text("#!/bin/sh\nkill -ILL $$\n")
    valgrind.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(benchmarks, "NAMES", ("observer_step",))
    assert benchmarks.main() == 1
    assert "valgrind died of SIGILL" in capsys.readouterr().out
