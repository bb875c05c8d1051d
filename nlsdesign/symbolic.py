"""Symbolic building blocks; every expression of the house is CasADi SX.

SX was chosen over MX once and for all: models are small scalar networks, SX gives flat C code, cheap
exact derivatives and free substitution. What SX lacks (splines with symbolic coefficients, implicit
scalar equations) stands here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca

Expression: TypeAlias = ca.SX

NEWTON_STEPS = 24
"""Bound on the work of an implicit scalar equation; bracketed Newton halves at worst."""


def symbol(name: str) -> Expression:
    """Return a scalar symbol.

    Parameters
    ----------
    name
        Name shown in printed expressions.
    """
    return ca.SX.sym(name)


def depends(expression: Expression, on: Expression) -> bool:
    """Tell whether an expression contains any of the symbols.

    Parameters
    ----------
    expression
        Any shape.
    on
        Symbols.
    """
    return bool(ca.depends_on(expression, on))


def positive_part(value: Expression, width: Expression | float) -> Expression:
    """Return the smooth positive part, C∞, exact to ``width``·ln 2 at zero.

    softplus(v) = w·ln(1 + e^(v/w)), written so that it neither overflows nor cancels.

    Parameters
    ----------
    value
        Argument.
    width
        Width w of the rounded corner, in the unit of ``value``.
    """
    return ca.fmax(value, 0) + width * ca.log1p(ca.exp(-ca.fabs(value) / width))


def smooth_sign(value: Expression, width: Expression | float) -> Expression:
    """Return tanh(v/w), the C∞ stand-in of the sign function.

    Parameters
    ----------
    value
        Argument.
    width
        Argument at which 76 % of the step is reached, in the unit of ``value``.
    """
    return ca.tanh(value / width)


def _cubic_bump(u: Expression) -> Expression:
    """Return the cardinal cubic B-spline on (−2, 2); C², no branches."""
    a = ca.fmax(2 - ca.fabs(u), 0)
    b = ca.fmax(1 - ca.fabs(u), 0)
    return (a * a * a - 4 * b * b * b) / 6


def _cubic_bump_integral(u: Expression) -> Expression:
    """Return ∫ from −∞ to u of the cardinal cubic B-spline; C³."""
    a = ca.fmax(2 - ca.fabs(u), 0)
    b = ca.fmax(1 - ca.fabs(u), 0)
    tail = (a**4 - 4 * b**4) / 24
    return ca.if_else(u < 0, tail, 1 - tail)


def uniform_spline(
    coefficients: Sequence[Expression], lower: float, step: Expression | float, at: Expression
) -> Expression:
    """Evaluate a uniform cubic B-spline with symbolic coefficients.

    Parameters
    ----------
    coefficients
        n coefficients; the knots of the n − 3 spans start at ``lower``.
    lower
        First knot of the first whole span.
    step
        Distance of the knots.
    at
        Argument; the spline is whole on [lower, lower + (n − 3)·step].
    """
    u = (at - lower) / step
    return sum((c * _cubic_bump(u - (k - 1)) for k, c in enumerate(coefficients)), start=ca.SX(0))


def uniform_spline_integral(
    coefficients: Sequence[Expression], lower: float, step: Expression | float, at: Expression
) -> Expression:
    """Evaluate the integral from ``lower`` of :func:`uniform_spline`, exactly.

    Parameters
    ----------
    coefficients, lower, step, at
        As for :func:`uniform_spline`.
    """
    u = (at - lower) / step
    zero = ca.SX(0)
    terms = (
        c * (_cubic_bump_integral(u - (k - 1)) - _cubic_bump_integral(zero - (k - 1)))
        for k, c in enumerate(coefficients)
    )
    return step * sum(terms, start=ca.SX(0))


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
    expression with a fixed bound of work: it differentiates and becomes C like any other.

    Parameters
    ----------
    residual
        g as a function of the unknown.
    unknown
        The symbol to solve for.
    guess
        Starting point of the iteration.
    """
    g = residual(unknown)
    exact = _linear_solution(g, unknown)
    if exact is not None:
        return exact
    free = [s for s in ca.symvar(g) if not ca.is_equal(s, unknown)]
    value_and_slope = ca.Function("g", [unknown, *free], [g, ca.jacobian(g, unknown)])
    z, low, high = guess, ca.SX(-math.inf), ca.SX(math.inf)
    for _ in range(NEWTON_STEPS):
        value, slope = value_and_slope.call([z, *free])
        low, high = ca.if_else(value <= 0, z, low), ca.if_else(value >= 0, z, high)
        newton = z - value / slope
        inside = ca.logic_and(newton >= low, newton <= high)
        # A finite middle even while one side of the bracket is still open.
        middle = (ca.fmax(low, -1e30) + ca.fmin(high, 1e30)) / 2
        z = ca.if_else(inside, newton, middle)
    return z
