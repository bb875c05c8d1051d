"""Elements of a MAT file before a library reads it: a code of no type would end the whole process there.

The reader of SciPy looks up the type of a column's numbers without asking whether there is one, and follows
arrays within arrays to any depth. Both are looked at here first, in the order in which it reads them.
"""

from __future__ import annotations

import math
import mmap
import struct
import zlib
from pathlib import Path

from ....foundation.errors import MeasurementError

_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))
"""Codes of the types of numbers and letters."""
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCTURE, _OBJECT, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 5, 16, 17
_HEADER = 128
_DEEPEST = 64


def check_mat(file: Path) -> None:
    """Look at every element of a MAT file of version 5; those of version 4 hold no types to look up."""
    with file.open("rb") as stream:
        head = stream.read(_HEADER)
        if len(head) < _HEADER or 0 in head[:4]:
            return
        order = "<" if head[126:128] == b"IM" else ">"
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
            place = _HEADER
            while place < len(content):
                kind, size = struct.unpack(order + "II", content[place : place + 8].ljust(8, b"\0"))
                whole = content[place : place + 8 + size]
                # What is cut off within a compressed element is met while its elements are read.
                plain = zlib.decompressobj().decompress(whole[8:]) if kind == _COMPRESSED else whole
                _Elements(file.name, plain, order).matrix(0)
                place += 8 + size


class _Elements:
    """The elements of one variable, one after the other.

    Parameters
    ----------
    name
        Of the file, for messages.
    content
        From the head of the variable.
    order
        Of bytes, as in :mod:`struct`.
    """

    def __init__(self, name: str, content: bytes, order: str) -> None:
        self._name, self._content, self._order, self._place = name, content, order, 0

    def matrix(self, depth: int) -> None:
        """Pass one array with all that it holds."""
        if depth > _DEEPEST:
            raise self._refusal(f"an array is nested more than {_DEEPEST} deep")
        kind, size = self._integers(2)
        if kind != _MATRIX:
            raise self._refusal(f"an element of type {kind} stands where an array belongs")
        if size == 0:
            return
        _, _, flags, _ = self._integers(4)
        kind, is_complex, count = flags & 0xFF, bool(flags & 0x800), 0
        if kind != _OPAQUE:
            dimensions = self._data()
            count = math.prod(struct.unpack(f"{self._order}{len(dimensions) // 4}i", dimensions))
            self._data()
        self._values(kind, 2 if is_complex else 1, count, depth)

    def _values(self, kind: int, parts: int, count: int, depth: int) -> None:
        arrays = {_CELL: count, _FUNCTION: 1, _OPAQUE: 1}.get(kind, 0)
        if kind in (_STRUCTURE, _OBJECT):
            if kind == _OBJECT:
                self._data()
            (length,) = struct.unpack(self._order + "i", self._data()[:4].ljust(4, b"\0"))
            arrays = count * (len(self._data()) // length if length > 0 else 0)
        elif kind not in (_CELL, _FUNCTION):
            for _ in range({_SPARSE: 2 + parts, _OPAQUE: 3}.get(kind, parts)):
                self._data()
        for _ in range(arrays):
            self.matrix(depth + 1)

    def _data(self) -> bytes:
        """Return the bytes of an element of numbers or letters; one of up to four stands within its head."""
        (kind,) = self._integers(1)
        size, kind = kind >> 16, kind & 0xFFFF if kind >> 16 else kind
        if kind not in _NUMBERS:
            raise self._refusal(f"{kind} is the code of no type of numbers")
        within = size > 0
        if not within:
            (size,) = self._integers(1)
        start = self._place
        if start + size > len(self._content):
            raise self._refusal("an array is cut off")
        self._place += 4 if within else -(-size // 8) * 8
        return self._content[start : start + size]

    def _integers(self, count: int) -> tuple[int, ...]:
        start, self._place = self._place, self._place + 4 * count
        if self._place > len(self._content):
            raise self._refusal("an array is cut off")
        return struct.unpack(f"{self._order}{count}I", self._content[start : self._place])

    def _refusal(self, reason: str) -> MeasurementError:
        return MeasurementError(
            self._name,
            f"cannot be read: {reason}",
            next_step="the file is damaged or of another format: copy or export it again",
        )
