"""C99 for the controller: a discrete model as ``init`` and ``step`` on a structure that the caller owns.

No heap, recursion, loop, or mutable data outside the caller's structure: a step is straight-line code. States
and outputs stay finite, the status word says what was held. The arithmetic is CasADi's, see ``instructions``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...model.flat import FlatModel
from ..files import write_all
from .c_text import Real, comment, identifier, signature
from .elementary import elementary_functions
from .guarded_step import (
    AGREEING,
    GAP,
    MOST,
    STATUS_BITS,
    first_outputs,
    index_bit,
    mover,
    reading_numbers,
)
from .instructions import named_indices
from .programs import selftest_source
from .provenance import interface_version, number_lines, origin_lines, origin_macros, stamped
from .writer import DERIVED, MISSED, CSource, CWriter


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
    c = CWriter(model, identifier(name or model.name), Real.named(real))
    check_discrete(model)
    header, source, selftest = (Path(folder) / f"{c.name}{end}" for end in (".h", ".c", "_selftest.c"))
    texts = {header: header_text(c), source: source_text(c), selftest: selftest_source(c)}
    write_all({path: stamped(text, model) for path, text in texts.items()})
    return CSource(c.name, model, c.real, header, source, selftest)


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


def header_text(c: CWriter) -> str:
    """Return the header file."""
    upper, count, derived = c.name.upper(), len(c.readings), c.equations.numbers.numel()
    values: dict[str, str | list[str]] = {
        "title": _title(c.model),
        "bits": [
            f"#define {upper}_{flag} 0x{bit:x}u /* {text} */" for flag, (bit, text) in STATUS_BITS.items()
        ],
        "sample_time": c.real.literal(float(c.model.sample_time or 0.0)),
        **_heads(c.name),
        "inputs": c.structure("inputs", "What step reads.", numbered=True),
        "outputs": c.structure("outputs", "What step gives, always finite.", numbered=False),
        "parameters": c.structure("parameters", "Tunable numbers.", numbered=True),
        "states": c.structure("states", "What is remembered from sample to sample.", numbered=False),
        "reading": c.filled("controller_reading.h", {}).splitlines() if count else [],
        "readings": [f"{c.name}_reading readings[{count}]; /* in the order of the inputs */"]
        if count
        else [],
        "derived": [f"{c.real} derived[{derived}]; /* follows from the parameters */"] if derived else [],
        "provenance": origin_macros(c.model, c.name),
        "numbers": number_lines(c.model),
    }
    bare = c.filled("controller.h", values | {"interface": "0u"})
    return c.filled("controller.h", values | {"interface": interface_version(bare, c.model)})


def source_text(c: CWriter) -> str:
    """Return the C file."""
    model, real = c.model, c.real
    body, looked_up = step_body(c)
    settled, derived = _settled(c), _derived(c)
    inputs = [min(max(v.start, v.minimum), v.maximum) for v in model.inputs]
    values: dict[str, str | list[str]] = {
        "title": _title(model),
        "tables": [
            *elementary_functions(real, [*body, *settled, *derived]),
            *(line for table in c.tables if table.columns(looked_up) for line in (*table.data(), "")),
        ],
        "start_parameters": _initialiser(c.parameters, [v.start for v in model.parameters], real),
        "start_states": _initialiser(c.states, [v.start for v in model.states], real),
        "start_inputs": _initialiser(c.inputs, inputs, real),
        "start_outputs": _initialiser(c.outputs, first_outputs(model, real), real),
        "guards": _guards(c),
        "derive": [*c.filled("controller_derive.c", {"statements": derived}).splitlines(), ""]
        if derived
        else [],
        "derived": [f"{c.name}_derive(state);"] if derived else [],
        "assignments": [
            f"take_over(parameters->{path}, {real.bound(v.minimum)}, {real.bound(v.maximum)}, "
            f"&state->parameters.{path}, 0x{index_bit(i):x}u, &status);"
            for i, (v, path) in enumerate(zip(model.parameters, c.parameters, strict=True))
        ]
        or ["(void)state;", "(void)parameters;"],
        "start_readings": [
            line
            for v, path in zip(model.inputs, c.inputs, strict=True)
            if (number := c.readings.get(v.name)) is not None
            for line in (
                f"state->readings[{number}] = ({c.name}_reading){{0}};",
                f"state->readings[{number}].last = start_inputs.{path};",
            )
        ],
        "settled": settled,
        "take": [*_take(c), *_beginning(c)],
        "body": body,
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
    return {
        "init": signature(f"uint32_t {name}_init", state, parameters),
        "set_parameters": signature(f"uint32_t {name}_set_parameters", state, parameters),
        "step": signature(
            f"uint32_t {name}_step", state, f"const {name}_inputs *inputs", f"{name}_outputs *outputs"
        ),
    }


def _initialiser(members: Sequence[str], values: Sequence[float], real: Real) -> list[str]:
    """Return designated initialisers of a structure."""
    lines = [f".{path} = {real.literal(value)}," for path, value in zip(members, values, strict=True)]
    return lines or [".none = 0"]


def _guards(c: CWriter) -> list[str]:
    """Return the functions that judge commands, readings and parameters, as far as there are any."""
    limits: list[str] = []
    for v in c.model.inputs:
        numbers = reading_numbers(v, float(c.model.sample_time or 0.0), c.real)
        if numbers is not None:
            parts = (numbers.lowest, numbers.highest, numbers.change, numbers.noticeable)
            row = ", ".join(c.real.literal(part) for part in parts)
            limits.append(
                f"static const reading_limits reading_{c.readings[v.name]} = {{{row}, {numbers.patience}u}};"
            )
    values: dict[str, str | list[str]] = {
        "LARGEST": "FLT_MAX" if c.real is Real.FLOAT else "DBL_MAX",
        "fabs": c.real.function("fabs"),
        "AGREEING": str(AGREEING),
        "GAP": str(GAP),
        "MOST": str(MOST),
        "readings": limits,
    }
    wanted = {
        "controller_guard.c": len(c.model.inputs) > len(c.readings),
        "controller_reading.c": bool(c.readings),
        "controller_parameter.c": bool(c.model.parameters),
    }
    texts = [c.filled(shell, values) for shell, is_wanted in wanted.items() if is_wanted]
    return [line for text in texts for line in (*text.splitlines(), "")]


def _derived(c: CWriter) -> list[str]:
    """Return the statements that compute what follows from the parameters alone."""
    equations = c.equations
    if not equations.numbers.numel():
        return []
    function = ca.Function("derived", [equations.symbols.parameter], [equations.values], {"cse": True})
    names = [f"p{i}" for i in range(len(c.parameters))]
    targets = [f"state->derived[{i}]" for i in range(equations.numbers.numel())]
    statements = c.statements(function, [names], [targets])
    return [*c.loads(statements), *statements]


def _settled(c: CWriter) -> list[str]:
    """Return the functions that begin and resume, where the states depend on the readings."""
    model = c.model
    if model.begin is None:
        return []
    lines: list[str] = []
    what = {"begin": "rests at its first readings", "resume": "goes on after a gap in its readings"}
    # Without a measured input there are no gaps after which to resume.
    for which, verb in enumerate(what if c.readings else ["begin"]):
        s = model.symbols()
        settled = ca.SX(ca.densify(model.begin(s.state, s.input, s.parameter, s.table)[which]))
        changed = [i for i in range(len(model.states)) if not ca.is_equal(settled[i], s.state[i], 2)]
        result = ca.SX(ca.vertcat(*[settled[i] for i in changed]))
        function = ca.Function("settled", [s.state, s.input, s.parameter, s.table], [result], {"cse": True})
        tables, equations = c.equation_lines(
            function, [], [[f"state->states.{c.states[i]}" for i in changed]]
        )
        body = [*c.loads([*tables, *equations]), *tables, *equations] or ["(void)state;"]
        text = c.filled("controller_settled.c", {"verb": verb, "words": what[verb], "body": body})
        lines += [*text.splitlines(), ""]
    return lines


def _take(c: CWriter) -> list[str]:
    """Return the statements that take the inputs: commands first, then readings."""
    model, real = c.model, c.real
    resumes = bool(c.readings) and model.begin is not None
    commands, readings = ["uint32_t resuming = 0u;"] if resumes else [], []
    for i, (v, path) in enumerate(zip(model.inputs, c.inputs, strict=True)):
        bit, taken = f"0x{index_bit(i):x}u, &status", f"&state->inputs.{path}"
        if v.name not in c.readings:
            limits = f"{real.bound(v.minimum)}, {real.bound(v.maximum)}"
            commands.append(f"usable(inputs->{path}, {limits}, {taken}, {bit});")
            continue
        moved = mover(model, v)
        driver = real.literal(0.0)
        if moved is not None:
            group, index = moved
            driver = f"state->{group}.{(c.inputs if group == 'inputs' else c.states)[index]}"
        number = c.readings[v.name]
        seen = f"&reading_{number}, &state->readings[{number}]"
        call = f"plausible(inputs->{path}, {driver}, {seen}, {taken}, {bit});"
        readings.append(f"{'resuming |=' if resumes else '(void)'} {call}")
    return [*commands, *readings] or ["(void)inputs;"]


def _beginning(c: CWriter) -> list[str]:
    """Return the statements that begin with the first usable readings, and resume after a gap."""
    begins = c.model.begin is not None
    seen = [f"state->readings[{number}].seen != 0u" for number in c.readings.values()]
    values = {
        "condition": " && ".join(["state->begun == 0u", *seen]),
        "begin": [f"{c.name}_begin(state);"] if begins else [],
        "resume": c.filled("controller_resuming.c", {}).splitlines() if begins and seen else [],
    }
    return c.filled("controller_beginning.c", values).splitlines()


def step_body(c: CWriter) -> tuple[list[str], set[int]]:
    """Return the statements of the step and the indices of the looked-up numbers it uses."""
    model, real, equations = c.model, c.real, c.equations
    s, gap, numbers = equations.symbols, equations.gap, equations.numbers
    function = ca.Function(
        "step", [s.state, s.input, s.parameter, s.table, gap, numbers], equations.results, {"cse": True}
    )
    targets = [[f"const {real} {y}{i}" for i in range(function.numel_out(k))] for k, y in enumerate("fy")]
    further = [
        [f"{letter}{i}" for i in range(group.numel())]
        for letter, group in ((MISSED, gap), (DERIVED, numbers))
    ]
    tables, statements = c.equation_lines(function, further, targets)
    ranges = dict.fromkeys((c.arguments[table.argument], *table.ends) for table in model.tables)
    beyond = " || ".join(
        f"{argument} < {real.literal(first)} || {argument} > {real.literal(last)}"
        for argument, first, last in ranges
    )
    flag = [f"status |= ({beyond}) ? {c.name.upper()}_OUT_OF_TABLE : 0u;"] if beyond else []
    one, zero = real.literal(1.0), real.literal(0.0)
    body = [
        *c.loads([*flag, *tables, *statements]),
        *(
            f"const {real} {MISSED}{i} = state->readings[{i}].missed > 0u ? {one} : {zero};"
            for i in sorted(named_indices(statements, MISSED))
        ),
        *(
            f"const {real} {DERIVED}{i} = state->derived[{i}];"
            for i in sorted(named_indices(statements, DERIVED))
        ),
        *flag,
        *tables,
        *statements,
        "",
        *_stores(c),
    ]
    return body, named_indices(statements, "w")


def _stores(c: CWriter) -> list[str]:
    """Return the assignments of the results, stored only if all are finite.

    A state that is not finite begins anew with the next sample; outputs that are not finite are held.
    """

    def finite(letter: str, count: int) -> str:
        # v - v is 0 for a finite v and NaN otherwise: one comparison for all, which NaN does not pass.
        terms = " + ".join(f"({letter}{i} - {letter}{i})" for i in range(count))
        return f"{terms} >= {c.real.literal(0.0)}"

    lines: list[str] = []
    if c.states:
        stores = [f"state->states.{path} = f{i};" for i, path in enumerate(c.states)]
        values = {"finite": finite("f", len(c.states)), "stores": stores}
        lines += c.filled("controller_states.c", values).splitlines()
    if not c.outputs:
        return [*lines, "(void)state, (void)outputs;"]
    stores = [
        line
        for i, path in enumerate(c.outputs)
        for line in (f"state->outputs.{path} = y{i};", f"outputs->{path} = y{i};")
    ]
    values = {"finite": finite("y", len(c.outputs)), "stores": stores}
    return [*lines, *c.filled("controller_outputs.c", values).splitlines()]
