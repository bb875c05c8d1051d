"""Blocks of numbers that generated code takes at run time: what lies where, and whether a block is sound.

A block is one structure of C: a head, the parameters by their names, the coefficients of the equations, the
values of the tables, and a CRC-32. It has the least significant byte first and no padding, so a file is what
lies in memory.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.quantity import with_unit
from ...model.flat import FlatModel, Table, Variable
from .c_text import Real
from .coefficients import WIDER, BlockNumbers, LoadableModel

MAGIC = int.from_bytes(b"nlsB", "little")
VERSION = 1
"""Of the head and of the order of what follows it."""
_OTHER_CODE = "take the block that nlsdesign export block writes for this code"


@dataclass(frozen=True, eq=False)
class BlockLayout:
    """What the blocks of one generated code hold.

    Parameters
    ----------
    name
        Prefix of the C names of the code.
    real
        Its number type.
    deck, deck_digest
        Deck that the code was made from.
    parameters, coefficients
        Numbers in the order of the memory, with their ranges; their starts are those of the code.
    tables
        With the values of the code; minimum and maximum of a column bound its values. A block has them column
        by column.
    states, inputs, outputs
        Variables of an instance in the order of the memory.
    digest
        32 hexadecimal digits: what two blocks must have in common to fit the same code.
    """

    name: str
    real: Real
    deck: str
    deck_digest: str
    parameters: tuple[Variable, ...]
    coefficients: tuple[Variable, ...]
    tables: tuple[Table, ...]
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    digest: str

    @cached_property
    def record(self) -> np.dtype[Any]:
        """The structure as NumPy reads it."""
        number = "<f4" if self.real is Real.FLOAT else "<f8"
        members: list[Any] = [(name, "<u4") for name in ("magic", "version", "size", "reserved")]
        members += [("digest", "V16"), ("deck", "V8")]
        members += [("parameters", number, (len(self.parameters),))] if self.parameters else []
        members += [("coefficients", number, (len(self.coefficients),))] if self.coefficients else []
        members += [(f"table_{k}", number, table.values.T.shape) for k, table in enumerate(self.tables)]
        return np.dtype([*members, ("checksum", "<u4"), ("unused", "<u4")])

    @cached_property
    def instance(self) -> np.dtype[Any]:
        """The first members of an instance of the code, as NumPy reads them."""
        number = "<f4" if self.real is Real.FLOAT else "<f8"
        groups = ("parameters", "states", "inputs", "outputs")
        # C99 knows no empty structure: it has a character.
        members: list[Any] = [
            (g, *((number, (len(v),)) if (v := getattr(self, g)) else ("i1",))) for g in groups
        ]
        members += [("coefficients", number, (len(self.coefficients),))] if self.coefficients else []
        members += [(f"table_{k}", number, table.values.shape) for k, table in enumerate(self.tables)]
        return np.dtype([*members, ("status", "<u4"), ("loaded", "<u4")], align=True)

    @property
    def size(self) -> int:
        """Bytes of a block."""
        return int(self.record.itemsize)

    def offset(self, member: str) -> int:
        """Return the bytes before a member of the structure.

        ``member``: name of a member.
        """
        fields: Any = self.record.fields
        return int(fields[member][1])

    @property
    def default(self) -> ParameterBlock:
        """The block with the numbers of the code."""
        values = {v.name: v.start for v in (*self.parameters, *self.coefficients)}
        tables = tuple(np.asarray(table.values, dtype=float) for table in self.tables)
        return ParameterBlock(self, values, tables, self.deck, self.deck_digest)

    def block(self, numbers: BlockNumbers, names: tuple[str, ...], model: FlatModel) -> ParameterBlock:
        """Return the block with the numbers of another design.

        ``numbers``: as :meth:`LoadableModel.numbers_of` gives them. ``names``: of the parameters, in their
        order. ``model``: the design, with its deck.
        """
        values = dict(zip(names, numbers.parameters, strict=True))
        values |= {v.name: x for v, x in zip(self.coefficients, numbers.coefficients, strict=True)}
        origin = model.origin
        made = ParameterBlock(
            self, values, numbers.tables, origin.deck if origin else "", origin.digest if origin else ""
        )
        made.check()
        return made


def block_layout(
    loadable: LoadableModel, name: str, real: Real, in_memory: Callable[[Sequence[Variable]], Iterable[str]]
) -> BlockLayout:
    """Return the layout of the blocks of a code; ``in_memory`` gives names as they lie in a structure."""
    model = loadable.model
    origin = model.origin

    def ordered(group: Sequence[Variable]) -> tuple[Variable, ...]:
        by_name = {v.name: v for v in group}
        return tuple(by_name[n] for n in in_memory(group))

    sizes = [WIDER * np.max(np.abs(t.values), axis=0) for t in model.tables]
    tables = tuple(
        replace(t, columns=tuple(
            replace(v, minimum=-(float(most) or 1.0), maximum=float(most) or 1.0)
            for v, most in zip(t.columns, size, strict=True)
        ))
        for t, size in zip(model.tables, sizes, strict=True)
    )  # fmt: skip
    parameters = ordered(loadable.parameters)
    coefficients = model.parameters[len(parameters) :]
    lines = [
        f"nlsdesign block {VERSION}", str(real), repr(model.sample_time), origin.digest if origin else "",
        *(f"{v.name} {v.unit}" for v in (*parameters, *coefficients)),
        *(f"{t.argument} {len(t.values)} {[(v.name, v.unit) for v in t.columns]}" for t in tables),
        loadable.structure(),
    ]  # fmt: skip
    digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()[:32]
    deck, deck_digest = (origin.deck, origin.digest) if origin else ("", "")
    return BlockLayout(
        name, real, deck, deck_digest, parameters, coefficients, tables,
        ordered(model.states), ordered(model.inputs), ordered(model.outputs), digest,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ParameterBlock:
    """Numbers for generated code.

    Parameters
    ----------
    layout
        Of the code.
    values
        Parameters and coefficients by name, in SI.
    tables
        Values of the tables, each of shape (rows, columns).
    deck, deck_digest
        Deck that the numbers are from.
    recipe
        How the code was designed, so that another deck can be designed alike; empty where that is unknown.
    """

    layout: BlockLayout
    values: Mapping[str, float]
    tables: tuple[Array, ...]
    deck: str
    deck_digest: str
    recipe: Mapping[str, Any] = field(default_factory=dict)

    def check(self) -> None:
        """Raise unless all numbers are finite and in their ranges."""
        layout = self.layout
        for v in (*layout.parameters, *layout.coefficients):
            self._require(v, self.values[v.name], f"'{v.name}'")
        for k, (table, values) in enumerate(zip(layout.tables, self.tables, strict=True)):
            for column, of_column in zip(table.columns, values.T, strict=True):
                for row, value in enumerate(of_column):
                    self._require(column, float(value), f"row {row} of '{column.name}' in table {k}")

    def _require(self, variable: Variable, value: float, what: str) -> None:
        real = self.layout.real
        low, high = max(variable.minimum, -real.largest), min(variable.maximum, real.largest)
        # The C compares what its type holds of number and limits.
        if not real.round(low) <= real.round(value) <= real.round(high):
            raise ExportError(
                f"block of '{self.deck}': {what} is {with_unit(f'{value:.6g}', variable.unit)}",
                f"the code takes {variable.minimum:.6g} to {variable.maximum:.6g}",
                next_step="correct the number, or export the code again where it is meant so",
            )

    def with_values(self, values: Mapping[str, float]) -> ParameterBlock:
        """Return the block with other parameters."""
        known = [v.name for v in self.layout.parameters]
        for name in values:
            if name not in known:
                raise ExportError(
                    f"'{name}'", "is no parameter of the block",
                    next_step=f"change it in the deck; parameters are {', '.join(known)}",
                )  # fmt: skip
        made = replace(self, values={**self.values, **values})
        made.check()
        return made

    def packed(self) -> bytes:
        """Return the bytes of the structure, least significant first."""
        layout = self.layout
        content = np.zeros((), layout.record)
        content["magic"], content["version"], content["size"] = MAGIC, VERSION, layout.size
        content["digest"] = np.void(bytes.fromhex(layout.digest))
        content["deck"] = np.void(bytes.fromhex(self.deck_digest[:16].ljust(16, "0")))
        for group in ("parameters", "coefficients"):
            if variables := getattr(layout, group):
                content[group] = [self.values[v.name] for v in variables]
        for k, table in enumerate(self.tables):
            content[f"table_{k}"] = table.T
        content["checksum"] = zlib.crc32(content.tobytes()[: layout.offset("checksum")])
        return content.tobytes()

    @property
    def checksum(self) -> int:
        """CRC-32 of all before it."""
        at = self.layout.offset("checksum")
        return int.from_bytes(self.packed()[at : at + 4], "little")


def unpacked(content: bytes, layout: BlockLayout, place: str) -> ParameterBlock:
    """Return the block in some bytes; damaged, foreign or impossible ones are an ``ExportError``.

    ``place``: where the bytes are from, for messages.
    """
    if len(content) < 40 or int.from_bytes(content[:4], "little") != MAGIC:
        raise ExportError(place, f"is no block: it does not begin with {MAGIC.to_bytes(4, 'little')!r}",
                          next_step=_OTHER_CODE)  # fmt: skip
    if len(content) != layout.size:
        raise ExportError(place, f"has {len(content)} bytes, a block of '{layout.name}' has {layout.size}",
                          next_step=_OTHER_CODE)  # fmt: skip
    read = np.frombuffer(content, layout.record)[0]
    for name, expected in (("version", VERSION), ("size", layout.size)):
        if int(read[name]) != expected:
            raise ExportError(
                f"{place}: {name} {int(read[name])}", f"{expected} was expected", next_step=_OTHER_CODE
            )
    check_digest(bytes(read["digest"]).hex(), layout, place)
    stated, actual = int(read["checksum"]), zlib.crc32(content[: layout.offset("checksum")])
    check_sum(stated, actual, place)
    values = {
        v.name: float(x)
        for group in ("parameters", "coefficients")
        if (variables := getattr(layout, group))
        for v, x in zip(variables, read[group], strict=True)
    }
    tables = tuple(np.array(read[f"table_{k}"], dtype=float).T for k in range(len(layout.tables)))
    digits = bytes(read["deck"]).hex()
    name = layout.deck if layout.deck_digest.startswith(digits) else f"deck {digits}"
    made = ParameterBlock(layout, values, tables, name, digits)
    made.check()
    return made


def check_digest(stated: str, layout: BlockLayout, place: str) -> None:
    """Refuse a block of other code."""
    if stated != layout.digest:
        raise ExportError(
            f"{place}: digest {stated}",
            f"is of other code; '{layout.name}' of deck '{layout.deck}' takes {layout.digest}",
            next_step=_OTHER_CODE,
        )


def check_sum(stated: int, actual: int, place: str) -> None:
    """Refuse a block whose numbers are not those that it was written with."""
    if stated != actual:
        raise ExportError(
            f"{place}: checksum 0x{stated:08x}", f"its numbers have 0x{actual:08x}: it is damaged or edited",
            next_step="write it again with nlsdesign export block, which takes --value NAME=VALUE",
        )  # fmt: skip
