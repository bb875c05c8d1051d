"""C99 for the controller: a discrete model as ``init`` and ``step`` on a structure that the caller owns.

No heap, recursion, loop, or mutable data outside the caller's structure: a step is straight-line code. States
and outputs stay finite, the status word says what was held. The arithmetic is CasADi's, see ``instructions``.
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
from .controller_step import step_body
from .elementary import elementary_functions, portable
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
    groups: tuple[tuple[str, tuple[Variable, ...], str, bool], ...] = (
        ("inputs", model.inputs, "What step reads.", True),
        ("outputs", model.outputs, "What step gives, always finite.", False),
        ("parameters", model.parameters, "Tunable numbers.", True),
        ("states", model.states, "What is remembered from sample to sample.", False),
    )
    structures = {
        group: structure(f"{name}_{group}", variables, real, title, numbered=numbered)
        for group, variables, title, numbered in groups
    }
    bits = [f"#define {upper}_{flag} 0x{bit:x}u /* {text} */" for flag, (bit, text) in STATUS_BITS.items()]
    sample_time = real.literal(float(model.sample_time or 0.0))
    values = {"name": name, "NAME": upper, "title": _title(model), "bits": bits, "sample_time": sample_time}
    return filled("controller.h", values | _heads(name) | structures)


def _title(model: FlatModel) -> list[str]:
    return [
        f"/* {comment(model.name)}: {comment(model.description)}",
        f"   Sample time {model.sample_time!r} s; all numbers in SI units, given in brackets.",
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]


def _heads(name: str) -> dict[str, str]:
    """Return the heads of the functions with parameters."""
    state, parameters = f"{name}_state *state", f"const {name}_parameters *parameters"
    return {
        "init": signature(f"uint32_t {name}_init", state, parameters),
        "set_parameters": signature(f"uint32_t {name}_set_parameters", state, parameters),
        "step": signature(
            f"uint32_t {name}_step", state, f"const {name}_inputs *inputs", f"{name}_outputs *outputs"
        ),
    }


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
    body, used = step_body(model, name, portable(real))
    tables = [table_data(each, real) for each in indexed_tables(model) if each.columns(used)]
    outputs = [_at(v, start) for v, start in zip(model.outputs, first_outputs(model, real), strict=True)]
    inputs = [_at(v, min(max(v.start, v.minimum), v.maximum)) for v in model.inputs]
    names = {"real": real.name, "zero": real.literal(0.0), "name": name, "NAME": name.upper()}
    guards = [filled("controller_guard.c", names)] if model.inputs else []
    guards += [filled("controller_parameter.c", names)] if model.parameters else []
    values = {
        "title": _title(model),
        "tables": [
            *elementary_functions(real, body),
            *(line for table in tables for line in (*table, "")),
        ],
        "start_parameters": initialiser(model.parameters, real),
        "start_states": initialiser(model.states, real),
        "start_inputs": initialiser(inputs, real),
        "start_outputs": initialiser(outputs, real),
        "guards": [line for guard in guards for line in (*guard.splitlines(), "")],
        "assignments": _assignments(model, real),
        "body": body,
    }
    return filled("controller.c", {**names, **_heads(name), **values})


def _at(variable: Variable, start: float) -> Variable:
    return Variable(variable.name, variable.unit, variable.description, start)


def _assignments(model: FlatModel, real: Real) -> list[str]:
    paths = member_paths(model.parameters)
    return [
        f"take_over(parameters->{paths[v.name]}, {real.bound(v.minimum)}, {real.bound(v.maximum)}, "
        f"&state->parameters.{paths[v.name]}, 0x{index_bit(i):x}u, &status);"
        for i, v in enumerate(model.parameters)
    ] or ["(void)state;", "(void)parameters;"]
