"""C99 for the controller: a discrete model as ``init`` and ``step`` on a structure that the caller owns.

No heap, recursion, loop, or mutable data outside the caller's structure: a step is straight-line code. States
and outputs stay finite, the status word says what was held. The arithmetic is CasADi's, see ``instructions``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...model.flat import FlatModel
from ..files import write_all
from .c_text import (
    Real,
    comment,
    identifier,
    interface_version,
    number_lines,
    origin_lines,
    origin_macros,
    signature,
    stamped,
)
from .elementary import elementary_functions
from .guarded_step import STATUS_BITS, first_outputs, index_bit
from .programs import selftest_source
from .writer import (
    CSource,
    CWriter,
    derived_statements,
    guard_functions,
    settled_functions,
    step_body,
    take_statements,
)

_PLACES = ("block", "loaded", "load_head", "default_block", "block_check", "take_block", "load", "noted")
WITHOUT_BLOCKS: Mapping[str, list[str]] = {name: [] for name in _PLACES}
"""What header and source of code whose numbers are fixed say of blocks of numbers."""


def export_c(
    model: FlatModel, folder: str | Path, *, real: Real | str = Real.DOUBLE, name: str | None = None
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
    return write_step(
        CWriter(model, identifier(name or model.name), Real.named(real)), folder, WITHOUT_BLOCKS
    )


def write_step(c: CWriter, folder: str | Path, blocks: Mapping[str, list[str]] = WITHOUT_BLOCKS) -> CSource:
    """Write header, source and self-test of a step; ``blocks``: as :data:`WITHOUT_BLOCKS`."""
    model = c.model
    check_discrete(model)
    header, source, selftest = (Path(folder) / f"{c.name}{end}" for end in (".h", ".c", "_selftest.c"))
    texts = {header: header_text(c, blocks), source: source_text(c, blocks), selftest: selftest_source(c)}
    write_all({path: stamped(text, model) for path, text in texts.items()})
    return CSource(c.name, model, c.real, header, source, selftest, c.coefficients)


def check_discrete(model: FlatModel) -> None:
    """Raise unless a model is discrete, smooth and free of time, as a step needs it."""
    if model.switching is not None and model.switching.jumps:
        raise ExportError(
            f"model '{model.name}': '{model.switching.jumps[0]}'",
            "is not smooth, and an integrator with fixed steps does not locate sticking and impacts",
            next_step="export the smooth form: flatten(smoothed(assembly))",
        )
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


def header_text(c: CWriter, blocks: Mapping[str, list[str]] = WITHOUT_BLOCKS) -> str:
    """Return the header file, its parts in the order of the file."""
    upper, count, derived = c.name.upper(), len(c.readings), c.equations.numbers.numel()
    values: dict[str, str | list[str]] = {
        "title": _title(c.model),
        "provenance": origin_macros(c.model, c.name),
        "numbers": number_lines(c.model),
        "sample_time": c.real.literal(float(c.model.sample_time or 0.0)),
        "bits": [
            f"#define {upper}_{flag} 0x{bit:x}u /* {text} */" for flag, (bit, text) in STATUS_BITS.items()
        ],
        "inputs": c.structure("inputs", "What step reads.", numbered=True),
        "outputs": c.structure("outputs", "What step gives, always finite."),
        "parameters": c.structure("parameters", "Tunable numbers.", numbered=True),
        "states": c.structure("states", "What is remembered from sample to sample."),
        "reading": c.filled("controller_reading.h", {}).splitlines() if count else [],
        "readings": [f"{c.name}_reading readings[{count}]; /* in the order of the inputs */"]
        if count
        else [],
        "derived": [f"{c.real} derived[{derived}]; /* follows from the parameters */"] if derived else [],
        **_heads(c.name),
        **blocks,
    }
    version_of_interface = "@interface@"  # known once all else is written
    text = c.filled("controller.h", values | {"interface": version_of_interface})
    return text.replace(version_of_interface, interface_version(text, c.model))


def source_text(c: CWriter, blocks: Mapping[str, list[str]] = WITHOUT_BLOCKS) -> str:
    """Return the C file, its parts in the order of the file."""
    model, real = c.model, c.real
    title, outputs = _title(model), first_outputs(model, real)
    inputs = [min(max(v.start, v.minimum), v.maximum) for v in model.inputs]
    # What stands above the functions is what they call and look up.
    settled, derived, (body, looked_up) = settled_functions(c), derived_statements(c), step_body(c)
    values: dict[str, str | list[str]] = {
        "title": title,
        "tables": [
            *elementary_functions(real, [*body, *settled, *derived]),
            *(line for table in c.tables if table.columns(looked_up) for line in (*table.data(), "")),
        ],
        "start_parameters": c.initialiser("parameters", [v.start for v in c.parameters]),
        "start_states": c.initialiser("states", [v.start for v in model.states]),
        "start_inputs": c.initialiser("inputs", inputs),
        "start_outputs": c.initialiser("outputs", outputs),
        "guards": guard_functions(c),
        "derive": [*c.filled("controller_derive.c", {"statements": derived}).splitlines(), ""]
        if derived
        else [],
        "assignments": [
            f"take_over(parameters->{path}, {real.bound(v.minimum)}, {real.bound(v.maximum)}, "
            f"&state->parameters.{path}, 0x{index_bit(i):x}u, &status);"
            for i, (v, path) in enumerate(zip(c.parameters, c.paths.parameters, strict=True))
        ]
        or ["(void)parameters;"],
        "derived": [f"{c.name}_derive(state);"] if derived else [],
        "start_readings": [
            line
            for v, path in zip(model.inputs, c.paths.inputs, strict=True)
            if (reading := c.readings.get(v.name)) is not None
            for line in (
                f"state->readings[{reading.number}] = ({c.name}_reading){{0}};",
                f"state->readings[{reading.number}].last = start_inputs.{path};",
            )
        ],
        "settled": settled,
        "take": take_statements(c),
        "period": str(max(2, round(1e6 * float(model.sample_time or 0.0)))),
        "missed": [
            f"lacking(&state->readings[{reading.number}], (elapsed + PERIOD / 2u) / PERIOD - 1u);"
            for reading in c.readings.values()
        ],
        "body": body,
        **blocks,
    }
    return c.filled("controller.c", _heads(c.name) | values)


def _title(model: FlatModel) -> list[str]:
    return [
        f"/* {comment(model.name)}: {comment(model.description)}",
        f"   Sample time {model.sample_time!r} s; all numbers in SI units, given in brackets.",
        *origin_lines(model),
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]


def _heads(name: str) -> dict[str, str | list[str]]:
    """Return the heads of the functions with parameters."""
    state, parameters = f"{name}_state *state", f"const {name}_parameters *parameters"
    sample = (state, f"const {name}_inputs *inputs", f"{name}_outputs *outputs")
    return {
        "init": signature(f"uint32_t {name}_init", state, parameters),
        "set_parameters": signature(f"uint32_t {name}_set_parameters", state, parameters),
        "step": signature(f"uint32_t {name}_step", *sample),
        "step_at": signature(
            f"uint32_t {name}_step_at", f"{name}_clock *clock", *sample, "uint32_t microseconds"
        ),
    }
