"""C for blocks of numbers: their structure, the block of the design, and what checks and takes one over."""

from __future__ import annotations

from collections.abc import Sequence

from ...model.flat import Table, Variable
from .block_layout import MAGIC, VERSION, BlockLayout, ParameterBlock
from .c_text import comment, signature
from .writer import CWriter, paths_in_memory

_PER_LINE = 6
"""Numbers of a row in a line of C."""


def block_declarations(c: CWriter) -> dict[str, str | list[str]]:
    """Return what the header says of blocks; nothing for code whose numbers are fixed."""
    layout = c.layout
    if layout is None:
        return {"block": [], "loaded": [], "load": []}
    count = len(layout.coefficients)
    coefficients = [
        f"{c.real} coefficients[{count}]; /* constants of the equations that follow from the deck */"
    ]
    values: dict[str, str | list[str]] = {
        "magic": f"0x{MAGIC:08x}u",
        "version": f"{VERSION}u",
        "size": str(layout.size),
        "parameters_member": [f"{c.name}_parameters parameters;"] if layout.parameters else [],
        "coefficients_member": coefficients if count else [],
        "table_members": _table_members(layout, by_row=False),
    }
    return {
        "block": [*c.filled("controller_block.h", values).splitlines(), ""],
        "loaded": [
            *(coefficients if count else []),
            *_table_members(layout, by_row=True),
            "uint32_t status; /* last word of step */",
            "uint32_t loaded; /* first digits of the deck whose numbers are in force */",
        ],
        "load": [*c.filled("controller_load.h", {"load": _head(c.name)}).splitlines(), ""],
    }


def block_functions(c: CWriter, derived: bool) -> dict[str, str | list[str]]:
    """Return what the source has for blocks; nothing for code whose numbers are fixed.

    ``derived``: whether numbers follow from the parameters.
    """
    layout = c.layout
    if layout is None:
        return {name: [] for name in ("default_block", "block_check", "take_block", "load", "noted")}
    derive = [f"{c.name}_derive(state);"] if derived else []
    values: dict[str, str | list[str]] = {
        "half_bytes": _lines([f"0x{_half_byte(k):08x}u" for k in range(16)]),
        "bytes": str(layout.offset("checksum")),
        "ranges": _ranges(c, layout),
        "taken": _taken(layout),
        "load": _head(c.name),
        "derived": derive,
    }
    return {
        "default_block": [*initialised(layout.default, f"{c.name}_default_block"), ""],
        "block_check": [*c.filled("controller_check.c", values).splitlines(), ""],
        "take_block": [f"{c.name}_take_block(state, &{c.name}_default_block);"],
        "load": [*c.filled("controller_load.c", values).splitlines(), ""],
        "noted": ["state->status = status;"],
    }


def _head(name: str) -> str:
    return signature(f"{name}_block_result {name}_load", f"{name}_state *state", f"const {name}_block *block")


def _half_byte(number: int) -> int:
    """Return what the CRC-32 becomes by half a byte."""
    for _ in range(4):
        number = (number >> 1) ^ (0xEDB88320 if number & 1 else 0)
    return number


def _table_members(layout: BlockLayout, *, by_row: bool) -> list[str]:
    return [
        f"{layout.real} table_{k}{_size(t, by_row)}; /* over {comment(t.argument)}: "
        f"{comment(', '.join(f'{v.name} [{v.unit}]' for v in t.columns))} */"
        for k, t in enumerate(layout.tables)
    ]


def _size(table: Table, by_row: bool) -> str:
    rows, columns = table.values.shape
    return f"[{rows}][{columns}]" if by_row else f"[{columns}][{rows}]"


def _ranges(c: CWriter, layout: BlockLayout) -> list[str]:
    def call(v: Variable, text: str) -> str:
        return f"wrong |= outside(block->{text}, {c.real.bound(v.minimum)}, {c.real.bound(v.maximum)});"

    paths = paths_in_memory(layout.parameters)
    lines = [call(v, f"parameters.{paths[v.name]}") for v in layout.parameters]
    lines += [call(v, f"coefficients[{i}]") for i, v in enumerate(layout.coefficients)]
    for k, table in enumerate(layout.tables):
        rows = [f"    {call(v, f'table_{k}[{j}][row]')}" for j, v in enumerate(table.columns)]
        lines += [f"for (uint32_t row = 0u; row < {len(table.values)}u; ++row) {{", *rows, "}"]
    return lines


def _taken(layout: BlockLayout) -> list[str]:
    lines = ["state->parameters = block->parameters;"] if layout.parameters else []
    if count := len(layout.coefficients):
        lines += [f"for (uint32_t i = 0u; i < {count}u; ++i) {{",
                  "    state->coefficients[i] = block->coefficients[i];", "}"]  # fmt: skip
    for k, table in enumerate(layout.tables):
        lines.append(f"for (uint32_t row = 0u; row < {len(table.values)}u; ++row) {{")
        columns = range(len(table.columns))
        lines += [f"    state->table_{k}[row][{j}] = block->table_{k}[{j}][row];" for j in columns]
        lines.append("}")
    return [*lines, "state->loaded = block->deck[0];"]


def initialised(block: ParameterBlock, name: str) -> list[str]:
    """Return the definition of a constant block."""
    layout, real = block.layout, block.layout.real
    words = [
        f"0x{int.from_bytes(bytes.fromhex(layout.digest)[i : i + 4], 'little'):08x}u" for i in (0, 4, 8, 12)
    ]
    deck = bytes.fromhex(block.deck_digest[:16].ljust(16, "0"))
    lines = [
        f".magic = 0x{MAGIC:08x}u,", f".version = {VERSION}u,", f".size = {layout.size}u,", ".reserved = 0u,",
        f".digest = {{{', '.join(words)}}},",
        ".deck = {" + ", ".join(f"0x{int.from_bytes(deck[i : i + 4], 'little'):08x}u" for i in (0, 4)) + "},",
    ]  # fmt: skip
    paths = paths_in_memory(layout.parameters)
    for v in layout.parameters:
        lines.append(f".parameters.{paths[v.name]} = {real.literal(block.values[v.name])}, /* {_range(v)} */")
    if layout.coefficients:
        numbers = [real.literal(block.values[v.name]) for v in layout.coefficients]
        lines += [".coefficients = {", *(f"    {line}" for line in _lines(numbers)), "},"]
    for k, values in enumerate(block.tables):
        lines.append(f".table_{k} = {{")
        for column in values.T.tolist():
            numbers = _lines([real.literal(value) for value in column])
            lines += ["    {", *(f"        {line}" for line in numbers), "    },"]
        lines.append("},")
    lines += [f".checksum = 0x{block.checksum:08x}u,", ".unused = 0u,"]
    head = f"/* Numbers of {comment(block.deck) or 'no deck'}, {block.deck_digest[:12] or 'no digest'}. */"
    return [head, f"const {layout.name}_block {name} = {{", *(f"    {line}" for line in lines), "};"]


def _range(v: Variable) -> str:
    return f"{comment(v.unit)}, {v.minimum:.6g} to {v.maximum:.6g}"


def _lines(items: Sequence[str]) -> list[str]:
    return [", ".join(items[i : i + _PER_LINE]) + "," for i in range(0, len(items), _PER_LINE)]
