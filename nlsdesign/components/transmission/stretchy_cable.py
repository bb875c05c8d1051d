"""A cable that stretches, in series with what it pulls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, solve_monotone, symbol
from ..core.domain import TRANSLATION, Domain
from ..core.element import Combination, Scope
from ..core.part_numbers import parameter

_STEPS = 6


@dataclass(frozen=True, kw_only=True)
class StretchyCable(Combination):
    """An elastic cable in series with elements: F = C·(e − y) = ΣF(y), whose extension y is what is left.

    The same as ``series(cable=Spring(...), ...)``, but solved by six Newton steps from y = e, which is exact
    where the law inside is piecewise linear and softer than the cable; the remainder is checked. So it is
    four times cheaper in simulation and in C. Source: Hooke 1678.

    Raises
    ------
    ArrangementError
        If the force of an element depends directly on the rate.
    """

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION,)
    placing: ClassVar[str | None] = "put it behind the cam: through(cam, cable=...)"
    phenomena: ClassVar[frozenset[str]] = frozenset({"cable compliance"})

    stiffness: Quantity = parameter("N/m", "stiffness of the cable", minimum=1.0, maximum=1e12)

    def __post_init__(self) -> None:
        super().__post_init__()
        kind = type(self).__name__
        for name, member in self.members:
            if member.needs_rate:
                raise ArrangementError(
                    f"{kind} member '{name}'", "its force depends directly on the rate",
                    next_step="use series(cable=Spring(...), ...) inside pull_only(...) instead",
                )  # fmt: skip

    @property
    def needs_rate(self) -> bool:
        """False: the cable is a spring."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return C·(e − y)."""
        stiffness = scope.parameter("stiffness")
        whole, whole_rate = symbol(f"{scope.path}.whole"), symbol(f"{scope.path}.whole_rate")
        left, left_rate = symbol(f"{scope.path}.left"), symbol(f"{scope.path}.left_rate")
        inside, pull = self.inside(scope, left, left_rate), stiffness * (whole - left)
        residual = inside - pull
        solution = newton_root(residual, left, whole)
        relative = residual / (1 + ca.fabs(inside) + ca.fabs(pull))
        scope.check(f"{scope.path}.left", ca.substitute(relative, left, solution))
        if scope.rate_is_used(left_rate):
            # The rate follows from the time derivative of the same balance; dry friction inside bends it.
            drift = scope.total_rate(residual, {left: left_rate, whole: whole_rate})
            solved_rate = solve_monotone(lambda v: ca.substitute(drift, left_rate, v), left_rate, whole_rate)
            scope.define(left_rate, solved_rate)
        scope.define(left, solution)
        scope.define(whole, motion)
        scope.define(whole_rate, rate)
        return stiffness * (motion - ca.substitute(solution, whole, motion))


def newton_root(residual: Expression, unknown: Expression, start: Expression) -> Expression:
    """Return the root of a rising, piecewise smooth expression after a fixed number of Newton steps."""
    others = [s for s in ca.symvar(residual) if not ca.is_equal(s, unknown)]
    newton = ca.Function("newton", [unknown, *others], [unknown - residual / ca.jacobian(residual, unknown)])
    for _ in range(_STEPS):
        start = newton(start, *others)
    return start
