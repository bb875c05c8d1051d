"""Sizes of sections in 32-bit ELF files, as compilers for microcontrollers write them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

from ...foundation.errors import ExportError

_ALLOCATED, _WRITABLE = 2, 1
_NO_BITS = 8


@dataclass(frozen=True)
class SectionSizes:
    """What an object or image takes.

    Parameters
    ----------
    constant
        Code and constants in bytes.
    preset
        Variables with a start value in bytes: in flash and in working memory.
    cleared
        Variables that start at zero in bytes.
    """

    constant: int
    preset: int
    cleared: int

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
