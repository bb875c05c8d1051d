"""The C sources of an FMU: generated equations in fixed templates."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ...foundation.errors import ExportError
from ...model.flat import Symbols
from ..c.c_text import Real, cells, comment, identifier, string
from ..c.controller_code import check_discrete, header_text, source_text
from ..c.instructions import print_statements
from ..c.table_lookup import look_up, look_up_slopes
from ..c.writer import CWriter, named_indices, step_body
from ..files import filled, template
from .fmu_variables import FmuLayout


def fmu_sources(layout: FmuLayout, version: str, token: str) -> dict[str, str]:
    """Return the sources by file name; only the template ``fmi2.c`` or ``fmi3.c`` is to be compiled."""
    model = layout.model
    main = main_source(version)
    texts = {name: template(name) for name in (main, "instance.c", "exchange.c", "saved_state.c")}
    if model.sample_time is None:
        if model.tables:
            raise ExportError(
                f"model '{model.name}'", "is continuous and has tables", next_step="write them as laws"
            )
        body = _continuous(layout)
        texts |= {
            name: template(name)
            for name in ("integrator.c", *(("events.c", "switched.c") if layout.modes else ()))
        }
    else:
        check_discrete(model)
        c = CWriter(model, identifier(model.name))
        body = _discrete(layout, c)
        texts[f"{c.name}.h"], texts[f"{c.name}.c"] = header_text(c), source_text(c)
    texts["model.c"] = _head(layout, token) + body
    return texts


def main_source(version: str) -> str:
    """Return the name of the file to compile."""
    return "fmi2.c" if version == "2.0" else "fmi3.c"


def _head(layout: FmuLayout, token: str) -> str:
    model, end = layout.model, [layout.extra]
    modes = layout.modes or end
    indicators = layout.indicators or modes
    signals = layout.signals or indicators
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
        "Z": indicators[0].reference,
        "M": modes[0].reference,
        "SWITCHES": len(layout.modes),
        "EXTRA": layout.extra.reference,
        "VALUES": len(layout.reals),
    }
    sizes = [f"#define MODEL_{size} {number}" for size, number in numbers.items()]
    if model.sample_time is not None:
        sizes.append(f"#define MODEL_SAMPLE_TIME {Real.DOUBLE.literal(model.sample_time)}")
    real = Real.DOUBLE
    values = {
        "name": comment(model.name),
        "description": comment(model.description),
        "token": string(token),
        "sizes": sizes,
        "variables": [
            f"{{{string(v.name)}, {real.literal(v.start)}, {real.bound(v.minimum)}, "
            f"{real.bound(v.maximum)}}},"
            for v in (each.variable for each in layout.reals)
        ],
    }
    return filled("fmu_model.c", values)


def _continuous(layout: FmuLayout) -> str:
    model = layout.model
    s, mode, indicators = _held(layout)
    y, signals = _own(layout, s)
    everything = ca.vertcat(s.time, s.state, s.input, s.parameter)
    seed = ca.SX.sym("seed", everything.numel())
    n = len(model.states)
    jacobian = ca.densify(ca.jacobian(s.derivative, s.state))
    slope = ca.densify(ca.jacobian(s.derivative, s.time))
    results = [s.derivative, y, signals]
    targets = [cells(name, e.numel()) for name, e in zip("fys", results, strict=True)]
    moved = [*results, indicators]
    tangents = [ca.jtimes(e, everything, seed) for e in moved]
    tangent_targets = [*targets, cells("z", indicators.numel())]
    values = {
        "nominal": ", ".join(Real.DOUBLE.literal(abs(v.nominal) or 1.0) for v in model.states) or "1.0",
        "rates": _statements(s, mode, [s.derivative], [cells("f", n)]),
        "equations": _statements(s, mode, results, targets),
        "jacobian": _statements(s, mode, [jacobian, slope], [_table("jacobian", n, n), cells("slope", n)]),
        "directional": _statements(s, mode, tangents, tangent_targets, seed=seed),
    }
    return filled("fmu_continuous.c", values) + (
        _switched(layout, s, mode, indicators) if layout.modes else ""
    )


def _held(layout: FmuLayout) -> tuple[Symbols, ca.SX, ca.SX]:
    """Return the expressions with all modes held, the symbols of the modes and the event indicators."""
    s, switching = layout.model.symbols(), layout.model.switching
    if switching is None or not layout.modes:
        return s, ca.SX(0, 1), ca.SX(0, 1)
    mode = ca.SX.sym("mode", len(layout.modes))
    given = [s.time, s.state, s.input, s.parameter, mode]
    derivative, indicators, _ = switching.branch.call(given)
    output, signal = switching.shown.call(given)
    # An output that is a state or a signal is that one; so outputs may have been added to the model.
    named = {v.name: s.state[i] for i, v in enumerate(layout.model.states)}
    named |= {v.name: signal[i] for i, v in enumerate(layout.model.signals)}
    outputs = [named[v.name] if v.name in named else output[i] for i, v in enumerate(layout.model.outputs)]
    held = s._replace(derivative=derivative, output=ca.SX(ca.vertcat(*outputs)), signal=signal)
    return held, mode, ca.densify(indicators)


def _switched(layout: FmuLayout, s: Symbols, mode: ca.SX, indicators: ca.SX) -> str:
    """Return what the switches need: modes at a state, indicators with slopes, what follows a landing."""
    switching = layout.model.switching
    if switching is None:
        return ""
    n, k = len(layout.model.states), len(layout.modes)
    given = [s.time, s.state, s.input, s.parameter]
    natural = switching.natural.call(given)
    slope = ca.jtimes(indicators, s.state, s.derivative) + ca.jacobian(indicators, s.time)
    follows = switching.landing.call([*given, mode])
    targets = [cells("rate", k), cells("target", k), cells("leads", k)]
    targets += [_table("reach", n, k), _table("slope", k, n)]
    values = {
        "holds": ", ".join(str(int(holds)) for holds in switching.holds),
        "natural": _statements(s, mode, natural, [cells("m", k)]),
        "indicators": _statements(s, mode, [indicators, slope], [cells("z", k), cells("slope", k)]),
        "landing": _statements(s, mode, follows, targets),
    }
    return filled("fmu_switched.c", values)


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


def _table(name: str, rows: int, columns: int) -> list[str]:
    return [f"{name}[{i}][{j}]" for j in range(columns) for i in range(rows)]


def _statements(
    s: Symbols,
    mode: ca.SX,
    results: Sequence[ca.SX],
    targets: Sequence[Sequence[str]],
    *,
    seed: ca.SX | None = None,
) -> list[str]:
    """Return the body of a function of (t, x, u, p, m), and of a direction (dt, dx, du, dp) with a seed."""
    groups, texts = [s.time, s.state, s.input, s.parameter, mode], [["t"]]
    texts += [cells(name, e.numel()) for name, e in zip("xupm", groups[1:], strict=True)]
    if seed is not None:
        groups.append(seed)
        texts.append(["dt"] + [f"d{cell}" for group in texts[1:-1] for cell in group])
    function = ca.Function("f", groups, [ca.densify(e) for e in results], {"cse": True})
    return print_statements(function, texts, targets, real=Real.DOUBLE)


def _discrete(layout: FmuLayout, c: CWriter) -> str:
    given = {each.variable.name for each in layout.outputs}
    outputs = [path for path, v in zip(c.paths.outputs, c.model.outputs, strict=True) if v.name in given]
    lookups, signals, looked_up = _signals(layout, c)
    _, known = step_body(c)
    directional, sloped = _directional(layout, c)
    looked_up |= sloped
    missing = [table for table in c.tables if table.columns(looked_up) and not table.columns(known)]
    values = {
        "tables": [line for table in missing for line in (*table.data(), "")],
        "parameters": [f"parameters.{path} = p[{i}];" for i, path in enumerate(c.paths.parameters)],
        "start": [f"memory->states.{path} = x[{i}];" for i, path in enumerate(c.paths.states)],
        "inputs": [f"inputs.{path} = u[{i}];" for i, path in enumerate(c.paths.inputs)],
        "states": [f"x[{i}] = before.{path};" for i, path in enumerate(c.paths.states)],
        "outputs": [f"y[{i}] = outputs.{path};" for i, path in enumerate(outputs)],
        "signals": [*lookups, *signals],
        "directional": directional,
    }
    return c.filled("fmu_discrete.c", values)


def _directional(layout: FmuLayout, c: CWriter) -> tuple[list[str], set[int]]:
    """Return how what a sample shows changes in a direction, and the looked-up numbers used."""
    model = layout.model
    s = model.symbols()
    groups = {
        "x": (model.states, s.state),
        "u": (model.inputs, s.input),
        "p": (model.parameters, s.parameter),
    }
    texts = {
        "x": cells("x", len(model.states)),
        "u": [f"memory->inputs.{path}" for path in c.paths.inputs],
        "p": [f"memory->parameters.{path}" for path in c.paths.parameters],
    }
    count = s.table.numel()
    seeds = [ca.SX.sym(f"d{letter}", e.numel()) for letter, (_, e) in groups.items()]
    seeds.append(ca.SX.sym("dw", count))
    of = [e for _, e in groups.values()] + [s.table]
    results = [ca.jtimes(e, ca.vertcat(*of), ca.vertcat(*seeds)) for e in _own(layout, s)]
    function = ca.Function("d", [*of, *seeds], [ca.densify(e) for e in results], {"cse": True})
    given = [*texts.values(), [f"w{i}" for i in range(count)]]
    given += [cells(f"d{letter}", e.numel()) for letter, (_, e) in groups.items()]
    given.append([f"dw{i}" for i in range(count)])
    targets = [cells(name, e.numel()) for name, e in zip(("dy", "ds"), results, strict=True)]
    statements = print_statements(function, given, targets, real=Real.DOUBLE)
    sloped = named_indices(statements, "dw")
    used = named_indices(statements, "w") | sloped
    names = {v.name: (texts[letter][i], f"d{letter}[{i}]")
             for letter in "xu" for i, v in enumerate(groups[letter][0])}  # fmt: skip
    arguments = {name: text for name, (text, _) in names.items()}
    columns = [names[table.argument][1] for table in model.tables for _ in table.columns]
    changes = [f"const double dw{i} = slope{i} * {columns[i]};" for i in sorted(sloped)]
    slopes = look_up_slopes(c.tables, arguments, sloped)
    return [*look_up(c.tables, arguments, used), *slopes, *changes, *statements], used


def _signals(layout: FmuLayout, c: CWriter) -> tuple[list[str], list[str], set[int]]:
    """Return the look-ups and statements for the signals of a sample, and the looked-up numbers used."""
    model = layout.model
    s = model.symbols()
    _, signals = _own(layout, s)
    function = ca.Function("s", [s.state, s.input, s.parameter, s.table], [signals], {"cse": True})
    names = [
        [f"before.{path}" for path in c.paths.states],
        [f"memory->inputs.{path}" for path in c.paths.inputs],
        [f"memory->parameters.{path}" for path in c.paths.parameters],
    ]
    width = [f"w{i}" for i in range(s.table.numel())]
    statements = print_statements(function, [*names, width], [cells("s", signals.numel())], real=Real.DOUBLE)
    used = named_indices(statements, "w")
    arguments = dict(zip((v.name for v in model.states), names[0], strict=True))
    arguments |= dict(zip((v.name for v in model.inputs), names[1], strict=True))
    return look_up(c.tables, arguments, used), statements, used
