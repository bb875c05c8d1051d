"""Memory of the largest value so far."""

from __future__ import annotations

import casadi as ca

from ...foundation.symbolic import Expression
from ..core.element import Scope


def rising(
    scope: Scope, state: tuple[str, str, str], value: Expression, rate: Expression, width: Expression
) -> tuple[Expression, Expression]:
    """Return the greatest value so far, a state that is driven by the rate, and its own rate.

    The state follows the value up, behind it by ``width``·ln(1 + value/width), whatever the speed.
    """
    greatest = scope.state(*state)
    growth = (1 + ca.tanh((value - greatest) / (2 * width))) / 2 * ca.fmax(rate, 0)
    scope.derive(greatest, growth)
    return greatest, growth


def following(scope: Scope, state: tuple[str, str, str], value: Expression, time: Expression) -> Expression:
    """Return the largest value so far, at least the present one: ṁ = ⟨x − m⟩/τ."""
    memory = scope.state(*state)
    scope.derive(memory, ca.fmax(value - memory, 0) / time)
    return ca.fmax(memory, value)
