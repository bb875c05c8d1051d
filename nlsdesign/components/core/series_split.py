"""The split of one motion between several members that share the effort."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ...foundation.symbolic import NEWTON_STEPS, Expression, depends

_SOFTEST = 1e-9
"""Smallest slope relative to the largest that is believed; where a member is flat, it takes what is asked."""


def split(efforts: Sequence[Expression], shares: Sequence[Expression], whole: Expression) -> list[Expression]:
    """Solve f₁(z₁) = f₂(z₂) = …, Σzᵢ = e for rising fᵢ, in closed form where all are linear.

    Otherwise Newton's method on all shares at once is written out: with slopes kᵢ the common effort is
    F = Σ(fᵢ/kᵢ)/Σ(1/kᵢ) and the steps are (F − fᵢ)/kᵢ, which keep the sum. So the work grows with the
    number of members and not with its power. A step that goes beyond the minimum of the energy along itself
    is cut back, to half at least. The last step starts from the best point found and is never cut, so the
    derivative is that of the implicit function.
    """
    unknowns = ca.vertcat(*shares)
    stacked = ca.vertcat(*efforts)
    slopes = ca.vertcat(*[ca.jacobian(f, z) for f, z in zip(efforts, shares, strict=True)])
    if not depends(slopes, unknowns):
        flexible = 1 / slopes
        offsets = ca.substitute(stacked, unknowns, ca.SX.zeros(unknowns.shape))
        common = (whole + ca.dot(offsets, flexible)) / ca.sum1(flexible)
        return ca.vertsplit((common - offsets) * flexible)
    own = {z.element_hash() for z in shares}
    free = [s for s in ca.symvar(ca.vertcat(stacked, slopes)) if s.element_hash() not in own]
    law = ca.Function("law", [unknowns, *free], [stacked, slopes])
    only = ca.Function("only", [unknowns, *free], [stacked])
    at = ca.SX.ones(len(shares)) * whole / len(shares)
    best, least = at, ca.SX(ca.inf)
    for _ in range(NEWTON_STEPS):
        values, slope = law(at, *free)
        spread = ca.mmax(values) - ca.mmin(values)
        closer = spread <= least
        best, least = ca.if_else(closer, at, best), ca.if_else(closer, spread, least)
        step = _newton(values, slope)
        before, after = ca.dot(values, step), ca.dot(only(at + step, *free), step)
        share = ca.if_else(after > 0, ca.fmax(before / (before - after), 0.5), 1)
        at += ca.if_else(before < 0, share, 0) * step
    return ca.vertsplit(best + _newton(*law(best, *free)))


def _newton(values: Expression, slopes: Expression) -> Expression:
    steepest = ca.mmax(slopes)
    flexible = 1 / ca.fmax(slopes, ca.if_else(steepest > 0, _SOFTEST * steepest, 1))
    common = ca.dot(values, flexible) / ca.sum1(flexible)
    return (common - values) * flexible
