"""Images for the processor of a controller, and the sizes of their sections.

The start-up code is our own, and no library of the target is used. Images are 32-bit ELF files.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...foundation.errors import ExportError
from ..c.writer import CSource
from ..files import filled, template
from .cross_compiler import STRICT, run_compiler
from .processors import Processor

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
