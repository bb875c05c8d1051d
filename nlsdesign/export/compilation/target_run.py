"""What a controller does and costs on its processor: outputs, instructions, flash, memory, stack.

The emulator of Cortex-M boards, ``qemu-system-arm``, runs it and counts instructions.

Images for the processor of a controller, and the sizes of their sections.

The start-up code is our own, and no library of the target is used. Images are 32-bit ELF files.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
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
from ..files import filled, template
from .compiled_step import CompiledStep
from .cross_compiler import STRICT, run_compiler
from .processors import CORTEX_M4F, Processor

_ALLOCATED, _WRITABLE = 2, 1
_NO_BITS = 8


@dataclass(frozen=True)
class SectionSizes:
    """What an object or image takes."""

    constant: int  # code and constants in bytes
    preset: int  # variables with a start value in bytes: in flash and in working memory
    cleared: int  # variables that start at zero in bytes

    @property
    def flash(self) -> int:
        """Bytes in flash."""
        return self.constant + self.preset

    @property
    def memory(self) -> int:
        """Bytes in working memory."""
        return self.preset + self.cleared


def section_sizes(file: Path) -> SectionSizes:
    """Return what an object or image takes."""
    data = file.read_bytes()
    if data[:6] != b"\x7fELF\x01\x01":
        raise ExportError(f"{file}", "is no 32-bit ELF file", next_step="compile it for a microcontroller")
    (start,) = struct.unpack_from("<I", data, 0x20)
    size, count = struct.unpack_from("<HH", data, 0x2E)
    constant = preset = cleared = 0
    for k in range(count):
        _, kind, flags, _, _, length = struct.unpack_from("<IIIIII", data, start + k * size)
        if not flags & _ALLOCATED:
            continue
        if kind == _NO_BITS:
            cleared += length
        elif flags & _WRITABLE:
            preset += length
        else:
            constant += length
    return SectionSizes(constant, preset, cleared)


OPTIMISED = "-O2"
"""How the controller is compiled; the tables say so."""

_COMMON = (
    *("-std=c99", OPTIMISED, "-ffp-contract=off", "-fno-math-errno", "-fno-sanitize=undefined"),
    *("-ffunction-sections", "-fdata-sections", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables"),
)
# The start-up code speaks the assembler's language, which C99 does not know.
_OWN = ("-std=gnu99",)


def controller_object(source: CSource, processor: Processor, folder: Path) -> Path:
    """Compile the generated code alone, under the warnings that it must pass."""
    for name in ("math.h", "string.h"):
        (folder / name).write_text(template(f"target_{name}"), encoding="utf-8")
    target = folder / f"{source.name}.o"
    run_compiler(
        [*_machine(processor), *_COMMON, *STRICT, "-isystem", folder, "-c", source.source, "-o", target],
        about=f"{source.source.name} for {processor.name}",
    )
    return target


def image(
    source: CSource,
    processor: Processor,
    folder: Path,
    *,
    main: str,
    values: Mapping[str, str | Sequence[str]],
) -> Path:
    """Link the controller with a main program from a template."""
    (folder / "run.c").write_text(filled(main, {"name": source.name, **values}), encoding="utf-8")
    for name in ("target_start.c", "target_link.ld", "target.h"):
        (folder / name).write_text(template(name), encoding="utf-8")
    target = folder / f"{source.name}.elf"
    include: list[str | Path] = ["-isystem", folder, "-I", source.header.parent.resolve()]
    files = [folder / "target_start.c", folder / "run.c", folder / f"{source.name}.o"]
    link: list[str | Path] = ["-T", folder / "target_link.ld", "-Wl,--gc-sections", "-Wl,-e,start"]
    run_compiler(
        [*_machine(processor), *_COMMON, *_OWN, *include, *files, *link, "-o", target],
        about=f"the image of {source.source.name} for {processor.name}",
    )
    return target


def controller_sizes(
    source: CSource, processor: Processor, folder: Path
) -> tuple[SectionSizes, SectionSizes]:
    """Return what the controller alone takes, and what it adds to an image with what it calls."""
    alone = section_sizes(controller_object(source, processor, folder))
    images = []
    for present in (1, 0):
        if not present:
            (folder / "nothing.c").write_text("", encoding="utf-8")
            run_compiler(
                [*_machine(processor), "-c", folder / "nothing.c", "-o", folder / f"{source.name}.o"],
                about="an empty file",
            )
        values = {"present": str(present)}
        images.append(section_sizes(image(source, processor, folder, main="target_empty.c", values=values)))
    with_it, without = images
    added = SectionSizes(
        with_it.constant - without.constant,
        with_it.preset - without.preset,
        with_it.cleared - without.cleared,
    )
    return alone, added


def sized_object(source: CSource, processor: Processor, folder: Path) -> Path:
    """Compile an object with nothing but one instance of the controller."""
    target = folder / "instance.o"
    (folder / "instance.c").write_text(filled("target_instance.c", {"name": source.name}), encoding="utf-8")
    include = source.header.parent.resolve()
    run_compiler(
        [*_machine(processor), *_COMMON, "-I", include, "-c", folder / "instance.c", "-o", target],
        about=f"an instance of {source.name} for {processor.name}",
    )
    return target


def _machine(processor: Processor) -> list[str]:
    return ["-target", processor.target, f"-mcpu={processor.features}"]


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
