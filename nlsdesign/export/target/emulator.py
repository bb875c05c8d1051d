"""The emulator of Cortex-M boards, ``qemu-system-arm``, that counts instructions."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from ...foundation.errors import ExportError
from ...foundation.processes import run_to_end
from .processors import Processor

EMULATOR = "qemu-system-arm"
_SECONDS = 300


def missing_emulator() -> str:
    """Return why nothing can be run, or an empty text."""
    if shutil.which(EMULATOR) is None:
        return f"{EMULATOR} is not installed (Debian: apt-get install qemu-system-arm)"
    return ""


def emulated(image: Path, processor: Processor) -> list[list[int]]:
    """Run an image and return the numbers that it says, line by line.

    Each instruction takes one nanosecond of the emulator's clock.
    """
    missing = missing_emulator()
    if missing:
        raise ExportError("the emulator", missing.replace(f"{EMULATOR} ", "", 1), next_step="install it")
    command = [
        EMULATOR,
        "-machine",
        processor.machine,
        "-icount",
        "shift=0",
        "-nographic",
        "-monitor",
        "none",
    ]
    command += ["-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
    try:
        done = run_to_end(command, seconds=_SECONDS)
    except subprocess.TimeoutExpired as error:
        raise ExportError(
            f"{image.name} on {processor.name}", f"does not end within {_SECONDS} s", next_step="report it"
        ) from error
    answer = done.stdout + done.stderr
    if done.returncode != 0 or "fault" in answer:
        last = answer.strip().splitlines()[-1:] or ["it said nothing"]
        raise ExportError(
            f"{image.name} on {processor.name}", f"fails under {EMULATOR}: {last[0]}", next_step="report it"
        )
    return [[int(number, 16) for number in line.split()] for line in answer.splitlines() if line.strip()]
