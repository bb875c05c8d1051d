"""Flash of generated code on an Arm Cortex-M4F: what the bundled compiler puts into read-only sections."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

from ...errors import ExportError
from ..c.controller_code import CSource
from .cross_compiler import run_compiler

MACHINE = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4")
_FUNCTIONS = (
    "sqrt exp log sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh expm1 log1p erf floor ceil fabs"
)
_OF_TWO = "pow fmod atan2 hypot fmax fmin copysign"
_ALLOCATED, _WRITABLE, _NO_BITS = 2, 1, 8


def flash_bytes(source: CSource) -> int:
    """Return the flash of one generated controller on a Cortex-M4F, tables included, in bytes.

    The C library's mathematical functions that it calls are not counted.

    Parameters
    ----------
    source
        Generated C files.

    Raises
    ------
    ExportError
        If the compiler is missing or finds a mistake.
    """
    with tempfile.TemporaryDirectory() as name:
        folder, target = Path(name), Path(name) / "controller.o"
        (folder / "math.h").write_text(_mathematics(), encoding="utf-8")
        run_compiler(
            [*MACHINE, "-std=c99", "-Os", "-ffreestanding", "-fno-unwind-tables", "-isystem", folder,
             "-c", source.source, "-o", target],
            about=f"{source.source.name} for a Cortex-M4F",
        )  # fmt: skip
        return _read_only(target.read_bytes())


def _mathematics() -> str:
    lines = ["#define INFINITY (__builtin_inff())", '#define NAN (__builtin_nanf(""))']
    for names, arguments in ((_FUNCTIONS, 1), (_OF_TWO, 2)):
        for name in names.split():
            for suffix, real in (("", "double"), ("f", "float")):
                lines.append(f"{real} {name}{suffix}({', '.join([real] * arguments)});")
    return "\n".join(lines) + "\n"


def _read_only(content: bytes) -> int:
    """Return the bytes of all sections of an ELF object that are loaded and never written."""
    if content[:5] != b"\x7fELF\x01":
        raise ExportError("the object for a Cortex-M4F", "is not a 32 bit ELF file")
    (start,) = struct.unpack_from("<I", content, 0x20)
    size, count = struct.unpack_from("<HH", content, 0x2E)
    total = 0
    for k in range(count):
        _, kind, flags, _, _, length = struct.unpack_from("<IIIIII", content, start + k * size)
        exception_index = kind == 0x70000001
        if flags & _ALLOCATED and not flags & _WRITABLE and kind != _NO_BITS and not exception_index:
            total += int(length)
    return total
