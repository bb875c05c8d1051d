"""Verified ranges of symbolic functions: interval arithmetic, rounded outward, over many boxes at once.

A range contains every value that the function has for arguments in the box, in exact arithmetic. Sums,
products and roots are rounded outward by one unit in the last place, elementary functions by four, which is
more than their implementations err.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ArrangementError
from ....model.graph import fold, read_graph

Bounds: TypeAlias = tuple[Array, Array]

_graph = lru_cache(maxsize=16)(read_graph)
ELEMENTARY = 4
"""Units in the last place by which elementary functions are widened."""


@dataclass(frozen=True, eq=False)
class Range:
    """Lower and upper bounds of many numbers."""

    # lower, upper: arrays of one shape
    lower: Array
    upper: Array

    @property
    def magnitude(self) -> Array:
        """Largest absolute value in each."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))


def halved(cells: Bounds, middle: Array, wide: Mask) -> Bounds:
    """Return both halves of the cells that are too wide."""
    low, high = cells
    return np.concatenate([low[wide], middle[wide]]), np.concatenate([middle[wide], high[wide]])


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Ranges of the outputs of a function over many boxes."""

    outputs: tuple[Range, ...]  # one per output of the function, arrays of shape (boxes, elements)
    # undecided: boxes that reach over the edge of a piece of a table, shape (boxes,): their ranges are valid
    # but wide
    undecided: Mask


def enclose(function: ca.Function, boxes: Sequence[Sequence[tuple[ArrayLike, ArrayLike]]]) -> Enclosure:
    """Return ranges of a function over boxes."""
    given = [
        [(np.asarray(low, dtype=float), np.asarray(high, dtype=float)) for low, high in group]
        for group in boxes
    ]
    shape = np.broadcast_shapes((1,), *(low.shape for group in given for low, _ in group))
    results = [
        (np.zeros((*shape, function.numel_out(i))), np.zeros((*shape, function.numel_out(i))))
        for i in range(function.n_out())
    ]
    places = [_dense_places(function.sparsity_out(i)) for i in range(function.n_out())]
    undecided = np.zeros(shape, dtype=bool)

    def combined(operation: int, operands: Sequence[_Known]) -> _Known:
        if operation not in _OPERATIONS:
            raise ArrangementError(
                f"bounds of '{function.name()}'", f"uses operation {operation}, whose range is not known here"
            )
        low, high = _OPERATIONS[operation](*[each.bounds for each in operands])
        if operation == ca.OP_DIV and any(operands[0] is part for part in operands[1].sum_of):
            low, high = np.maximum(low, 0.0), np.minimum(high, 1.0)
        if operation == ca.OP_FLOOR:
            undecided[...] |= np.broadcast_to(low != high, shape)
        summed = operation == ca.OP_ADD and all(each.compared for each in operands)
        return _Known((low, high), operation in (ca.OP_LE, ca.OP_LT), tuple(operands) if summed else ())

    with np.errstate(all="ignore"):
        values = fold(
            _graph(function),
            lambda argument, element: _Known(given[argument][element]),
            lambda value: _Known((np.array(value), np.array(value))),
            combined=combined,
        )
    for (output, nonzero), known in values.items():
        low, high = results[output]
        place = places[output][nonzero]
        low[..., place], high[..., place] = known.bounds
    return Enclosure(tuple(Range(low, high) for low, high in results), undecided)


@dataclass(frozen=True, eq=False)
class _Known:
    """Bounds of a value; whether it is the truth of a comparison, or of which two such truths it is the sum.

    A quotient p/(p + q) of two truths lies between zero and one: the slope of the greater of two numbers.
    """

    bounds: Bounds
    compared: bool = False
    sum_of: tuple[_Known, ...] = ()


def _dense_places(sparsity: ca.Sparsity) -> list[int]:
    """Return where each stored element stands in the column-wise dense matrix."""
    rows, columns = sparsity.get_triplet()
    return [row + sparsity.size1() * column for row, column in zip(rows, columns, strict=True)]


def _outward(low: Array, high: Array, units: int = 1) -> Bounds:
    below, above = -np.asarray(low), np.asarray(high)
    for _ in range(units):
        below, above = _next_above(below), _next_above(above)
    # No number is an infinite bound.
    return np.fmax(-below, -np.inf), np.fmin(above, np.inf)


def _next_above(value: Array) -> Array:
    """Return ``nextafter(value, inf)``, as integers and so five times as fast; of infinity no number."""
    above = value + np.zeros(np.shape(value) or 1)
    digits = above.view(np.int64)
    digits += 1 + 2 * (digits >> 63)
    return above.reshape(np.shape(value))


def _sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a sum and what rounding took from it, exactly."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _add(a: Bounds, b: Bounds) -> Bounds:
    (low, low_error), (high, high_error) = _sum(a[0], b[0]), _sum(a[1], b[1])
    wide = _outward(low, high)
    return np.where(low_error == 0.0, low, wide[0]), np.where(high_error == 0.0, high, wide[1])


def _negate(a: Bounds) -> Bounds:
    return -a[1], -a[0]


def multiply(a: Bounds, b: Bounds) -> Bounds:
    """Return the range of a product."""
    products = np.array(np.broadcast_arrays(a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]))
    zero = (a[0] == 0.0) | (a[1] == 0.0) | (b[0] == 0.0) | (b[1] == 0.0)
    low, high = np.min(products, axis=0), np.max(products, axis=0)
    # Products of whole numbers are exact: places in a table are counted so.
    whole = (a[0] == np.round(a[0])) & (a[1] == np.round(a[1])) & (b[0] == np.round(b[0]))
    whole &= (b[1] == np.round(b[1])) & (np.maximum(np.abs(low), np.abs(high)) < 2.0**52)
    wide = _outward_but_zero(low, high, zero)
    return np.where(whole, low, wide[0]), np.where(whole, high, wide[1])


def _outward_but_zero(low: Array, high: Array, zero: Mask) -> Bounds:
    """Return bounds rounded outward, but for a zero that is exact because an operand is zero."""
    wide = _outward(low, high)
    return np.where(zero & (low == 0.0), 0.0, wide[0]), np.where(zero & (high == 0.0), 0.0, wide[1])


def _inverse(a: Bounds) -> Bounds:
    low, high = _outward(1.0 / a[1], 1.0 / a[0])
    through = (a[0] <= 0.0) & (a[1] >= 0.0)
    return np.where(through, -np.inf, low), np.where(through, np.inf, high)


def _divide(a: Bounds, b: Bounds) -> Bounds:
    quotients = np.array(np.broadcast_arrays(a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1]))
    low, high = np.min(quotients, axis=0), np.max(quotients, axis=0)
    # Whole numbers that divide without remainder are exact: places in a table are counted so.
    whole = (a[0] == a[1]) & (b[0] == b[1]) & (low == np.round(low)) & (low * b[0] == a[0])
    whole &= (np.abs(a[0]) < 2.0**52) & (b[0] == np.round(b[0]))
    wide = _outward_but_zero(low, high, (a[0] == 0.0) | (a[1] == 0.0))
    low, high = np.where(whole, low, wide[0]), np.where(whole, high, wide[1])
    through = (b[0] <= 0.0) & (b[1] >= 0.0)
    return np.where(through, -np.inf, low), np.where(through, np.inf, high)


def _square(a: Bounds) -> Bounds:
    low, high = _outward(np.minimum(a[0] ** 2, a[1] ** 2), np.maximum(a[0] ** 2, a[1] ** 2))
    return np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.maximum(low, 0.0)), high


def _magnitude(a: Bounds) -> Bounds:
    high = np.maximum(np.abs(a[0]), np.abs(a[1]))
    return np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1]))), high


def _root(a: Bounds) -> Bounds:
    low, high = _outward(np.sqrt(np.maximum(a[0], 0.0)), np.sqrt(np.maximum(a[1], 0.0)))
    return np.maximum(low, 0.0), high


def _rising(function: Callable[[Array], Array]) -> Callable[[Bounds], Bounds]:
    """Return the range of a function that never falls."""

    def of(a: Bounds) -> Bounds:
        return _outward(function(a[0]), function(a[1]), ELEMENTARY)

    return of


def _wave(function: Callable[[Array], Array]) -> Callable[[Bounds], Bounds]:
    """Return the range of a function whose slope is never steeper than one and which stays within ±1."""

    def of(a: Bounds) -> Bounds:
        middle = (a[0] + a[1]) / 2.0
        half = np.nextafter(np.maximum(a[1] - middle, middle - a[0]), np.inf)
        at = function(middle)
        low, high = _outward(at - half, at + half, 2 * ELEMENTARY)
        return np.maximum(low, -1.0), np.minimum(high, 1.0)

    return of


def _truth(never: Mask, always: Mask) -> Bounds:
    return np.where(always, 1.0, 0.0), np.where(never, 0.0, 1.0)


def _equal(a: Bounds, b: Bounds) -> Bounds:
    apart = (a[0] > b[1]) | (a[1] < b[0])
    return _truth(apart, (a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]))


def _not(a: Bounds) -> Bounds:
    return _truth((a[0] > 0.0) | (a[1] < 0.0), (a[0] == 0.0) & (a[1] == 0.0))


def _and(a: Bounds, b: Bounds) -> Bounds:
    return np.minimum(a[0], b[0]), np.minimum(a[1], b[1])


def _or(a: Bounds, b: Bounds) -> Bounds:
    return np.maximum(a[0], b[0]), np.maximum(a[1], b[1])


def _where(a: Bounds, b: Bounds) -> Bounds:
    """Return the range of: b where a is not zero, else zero."""
    never, always = (a[0] == 0.0) & (a[1] == 0.0), (a[0] > 0.0) | (a[1] < 0.0)
    low = np.where(never, 0.0, np.where(always, b[0], np.minimum(b[0], 0.0)))
    return low, np.where(never, 0.0, np.where(always, b[1], np.maximum(b[1], 0.0)))


def _power(a: Bounds, b: Bounds) -> Bounds:
    if np.all(b[0] == b[1]) and np.all(b[0] == np.round(b[0])):
        results = np.array([_whole_power(a, int(n)) for n in np.unique(b[0])])
        return np.min(results[:, 0], axis=0), np.max(results[:, 1], axis=0)
    positive = (np.maximum(a[0], 0.0), np.maximum(a[1], 0.0))
    return _rising(np.exp)(multiply(b, _rising(np.log)(positive)))


def _whole_power(a: Bounds, n: int) -> Bounds:
    if n < 0:
        return _inverse(_whole_power(a, -n))
    if n == 0:
        return np.ones_like(a[0]), np.ones_like(a[1])
    half = _square(_whole_power(a, n // 2)) if n > 1 else (np.ones_like(a[0]), np.ones_like(a[1]))
    return multiply(half, a) if n % 2 else half


_OPERATIONS: dict[int, Callable[..., Bounds]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: _add, ca.OP_SUB: lambda a, b: _add(a, _negate(b)), ca.OP_MUL: multiply, ca.OP_DIV: _divide,
    ca.OP_NEG: _negate, ca.OP_SQ: _square, ca.OP_INV: _inverse, ca.OP_SQRT: _root, ca.OP_FABS: _magnitude,
    ca.OP_TWICE: lambda a: (2.0 * a[0], 2.0 * a[1]),
    ca.OP_FMIN: _and, ca.OP_FMAX: _or, ca.OP_AND: _and, ca.OP_OR: _or, ca.OP_NOT: _not,
    ca.OP_FLOOR: lambda a: (np.floor(a[0]), np.floor(a[1])),
    ca.OP_CEIL: lambda a: (np.ceil(a[0]), np.ceil(a[1])),
    ca.OP_SIGN: lambda a: (np.sign(a[0]), np.sign(a[1])),
    ca.OP_EQ: _equal, ca.OP_NE: lambda a, b: _not(_equal(a, b)),
    ca.OP_LT: lambda a, b: _truth(a[0] >= b[1], a[1] < b[0]),
    ca.OP_LE: lambda a, b: _truth(a[0] > b[1], a[1] <= b[0]),
    ca.OP_IF_ELSE_ZERO: _where, ca.OP_POW: _power, ca.OP_CONSTPOW: _power,
    ca.OP_EXP: _rising(np.exp), ca.OP_EXPM1: _rising(np.expm1), ca.OP_LOG: _rising(np.log),
    ca.OP_LOG1P: _rising(np.log1p), ca.OP_TANH: _rising(np.tanh), ca.OP_SINH: _rising(np.sinh),
    ca.OP_ATAN: _rising(np.arctan), ca.OP_ASIN: _rising(np.arcsin), ca.OP_ASINH: _rising(np.arcsinh),
    ca.OP_ERF: _rising(np.vectorize(math.erf, otypes=[float])),
    ca.OP_SIN: _wave(np.sin), ca.OP_COS: _wave(np.cos),
}  # fmt: skip
