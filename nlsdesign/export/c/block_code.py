"""C for blocks of numbers: their structure, the block of the design, and what checks and takes one over."""

from __future__ import annotations

from pathlib import Path

from ...model.flat import Variable
from ..files import filled
from .block_layout import MAGIC, VERSION, BlockLayout, ParameterBlock, block_layout
from .c_text import Real, comma_rows, comment, half_byte_sums, identifier, signature
from .coefficients import LoadableModel
from .controller_code import write_step
from .writer import CSource, CWriter, paths_in_memory


def export_c_with_blocks(
    loadable: LoadableModel, folder: str | Path, *, real: Real | str = Real.DOUBLE, name: str | None = None
) -> tuple[CSource, BlockLayout]:
    """Write C as :func:`~nlsdesign.export.export_c` does, which takes blocks of other numbers at run time."""
    number, prefix = Real.named(real), identifier(name or loadable.model.name)
    layout = block_layout(loadable, prefix, number, paths_in_memory)
    c = CWriter(loadable.model, prefix, number, loadable.coefficients)
    return write_step(c, folder, {**block_declarations(c, layout), **block_functions(c, layout)}), layout


def block_declarations(c: CWriter, layout: BlockLayout) -> dict[str, list[str]]:
    """Return what the header says of blocks."""
    count = len(layout.coefficients)
    own = f"{c.real} coefficients[{count}]; /* constants of the equations that follow from the deck */"
    coefficients = [own] if count else []
    values: dict[str, str | list[str]] = {
        "magic": f"0x{MAGIC:08x}u",
        "version": f"{VERSION}u",
        "size": str(layout.size),
        "parameters_member": [f"{c.name}_parameters parameters;"] if layout.parameters else [],
        "coefficients_member": coefficients,
        "table_members": _table_members(layout, by_row=False),
    }
    return {
        "block": [*c.filled("controller_block.h", values).splitlines(), ""],
        "loaded": [
            *coefficients,
            *_table_members(layout, by_row=True),
            "uint32_t status; /* last word of step */",
            "uint32_t loaded; /* first digits of the deck whose numbers are in force */",
        ],
        "load_head": [*c.filled("controller_load.h", {"load": _head(c.name)}).splitlines(), ""],
    }


def block_functions(c: CWriter, layout: BlockLayout) -> dict[str, list[str]]:
    """Return what the source has for blocks."""
    values: dict[str, str | list[str]] = {
        "half_bytes": half_byte_sums(),
        "bytes": str(layout.offset("checksum")),
        "ranges": range_checks(layout),
        "taken": taken_numbers(layout),
        "load": _head(c.name),
        "derived": [f"{c.name}_derive(state);"] if c.equations.numbers.numel() else [],
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


def _table_members(layout: BlockLayout, *, by_row: bool) -> list[str]:
    lines = []
    for k, table in enumerate(layout.tables):
        rows, columns = table.values.shape
        size = f"[{rows}][{columns}]" if by_row else f"[{columns}][{rows}]"
        names = comment(", ".join(f"{v.name} [{v.unit}]" for v in table.columns))
        lines.append(f"{layout.real} table_{k}{size}; /* over {comment(table.argument)}: {names} */")
    return lines


def range_checks(layout: BlockLayout) -> list[str]:
    """Return the statements that compare every number with its range."""

    def call(v: Variable, text: str) -> str:
        limits = f"{layout.real.bound(v.minimum)}, {layout.real.bound(v.maximum)}"
        return f"wrong |= outside(block->{text}, {limits});"

    paths = paths_in_memory(layout.parameters)
    lines = [call(v, f"parameters.{paths[v.name]}") for v in layout.parameters]
    lines += [call(v, f"coefficients[{i}]") for i, v in enumerate(layout.coefficients)]
    for k, table in enumerate(layout.tables):
        rows = [call(v, f"table_{k}[{j}][row]") for j, v in enumerate(table.columns)]
        lines += _for_rows(len(table.values), rows)
    return lines


def taken_numbers(layout: BlockLayout) -> list[str]:
    """Return the statements that copy the numbers of a block into an instance."""
    lines = ["state->parameters = block->parameters;"] if layout.parameters else []
    if count := len(layout.coefficients):
        lines += _for_rows(count, ["state->coefficients[row] = block->coefficients[row];"])
    for k, table in enumerate(layout.tables):
        columns = range(len(table.columns))
        rows = [f"state->table_{k}[row][{j}] = block->table_{k}[{j}][row];" for j in columns]
        lines += _for_rows(len(table.values), rows)
    return [*lines, "state->loaded = block->deck[0];"]


def _for_rows(count: int, body: list[str]) -> list[str]:
    return filled("block_loop.c", {"count": str(count), "body": body}).splitlines()


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
        remark = f"{comment(v.unit)}, {v.minimum:.6g} to {v.maximum:.6g}"
        value = real.literal(block.values[v.name])
        lines.append(f".parameters.{paths[v.name]} = {value}, /* {remark} */")
    if layout.coefficients:
        numbers = [real.literal(block.values[v.name]) for v in layout.coefficients]
        lines += [".coefficients = {", *(f"    {line}" for line in comma_rows(numbers)), "},"]
    for k, values in enumerate(block.tables):
        lines.append(f".table_{k} = {{")
        for column in values.T.tolist():
            numbers = comma_rows([real.literal(value) for value in column])
            lines += ["    {", *(f"        {line}" for line in numbers), "    },"]
        lines.append("},")
    lines += [f".checksum = 0x{block.checksum:08x}u,", ".unused = 0u,"]
    head = f"/* Numbers of {comment(block.deck) or 'no deck'}, {block.deck_digest[:12] or 'no digest'}. */"
    return [head, f"const {layout.name}_block {name} = {{", *(f"    {line}" for line in lines), "};"]
