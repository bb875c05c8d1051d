"""Elements in series: they share the effort, their motions add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ...foundation.symbolic import NEWTON_STEPS, Expression, depends, solve_monotone, symbol
from .element import Combination, Element, Scope, observed_effort


@dataclass(frozen=True, kw_only=True)
class Series(Combination):
    """Elements that share the effort; their motions add.

    Members that need the rate keep their own motion as a state, whose rate follows from the common
    effort. What is left of the motion belongs to the others; where these are several, their shares are
    algebraic unknowns of a monotone equation. If all members need the rate, so does the series.
    """

    @property
    def needs_rate(self) -> bool:
        """True if all members need the rate."""
        return all(member.needs_rate for _, member in self.members)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the common effort."""
        if self.needs_rate:
            return _flowing(list(self.members), scope, motion, rate)
        slow = [(n, m) for n, m in self.members if m.needs_rate]
        stiff = [(n, m) for n, m in self.members if not m.needs_rate]
        states = {name: _own_motion(member, scope.child(name)) for name, member in slow}
        rates = {name: symbol(f"{scope.path}.{name}.own_rate") for name, _ in slow}
        left = motion - sum(states.values(), start=ca.SX(0))
        left_rate = rate - sum(rates.values(), start=ca.SX(0))
        common = _shared(stiff, scope, left, left_rate)
        for name, member in slow:
            inside = scope.child(name)
            own = observed_effort(member, inside, states[name], rates[name])
            inside.derive(states[name], rates[name])
            scope.define(rates[name], _root(own, common, rates[name], inside))
        return common


def _own_motion(member: Element, scope: Scope) -> Expression:
    domain = member.domain
    return scope.state(domain.motion, domain.motion_unit, f"{domain.motion} of {scope.path}")


def _root(
    one: Expression, other: Expression, unknown: Expression, scope: Scope, guess: Expression | None = None
) -> Expression:
    """Return where one (rising) equals the other (falling).

    Where the root was iterated, the remainder relative to the size of both sides is recorded as a check.
    """
    residual = one - other
    solution = solve_monotone(
        lambda z: ca.substitute(residual, unknown, z), unknown, ca.SX(0) if guess is None else guess
    )
    if depends(ca.jacobian(residual, unknown), unknown):
        relative = residual / (1 + ca.fabs(one) + ca.fabs(other))
        scope.check(unknown.name(), ca.substitute(relative, unknown, solution))
    return solution


def _flowing(
    members: list[tuple[str, Element]], scope: Scope, motion: Expression, rate: Expression
) -> Expression:
    """Return the effort of a series in which every member needs the rate.

    The first member keeps its motion as a state, the rest takes what is left; equal effort gives the
    split of the rate.
    """
    name, first = members[0]
    inside = scope.child(name)
    if len(members) == 1:
        return observed_effort(first, inside, motion, rate)
    own = _own_motion(first, inside)
    own_rate = symbol(f"{inside.path}.own_rate")
    one = observed_effort(first, inside, own, own_rate)
    other = _flowing(members[1:], scope, motion - own, rate - own_rate)
    solution = _root(one, other, own_rate, inside)
    inside.derive(own, own_rate)
    scope.define(own_rate, solution)
    return ca.substitute(one, own_rate, solution)


def _shared(
    members: list[tuple[str, Element]], scope: Scope, motion: Expression, rate: Expression
) -> Expression:
    """Return the effort of members in series none of which needs the rate.

    The share of the first member is an algebraic unknown z of f₁(z) = f₂(e − z); its rate, where a law
    inside asks for it, follows from the time derivative of the same equation.
    """
    name, first = members[0]
    inside = scope.child(name)
    if len(members) == 1:
        return observed_effort(first, inside, motion, rate)
    if len(members) > 2:
        return _shared_by_many(members, scope, motion, rate)
    whole, whole_rate = symbol(f"{scope.path}.whole"), symbol(f"{scope.path}.whole_rate")
    share, share_rate = symbol(f"{inside.path}.share"), symbol(f"{inside.path}.share_rate")
    one = observed_effort(first, inside, share, share_rate)
    other = _shared(members[1:], scope, whole - share, whole_rate - share_rate)
    solution = _root(one, other, share, inside, whole / 2)
    if scope.rate_is_used(share_rate):
        moving = {share: share_rate, whole: whole_rate}
        drifts = scope.total_rate(one, moving), scope.total_rate(other, moving)
        scope.define(share_rate, _root(*drifts, share_rate, inside))
    scope.define(share, solution)
    scope.define(whole, motion)
    scope.define(whole_rate, rate)
    return ca.substitute(
        one, ca.vertcat(share, whole), ca.vertcat(ca.substitute(solution, whole, motion), motion)
    )


def _shared_by_many(
    members: list[tuple[str, Element]], scope: Scope, motion: Expression, rate: Expression
) -> Expression:
    """Return the effort of three or more members in series none of which needs the rate."""
    whole, whole_rate = symbol(f"{scope.path}.whole"), symbol(f"{scope.path}.whole_rate")
    insides = [scope.child(name) for name, _ in members]
    shares = [symbol(f"{inside.path}.share") for inside in insides]
    rates = [symbol(f"{inside.path}.share_rate") for inside in insides]
    laws = zip(members, insides, shares, rates, strict=True)
    efforts = [observed_effort(member, inside, z, v) for (_, member), inside, z, v in laws]
    solutions = ca.vertcat(*split(efforts, shares, whole))
    if any(depends(ca.jacobian(f, z), z) for f, z in zip(efforts, shares, strict=True)):
        first = efforts[0]
        for other, inside in zip(efforts[1:], insides[1:], strict=True):
            relative = (other - first) / (1 + ca.fabs(other) + ca.fabs(first))
            scope.check(f"{inside.path}.share", ca.substitute(relative, ca.vertcat(*shares), solutions))
    if any(scope.rate_is_used(v) for v in rates):
        pairs = zip(efforts, shares, rates, strict=True)
        drifts = [scope.total_rate(f, {z: v}) for f, z, v in pairs]
        for v, solution in zip(rates, split(drifts, rates, whole_rate), strict=True):
            scope.define(v, solution)
    for z, solution in zip(shares, ca.vertsplit(solutions), strict=True):
        scope.define(z, solution)
    scope.define(whole, motion)
    scope.define(whole_rate, rate)
    return ca.substitute(efforts[0], shares[0], ca.substitute(solutions[0], whole, motion))


def series(**members: Element) -> Series:
    """Put elements in series: same effort, motions add.

    Parameters
    ----------
    **members
        Elements by name.
    """
    return Series(members=tuple(members.items()))


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
