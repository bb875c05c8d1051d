"""What a controller does and costs on its processor: outputs, instructions, flash, memory, stack.

The emulator of Cortex-M boards, ``qemu-system-arm``, runs it and counts instructions.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.processes import run_to_end
from ..c.c_text import Real
from ..c.programs import sample_inputs
from ..c.writer import CSource
from .compiled_step import CompiledStep
from .processors import CORTEX_M4F, Processor
from .target_build import (
    SectionSizes,
    controller_object,
    controller_sizes,
    image,
    section_sizes,
    sized_object,
)

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


_NS_PER_TICK = 40  # the clock of the boards runs at 25 MHz, an instruction takes 1 ns
_KNOWN, _NOTHING = 2003, 2  # instructions of the two functions of the template


@dataclass(frozen=True, eq=False)
class TargetRun:
    """One run of the vectors of the self-test on the processor."""

    # instructions: of the step at each sample, the return included, to one part in 4000, shape (samples,)
    instructions: NDArray[np.int64]
    stack: NDArray[np.int64]  # deepest use at each sample in bytes, without interrupts, shape (samples,)
    outputs: Array  # shape (samples, outputs)
    status: NDArray[np.int64]  # status words, shape (samples,)
    same: bool  # whether all outputs and status words are those of the same code on this machine, bit by bit


@dataclass(frozen=True, eq=False)
class TargetMeasurement:
    """What a controller costs on a processor."""

    source: CSource
    processor: Processor  # where
    alone: SectionSizes  # its own code, tables and variables
    # added: what it adds to a program, with all that it calls, for instance arithmetic in software
    added: SectionSizes
    state: int  # size of the structure that the caller owns, in bytes
    run: TargetRun | None  # what was seen in the emulator; None where there is none
    reason: str = ""  # why it was not run; empty otherwise

    @property
    def flash(self) -> int:
        """Bytes of flash: code, tables and start values, and what they call."""
        return self.added.flash

    @property
    def memory(self) -> int:
        """Bytes of working memory without the stack: one instance, and variables outside it."""
        return self.state + self.alone.memory


def measure_on_target(
    source: CSource, processor: Processor = CORTEX_M4F, *, inputs: Array | None = None
) -> TargetMeasurement:
    """Measure what a controller costs on a processor, and whether it computes there what it computes here.

    The code is compiled with the bundled compiler. Where the emulator ``qemu-system-arm`` is installed, the
    vectors of the self-test run there, and the count of instructions is verified on a loop of known length.

    Parameters
    ----------
    source
        Generated C files.
    processor
        Where.
    inputs
        Samples to run, shape (samples, inputs); those of the self-test by default.

    Raises
    ------
    ExportError
        If the compiler is missing or finds a mistake, or the emulator fails or miscounts.

    Examples
    --------
    >>> cost = measure_on_target(export_c(observer, "out/c", real="float"), CORTEX_M4F)  # doctest: +SKIP
    >>> cost.flash, cost.memory, cost.run.instructions.max()  # doctest: +SKIP
    """
    reason = missing_emulator()
    with tempfile.TemporaryDirectory(prefix="nlsdesign-target-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        alone, added = controller_sizes(source, processor, folder)
        state = section_sizes(sized_object(source, processor, folder)).cleared
        given = sample_inputs(source.model, source.real) if inputs is None else inputs
        run = None if reason else _run(source, processor, folder, np.asarray(given, dtype=float))
    return TargetMeasurement(source, processor, alone, added, state, run, reason)


def _run(source: CSource, processor: Processor, folder: Path, given: Array) -> TargetRun:
    real, c = source.real, source.writer
    controller_object(source, processor, folder)
    values: dict[str, str | list[str]] = {
        "real": real,
        "samples": str(len(given)),
        "given": real.table("given", given.tolist()),
        "assignments": [f"inputs.{path} = given[k][{i}];" for i, path in enumerate(c.paths.inputs)],
        "outputs": [f"say_real(outputs.{path});" for path in c.paths.outputs],
    }
    first, *rows = emulated(image(source, processor, folder, main="target_run.c", values=values), processor)
    counted = _instructions(*first[1:4])
    if abs(counted - _KNOWN) > 0.5:
        raise ExportError(
            f"the emulator's count on {processor.name}",
            f"is wrong: {counted:.1f} instructions for a loop of {_KNOWN}",
            next_step="measure with another version of qemu-system-arm",
        )
    table = np.array(rows, dtype=np.uint32)
    words = np.ascontiguousarray(table[:, 5:])
    outputs = words.view(np.float32 if real is Real.FLOAT else np.float64)
    step = CompiledStep(source)
    expected = [step(row) for row in given.tolist()]
    here = np.array([each for each, _ in expected]).reshape(outputs.shape).astype(outputs.dtype)
    status = table[:, 4].astype(np.int64)
    same = here.tobytes() == outputs.tobytes() and status.tolist() == [flags for _, flags in expected]
    return TargetRun(
        np.rint([_instructions(*row[:3]) for row in rows]).astype(np.int64),
        table[:, 3].astype(np.int64),
        outputs.astype(np.float64),
        status,
        same,
    )


def _instructions(calls: int, ticks: int, empty: int) -> float:
    return (ticks - empty) * _NS_PER_TICK / calls + _NOTHING
