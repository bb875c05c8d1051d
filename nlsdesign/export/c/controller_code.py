"""C99 for the controller: a discrete model as ``init`` and ``step`` on a structure that the caller owns.

No heap, no recursion, no mutable data outside the caller's structure, tables ``static const``, no loop: a
step is straight-line code. For any input states and outputs stay finite, and the status word tells what was
held or saturated. CasADi generates the arithmetic (see :mod:`.instructions`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca

from ...errors import ExportError
from ...locations import version
from ...model.flat import FlatModel, Variable
from ..files import filled, write_all
from .c_text import Real, comment, identifier, real_type, signature
from .controller_step import step_function, step_head
from .guarded_step import STATUS_BITS, first_outputs, index_bit
from .self_test import selftest_source
from .smooth_only import refuse_jumps
from .structures import initialiser, member_paths, structure
from .table_lookup import indexed_tables, table_data


@dataclass(frozen=True, eq=False)
class CSource:
    """C files of one discrete model.

    Parameters
    ----------
    name
        Prefix of all C names and of the files.
    model
        The model they compute.
    real
        ``"double"`` or ``"float"``.
    header, source, selftest
        The files.
    """

    name: str
    model: FlatModel
    real: str
    header: Path
    source: Path
    selftest: Path


def export_c(
    model: FlatModel, folder: str | Path, *, real: str = "double", name: str | None = None
) -> CSource:
    """Write ``<name>.h``, ``<name>.c`` and ``<name>_selftest.c`` for a discrete model.

    Parameters
    ----------
    model
        Discrete model: observer or controller.
    folder
        Folder of the files; it is made if it is missing.
    real
        ``"double"`` or ``"float"``.
    name
        Prefix of all C names; made from the name of the model by default.

    Returns
    -------
    CSource
        Names of the files.

    Raises
    ------
    ExportError
        If the model is continuous, depends on time, cannot be written in C, or the folder cannot be written.
    """
    number, prefix = real_type(real), identifier(name or model.name)
    check_discrete(model)
    place = Path(folder)
    source = CSource(
        prefix,
        model,
        real,
        place / f"{prefix}.h",
        place / f"{prefix}.c",
        place / f"{prefix}_selftest.c",
    )
    texts = {
        source.header: header_text(model, prefix, number),
        source.source: source_text(model, prefix, number),
        source.selftest: selftest_source(model, prefix, number),
    }
    write_all(texts)
    return source


def check_discrete(model: FlatModel) -> None:
    """Raise unless a model can be a controller's step.

    Parameters
    ----------
    model
        Any model.

    Raises
    ------
    ExportError
        If it is continuous or depends on time.
    """
    refuse_jumps(model)
    if model.sample_time is None:
        raise ExportError(
            f"model '{model.name}'",
            "is continuous, C code for a controller needs a sample time",
            next_step="discretise it first, or export an FMU",
        )
    s = model.symbols()
    if ca.depends_on(ca.vertcat(s.derivative, s.output, s.signal), s.time):
        raise ExportError(
            f"model '{model.name}'",
            "depends on time, which would run out of digits in a controller",
            next_step="make the signal an input",
        )


def header_text(model: FlatModel, name: str, real: Real) -> str:
    """Return the header file.

    Parameters
    ----------
    model
        Discrete model.
    name
        Prefix of all C names.
    real
        Number type.
    """
    upper = name.upper()
    bits = [
        f"#define {upper}_{flag} 0x{bit:x}u /* {meaning} */" for flag, (bit, meaning) in STATUS_BITS.items()
    ]
    lines = [
        *_title(model),
        f"#ifndef {upper}_H",
        f"#define {upper}_H",
        "",
        "#include <stdint.h>",
        "",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
        "",
        f"#define {upper}_SAMPLE_TIME {real.literal(float(model.sample_time or 0.0))} /* s */",
        "",
        "/* Bits of the status word. Bit 8 + i names input i (of step) or parameter i (of init and",
        "   set_parameters) as numbered below; bit 30 stands for all from 22 on. */",
        *bits,
        "",
        *structure(f"{name}_inputs", model.inputs, real, "What step reads.", numbered=True),
        "",
        *structure(f"{name}_outputs", model.outputs, real, "What step gives, always finite."),
        "",
        *structure(f"{name}_parameters", model.parameters, real, "Tunable numbers.", numbered=True),
        "",
        *structure(f"{name}_states", model.states, real, "What is remembered from sample to sample."),
        "",
        *_interface(name),
        "",
        "#ifdef __cplusplus",
        "}",
        "#endif",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def _title(model: FlatModel) -> list[str]:
    return [
        f"/* {comment(model.name)}: {comment(model.description)}",
        f"   Sample time {model.sample_time!r} s; all numbers in SI units, given in brackets.",
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]


def _interface(name: str) -> list[str]:
    return [
        "/* One running instance; the caller owns it, there may be many. */",
        "typedef struct {",
        f"    {name}_parameters parameters;",
        f"    {name}_states states;",
        f"    {name}_inputs inputs; /* last good */",
        f"    {name}_outputs outputs; /* last good */",
        f"}} {name}_state;",
        "",
        "/* Gives the parameters of the design. */",
        f"void {name}_defaults({name}_parameters *parameters);",
        "",
        "/* Starts an instance; null stands for the parameters of the design. Returns a status word. */",
        _head(name, "init", "parameters") + ";",
        "",
        "/* Takes over parameters, each only if it is within its range. Returns a status word. */",
        _head(name, "set_parameters", "parameters") + ";",
        "",
        "/* Computes the outputs of this sample and the state of the next. Returns a status word. */",
        step_head(name) + ";",
    ]


def _head(name: str, function: str, group: str) -> str:
    return signature(f"uint32_t {name}_{function}", f"{name}_state *state", f"const {name}_{group} *{group}")


def source_text(model: FlatModel, name: str, real: Real) -> str:
    """Return the C file.

    Parameters
    ----------
    model
        Discrete model.
    name
        Prefix of all C names.
    real
        Number type.
    """
    values = {"real": real.name, "zero": real.literal(0.0), "NAME": name.upper()}
    step, used = step_function(model, name, real)
    lines = [
        *_title(model),
        "#include <math.h>",
        "#include <stddef.h>",
        "",
        f'#include "{name}.h"',
        "",
        "#ifdef __FAST_MATH__",
        '#error "the guards need IEEE arithmetic: compile without -ffast-math"',
        "#endif",
        "",
    ]
    for each in indexed_tables(model):
        if each.columns(used):
            lines += [*table_data(each, real), ""]
    outputs = [_at(v, start) for v, start in zip(model.outputs, first_outputs(model, real), strict=True)]
    inputs = [_at(v, min(max(v.start, v.minimum), v.maximum)) for v in model.inputs]
    for group, variables in (
        ("parameters", model.parameters),
        ("states", model.states),
        ("inputs", inputs),
        ("outputs", outputs),
    ):
        lines += [f"static const {name}_{group} start_{group} = {{", *initialiser(variables, real), "};", ""]
    if model.inputs:
        lines += [filled("controller_guard.c", values)]
    if model.parameters:
        lines += [filled("controller_parameter.c", values)]
    return "\n".join([*lines, *_start(model, name, real), "", *step]) + "\n"


def _at(variable: Variable, start: float) -> Variable:
    return Variable(variable.name, variable.unit, variable.description, start)


def _start(model: FlatModel, name: str, real: Real) -> list[str]:
    paths = member_paths(model.parameters)
    assignments = [
        f"take_over(parameters->{paths[v.name]}, {real.bound(v.minimum)}, {real.bound(v.maximum)}, "
        f"&state->parameters.{paths[v.name]}, 0x{index_bit(i):x}u, &status);"
        for i, v in enumerate(model.parameters)
    ] or ["(void)state;", "(void)parameters;"]
    return [
        f"void {name}_defaults({name}_parameters *parameters)",
        "{",
        "    *parameters = start_parameters;",
        "}",
        "",
        _head(name, "set_parameters", "parameters"),
        "{",
        "    uint32_t status = 0u;",
        "",
        *[f"    {line}" for line in assignments],
        "    return status;",
        "}",
        "",
        _head(name, "init", "parameters"),
        "{",
        "    state->parameters = start_parameters;",
        "    state->states = start_states;",
        "    state->inputs = start_inputs;",
        "    state->outputs = start_outputs;",
        f"    return parameters == NULL ? 0u : {name}_set_parameters(state, parameters);",
        "}",
    ]
