"""What the graph of an expression says where its derivative says nothing: dependence and range.

A rounded reading has the slope zero and yet depends on what is rounded; so both are read off the operations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import casadi as ca

from ...model.graph import fold, read_graph

Interval = tuple[float, float]
EVERYTHING: Interval = (-math.inf, math.inf)

_Value = TypeVar("_Value")

_LINEAR = frozenset([ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_ASSIGN, ca.OP_LIFT])


@dataclass(frozen=True)
class Dependence:
    """How a value depends on numbered symbols; sets are the bits of whole numbers."""

    on: int = 0  # all symbols that it depends on
    # scaled: those whose factor is not a constant: it depends on other symbols, or there is no factor at all
    scaled: int = 0
    # nonlinear: those whose factor changes while the model runs, or for which there is none: rounded,
    # compared, multiplied by another changing value
    nonlinear: int = 0

    def joined(self, other: Dependence) -> Dependence:
        """Return the dependence of a sum."""
        return Dependence(self.on | other.on, self.scaled | other.scaled, self.nonlinear | other.nonlinear)

    def times(self, factor: Dependence, changing: int) -> Dependence:
        """Return the part of a product's dependence that comes through this operand."""
        if not factor.on:
            return self
        return Dependence(self.on, self.on, self.on if factor.on & changing else self.nonlinear)

    def anyhow(self) -> Dependence:
        """Return the dependence of a function of this value that is no multiple of it."""
        return Dependence(self.on, self.on, self.on)


def dependences(function: ca.Function, symbols: Sequence[Sequence[int]], changing: int) -> list[Dependence]:
    """Return how each nonzero of the first result of an SX function depends on symbols.

    ``symbols``: for each argument the number of the symbol that each element stands for. Looked-up numbers
    stand for the argument of their table, and are nonlinear.
    """
    looked_up = len(symbols) - 1

    def given(argument: int, element: int) -> Dependence:
        bit = 1 << symbols[argument][element]
        return Dependence(bit, bit, bit) if argument == looked_up else Dependence(bit)

    def combined(operation: int, operands: Sequence[Dependence]) -> Dependence:
        together = Dependence()
        for each in operands:
            together = together.joined(each)
        if operation in _LINEAR:
            return together
        if operation in (ca.OP_MUL, ca.OP_DIV, ca.OP_IF_ELSE_ZERO):
            one, other = operands
            weight, weighed = (other, one) if operation == ca.OP_DIV else (one, other)
            factor = weight.times(weighed, changing) if operation == ca.OP_MUL else weight.anyhow()
            return weighed.times(weight, changing).joined(factor)
        return together.anyhow()

    return _of_first_result(fold(read_graph(function), given, lambda _: Dependence(), combined=combined))


def ranges(function: ca.Function, bounds: Sequence[Sequence[Interval]]) -> list[Interval]:
    """Return an interval that holds each nonzero of the first result, by interval arithmetic.

    The interval may be wider than the values that occur, never narrower.
    """
    values = fold(
        read_graph(function),
        lambda argument, element: bounds[argument][element],
        lambda value: (value, value),
        combined=lambda operation, operands: (
            _RANGES[operation](*operands) if operation in _RANGES else EVERYTHING
        ),
    )
    return _of_first_result(values)


def _of_first_result(values: Mapping[tuple[int, int], _Value]) -> list[_Value]:
    """Return what is known of each nonzero of the first result."""
    first = {nonzero: value for (result, nonzero), value in values.items() if result == 0}
    return [first[i] for i in range(len(first))]


def _sum(a: Interval, b: Interval) -> Interval:
    return a[0] + b[0], a[1] + b[1]


def _negative(a: Interval) -> Interval:
    return -a[1], -a[0]


def _product(a: Interval, b: Interval) -> Interval:
    # 0·∞ is 0 here: an unbounded number is not infinite.
    corners = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(corners), max(corners)


def _size(a: Interval) -> Interval:
    least = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return least, max(abs(a[0]), abs(a[1]))


_RANGES: Mapping[int, Callable[..., Interval]] = {
    ca.OP_ADD: _sum,
    ca.OP_SUB: lambda a, b: _sum(a, _negative(b)),
    ca.OP_NEG: _negative,
    ca.OP_TWICE: lambda a: _sum(a, a),
    ca.OP_MUL: _product,
    ca.OP_SQ: lambda a: _product(_size(a), _size(a)),
    ca.OP_FABS: _size,
    ca.OP_FMIN: lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    ca.OP_FMAX: lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    ca.OP_IF_ELSE_ZERO: lambda _, a: (min(a[0], 0.0), max(a[1], 0.0)),
    ca.OP_ASSIGN: lambda a: a,
    **dict.fromkeys((ca.OP_SIN, ca.OP_COS, ca.OP_TANH, ca.OP_ERF, ca.OP_SIGN), lambda _: (-1.0, 1.0)),
}
