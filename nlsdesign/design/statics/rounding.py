"""Rounds the corners of a law: Newton's method goes round in circles at a knot where the stiffness jumps.

The instructions of a CasADi function are read one by one and written again, with

    max(a, b) = (a + b + |a − b|)/2,  min(a, b) = (a + b − |a − b|)/2,  |v| ≈ √(v² + w²),

where w is a share of the largest |v| that occurs. Everything else stays as it is.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression

_CORNERS = (ca.OP_FMAX, ca.OP_FMIN, ca.OP_FABS)


def has_corners(function: ca.Function) -> bool:
    """Tell whether a function of SX contains a maximum, minimum or absolute value."""
    return any(function.instruction_id(k) in _CORNERS for k in range(function.n_instructions()))


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
    results = [ca.SX.zeros(function.sparsity_out(i)) for i in range(function.n_out())]
    work: dict[int, Expression] = {}
    distances: list[Expression] = []
    for k in range(function.n_instructions()):
        code, out, into = (
            function.instruction_id(k),
            function.instruction_output(k),
            function.instruction_input(k),
        )
        if code == ca.OP_OUTPUT:
            results[out[0]].nz[out[1]] = work[into[0]]
        elif code == ca.OP_INPUT:
            work[out[0]] = arguments[into[0]].nz[into[1]]
        elif code == ca.OP_CONST:
            work[out[0]] = ca.SX(function.instruction_constant(k))
        elif code in _CORNERS:
            a = work[into[0]]
            b = ca.SX(0) if code == ca.OP_FABS else work[into[1]]
            width = widths[len(distances)] if widths else 0.0
            distances.append(a - b)
            work[out[0]] = _corner(code, a, b, width)
        else:
            operands = [work[i] for i in into]
            work[out[0]] = (ca.SX.binary if len(operands) == 2 else ca.SX.unary)(code, *operands)
    return results, distances


def _corner(code: int, a: Expression, b: Expression, width: float) -> Expression:
    away = a - b
    size = ca.sqrt(away**2 + width**2) if width > 0.0 else ca.fabs(away)
    if code == ca.OP_FABS:
        return size
    return (a + b + size) / 2 if code == ca.OP_FMAX else (a + b - size) / 2
