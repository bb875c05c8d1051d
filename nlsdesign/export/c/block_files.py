"""Blocks of numbers as files: C, the bytes of the structure, and JSON that names every number."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...foundation.errors import ExportError, NlsError, nearest
from ...foundation.locations import version
from ...foundation.text_files import draft
from ...model.flat import Table, Variable
from ..files import filled
from .block_code import initialised
from .block_layout import BlockLayout, ParameterBlock, check_digest, check_sum, unpacked
from .c_text import Real, comment, identifier

FORMAT = "nlsdesign parameter block 1"
_MOST_BYTES = 1 << 26
_SEEN = ("states", "inputs", "outputs")


def write_parameter_block(block: ParameterBlock, path: str | Path) -> Path:
    """Write a block as a file; its ending says in which form.

    ``.bin`` holds the bytes of the structure, least significant first, ``.c`` a constant of that structure,
    ``.json`` names, values, units and ranges, from which the other two can be made again.

    Examples
    --------
    >>> write_parameter_block(block, "joint.bin")  # doctest: +SKIP
    """
    target = Path(path)
    made = _WRITERS.get(target.suffix)
    if made is None:
        raise ExportError(
            str(path), f"a block has one of the endings {', '.join(_WRITERS)}",
            did_you_mean=nearest(target.suffix, list(_WRITERS)),
        )  # fmt: skip
    block.check()
    with draft(target) as name:
        name.write_bytes(made(block))
    return target


def read_parameter_block(path: str | Path, code: BlockLayout | None = None) -> ParameterBlock:
    """Return a block from a ``.json`` or ``.bin`` file.

    Examples
    --------
    >>> read_parameter_block("out/c/torque_loop_block.json").values["motor.inertia"]  # doctest: +SKIP
    """
    file, place = Path(path), str(path)
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise ExportError(place, f"has {file.stat().st_size} bytes, no block is as large")
        content = file.read_bytes()
    except OSError as error:
        raise ExportError(place, f"cannot be read: {error.strerror or error}") from None
    if file.suffix == ".json":
        return block_from_json(content, code, place)
    if code is None:
        raise ExportError(
            place, "holds no names, so the code must be named that it is for",
            next_step="give the layout from the .json beside the code: read_parameter_block(json).layout",
        )  # fmt: skip
    return unpacked(content, code, place)


def block_in_c(block: ParameterBlock) -> bytes:
    """Return a block as a constant in C."""
    name = block.layout.name
    own = f"{name}_block_of_{identifier(block.deck or 'no_deck')}"
    values: dict[str, str | list[str]] = {
        "title": f"Block for {name}.c of {comment(block.layout.deck)}, layout {block.layout.digest}.",
        "version": version(),
        "name": name,
        "own": own,
        "numbers": initialised(block, own),
    }
    return filled("block_constant.c", values).encode()


def block_in_json(block: ParameterBlock) -> bytes:
    """Return a block with names, units and ranges as JSON."""
    layout = block.layout
    numbers = [_described(v) | {"value": block.values[v.name]} for v in layout.parameters]
    coefficients = [_described(v) | {"value": block.values[v.name]} for v in layout.coefficients]
    tables = [
        {
            "argument": t.argument,
            "grid": t.grid.tolist(),
            "uniform": None if t.breakpoints is not None else [t.lower, t.step],
            "columns": [_described(v) for v in t.columns],
            "values": values.tolist(),
        }
        for t, values in zip(layout.tables, block.tables, strict=True)
    ]
    content = {
        "format": FORMAT,
        "code": layout.name,
        "real": str(layout.real),
        "byte_order": "little",
        "digest": layout.digest,
        "checksum": f"0x{block.checksum:08x}",
        "code_deck": {"name": layout.deck, "sha256": layout.deck_digest},
        "deck": {"name": block.deck, "sha256": block.deck_digest},
        "parameters": numbers,
        "coefficients": coefficients,
        "tables": tables,
        **{group: [_described(v) for v in getattr(layout, group)] for group in _SEEN},
        "recipe": dict(block.recipe),
    }
    return (json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _described(v: Variable) -> dict[str, Any]:
    limits = [x if math.isfinite(x) else None for x in (v.minimum, v.maximum)]
    return {
        "name": v.name,
        "unit": v.unit,
        "minimum": limits[0],
        "maximum": limits[1],
        "description": v.description,
    }


_WRITERS: Mapping[str, Callable[[ParameterBlock], bytes]] = {
    ".json": block_in_json,
    ".bin": ParameterBlock.packed,
    ".c": block_in_c,
}


_ANOTHER = "take the NAME_block.json that nlsdesign export c --block writes beside the code"


def block_from_json(content: bytes, code: BlockLayout | None, place: str) -> ParameterBlock:
    """Return the block in a JSON file; a damaged or foreign one is an ``ExportError``."""
    try:
        raw = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ExportError(place, f"is no JSON: {error}", next_step=_ANOTHER) from None
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise ExportError(place, f"is not of the format '{FORMAT}'", next_step=_ANOTHER)
    try:
        block, stated = block_of_fields(raw), int(raw["checksum"], 16)
        check_sum(stated, block.checksum, place)
    except NlsError:
        raise
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        words = f"lacks a field or has one of another form: {error!r}"
        raise ExportError(place, words, next_step=_ANOTHER) from None
    if code is not None:
        check_digest(block.layout.digest, code, place)
    block.check()
    return block


def block_of_fields(raw: Mapping[str, Any]) -> ParameterBlock:
    """Return the block that the fields of a JSON file describe."""
    parameters, coefficients = (tuple(map(_variable, raw[group])) for group in ("parameters", "coefficients"))
    tables = tuple(map(table_of_fields, raw["tables"]))
    states, inputs, outputs = (tuple(map(_variable, raw[group])) for group in _SEEN)
    code = raw["code_deck"]
    layout = BlockLayout(
        str(raw["code"]), Real.named(raw["real"]), str(code["name"]), str(code["sha256"]),
        parameters, coefficients, tables, states, inputs, outputs, str(raw["digest"]),
    )  # fmt: skip
    values = {v.name: v.start for v in (*parameters, *coefficients)}
    if len(values) != len(parameters) + len(coefficients):
        raise ValueError("a name stands twice")
    deck = raw["deck"]
    return ParameterBlock(
        layout, values, tuple(t.values for t in tables), str(deck["name"]), str(deck["sha256"]),
        dict(raw["recipe"]),
    )  # fmt: skip


def _variable(raw: Mapping[str, Any]) -> Variable:
    low, high = (
        math.inf * s if raw[k] is None else float(raw[k]) for s, k in ((-1, "minimum"), (1, "maximum"))
    )
    return Variable(
        str(raw["name"]), str(raw["unit"]), str(raw["description"]), start=float(raw.get("value", 0.0)),
        minimum=low, maximum=high,
    )  # fmt: skip


def table_of_fields(raw: Mapping[str, Any]) -> Table:
    """Return a table of such fields."""
    columns, values = tuple(map(_variable, raw["columns"])), np.array(raw["values"], dtype=float)
    if values.shape != (len(raw["grid"]), len(columns)):
        raise ValueError(f"a table has the shape {values.shape}")
    if raw["uniform"] is None:
        return Table.over(str(raw["argument"]), np.array(raw["grid"], dtype=float), columns, values)
    lower, step = map(float, raw["uniform"])
    return Table(str(raw["argument"]), lower, step, columns, values)
