"""Symbolic building blocks; every expression of the package is CasADi SX.

Models are small scalar networks, for which SX gives flat C code, cheap exact derivatives and free
substitution. This module adds what SX lacks: splines with symbolic coefficients, implicit scalar equations,
and a memory for what was built from them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, lru_cache, wraps
from typing import ParamSpec, TypeAlias, TypeVar

import casadi as ca
import numpy as np

from .arrays import Mask

Expression: TypeAlias = ca.SX
P = ParamSpec("P")
T = TypeVar("T")

NEWTON_STEPS = 24
"""Number of iterations of an implicit scalar equation; the worst one halves the bracket."""


def symbol(name: str) -> Expression:
    """Return a scalar symbol."""
    return ca.SX.sym(name)


def depends(expression: Expression, on: Expression) -> bool:
    """Tell whether an expression contains any of the symbols."""
    return bool(ca.depends_on(expression, on))


def dependence(column: Expression, on: Expression) -> Mask:
    """Return which items of a column contain which symbols, shape (items, symbols)."""
    return np.asarray(ca.DM(ca.jacobian_sparsity(column, on), 1.0).full() > 0.0)


def positive_part(value: Expression, width: Expression | float) -> Expression:
    """Return the smooth positive part, C∞, exact to ``width``·ln 2 at zero.

    softplus(v) = w·ln(1 + e^(v/w)), written so that it neither overflows nor cancels.
    """
    return ca.fmax(value, 0) + width * ca.log1p(ca.exp(-ca.fabs(value) / width))


def smooth_sign(value: Expression, width: Expression | float) -> Expression:
    """Return tanh(v/w), a C∞ approximation of the sign function."""
    return ca.tanh(value / width)


def _selected(hits: Sequence[Expression], rows: Sequence[Sequence[Expression]]) -> list[Expression]:
    """Return the row whose hit is 1, item by item; SX cannot be indexed by an expression."""
    return [
        sum((ca.if_else(hit, item, 0) for hit, item in zip(hits, items, strict=True)), start=ca.SX(0))
        for items in zip(*rows, strict=True)
    ]


def _windows(values: Sequence[Expression], width: int, at: Expression) -> list[Expression]:
    """Return the ``width`` values from number ``at`` on, selected in two stages: block, then inside.

    Two stages of about √n choices take far fewer operations than one of n.
    """
    starts = len(values) - width + 1
    block = max(1, math.isqrt(starts))
    blocks = -(-starts // block)
    padded = [*values, *[ca.SX(0)] * (blocks * block + width - 1 - len(values))]
    number = ca.floor(at / block)
    coarse = _selected(
        [number == k for k in range(blocks)],
        [padded[k * block : (k + 1) * block + width - 1] for k in range(blocks)],
    )
    inside = at - block * number
    return _selected([inside == k for k in range(block)], [coarse[k : k + width] for k in range(block)])


def _span(coefficients: Sequence[Expression], u: Expression) -> tuple[Expression, Expression]:
    """Return the number of the span in which u lies and the place in it, in [0, 1] on the whole spline."""
    number = ca.fmin(ca.fmax(ca.floor(u), 0), len(coefficients) - 4)
    return number, u - number


def uniform_spline(
    coefficients: Sequence[Expression], lower: float, step: Expression | float, at: Expression
) -> Expression:
    """Evaluate a uniform cubic B-spline with symbolic coefficients.

    ``coefficients``: n coefficients; the knots of the n − 3 spans start at ``lower``. ``at``: argument in
    [lower, lower + (n − 3)·step]; beyond, the polynomial of the last span continues.
    """
    value: Expression = _spline(len(coefficients))(ca.vertcat(*coefficients), (at - lower) / step)
    return value


def uniform_spline_integral(
    coefficients: Sequence[Expression], lower: float, step: Expression | float, at: Expression
) -> Expression:
    """Evaluate the integral from ``lower`` of :func:`uniform_spline`, exactly."""
    integral = _spline_integral(len(coefficients))
    value: Expression = step * integral(ca.vertcat(*coefficients), (at - lower) / step)
    return value


# CasADi writes a function into an expression hundreds of times as fast as it is written term by term.


@cache
def _spline(count: int) -> ca.Function:
    """Return a spline of so many coefficients and unit step as a function of these and of the place."""
    column, u = ca.SX.sym("coefficient", count), ca.SX.sym("u")
    coefficients = ca.vertsplit(column)
    number, r = _span(coefficients, u)
    a, b, c, d = _windows(coefficients, 4, number)
    q = 1 - r
    value = (a * q**3 + b * (4 - 3 * r * r * (2 - r)) + c * (4 - 3 * q * q * (2 - q)) + d * r**3) / 6
    return ca.Function("spline", [column, u], [value])


@cache
def _spline_integral(count: int) -> ca.Function:
    """Return the integral of such a spline from its first knot, likewise."""
    column, u = ca.SX.sym("coefficient", count), ca.SX.sym("u")
    coefficients = ca.vertsplit(column)
    number, r = _span(coefficients, u)
    a, b, c, d = _windows(coefficients, 4, number)
    q = 1 - r
    # Sums of the coefficients whose basis functions lie completely to the left of the span.
    sums = [ca.SX(0)]
    for each in coefficients[: len(coefficients) - 4]:
        sums.append(sums[-1] + each)
    (left,) = _windows(sums, 1, number)
    inside = a * (24 - q**4) + b * (12 + _half_bump(r)) + c * (12 - _half_bump(q)) + d * r**4
    before = 23 * coefficients[0] + 12 * coefficients[1] + coefficients[2]
    return ca.Function("spline_integral", [column, u], [left + (inside - before) / 24])


def _half_bump(r: Expression) -> Expression:
    """Return 24 times the integral of the cardinal cubic B-spline from 0 to r, for r in [0, 1]."""
    return r * (16 - r * r * (8 - 3 * r))


def _linear_solution(residual: Expression, unknown: Expression) -> Expression | None:
    slope = ca.jacobian(residual, unknown)
    if depends(slope, unknown):
        return None
    return -ca.substitute(residual, unknown, ca.SX(0)) / slope


def solve_monotone(
    residual: Callable[[Expression], Expression], unknown: Expression, guess: Expression
) -> Expression:
    """Solve g(z) = 0 for a monotonically increasing g, symbolically where g is linear.

    Otherwise a bracketed Newton iteration of fixed length is written out, so that the result is a plain
    expression with a fixed bound of work: it differentiates and becomes C like any other. A Newton step that
    does not fall strictly inside the bracket is replaced by bisection, because Newton's method can cycle
    where g is flat, steep and flat again. The last step starts from the best point and is never replaced, so
    the derivative is that of the implicit function.
    """
    g = residual(unknown)
    exact = _linear_solution(g, unknown)
    if exact is not None:
        return exact
    free = [s for s in ca.symvar(g) if not ca.is_equal(s, unknown)]
    value_and_slope = ca.Function("g", [unknown, *free], [g, ca.jacobian(g, unknown)])
    z, low, high = guess, ca.SX(-math.inf), ca.SX(math.inf)
    best, least = guess, ca.SX(math.inf)
    for _ in range(NEWTON_STEPS):
        value, slope = value_and_slope.call([z, *free])
        closer = ca.fabs(value) <= least
        best, least = ca.if_else(closer, z, best), ca.if_else(closer, ca.fabs(value), least)
        low, high = ca.if_else(value <= 0, z, low), ca.if_else(value >= 0, z, high)
        newton = z - value / _not_zero(slope)
        # A finite middle while one side of the bracket is still open.
        middle = (ca.fmax(low, -1e30) + ca.fmin(high, 1e30)) / 2
        z = ca.if_else(ca.logic_and(newton > low, newton < high), newton, middle)
    value, slope = value_and_slope.call([best, *free])
    return best - value / _not_zero(slope)


def _not_zero(slope: Expression) -> Expression:
    # Where g is flat, as between two slack cables, any point is a root and the step is zero.
    return ca.if_else(slope > 0, slope, 1)


def remembered(count: int) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Mark a function whose results cannot change: the last of them are handed out again."""

    def around(function: Callable[P, T]) -> Callable[P, T]:
        last: Callable[..., T] = lru_cache(maxsize=count)(function)

        @wraps(function)
        def call(*arguments: P.args, **named: P.kwargs) -> T:
            # A list counts as it is now.
            given = [
                tuple(each) if isinstance(each, list) else each for each in (*arguments, *named.values())
            ]
            try:
                hash(tuple(given))
            except TypeError:  # a dictionary, an array
                return function(*arguments, **named)
            count = len(arguments)
            return last(*given[:count], **dict(zip(named, given[count:], strict=True)))

        return call

    return around
