"""The C sources of an FMU: generated equations in fixed shells."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ...errors import ExportError
from ...model.flat import Symbols, Variable
from ..c.c_text import DOUBLE, comment, identifier, string
from ..c.controller_code import check_discrete, header_text, source_text
from ..c.controller_step import step_function
from ..c.instructions import named_indices, print_statements
from ..c.structures import member_paths
from ..c.table_lookup import indexed_tables, look_up, table_data
from ..files import shell
from .fmu_variables import FmuLayout


def fmu_sources(layout: FmuLayout, version: str, token: str) -> dict[str, str]:
    """Return the sources by file name; the shell ``fmi2.c`` or ``fmi3.c`` is the only one to be compiled.

    Parameters
    ----------
    layout
        Variables of the FMU.
    version
        ``"2.0"`` or ``"3.0"``.
    token
        Instantiation token.

    Raises
    ------
    ExportError
        If the model cannot be written in C.
    """
    model = layout.model
    main = main_source(version)
    texts = {main: shell(main), "instance.c": shell("instance.c")}
    if model.sample_time is None:
        if model.tables:
            raise ExportError(
                f"model '{model.name}'", "is continuous and has tables", next_step="write them as laws"
            )
        body = _continuous(layout)
        texts["integrator.c"] = shell("integrator.c")
    else:
        check_discrete(model)
        name = identifier(model.name)
        body = _discrete(layout, name)
        texts[f"{name}.h"] = header_text(model, name, DOUBLE)
        texts[f"{name}.c"] = source_text(model, name, DOUBLE)
    texts["model.c"] = "\n".join([*_head(layout, token), *body]) + "\n"
    return texts


def main_source(version: str) -> str:
    """Return the name of the file to compile.

    Parameters
    ----------
    version
        ``"2.0"`` or ``"3.0"``.
    """
    return "fmi2.c" if version == "2.0" else "fmi3.c"


def _head(layout: FmuLayout, token: str) -> list[str]:
    model, end = layout.model, [layout.extra]
    signals = layout.signals or end
    outputs = layout.outputs or signals
    parameters = layout.parameters or outputs
    inputs = layout.inputs or parameters
    derivatives = layout.derivatives or inputs
    numbers = {
        "CONTINUOUS": int(model.sample_time is None),
        "STATES": len(layout.states),
        "INPUTS": len(layout.inputs),
        "PARAMETERS": len(layout.parameters),
        "X": (layout.states or derivatives)[0].reference,
        "D": derivatives[0].reference,
        "U": inputs[0].reference,
        "P": parameters[0].reference,
        "Y": outputs[0].reference,
        "S": signals[0].reference,
        "EXTRA": layout.extra.reference,
        "VALUES": len(layout.reals),
    }
    lines = [
        f"/* {comment(model.name)}: {comment(model.description)}. Generated; do not edit. */",
        "#include <float.h>",
        "#include <math.h>",
        "#include <stddef.h>",
        "#include <stdint.h>",
        "",
        f"#define MODEL_TOKEN {string(token)}",
        "#define MODEL_LARGEST DBL_MAX",
        *[f"#define MODEL_{size} {number}" for size, number in numbers.items()],
    ]
    if model.sample_time is not None:
        lines.append(f"#define MODEL_SAMPLE_TIME {DOUBLE.literal(model.sample_time)}")
    lines += [
        "",
        "typedef struct {",
        "    const char *name;",
        "    double start, lowest, highest;",
        "} variable;",
        "",
        "/* By value reference. */",
        "static const variable model_variable[MODEL_VALUES] = {",
        *[f"    {_row(each.variable)}," for each in layout.reals],
        "};",
        "",
    ]
    return lines


def _row(v: Variable) -> str:
    limits = f"{DOUBLE.bound(v.minimum)}, {DOUBLE.bound(v.maximum)}"
    return f"{{{string(v.name)}, {DOUBLE.literal(v.start)}, {limits}}}"


_POINT = "double t, const double x[], const double u[], const double p[]"


def _continuous(layout: FmuLayout) -> list[str]:
    model = layout.model
    s = model.symbols()
    y, signals = _own(layout, s)
    everything = ca.vertcat(s.time, s.state, s.input, s.parameter)
    seed = ca.SX.sym("seed", everything.numel())
    n = len(model.states)
    jacobian = ca.densify(ca.jacobian(s.derivative, s.state))
    cells = [f"jacobian[{i}][{j}]" for j in range(n) for i in range(n)]
    nominal = ", ".join(DOUBLE.literal(abs(v.nominal) or 1.0) for v in model.states) or "1.0"
    results, names = [s.derivative, y, signals], ["f", "y", "s"]
    tangents = [ca.jtimes(e, everything, seed) for e in results]
    size = "MODEL_STATES > 0 ? MODEL_STATES : 1"
    slope = ca.densify(ca.jacobian(s.derivative, s.time))
    return [
        f"static const double model_nominal[{size}] = {{{nominal}}};",
        "",
        *_function(f"model_rates({_POINT}, double f[])", s, [s.derivative], [_cells("f", n)]),
        *_function(
            f"model_equations({_POINT}, double f[], double y[], double s[])",
            s,
            results,
            [_cells(w, e.numel()) for w, e in zip(names, results, strict=True)],
        ),
        *_function(
            f"model_jacobian({_POINT}, double jacobian[][{size}], double slope[])",
            s,
            [jacobian, slope],
            [cells, _cells("slope", n)],
        ),
        *_function(
            f"model_directional({_POINT}, double dt, const double dx[], const double du[], "
            "const double dp[], double f[], double y[], double s[])",
            s,
            tangents,
            [_cells(w, e.numel()) for w, e in zip(names, results, strict=True)],
            seed=seed,
        ),
    ]


def _own(layout: FmuLayout, s: Symbols) -> tuple[ca.SX, ca.SX]:
    """Return the outputs and signals that have a value reference of their own."""
    selected = []
    for group, variables, kept in (
        (s.output, layout.model.outputs, layout.outputs),
        (s.signal, layout.model.signals, layout.signals),
    ):
        index = {v.name: i for i, v in enumerate(variables)}
        selected.append(ca.SX(ca.vertcat(*[ca.densify(group)[index[each.variable.name]] for each in kept])))
    return selected[0], selected[1]


def _cells(name: str, count: int) -> list[str]:
    return [f"{name}[{i}]" for i in range(count)]


def _function(
    signature: str,
    s: Symbols,
    results: Sequence[ca.SX],
    targets: Sequence[Sequence[str]],
    *,
    seed: ca.SX | None = None,
) -> list[str]:
    """Return one static function of (t, x, u, p), and of a direction (dt, dx, du, dp) if there is a seed."""
    groups, texts = [s.time, s.state, s.input, s.parameter], [["t"]]
    texts += [_cells(w, e.numel()) for w, e in zip("xup", groups[1:], strict=True)]
    if seed is not None:
        groups.append(seed)
        texts.append(["dt"] + [f"d{cell}" for group in texts[1:] for cell in group])
    function = ca.Function("f", groups, [ca.densify(e) for e in results], {"cse": True})
    statements = print_statements(function, texts, targets, real=DOUBLE)
    arguments = [
        piece.split("[")[0].split()[-1] for piece in signature.split("(", 1)[1].rstrip(")").split(", ")
    ]
    body = [f"(void){name};" for name in arguments] + statements
    return [f"static void {signature}", "{", *[f"    {line}" for line in body], "}", ""]


def _discrete(layout: FmuLayout, name: str) -> list[str]:
    model = layout.model
    x, u, p, y = (
        list(member_paths(group).values())
        for group in (model.states, model.inputs, model.parameters, model.outputs)
    )
    own = {each.variable.name for each in layout.outputs}
    given = [path for path, v in zip(y, model.outputs, strict=True) if v.name in own]
    tables, signals, looked_up = _signals(layout)
    there = step_function(model, name, DOUBLE)[1]
    missing = {
        each.number for each in indexed_tables(model) if each.columns(looked_up) and not each.columns(there)
    }
    return [
        f'#include "{name}.c"',
        "",
        *[
            line
            for each in indexed_tables(model)
            if each.number in missing
            for line in [*table_data(each, DOUBLE), ""]
        ],
        f"typedef {name}_state model_memory;",
        "",
        "static void model_tune(model_memory *memory, const double p[])",
        "{",
        f"    {name}_parameters parameters;",
        "",
        f"    {name}_defaults(&parameters);",
        *[f"    parameters.{path} = p[{i}];" for i, path in enumerate(p)],
        f"    (void){name}_set_parameters(memory, &parameters);",
        "    (void)p;",
        "}",
        "",
        "static void model_start(model_memory *memory, const double x[], const double p[])",
        "{",
        f"    (void){name}_init(memory, NULL);",
        *[f"    memory->states.{path} = x[{i}];" for i, path in enumerate(x)],
        "    model_tune(memory, p);",
        "    (void)x;",
        "}",
        "",
        "/* One sample. The states that are shown are those that its outputs came from. */",
        "static int32_t model_sample(model_memory *memory, const double u[], double x[], double y[],",
        "                            double s[])",
        "{",
        f"    const {name}_states before = memory->states;",
        f"    {name}_inputs inputs = {{0}};",
        f"    {name}_outputs outputs = {{0}};",
        "",
        *[f"    inputs.{path} = u[{i}];" for i, path in enumerate(u)],
        f"    const uint32_t status = {name}_step(memory, &inputs, &outputs);",
        *[f"    x[{i}] = before.{path};" for i, path in enumerate(x)],
        *[f"    y[{i}] = outputs.{path};" for i, path in enumerate(given)],
        *[f"    {line}" for line in [*tables, *signals]],
        "    (void)before, (void)u, (void)x, (void)y, (void)s;",
        "    return (int32_t)status;",
        "}",
        "",
    ]


def _signals(layout: FmuLayout) -> tuple[list[str], list[str], set[int]]:
    """Return the look-ups and statements for the signals of a sample, and the looked-up numbers used."""
    model = layout.model
    s = model.symbols()
    _, signals = _own(layout, s)
    function = ca.Function("s", [s.state, s.input, s.parameter, s.table], [signals], {"cse": True})
    names = [
        [f"{place}.{path}" for path in member_paths(group).values()]
        for place, group in (
            ("before", model.states),
            ("memory->inputs", model.inputs),
            ("memory->parameters", model.parameters),
        )
    ]
    width = [f"w{i}" for i in range(s.table.numel())]
    statements = print_statements(function, [*names, width], [_cells("s", signals.numel())], real=DOUBLE)
    used = named_indices(statements, "w")
    arguments = dict(zip((v.name for v in model.states), names[0], strict=True))
    arguments |= dict(zip((v.name for v in model.inputs), names[1], strict=True))
    return look_up(model, DOUBLE, arguments, used), statements, used
