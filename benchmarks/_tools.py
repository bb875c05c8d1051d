"""Foreign programs that benchmarks run: what fails is named, with what it said."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path


def run_tool(command: Sequence[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program; one that is missing, fails or dies ends the benchmark with a sentence."""
    name = "the compiler ziglang" if any("ziglang" in each for each in command[:3]) else command[0]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    except OSError as error:
        raise SystemExit(f"{name} cannot be started: {error.strerror}") from error
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        last = f"; it said: {said[-1].strip()}" if said else ""
        raise SystemExit(f"{name} {_end(done.returncode)}{last}")
    return done


def _end(status: int) -> str:
    if status > 0:
        return f"failed with exit status {status}"
    known = {each.value: each.name for each in signal.Signals}
    return f"died of {known.get(-status, f'signal {-status}')}"
