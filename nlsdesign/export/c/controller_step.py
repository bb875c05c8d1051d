"""The step of a controller in C: guarded inputs, table look-ups, equations, results stored only if finite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from ...model.flat import FlatModel, Symbols, Variable
from .c_text import Real
from .instructions import named_indices, print_statements
from .parameter_numbers import LETTER, ParameterNumbers, without_parameter_numbers
from .reading_guard import mover, reading_numbers
from .status_bits import index_bit
from .structures import member_paths
from .table_lookup import look_up

_GAP = "q"
"""First letter of the numbers that are 1 while an input stands in for a refused reading."""


def measured_inputs(model: FlatModel) -> dict[str, int]:
    """Return the number of each input that is measured, in order, by name.

    Parameters
    ----------
    model
        Discrete model.
    """
    names = [v.name for v in model.inputs if v.plausibility is not None]
    return {name: number for number, name in enumerate(names)}


def step_body(model: FlatModel, name: str, real: Real) -> tuple[list[str], set[int]]:
    """Return the statements of the step function and the indices of the looked-up numbers it uses.

    Parameters
    ----------
    model
        Discrete model.
    name
        Prefix of all C names.
    real
        Number type.
    """
    s = model.symbols()
    gap, numbers = _numbers(model, s)
    function = ca.Function(
        "step", [s.state, s.input, s.parameter, s.table, gap, numbers.symbols], numbers.results, {"cse": True}
    )
    targets = [
        [f"const {real.name} {y}{i}" for i in range(function.numel_out(k))] for k, y in enumerate("fy")
    ]
    gaps = [f"{_GAP}{i}" for i in range(gap.numel())]
    equations = print_statements(function, [*_names(model), gaps, numbers.names], targets, real=real)
    looked_up = named_indices(equations, "w")
    tables = look_up(model, real, _arguments(model), looked_up)
    beyond = _beyond_tables(model, name, real)
    body = [
        *_loads(model, real, [*beyond, *tables, *equations]),
        *_gaps(model, real, equations),
        *[
            f"const {real.name} {LETTER}{i} = state->derived[{i}];"
            for i in sorted(named_indices(equations, LETTER))
        ],
        *beyond,
        *tables,
        *equations,
        "",
        *_stores(model, name, real),
    ]
    return body, looked_up


def numbers_of_parameters(model: FlatModel) -> ParameterNumbers:
    """Return the numbers that the step reads and that follow from the parameters alone.

    Parameters
    ----------
    model
        Discrete model.
    """
    return _numbers(model, model.symbols())[1]


def _numbers(model: FlatModel, s: Symbols) -> tuple[ca.SX, ParameterNumbers]:
    gap, used = _used_inputs(model, s)
    results = ca.substitute([ca.densify(s.derivative), ca.densify(s.output)], [s.input], [used])
    return gap, without_parameter_numbers(results, s.parameter)


def settled_body(model: FlatModel, real: Real, which: int) -> list[str]:
    """Return the statements that begin (0) or resume (1) from the first usable readings.

    Parameters
    ----------
    model
        Discrete model with ``begin``.
    real
        Number type.
    which
        Of the results of ``begin``.
    """
    assert model.begin is not None
    s = model.symbols()
    settled = ca.SX(ca.densify(model.begin(s.state, s.input, s.parameter, s.table)[which]))
    kept = [i for i in range(len(model.states)) if not ca.is_equal(settled[i], s.state[i], 2)]
    changed = ca.SX(ca.vertcat(*[settled[i] for i in kept]))
    function = ca.Function("settled", [s.state, s.input, s.parameter, s.table], [changed], {"cse": True})
    paths = list(member_paths(model.states).values())
    targets = [f"state->states.{paths[i]}" for i in kept]
    equations = print_statements(function, _names(model), [targets], real=real)
    tables = look_up(model, real, _arguments(model), named_indices(equations, "w"))
    return [*_loads(model, real, [*tables, *equations]), *tables, *equations]


def take_body(model: FlatModel, name: str, real: Real) -> list[str]:
    """Return the statements that take the inputs: commands first, then readings.

    Parameters
    ----------
    model
        Discrete model.
    name
        Prefix of all C names.
    real
        Number type.
    """
    if not model.inputs:
        return ["(void)inputs;"]
    paths, readings = member_paths(model.inputs), measured_inputs(model)
    resumes = bool(readings) and model.begin is not None
    lines = ["uint32_t resuming = 0u;"] if resumes else []
    for i, v in enumerate(model.inputs):
        if v.name not in readings:
            limits = f"{real.bound(v.minimum)}, {real.bound(v.maximum)}"
            given = f"inputs->{paths[v.name]}, {limits}, &state->inputs.{paths[v.name]}"
            lines.append(f"usable({given}, 0x{index_bit(i):x}u, &status);")
    for i, v in enumerate(model.inputs):
        if v.name in readings:
            number, path = readings[v.name], paths[v.name]
            moved = _mover(model, v, real)
            kept = f"&reading_{number}, &state->readings[{number}], &state->inputs.{path}"
            call = f"plausible(inputs->{path}, {moved}, {kept}, 0x{index_bit(i):x}u, &status);"
            lines.append(f"{'resuming |=' if resumes else '(void)'} {call}")
    return lines


def reading_constants(model: FlatModel, real: Real) -> list[str]:
    """Return the numbers of each measured input as constants of C.

    Parameters
    ----------
    model
        Discrete model.
    real
        Number type.
    """
    lines: list[str] = []
    for v in model.inputs:
        numbers = reading_numbers(v, float(model.sample_time or 0.0), real)
        if numbers is not None:
            parts = (numbers.lowest, numbers.highest, numbers.change, numbers.noticeable)
            values = ", ".join(real.literal(part) for part in parts)
            number = measured_inputs(model)[v.name]
            lines.append(f"static const reading_limits reading_{number} = {{{values}, {numbers.patience}u}};")
    return lines


def _mover(model: FlatModel, variable: Variable, real: Real) -> str:
    moved = mover(model, variable)
    if moved is None:
        return real.literal(0.0)
    group, place = moved
    variables = model.inputs if group == "inputs" else model.states
    return f"state->{group}.{list(member_paths(variables).values())[place]}"


def _used_inputs(model: FlatModel, s: Symbols) -> tuple[ca.SX, ca.SX]:
    """Return the symbols of gaps, and the inputs with what is expected in place of refused readings."""
    readings = measured_inputs(model)
    if model.expected is None or not readings:
        return ca.SX(0, 1), s.input
    gap = ca.SX.sym("gap", len(readings))
    expected = ca.SX(ca.densify(model.expected(s.state, s.input, s.parameter, s.table)))
    used = [
        ca.if_else(gap[readings[v.name]] > 0.5, expected[i], s.input[i]) if v.name in readings else s.input[i]
        for i, v in enumerate(model.inputs)
    ]
    return gap, ca.SX(ca.vertcat(*used))


def _names(model: FlatModel) -> list[list[str]]:
    groups = [model.states, model.inputs, model.parameters]
    names = [[f"{letter}{i}" for i in range(len(group))] for letter, group in zip("xup", groups, strict=True)]
    return [*names, [f"w{i}" for i in range(sum(len(table.columns) for table in model.tables))]]


def _arguments(model: FlatModel) -> dict[str, str]:
    arguments = {v.name: f"x{i}" for i, v in enumerate(model.states)}
    return arguments | {v.name: f"u{i}" for i, v in enumerate(model.inputs)}


def _beyond_tables(model: FlatModel, name: str, real: Real) -> list[str]:
    """Return the statement that sets the flag for reading a table beyond its ends."""
    arguments = _arguments(model)
    ranges = dict.fromkeys((arguments[table.argument], *table.ends) for table in model.tables)
    beyond = [
        f"{argument} < {real.literal(first)} || {argument} > {real.literal(last)}"
        for argument, first, last in ranges
    ]
    flag = f"{name.upper()}_OUT_OF_TABLE"
    return [f"status |= ({' || '.join(beyond)}) ? {flag} : 0u;"] if beyond else []


def _gaps(model: FlatModel, real: Real, following: Sequence[str]) -> list[str]:
    one, zero = real.literal(1.0), real.literal(0.0)
    return [
        f"const {real.name} {_GAP}{i} = state->readings[{i}].missed > 0u ? {one} : {zero};"
        for i in sorted(named_indices(following, _GAP))
    ]


def _loads(model: FlatModel, real: Real, following: Sequence[str]) -> list[str]:
    groups: Mapping[str, tuple[str, tuple[Variable, ...]]] = {
        "u": ("inputs", model.inputs),
        "x": ("states", model.states),
        "p": ("parameters", model.parameters),
    }
    lines: list[str] = []
    for letter, (place, group) in groups.items():
        paths, used = member_paths(group), named_indices(following, letter)
        lines += [
            f"const {real.name} {letter}{i} = state->{place}.{paths[v.name]};"
            for i, v in enumerate(group)
            if i in used
        ]
    return lines


def _stores(model: FlatModel, name: str, real: Real) -> list[str]:
    """Return the assignments of the results, stored only if all are finite.

    A state that is not finite begins anew with the next sample; outputs that are not finite are held.
    """
    lines: list[str] = []
    states, outputs = member_paths(model.states), member_paths(model.outputs)
    if states:
        lines += [f"if ({_finite('f', len(states), real)}) {{"]
        lines += [f"    state->states.{path} = f{i};" for i, path in enumerate(states.values())]
        lines += ["} else {", "    state->states = start_states;", "    state->begun = 0u;"]
        lines += [f"    status |= {name.upper()}_STATE_RESTARTED;", "}"]
    if not outputs:
        return [*lines, "(void)state, (void)outputs;"]
    lines += [f"if ({_finite('y', len(outputs), real)}) {{"]
    for i, path in enumerate(outputs.values()):
        lines += [f"    state->outputs.{path} = y{i};", f"    outputs->{path} = y{i};"]
    lines += ["} else {", f"    status |= {name.upper()}_OUTPUT_HELD;"]
    return [*lines, "    *outputs = state->outputs;", "}"]


def _finite(letter: str, count: int, real: Real) -> str:
    # v - v is 0 for a finite v and NaN otherwise: one comparison for all, which NaN does not pass.
    terms = " + ".join(f"({letter}{i} - {letter}{i})" for i in range(count))
    return f"{terms} >= {real.literal(0.0)}"
