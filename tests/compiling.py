"""Programs of C for this machine, compiled under the warnings that generated code must pass."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nlsdesign.export.compilation.cross_compiler import (
    BASELINE,
    PLATFORMS,
    STRICT,
    host_platform,
    run_compiler,
)


def compile_program(sources: Sequence[Path], target: Path, *, flags: Sequence[str] = STRICT) -> Path:
    """Compile C files to a program for this machine; return its path."""
    where = PLATFORMS[host_platform()]
    # With -s as libraries are: without it a new machine builds the library of the compiler once more.
    usual = (*BASELINE, "-O2", "-s", "-ffp-contract=off")
    arguments: list[str | Path] = ["-target", where.target, *usual, *flags]
    run_compiler([*arguments, *sources, "-lm", "-o", target], about=f"{sources[0].name} for {where.name}")
    return target
