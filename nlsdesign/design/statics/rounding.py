"""Rounds the corners of a law: Newton's method goes round in circles at a knot where the stiffness jumps.

The instructions of a CasADi function are read one by one and written again, with

    max(a, b) = (a + b + |a − b|)/2,  min(a, b) = (a + b − |a − b|)/2,  |v| ≈ √(v² + w²),

where w is a share of the largest |v| that occurs. Everything else stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ...model.graph import applied, as_results, fold, read_graph

_CORNERS = (ca.OP_FMAX, ca.OP_FMIN, ca.OP_FABS)


def has_corners(function: ca.Function) -> bool:
    """Tell whether a function of SX contains a maximum, minimum or absolute value."""
    return any(step.operation in _CORNERS for step in read_graph(function).steps)


def rounded(function: ca.Function, samples: list[Array], share: float) -> ca.Function:
    """Return a function of SX with all corners rounded.

    ``samples``: for each argument typical values, shape (argument, samples) or (argument,).
    """
    arguments = [ca.SX.sym(function.name_in(i), function.size1_in(i)) for i in range(function.n_in())]
    _, distances = _rewritten(function, arguments, [])
    if not distances:
        return function
    sampled = np.array(ca.Function("distances", arguments, [ca.vertcat(*distances)])(*samples))
    widths = [share * float(np.max(np.abs(row))) for row in sampled]
    results, _ = _rewritten(function, arguments, widths)
    return ca.Function(function.name(), arguments, results)


def _rewritten(
    function: ca.Function, arguments: list[Expression], widths: list[float]
) -> tuple[list[Expression], list[Expression]]:
    """Return the results, with corners rounded where widths are given, and the distances from the corners."""
    distances: list[Expression] = []

    def written(operation: int, operands: Sequence[Expression]) -> Expression:
        if operation not in _CORNERS:
            return applied(operation, operands)
        a, b = operands if len(operands) == 2 else (operands[0], ca.SX(0))
        width = widths[len(distances)] if widths else 0.0
        distances.append(a - b)
        return _corner(operation, a, b, width)

    values = fold(read_graph(function), lambda i, k: arguments[i].nz[k], ca.SX, combined=written)
    return as_results(function, values), distances


def _corner(code: int, a: Expression, b: Expression, width: float) -> Expression:
    away = a - b
    size = ca.sqrt(away**2 + width**2) if width > 0.0 else ca.fabs(away)
    if code == ca.OP_FABS:
        return size
    return (a + b + size) / 2 if code == ca.OP_FMAX else (a + b - size) / 2
