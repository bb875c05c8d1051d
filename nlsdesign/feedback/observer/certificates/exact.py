"""Exact rational arithmetic: what decides whether a matrix inequality holds. No rounding, no solver."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import product
from typing import TypeAlias

from ....foundation.arrays import Array

Matrix: TypeAlias = list[list[Fraction]]


def exact(values: Array | Sequence[Sequence[float]]) -> Matrix:
    """Return a matrix of floating-point numbers as the fractions that they are.

    ``values``: shape (n, m).
    """
    return [[Fraction(float(v)) for v in row] for row in values]


def times(a: Matrix, b: Matrix) -> Matrix:
    """Return a product.

    ``a``, ``b``: shapes (n, k) and (k, m).
    """
    columns = list(zip(*b, strict=True))
    return [[sum((x * y for x, y in zip(row, c, strict=True)), Fraction(0)) for c in columns] for row in a]


def transposed(a: Matrix) -> Matrix:
    """Return the transpose.

    ``a``: shape (n, m).
    """
    return [list(column) for column in zip(*a, strict=True)]


def combined(a: Matrix, b: Matrix, *, first: Fraction, second: Fraction) -> Matrix:
    """Return first·a + second·b."""
    return [[first * x + second * y for x, y in zip(r, s, strict=True)] for r, s in zip(a, b, strict=True)]


def identity(n: int) -> Matrix:
    """Return the identity."""
    return [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]


def is_positive_definite(a: Matrix) -> bool:
    """Return whether a symmetric matrix is positive definite, by LDLᵀ in fractions: all pivots positive.

    ``a``: shape (n, n); one that is not symmetric is not positive definite.
    """
    n, left = len(a), [list(row) for row in a]
    if any(a[i][j] != a[j][i] for i in range(n) for j in range(i)):
        return False
    for k in range(n):
        if left[k][k] <= 0:
            return False
        for i in range(k + 1, n):
            factor = left[i][k] / left[k][k]
            left[i] = [x - factor * y for x, y in zip(left[i], left[k], strict=True)]
    return True


def exponential_below(x: Fraction) -> Fraction:
    """Return a number not larger than e^(−x), for x ≥ 0, within 1e-25 of its size or so.

    Notes
    -----
    e^(−y) with y = x/m ≤ 1/2 is an alternating series with falling terms, so a sum that ends with a negative
    term is too small.
    """
    pieces = max(1, int(2 * x) + 1)
    y, term, total = x / pieces, Fraction(1), Fraction(1)
    for k in range(1, 20):
        term = term * y / k
        total = total - term if k % 2 else total + term
    return Fraction(total.limit_denominator(10**40)) ** pieces * (1 - Fraction(1, 10**25))


def corners(low: Sequence[float], high: Sequence[float]) -> list[tuple[float, ...]]:
    """Return the corners of a box; an edge without length gives one corner, not two."""
    return list(product(*[(a, b) if a != b else (a,) for a, b in zip(low, high, strict=True)]))
