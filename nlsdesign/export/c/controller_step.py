"""The step of a controller in C: guarded inputs, table look-ups, equations, results stored only if finite."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ...model.flat import FlatModel
from .c_text import Real
from .guarded_step import index_bit
from .instructions import named_indices, print_statements
from .structures import member_paths
from .table_lookup import look_up


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
    function = ca.Function(
        "step",
        [s.state, s.input, s.parameter, s.table],
        [ca.densify(s.derivative), ca.densify(s.output)],
        {"cse": True},
    )
    groups = [model.states, model.inputs, model.parameters]
    names = [[f"{letter}{i}" for i in range(len(group))] for letter, group in zip("xup", groups, strict=True)]
    targets = [
        [f"const {real.name} {y}{i}" for i in range(function.numel_out(k))] for k, y in enumerate("fy")
    ]
    width = [f"w{i}" for i in range(s.table.numel())]
    equations = print_statements(function, [*names, width], targets, real=real)
    used = named_indices(equations, "w")
    arguments = {v.name: f"x{i}" for i, v in enumerate(model.states)}
    arguments |= {v.name: f"u{i}" for i, v in enumerate(model.inputs)}
    tables = look_up(model, real, arguments, used)
    body = [
        *_loads(model, real, [*tables, *equations]),
        *tables,
        *equations,
        "",
        *_stores(model, name, real),
    ]
    return body, used


def _loads(model: FlatModel, real: Real, following: Sequence[str]) -> list[str]:
    lines = [] if model.inputs else ["(void)inputs;"]
    paths = member_paths(model.inputs)
    for i, v in enumerate(model.inputs):
        path = paths[v.name]
        given = (
            f"{real.bound(v.minimum)}, {real.bound(v.maximum)}, &state->inputs.{path}, 0x{index_bit(i):x}u"
        )
        # An input without influence is still guarded, for the sake of the status word.
        target = f"const {real.name} u{i} =" if i in named_indices(following, "u") else "(void)"
        lines.append(f"{target} usable(inputs->{path}, {given}, &status);")
    for letter, place, group in (("x", "states", model.states), ("p", "parameters", model.parameters)):
        paths, used = member_paths(group), named_indices(following, letter)
        lines += [
            f"const {real.name} {letter}{i} = state->{place}.{paths[v.name]};"
            for i, v in enumerate(group)
            if i in used
        ]
    return lines


def _stores(model: FlatModel, name: str, real: Real) -> list[str]:
    """Return the assignments of the results: stored if all are finite, else the last good ones are kept."""
    lines: list[str] = []
    states, outputs = member_paths(model.states), member_paths(model.outputs)
    if states:
        lines += [f"if ({_finite('f', len(states), real)}) {{"]
        lines += [f"    state->states.{path} = f{i};" for i, path in enumerate(states.values())]
        lines += ["} else {", f"    status |= {name.upper()}_STATE_HELD;", "}"]
    if not outputs:
        return [*lines, "(void)outputs;"]
    lines += [f"if ({_finite('y', len(outputs), real)}) {{"]
    lines += [f"    outputs->{p} = state->outputs.{p} = y{i};" for i, p in enumerate(outputs.values())]
    lines += ["} else {", f"    status |= {name.upper()}_OUTPUT_HELD;"]
    return [*lines, "    *outputs = state->outputs;", "}"]


def _finite(letter: str, count: int, real: Real) -> str:
    # v - v is 0 for a finite v and NaN otherwise: one comparison for all.
    terms = " + ".join(f"({letter}{i} - {letter}{i})" for i in range(count))
    return f"{terms} == {real.literal(0.0)}"
