"""A CasADi function as a list of elementary operations, so that it can be evaluated for many columns at once.

Every value is one number per column. What depends on nothing but arguments that stay the same from call to
call (the parameters) is marked as fixed, so that it is computed once for a whole run. Operations keep the
order and form that CasADi gives them: a column gets the bits of the single call, as long as the elementary
functions of the evaluator are those of CasADi.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import casadi as ca

from ..model import Table
from ..model.graph import fold, read_graph

ARITHMETIC = frozenset([
    ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_INV, ca.OP_SQRT,
    ca.OP_EXP, ca.OP_LOG, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_LOG1P, ca.OP_EXPM1, ca.OP_HYPOT,
    ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ATAN, ca.OP_ATAN2,
    ca.OP_SINH, ca.OP_COSH, ca.OP_TANH, ca.OP_ASINH, ca.OP_ACOSH, ca.OP_ATANH, ca.OP_ERF,
    ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO,
    ca.OP_FLOOR, ca.OP_CEIL, ca.OP_FMOD, ca.OP_FABS, ca.OP_SIGN, ca.OP_COPYSIGN, ca.OP_FMIN, ca.OP_FMAX,
])  # fmt: skip
"""Operations that are known by columns, as CasADi numbers them."""

CONDITIONS = frozenset([ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR])
_MOVED = frozenset([ca.OP_RESHAPE, ca.OP_VERTCAT, ca.OP_HORZCAT, ca.OP_VERTSPLIT, ca.OP_HORZSPLIT])


class NotByColumnsError(Exception):
    """A function has an operation that is not known by columns; it is evaluated one column at a time."""


@dataclass(frozen=True)
class Operation:
    """One elementary operation."""

    code: int  # as CasADi numbers it, one of ARITHMETIC
    operands: tuple[int, ...]  # numbers of values, one or two
    result: int  # number of the value


@dataclass(frozen=True)
class TableReading:
    """A table is read: linear between its nodes, held at the ends."""

    table: int  # number of the table in the graph
    at: int  # number of the value at which it is read
    results: tuple[int, ...]  # numbers of the values, one for each column of the table

    @property
    def operands(self) -> tuple[int, ...]:
        """Numbers of the values that it takes."""
        return (self.at,)


@dataclass(frozen=True)
class Call:
    """Another graph is evaluated."""

    body: int  # number of the graph among the bodies
    # operands, results: numbers of values, in the order of its arguments and results
    operands: tuple[int, ...]
    results: tuple[int, ...]
    once: int  # number of the set of its fixed values: calls with the same fixed arguments share them


Step: TypeAlias = Operation | TableReading | Call


@dataclass(eq=False)
class ColumnGraph:
    """What a function computes, value by value; values are numbered from zero."""

    # arguments: numbers of the values of each argument, in the order of the function
    arguments: tuple[tuple[int, ...], ...] = ()
    results: tuple[tuple[int, ...], ...] = ()  # numbers of the values of each result
    constants: dict[int, float] = field(default_factory=dict)  # constants by the number of their value
    # fixed: numbers of the values that depend on fixed arguments and constants only
    fixed: set[int] = field(default_factory=set)
    steps: list[Step] = field(default_factory=list)  # in the order of computation
    count: int = 0  # how many values there are
    bodies: list[ColumnGraph] = field(default_factory=list)  # graphs that are called
    # onces: for each set of fixed values the number of the body and its fixed operands
    onces: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)  # tables that are read

    @cached_property
    def conditions(self) -> frozenset[int]:
        """Numbers of the values that are 0 or 1."""
        return frozenset(s.result for s in self.steps if isinstance(s, Operation) and s.code in CONDITIONS)

    def new(self, number: int = 1) -> tuple[int, ...]:
        """Return numbers of new values."""
        self.count += number
        return tuple(range(self.count - number, self.count))


def column_graph(
    function: ca.Function, *, fixed: Sequence[int] = (), tables: Mapping[str, Table] | None = None
) -> ColumnGraph:
    """Return a function as a graph of elementary operations."""
    if function.class_name() == "SXFunction":
        places = [k for i in fixed for k in _places(function, i)]
        return _body(function, frozenset(places))
    if function.class_name() != "MXFunction":
        raise NotByColumnsError(function.class_name())
    return _Walk(function, frozenset(fixed), tables or {}).graph


def _places(function: ca.Function, argument: int) -> range:
    first = sum(function.nnz_in(i) for i in range(argument))
    return range(first, first + function.nnz_in(argument))


class _Builder:
    """Adds operations to a graph; the same operation on the same values is computed once."""

    def __init__(self) -> None:
        self.graph = ColumnGraph()
        self._known: dict[tuple[int, tuple[int, ...]], int] = {}
        self._constants: dict[str, int] = {}

    def constant(self, value: float) -> int:
        key = value.hex()
        if key not in self._constants:
            (number,) = self.graph.new()
            self.graph.constants[number] = value
            self.graph.fixed.add(number)
            self._constants[key] = number
        return self._constants[key]

    def operation(self, code: int, values: Sequence[int]) -> int:
        operands = tuple(values)
        if code == ca.OP_ASSIGN:
            return operands[0]
        if code not in ARITHMETIC:
            raise NotByColumnsError(f"operation {code} of CasADi")
        key = (code, operands)
        if key not in self._known:
            (number,) = self.graph.new()
            self.graph.steps.append(Operation(code, operands, number))
            self._known[key] = number
            if self.graph.fixed.issuperset(operands):
                self.graph.fixed.add(number)
        return self._known[key]


def _body(function: ca.Function, fixed: frozenset[int]) -> ColumnGraph:
    """Return a function of SX; the fixed places count through all arguments."""
    built = _Builder()
    graph = built.graph
    firsts = [_places(function, i).start for i in range(function.n_in())]
    inputs = graph.new(sum(function.nnz_in(i) for i in range(function.n_in())))
    graph.fixed |= {inputs[k] for k in fixed}
    graph.arguments = tuple(tuple(inputs[k] for k in _places(function, i)) for i in range(function.n_in()))
    values = fold(
        read_graph(function), lambda i, k: inputs[firsts[i] + k], built.constant, combined=built.operation
    )
    graph.results = tuple(
        tuple(values[i, k] if (i, k) in values else built.constant(0.0) for k in range(function.nnz_out(i)))
        for i in range(function.n_out())
    )
    return graph


class _Walk:
    """Walks through a function of MX."""

    def __init__(self, function: ca.Function, fixed: frozenset[int], tables: Mapping[str, Table]) -> None:
        self._built = _Builder()
        self.graph, self._tables = self._built.graph, tables
        self._bodies: dict[tuple[int, frozenset[int]], int] = {}
        self._onces: dict[tuple[int, tuple[int, ...]], int] = {}
        self._functions: list[ca.Function] = []
        arguments = [self.graph.new(function.nnz_in(i)) for i in range(function.n_in())]
        self.graph.arguments = tuple(arguments)
        self.graph.fixed |= {k for i in fixed for k in arguments[i]}
        self.graph.results = tuple(self._walked(function, arguments))

    def _walked(self, function: ca.Function, arguments: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Return the values of each result of a function for these arguments."""
        held: dict[int, tuple[int, ...]] = {}
        results: dict[int, tuple[int, ...]] = {}
        for k in range(function.n_instructions()):
            code, into, out = (
                function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
            )  # fmt: skip
            if code == ca.OP_OUTPUT:
                # A result may come in several parts, one after the other.
                results[out[0]] = results.get(out[0], ()) + held[into[0]]
                continue
            node = function.instruction_MX(k)
            if code == ca.OP_INPUT:
                first = node.info()["offset"]
                held[out[0]] = arguments[into[0]][first : first + node.nnz()]
                continue
            given = [held[i] for i in into]
            for place, values in zip(out, self._values(code, node, given), strict=True):
                if place >= 0:
                    held[place] = values
        whole = [results.get(i, ()) for i in range(function.n_out())]
        if any(len(each) != function.nnz_out(i) for i, each in enumerate(whole)):
            raise NotByColumnsError(f"a result of {function.name()} of another sparsity")
        return whole

    def _values(self, code: int, node: ca.MX, given: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Return the values of each result of an instruction."""
        if code == ca.OP_CALL:
            return self._called(node.which_function(), given)
        if code == ca.OP_CONST:
            return [tuple(self._built.constant(float(v)) for v in node.to_DM().nonzeros())]
        if code == ca.OP_GETNONZEROS:
            return [tuple(given[0][k] for k in _chosen(node.info()))]
        if code == ca.OP_SETNONZEROS:
            values = list(given[0])
            for k, value in zip(_chosen(node.info()), given[1], strict=True):
                values[k] = value
            return [tuple(values)]
        if code in _MOVED:
            everything = tuple(k for values in given for k in values)
            if code not in (ca.OP_VERTSPLIT, ca.OP_HORZSPLIT):
                return [everything]
            offsets = node.info()["offset"]
            if offsets[-1] != len(everything):
                raise NotByColumnsError("a matrix that is split")
            return [everything[a:b] for a, b in pairwise(offsets)]
        size = max(len(values) for values in given)
        wide = [values * size if len(values) == 1 else values for values in given]
        if any(len(values) != size for values in wide):
            raise NotByColumnsError("operands of different sparsity")
        return [tuple(self._built.operation(code, each) for each in zip(*wide, strict=True))]

    def _called(self, function: ca.Function, given: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        for i, values in enumerate(given):
            if len(values) != function.nnz_in(i):
                raise NotByColumnsError(f"an argument of {function.name()} of another sparsity")
        graph = self.graph
        if function.name() in self._tables:
            (at,) = given[0]
            results = graph.new(function.nnz_out(0))
            graph.tables.append(self._tables[function.name()])
            graph.steps.append(TableReading(len(graph.tables) - 1, at, results))
            return [results]
        if function.class_name() == "MXFunction":
            return self._walked(function, given)
        if function.class_name() != "SXFunction":
            raise NotByColumnsError(function.class_name())
        operands = tuple(k for values in given for k in values)
        fixed = frozenset(i for i, k in enumerate(operands) if k in graph.fixed)
        key = (function.__hash__(), fixed)
        if key not in self._bodies:
            self._functions.append(function)  # so that its number is not given to another one
            self._bodies[key] = len(graph.bodies)
            graph.bodies.append(_body(function, fixed))
        body = self._bodies[key]
        same = (body, tuple(operands[i] for i in sorted(fixed)))
        if same not in self._onces:
            self._onces[same] = len(graph.onces)
            graph.onces.append(same)
        sizes = [function.nnz_out(i) for i in range(function.n_out())]
        results = graph.new(sum(sizes))
        graph.steps.append(Call(body, operands, results, self._onces[same]))
        ends = [sum(sizes[: i + 1]) for i in range(len(sizes))]
        return [results[end - size : end] for end, size in zip(ends, sizes, strict=True)]


def _chosen(info: Mapping[str, object]) -> list[int]:
    """Return the places that an instruction takes or sets."""
    if "slice" in info:
        part: Mapping[str, int] = info["slice"]  # type: ignore[assignment]
        return list(range(part["start"], part["stop"], part["step"]))
    if "nz" in info:
        places: Sequence[int] = info["nz"]  # type: ignore[assignment]
        return list(places)
    raise NotByColumnsError(f"places {sorted(info)}")
