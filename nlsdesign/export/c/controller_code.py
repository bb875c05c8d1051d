"""C99 for the controller: a discrete model as ``init`` and ``step`` on a structure that the caller owns.

No heap, recursion, loop, or mutable data outside the caller's structure: a step is straight-line code. States
and outputs stay finite, the status word says what was held. The arithmetic is CasADi's, see ``instructions``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...model.flat import FlatModel, Variable
from ..files import filled, write_all
from .c_text import Real, comment, identifier, real_type, signature
from .controller_step import (
    measured_inputs,
    numbers_of_parameters,
    reading_constants,
    settled_body,
    step_body,
    take_body,
)
from .elementary import elementary_functions, portable
from .guarded_step import first_outputs
from .parameter_numbers import parameter_statements
from .provenance import interface_version, number_lines, origin_lines, origin_macros, stamped
from .reading_guard import AGREEING, GAP, MOST
from .self_test import selftest_source
from .smooth_only import refuse_jumps
from .status_bits import STATUS_BITS, index_bit
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
    write_all({path: stamped(text, model) for path, text in texts.items()})
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
    count = len(measured_inputs(model))
    readings = {
        "reading": filled("controller_reading.h", {"name": name, "real": real.name}).splitlines()
        if count
        else [],
        "readings": [f"{name}_reading readings[{count}]; /* in the order of the inputs */"] if count else [],
    }
    derived = numbers_of_parameters(model).symbols.numel()
    readings["derived"] = (
        [f"{real.name} derived[{derived}]; /* follows from the parameters */"] if derived else []
    )
    texts = values | _heads(name) | structures | readings
    texts |= {"provenance": origin_macros(model, name), "numbers": number_lines(model)}
    text = filled("controller.h", texts | {"interface": "0u"})
    return filled("controller.h", texts | {"interface": interface_version(text, model)})


def _title(model: FlatModel) -> list[str]:
    return [
        f"/* {comment(model.name)}: {comment(model.description)}",
        f"   Sample time {model.sample_time!r} s; all numbers in SI units, given in brackets.",
        *origin_lines(model),
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
    real = portable(real)
    body, used = step_body(model, name, real)
    settled = _settled(model, name, real)
    derived = parameter_statements(model, numbers_of_parameters(model), real)
    tables = [table_data(each, real) for each in indexed_tables(model) if each.columns(used)]
    outputs = [_at(v, start) for v, start in zip(model.outputs, first_outputs(model, real), strict=True)]
    inputs = [_at(v, min(max(v.start, v.minimum), v.maximum)) for v in model.inputs]
    names = {"real": real.name, "zero": real.literal(0.0), "name": name, "NAME": name.upper()}
    values = {
        "title": _title(model),
        "tables": [
            *elementary_functions(real, [*body, *settled, *derived]),
            *(line for table in tables for line in (*table, "")),
        ],
        "start_parameters": initialiser(model.parameters, real),
        "start_states": initialiser(model.states, real),
        "start_inputs": initialiser(inputs, real),
        "start_outputs": initialiser(outputs, real),
        "guards": _guards(model, real, names),
        "derive": _derive(derived, name),
        "derived": [f"{name}_derive(state);"] if derived else [],
        "assignments": _assignments(model, real),
        "start_readings": _start_readings(model, name, real),
        "settled": settled,
        "take": [*take_body(model, name, real), *_beginning(model, name)],
        "body": body,
    }
    return filled("controller.c", {**names, **_heads(name), **values})


def _derive(statements: list[str], name: str) -> list[str]:
    """Return the function that computes what follows from the parameters, where anything does."""
    if not statements:
        return []
    return [*filled("controller_derive.c", {"name": name, "statements": statements}).splitlines(), ""]


def _guards(model: FlatModel, real: Real, names: dict[str, str]) -> list[str]:
    """Return the functions that judge commands, readings and parameters, as far as there are any."""
    largest = "FLT_MAX" if real.name == "float" else "DBL_MAX"
    numbers: dict[str, str | list[str]] = {
        **names, "LARGEST": largest, "fabs": real.function("fabs"), "AGREEING": str(AGREEING),
        "GAP": str(GAP), "MOST": str(MOST), "readings": reading_constants(model, real),
    }  # fmt: skip
    count = len(measured_inputs(model))
    wanted = {
        "controller_guard.c": len(model.inputs) > count,
        "controller_reading.c": count > 0,
        "controller_parameter.c": bool(model.parameters),
    }
    texts = [filled(shell, numbers) for shell, is_wanted in wanted.items() if is_wanted]
    return [line for text in texts for line in (*text.splitlines(), "")]


def _start_readings(model: FlatModel, name: str, real: Real) -> list[str]:
    paths, lines = member_paths(model.inputs), []
    for reading, number in measured_inputs(model).items():
        lines.append(f"state->readings[{number}] = ({name}_reading){{0}};")
        lines.append(f"state->readings[{number}].last = start_inputs.{paths[reading]};")
    return lines


def _settled(model: FlatModel, name: str, real: Real) -> list[str]:
    """Return the functions that begin and resume, where the states depend on the readings."""
    if model.begin is None:
        return []
    lines: list[str] = []
    # Without a measured input there are no gaps after which to resume.
    for which, verb in enumerate(("begin", "resume") if measured_inputs(model) else ("begin",)):
        words = "rests at its first readings" if which == 0 else "goes on after a gap in its readings"
        body = settled_body(model, real, which) or ["(void)state;"]
        text = filled("controller_settled.c", {"name": name, "verb": verb, "words": words, "body": body})
        lines += [*text.splitlines(), ""]
    return lines


def _beginning(model: FlatModel, name: str) -> list[str]:
    """Return the statements that begin with the first usable readings, and resume after a gap."""
    readings = measured_inputs(model).values()
    begin = [f"    {name}_begin(state);"] if model.begin is not None else []
    seen = " && ".join(f"state->readings[{number}].seen != 0u" for number in readings)
    condition = f"state->begun == 0u && {seen}" if seen else "state->begun == 0u"
    lines = [f"if ({condition}) {{", *begin, "    state->begun = 1u;"]
    if readings and model.begin is not None:
        return [
            *lines,
            "} else if (state->begun != 0u && resuming != 0u) {",
            f"    {name}_resume(state);",
            "} else {",
            "    /* goes on, or waits for the first readings */",
            "}",
        ]
    return [*lines, "}"]


def _at(variable: Variable, start: float) -> Variable:
    return Variable(variable.name, variable.unit, variable.description, start)


def _assignments(model: FlatModel, real: Real) -> list[str]:
    paths = member_paths(model.parameters)
    return [
        f"take_over(parameters->{paths[v.name]}, {real.bound(v.minimum)}, {real.bound(v.maximum)}, "
        f"&state->parameters.{paths[v.name]}, 0x{index_bit(i):x}u, &status);"
        for i, v in enumerate(model.parameters)
    ] or ["(void)state;", "(void)parameters;"]
