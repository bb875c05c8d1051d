"""ASAP2 descriptions (A2L, ASAM MCD-2 MC 1.7) of blocks, instances of the code and monitors, for XCP tools.

Addresses are those of two symbols of the program, with offsets. Without an ELF file they are 0 and the symbol
links say which symbols; tools fill in the addresses then.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ...foundation.errors import ExportError, nearest
from ...foundation.locations import version
from ...foundation.text_files import write_text
from ...model.flat import Variable
from .block_layout import BlockLayout
from .c_text import Real
from .guarded_step import STATUS_BITS
from .watch_code import BINS, WatchSource

_LARGEST_ELF = 1 << 29


class Symbol(NamedTuple):
    """A variable of a program: its name, and its address, 0 where that is not known."""

    name: str
    address: int = 0


def write_a2l(
    layout: BlockLayout,
    path: str | Path,
    *,
    block: str = "block",
    instance: str = "state",
    elf: str | Path | None = None,
) -> Path:
    """Write an A2L file: the numbers of a block as characteristics, what an instance holds as measurements.

    Examples
    --------
    >>> write_a2l(source.layout, "joint.a2l", block="joint_block", elf="firmware.elf")  # doctest: +SKIP
    """
    addresses = _addresses((block, instance), elf)
    text = a2l_text(layout, Symbol(block, addresses[block]), Symbol(instance, addresses[instance]))
    write_text(Path(path), text)
    return Path(path)


def _addresses(names: Sequence[str], elf: str | Path | None) -> Mapping[str, int]:
    """Return the addresses of variables of a program, 0 without one; what is no name in C is an error."""
    for name in names:
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            raise ExportError(f"symbol '{name}'", "is no name of a variable in C",
                              next_step="name a variable at file scope of the program")  # fmt: skip
    return elf_symbols(Path(elf), names) if elf else dict.fromkeys(names, 0)


def write_watch_a2l(
    source: WatchSource, path: str | Path, *, instance: str = "monitor", elf: str | Path | None = None
) -> Path:
    """Write an A2L file of what a monitor has seen: its word, what counts as no change, sums and counts.

    Parameters
    ----------
    source
        Files of the monitor, as :func:`~nlsdesign.export.export_watch` writes them.
    path
        File to write.
    instance
        Name of the variable in the program that is the state of the monitor.
    elf
        Linked program with this symbol, for its address; 0 stands for it without one.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ExportError
        If the name is no identifier, or the program cannot be read or lacks the symbol.
    """
    symbol = Symbol(instance, _addresses((instance,), elf)[instance])
    plan, name = source.plan, source.name
    of_deck = plan.model.origin.deck if plan.model.origin else plan.model.name
    about = _File(name, f"monitor of deck {of_deck}", " ".join(f"{w:08x}" for w in plan.digest))
    write_text(Path(path), about.text(["1"], list(watched_entries(source, symbol))))
    return Path(path)


def watched_entries(source: WatchSource, symbol: Symbol) -> Iterator[str]:
    """Yield the measurements of the record, which stands first in the state of a monitor."""
    plan, layout = source.plan, source.plan.layout(source.real)
    kind, most = _kind(source.real), repr(source.real.largest)
    fields, width = layout.fields, 4 if source.real is Real.FLOAT else 8
    assert fields is not None

    def row(name: str, text: str, at: int, is_number: bool = True, count: int = 1) -> Iterator[str]:
        about = (_identifier(f"{source.name}.{name}"), text, kind if is_number else "ULONG")
        limits = f"-{most} {most}" if is_number else "0 4294967295"
        yield from _measurement(symbol, about, at, ("1", limits), count=count)

    for name in ("magic", "version", "size", "judged", "word", "checksum"):
        yield from row(name, f"{name} of the record", int(fields[name][1]), is_number=False)
    moments = int(layout["recent"].base.itemsize)
    for i, block in enumerate(plan.blocks):
        for k, change in enumerate(block.changes):
            at = int(fields["reference"][1]) + (i * plan.most + k) * width
            yield from row(
                f"reference.{block.name}.{change}", "counts as no change, in changes to be noticed", at
            )
        first, pairs = int(fields["bins"][1]) + i * BINS * moments, moments // width - 1
        places = [(f"recent.{block.name}", int(fields["recent"][1]) + i * moments)]
        places += [(f"bins.{block.name}[{k}]", first + k * moments) for k in range(BINS)]
        for name, at in places:
            yield from row(f"{name}.count", "means that were used", at)
            yield from row(f"{name}.products", "sums of products", at + width, count=pairs)


def a2l_text(layout: BlockLayout, block: Symbol, instance: Symbol) -> str:
    """Return the description."""
    numbers = _Description(layout, block, instance)
    about = _File(
        layout.name, f"{layout.name} of deck {layout.deck}", layout.digest,
        f"block of {layout.size} bytes; load it by {layout.name}_load",
    )  # fmt: skip
    layouts = [
        f"    /begin RECORD_LAYOUT number FNC_VALUES 1 {numbers.kind} ROW_DIR DIRECT /end RECORD_LAYOUT",
        "    /begin RECORD_LAYOUT word FNC_VALUES 1 ULONG ROW_DIR DIRECT /end RECORD_LAYOUT",
    ]
    return about.text(numbers.units(), [*layouts, *numbers.characteristics(), *numbers.measurements()])


class _File(NamedTuple):
    """What stands around the entries of a description."""

    name: str
    about: str
    digest: str
    parameters: str = ""

    def text(self, units: Sequence[str], entries: Sequence[str]) -> str:
        """Return the file: how each unit is shown, as it is, then the entries."""
        methods = [
            f"    /begin COMPU_METHOD {_method(unit)} {_string(unit)} IDENTICAL "
            f'"%.9" {_string("" if unit == "1" else unit)} /end COMPU_METHOD'
            for unit in units
        ]
        lines = [
            "ASAP2_VERSION 1 71",
            f"/begin PROJECT {self.name} {_string(self.about)}",
            f"  /begin HEADER {_string(f'written by nlsdesign {version()}')}",
            f'    VERSION "{self.digest}"',
            "  /end HEADER",
            f"  /begin MODULE {self.name} {_string(f'numbers and signals of {self.name}')}",
            '    /begin MOD_COMMON ""',
            "      BYTE_ORDER MSB_LAST",
            *(f"      ALIGNMENT_{kind} {size}" for kind, size in _ALIGNMENTS.items()),
            "    /end MOD_COMMON",
            f"    /begin MOD_PAR {_string(self.parameters)}",
            f'      VERSION "{self.digest}"',
            "    /end MOD_PAR",
            *methods,
            *entries,
            "  /end MODULE",
            "/end PROJECT",
            "",
        ]
        return "\n".join(lines)


def _kind(real: Real) -> str:
    """Return a number type as A2L calls it."""
    return "FLOAT32_IEEE" if real is Real.FLOAT else "FLOAT64_IEEE"


_ALIGNMENTS = {"BYTE": 1, "WORD": 2, "LONG": 4, "FLOAT32_IEEE": 4, "FLOAT64_IEEE": 8}
_HEAD = ("magic", "version", "size")


@dataclass(frozen=True, eq=False)
class _Description:
    layout: BlockLayout
    block: Symbol
    instance: Symbol

    @property
    def kind(self) -> str:
        """The number type as A2L calls it."""
        return _kind(self.layout.real)

    @property
    def width(self) -> int:
        """Bytes of a number."""
        return 4 if self.layout.real is Real.FLOAT else 8

    def units(self) -> list[str]:
        """Return all units that occur."""
        layout = self.layout
        columns = [v for t in layout.tables for v in t.columns]
        groups = (
            layout.parameters,
            layout.coefficients,
            columns,
            layout.states,
            layout.inputs,
            layout.outputs,
        )
        return sorted({v.unit for group in groups for v in group} | {"1"} | set(self._axis_units()))

    def _axis_units(self) -> list[str]:
        named = {v.name: v.unit for v in (*self.layout.inputs, *self.layout.states)}
        return [named.get(t.argument, "1") for t in self.layout.tables]

    def characteristics(self) -> Iterator[str]:
        """Yield the numbers of the block."""
        layout = self.layout
        unsigned = [(member, layout.offset(member)) for member in (*_HEAD, "checksum")]
        unsigned += [(f"digest[{i}]", layout.offset("digest") + 4 * i) for i in range(4)]
        unsigned += [(f"deck[{i}]", layout.offset("deck") + 4 * i) for i in range(2)]
        for name, at in unsigned:
            limited = Variable(name, "1", f"{name} of the block", minimum=0, maximum=4294967295)
            yield from self._value(f"{layout.name}.block.{name}", limited, at, "word")
        for group in ("parameters", "coefficients"):
            start = layout.offset(group) if getattr(layout, group) else 0
            for i, v in enumerate(getattr(layout, group)):
                yield from self._value(f"{layout.name}.{v.name}", v, start + i * self.width)
        for k, (table, unit) in enumerate(zip(layout.tables, self._axis_units(), strict=True)):
            rows = len(table.values)
            for j, column in enumerate(table.columns):
                at = layout.offset(f"table_{k}") + j * rows * self.width
                name = f"{layout.name}.table_{k}.{column.name}"
                yield from self.curve(name, column, at, (table.argument, unit, table.grid.tolist()))

    def _value(self, name: str, v: Variable, at: int, record: str = "number") -> Iterator[str]:
        yield f"    /begin CHARACTERISTIC {_identifier(name)}"
        yield f"      {_string(v.description)} VALUE {_address(self.block, at)} {record} 0"
        yield f"      {_method(v.unit)} {self._limits(v)}"
        yield f'      SYMBOL_LINK "{self.block.name}" {at}'
        yield "    /end CHARACTERISTIC"

    def curve(self, name: str, v: Variable, at: int, axis: tuple[str, str, Sequence[float]]) -> Iterator[str]:
        """Yield a column of a table over its grid points: argument, unit and points of the axis."""
        argument, unit, points = axis
        yield f"    /begin CHARACTERISTIC {_identifier(name)}"
        yield f"      {_string(v.description)} CURVE {_address(self.block, at)} number 0"
        yield f"      {_method(v.unit)} {self._limits(v)}"
        yield f"      /begin AXIS_DESCR FIX_AXIS {self.quantity(argument)} {_method(unit)} {len(points)}"
        yield f"        {points[0]!r} {points[-1]!r}"
        yield "        /begin FIX_AXIS_PAR_LIST"
        for first in range(0, len(points), 6):
            yield "          " + " ".join(map(repr, points[first : first + 6]))
        yield "        /end FIX_AXIS_PAR_LIST"
        yield "      /end AXIS_DESCR"
        yield f'      SYMBOL_LINK "{self.block.name}" {at}'
        yield "    /end CHARACTERISTIC"

    def quantity(self, argument: str) -> str:
        """Return the name of the measurement of what a table is read over."""
        of = next(
            (g for g in ("inputs", "states") if argument in [v.name for v in getattr(self.layout, g)]), None
        )
        return _identifier(f"{self.layout.name}.{of}.{argument}") if of else "NO_INPUT_QUANTITY"

    def measurements(self) -> Iterator[str]:
        """Yield what an instance holds: inputs as they were taken, states, outputs, and the status word."""
        layout = self.layout
        places = layout.instance.fields
        assert places is not None
        for group in ("inputs", "states", "outputs"):
            start = int(places[group][1])
            for i, v in enumerate(getattr(layout, group)):
                name, at = f"{layout.name}.{group}.{v.name}", start + i * self.width
                about = (_identifier(name), v.description, self.kind)
                yield from _measurement(self.instance, about, at, (v.unit, self._limits(v)))
        bits = "; ".join(f"bit {bit.bit_length() - 1}: {flag}" for flag, (bit, _) in STATUS_BITS.items())
        for name, text in (
            ("status", f"status word. {bits}"),
            ("loaded", "first digits of the deck in force"),
        ):
            at = int(places[name][1])
            about = (f"{layout.name}.{name}", text, "ULONG")
            yield from _measurement(self.instance, about, at, ("1", "0 4294967295"))

    def _limits(self, v: Variable) -> str:
        most = self.layout.real.largest
        return f"{max(v.minimum, -most)!r} {min(v.maximum, most)!r}"


def _measurement(
    symbol: Symbol, about: tuple[str, str, str], at: int, shown: tuple[str, str], *, count: int = 1
) -> Iterator[str]:
    """Yield what is read of a variable: name, text and kind, then unit and limits."""
    name, text, kind = about
    yield f"    /begin MEASUREMENT {name}"
    yield f"      {_string(text)} {kind} {_method(shown[0])} 0 0 {shown[1]}"
    yield f"      ECU_ADDRESS {_address(symbol, at)}"
    if count > 1:
        yield f"      MATRIX_DIM {count}"
    yield f'      SYMBOL_LINK "{symbol.name}" {at}'
    yield "    /end MEASUREMENT"


def _address(symbol: Symbol, at: int) -> str:
    return f"0x{symbol.address + at if symbol.address else 0:08X}"


def _string(text: str) -> str:
    flat = " ".join(text.split()).replace("\\", "/").replace('"', "'")
    return f'"{flat[:255]}"'


def _method(unit: str) -> str:
    return "unit_" + (
        re.sub(r"\W", "_", unit.replace("*", "_").replace("/", "_per_").replace("^", "")) or "none"
    )


def _identifier(name: str) -> str:
    """Return a name as A2L writes it: parts begin with a letter, indices stand in brackets."""
    return ".".join(re.sub(r"[^\w\[\]]", "_", part) for part in name.split("."))


def elf_symbols(path: Path, wanted: Sequence[str]) -> Mapping[str, int]:
    """Return the addresses of some symbols of a program; one that lacks them is an ``ExportError``."""
    try:
        if path.stat().st_size > _LARGEST_ELF:
            raise ExportError(str(path), f"has more than {_LARGEST_ELF >> 20} MB, no firmware has")
        addresses = dict(symbols_in(path.read_bytes()))
    except OSError as error:
        raise ExportError(str(path), f"cannot be read: {error.strerror or error}") from None
    except (struct.error, IndexError, ValueError) as error:
        raise ExportError(
            str(path), f"is no ELF file with the least significant byte first and symbols: {error}",
            next_step="name the linked program, not stripped",
        ) from None  # fmt: skip
    for name in wanted:
        if name not in addresses:
            raise ExportError(
                f"{path}: symbol '{name}'", "does not exist", did_you_mean=nearest(name, list(addresses)),
                next_step="give the names of the variables with --block-symbol and --instance-symbol",
            )  # fmt: skip
    return {name: addresses[name] for name in wanted}


def symbols_in(content: bytes) -> Iterator[tuple[str, int]]:
    """Yield names and addresses from the tables of symbols of an ELF file."""
    if content[:4] != b"\x7fELF" or content[4] not in (1, 2) or content[5] != 1:
        raise ValueError("its head is another one")
    wide = content[4] == 2
    at, step, count = struct.unpack_from("<Q10xHH" if wide else "<I10xHH", content, 40 if wide else 32)
    section = "<4xI16xQQI12xQ" if wide else "<4xI8xIIIxxxxxxxxI"
    sections = [struct.unpack_from(section, content, at + k * step) for k in range(count)]
    for kind, start, size, link, width in sections:
        if kind != 2:
            continue
        texts = content[sections[link][1] :]
        for place in range(start, start + size, width):
            name, value = struct.unpack_from("<I4xQ" if wide else "<II", content, place)
            end = texts.index(b"\0", name)
            yield texts[name:end].decode("utf-8", "replace"), value
