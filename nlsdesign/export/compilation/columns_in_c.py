"""A graph of elementary operations written in C, eight columns of numbers at a time.

The types are vectors of the compiler, so that one instruction of the processor works on several columns.
Sums, products, quotients, roots and comparisons have the bits of the single column; elementary functions are
those of the C library, column by column. Constants and tables are no part of the code but are given to it, so
that machines of one structure, each with an observer of its own numbers, share what was compiled once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...simulation.column_graph import Call, ColumnGraph, Operation, TableReading
from ..files import filled, template

WIDTH = 8
"""Columns that are computed together."""

_FORMS: Mapping[int, str] = {
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "all(1.0) / {0}",
    ca.OP_FMIN: "choose(({0} < {1}) | ({1} != {1}), {0}, {1})",
    ca.OP_FMAX: "choose(({0} > {1}) | ({1} != {1}), {0}, {1})",
    ca.OP_FABS: "(column)((mask){0} & INT64_MAX)",
    ca.OP_SIGN: "choose({0} < 0.0, all(-1.0), choose({0} > 0.0, all(1.0), {0}))",
    ca.OP_COPYSIGN: "(column)(((mask){0} & INT64_MAX) | ((mask){1} & INT64_MIN))",
}
_CONDITIONS: Mapping[int, str] = {
    ca.OP_LT: "{0} < {1}",
    ca.OP_LE: "{0} <= {1}",
    ca.OP_EQ: "{0} == {1}",
    ca.OP_NE: "{0} != {1}",
    ca.OP_NOT: "{0} == 0.0",
    ca.OP_AND: "({0} != 0.0) & ({1} != 0.0)",
    ca.OP_OR: "({0} != 0.0) | ({1} != 0.0)",
}
_LIBRARY: Mapping[int, str] = {
    ca.OP_SQRT: "sqrt", ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow",
    ca.OP_LOG1P: "log1p", ca.OP_EXPM1: "expm1", ca.OP_HYPOT: "hypot", ca.OP_SIN: "sin", ca.OP_COS: "cos",
    ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2",
    ca.OP_SINH: "sinh", ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_ASINH: "asinh",
    ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh", ca.OP_ERF: "erf", ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil", ca.OP_FMOD: "fmod",
}  # fmt: skip
_TWO_OPERANDS = frozenset(["pow", "hypot", "atan2", "fmod"])


_WRITTEN = frozenset([0.0, 0.5, 1.0, 2.0])
"""Sizes of constants that stand in the code: they belong to formulas, not to a machine."""


class ColumnsInC(NamedTuple):
    """Code of a run, and what is given to it."""

    text: str  # C code with a function run
    numbers: Array  # constants, then grid and values of each table


class _Given:
    """Numbers that are given to the code, and where each stands."""

    def __init__(self, graph: ColumnGraph) -> None:
        self._numbers: list[float] = []
        self.constants = {id(each): self._places(each) for each in (graph, *graph.bodies)}
        self.grids, self.tables = [], []
        for table in graph.tables:
            self.grids.append(self._added(table.grid))
            self.tables.append(self._added(table.values.ravel()))

    def _places(self, graph: ColumnGraph) -> dict[int, str]:
        names = {}
        for number, value in graph.constants.items():
            given = math.isfinite(value) and abs(value) not in _WRITTEN
            names[number] = f"all({f'c[{self._added([value])}]' if given else _number(value)})"
        return names

    def _added(self, values: Iterable[float]) -> int:
        first = len(self._numbers)
        self._numbers.extend(map(float, values))
        return first

    @property
    def numbers(self) -> Array:
        """All of them; at least one, so that there is something to point at."""
        return np.array(self._numbers or [0.0])


def sampled_run_in_c(graph: ColumnGraph) -> ColumnsInC:
    """Return C code of a run of samples, for many columns."""
    written = [filled("columns.c", {"width": str(WIDTH)})]
    if graph.tables:
        written.append(template("columns_look_up.c"))
    used = {
        step.code for each in (graph, *graph.bodies) for step in each.steps if isinstance(step, Operation)
    }
    written += [_by_columns(name) for name in sorted({_LIBRARY[code] for code in used & set(_LIBRARY)})]
    held = _Given(graph)
    constants = held.constants
    crossing = [_crossing(body) for body in graph.bodies]
    for k, body in enumerate(graph.bodies):
        names = constants[id(body)]
        written.append(_once(k, body, crossing[k], names) + _each(k, body, crossing[k], names))
    state, given, parameter = graph.arguments
    names = constants[id(graph)] | {number: f"p[{i}]" for i, number in enumerate(parameter)}
    fixed = [_operation(s, graph, names) for s in graph.steps if _is_fixed(s, graph)]
    onces = []
    for k, (place, operands) in enumerate(graph.onces):
        onces.append(f"column o{k}[{len(crossing[place])} + 1];")
        values = "".join(f"{_name(v, names)}, " for v in operands)
        fixed.append(f"{{ column a[] = {{{values}{{0}}}}; once{place}(c, a, o{k}); }}")
    names |= {number: f"s[{i}]" for i, number in enumerate(state)}
    names |= {number: f"load(g + {i} * every)" for i, number in enumerate(given)}
    lines = [_step(step, graph, names, held) for step in graph.steps if not _is_fixed(step, graph)]
    after, kept = graph.results
    lines += [f"store(out + {i} * every, {_name(v, names)});" for i, v in enumerate(kept)]
    lines += [f"column n{i} = {_name(v, names)};" for i, v in enumerate(after)]
    lines += [f"s[{i}] = n{i};" for i in range(len(after))]
    sizes = {"states": len(state), "inputs": len(given), "parameters": len(parameter), "shown": len(kept)}
    rows = {"onces": onces, "fixed": fixed, "body": lines}
    written.append(filled("columns_run.c", {**{name: str(size) for name, size in sizes.items()}, **rows}))
    return ColumnsInC("\n".join(written), held.numbers)


def _is_fixed(step: object, graph: ColumnGraph) -> bool:
    return isinstance(step, Operation) and step.result in graph.fixed


def _number(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return f"({value.hex()})"


def _by_columns(name: str) -> str:
    two = name in _TWO_OPERANDS
    return (
        f"static inline column {name}_of(column a{', column b' if two else ''}) {{\n"
        f"    column r; for (int j = 0; j < WIDTH; ++j) r[j] = {name}(a[j]{', b[j]' if two else ''});\n"
        "    return r;\n}\n"
    )


def _crossing(body: ColumnGraph) -> list[int]:
    """Return the fixed values of a body that what is not fixed takes, without constants."""
    given = {k for argument in body.arguments for k in argument}
    taken = {
        k for s in body.steps if isinstance(s, Operation) and s.result not in body.fixed for k in s.operands
    }
    taken |= {k for result in body.results for k in result}
    return sorted(k for k in taken & body.fixed if k not in body.constants and k not in given) + sorted(
        k for k in taken & body.fixed & given
    )


def _once(number: int, body: ColumnGraph, crossing: Sequence[int], constants: Mapping[int, str]) -> str:
    names = dict(constants) | {
        k: f"a[{i}]"
        for i, k in enumerate(k for argument in body.arguments for k in argument if k in body.fixed)
    }
    lines = [_operation(s, body, names) for s in body.steps if _is_fixed(s, body)]
    lines += [f"o[{i}] = {_name(k, names)};" for i, k in enumerate(crossing)]
    text = "\n    ".join(lines)
    return (
        f"static __attribute__((noinline)) void once{number}(const double *restrict c, const column *a, "
        f"column *o) {{\n    (void)c;\n    {text}\n}}\n"
    )


def _each(number: int, body: ColumnGraph, crossing: Sequence[int], constants: Mapping[int, str]) -> str:
    names = dict(constants) | {k: f"o[{i}]" for i, k in enumerate(crossing)}
    moving = [k for argument in body.arguments for k in argument if k not in body.fixed]
    names |= {k: f"a[{i}]" for i, k in enumerate(moving)}
    lines = [_operation(s, body, names) for s in body.steps if not _is_fixed(s, body)]
    results = [k for result in body.results for k in result]
    lines += [f"r[{i}] = {_name(k, names)};" for i, k in enumerate(results)]
    text = "\n    ".join(lines)
    return (
        f"static __attribute__((noinline)) void each{number}(const double *restrict c, "
        f"const column *restrict o, const column *restrict a, column *restrict r) {{\n    (void)c;\n"
        f"    {text}\n}}\n"
    )


def _name(number: int, names: Mapping[int, str]) -> str:
    return names.get(number, f"v{number}")


def _operation(step: object, graph: ColumnGraph, names: Mapping[int, str]) -> str:
    assert isinstance(step, Operation)
    operands = [_name(k, names) for k in step.operands]
    result = step.result
    if step.code in _CONDITIONS:
        condition = _CONDITIONS[step.code].format(*operands)
        return f"mask m{result} = {condition}; column v{result} = number(m{result}); (void)v{result};"
    if step.code == ca.OP_IF_ELSE_ZERO:
        where = f"m{step.operands[0]}" if step.operands[0] in graph.conditions else f"({operands[0]} != 0.0)"
        return f"column v{result} = (column)((mask){operands[1]} & {where});"
    if step.code in _LIBRARY:
        return f"column v{result} = {_LIBRARY[step.code]}_of({', '.join(operands)});"
    return f"column v{result} = {_FORMS[step.code].format(*operands)};"


def _step(step: object, graph: ColumnGraph, names: Mapping[int, str], held: _Given) -> str:
    if isinstance(step, Operation):
        return _operation(step, graph, names)
    if isinstance(step, TableReading):
        table, first = graph.tables[step.table], step.results[0]
        exact = int(table.breakpoints is None)
        call = (
            f"column t{first}[{len(step.results)}]; look_up(c + {held.grids[step.table]}, "
            f"c + {held.tables[step.table]}, {len(table.grid)}, {len(step.results)}, {exact}, "
            f"{_name(step.at, names)}, t{first});"
        )
        return " ".join([call, *(f"column v{k} = t{first}[{i}];" for i, k in enumerate(step.results))])
    assert isinstance(step, Call)
    first, body = step.results[0], graph.bodies[step.body]
    places = [k for argument in body.arguments for k in argument]
    moving = "".join(
        f"{_name(value, names)}, "
        for value, own in zip(step.operands, places, strict=True) if own not in body.fixed
    )  # fmt: skip
    call = (
        f"column r{first}[{len(step.results)}]; {{ column a[] = {{{moving}{{0}}}}; "
        f"each{step.body}(c, o{step.once}, a, r{first}); }}"
    )
    return " ".join([call, *(f"column v{k} = r{first}[{i}];" for i, k in enumerate(step.results))])
