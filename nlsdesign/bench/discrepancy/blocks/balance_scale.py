"""In which scale a balance of efforts is judged: one that no hypothesis can change.

A balance, inertia times acceleration less all efforts, can be made small by making all its factors small. An
error of something that was measured cannot. So a balance is written as the error of a measured signal, times
the *declared* effort per unit of that signal, a constant:

1. Where the drive is measured: the error of the drive. With e(u) what a drive of u gives at standstill and b
   the balance, the model asks for the drive u + b/e'(u), to first order: its inverse along the tangent at the
   measured point. So the error is b/e'(u). A drive that saturates gives less and asks for more: the flatter
   it is, the larger its error. Where a drive is held at its limit there is no tangent; the straight line
   from zero to the measured point stands for it. Where e is proportional to u the tangent is that in motion,
   and the inverse exact: a gear with losses passes on another share of the drive in each direction.
2. Where another effort on the body is measured: the balance as it is, for its reading enters there.
3. Where motion alone is measured: the error of the acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.symbolic import Expression, depends

_NEAR_ZERO = 1e-9
"""Drive, in SI, below which the slope at zero stands for the straight line to the measured point."""
_INSIDE = 0.999
"""Share of the measured drive at which the tangent is taken."""
_LEAST_SLOPE = 0.1
"""Of that line, the least slope that is taken for a tangent: no error counts more than ten times."""


class BalanceTerms(NamedTuple):
    """A balance and what stands in it.

    Parameters
    ----------
    balance
        Inertia times acceleration less all efforts.
    derivative, state
        Of the states left in the block, columns.
    readings
        Symbols of all measured signals and their derivatives.
    parameter, declared
        Symbols and numbers.
    """

    balance: Expression
    derivative: Expression
    state: Expression
    readings: Expression
    parameter: Expression
    declared: Array


def scaled_balance(
    terms: BalanceTerms, *, drives: Sequence[Expression], efforts: Sequence[Expression], inertia: Expression
) -> tuple[Expression, float]:
    """Return a balance in the scale of what was measured, and the declared effort per unit of that.

    ``drives``: readings of what may drive the body; the first one that does is taken.
    """
    for reading in drives:
        given = _effort_at_standstill(terms, reading)
        slope = ca.substitute(ca.jacobian(given, reading), reading, ca.SX(0))
        declared = _declared(terms, slope)
        if declared == 0.0 or not np.isfinite(declared):
            continue
        tangent = ca.jacobian(given, reading)
        if not depends(tangent, reading):
            direct = depends(terms.balance, reading) and not _states_behind(terms, reading)
            in_motion = -ca.jacobian(terms.balance, reading) if direct else slope
            return terms.balance * (declared / in_motion), declared
        tiny = _NEAR_ZERO**2
        line = (given * reading + tiny * slope) / (reading * reading + tiny)
        # A record of what a limit lets through stands on the limit itself: the slope is that just below it.
        inside = ca.substitute(tangent, reading, _INSIDE * reading)
        share = ca.fmax(inside / slope, _LEAST_SLOPE * line / slope)
        share = ca.if_else(inside == 0, line / slope, share)
        return terms.balance * (declared / (slope * share)), declared
    if any(depends(terms.balance, reading) for reading in efforts):
        return terms.balance, 1.0
    declared = _declared(terms, inertia)
    return terms.balance * (declared / inertia), declared


def _effort_at_standstill(terms: BalanceTerms, reading: Expression) -> Expression:
    """Return the effort that a constant drive gives in the end, while nothing moves.

    States between the drive and its effort, of a delay or a winding, are taken where they rest.
    """
    behind = _states_behind(terms, reading)
    others = [symbol for symbol in ca.vertsplit(terms.readings) if symbol.name() != reading.name()]
    rest = ca.vertcat(*others, *[terms.state[i] for i in range(terms.state.numel()) if i not in behind])
    still = [terms.balance, ca.vertcat(ca.SX(0, 1), *[terms.derivative[i] for i in behind])]
    balance, rate = ca.substitute(still, [rest], [ca.SX.zeros(rest.shape)])
    if behind:
        inner = ca.vertcat(*[terms.state[i] for i in behind])
        nowhere = ca.SX.zeros(inner.shape)
        slope = ca.substitute(ca.jacobian(rate, inner), inner, nowhere)
        start = ca.substitute(rate, inner, nowhere)
        if bool(_singular(terms, ca.substitute(slope, reading, ca.SX(0)))):
            return ca.SX(0)
        balance = ca.substitute(balance, inner, -ca.solve(slope, start))
    return ca.substitute(balance, reading, ca.SX(0)) - balance


def _states_behind(terms: BalanceTerms, reading: Expression) -> list[int]:
    """Return the states that a drive reaches."""
    reached: list[int] = []
    frontier: list[Expression] = [reading]
    while frontier:
        symbol = frontier.pop()
        for i in range(terms.state.numel()):
            if i not in reached and depends(terms.derivative[i], symbol):
                reached.append(i)
                frontier.append(terms.state[i])
    return sorted(reached)


def _declared(terms: BalanceTerms, value: Expression) -> float:
    """Return a number that depends on parameters alone at their declared values."""
    return float(ca.Function("declared", [terms.parameter], [value])(terms.declared))


def _singular(terms: BalanceTerms, matrix: Expression) -> bool:
    values = ca.Function("slope", [terms.parameter], [ca.densify(matrix)])(terms.declared).full()
    return not np.all(np.isfinite(values)) or np.linalg.matrix_rank(values) < len(values)
