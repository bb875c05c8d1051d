"""What an adaptive observer makes of its first reading and of one after a gap, and what it expects next."""

from __future__ import annotations

import casadi as ca

from ....foundation.symbolic import Expression
from ..scheduling.first_reading import at_rest
from .filter_equations import FilterEquations


def expected_inputs(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> what is expected of each input: of the angle what the filter predicts.

    Parameters
    ----------
    filter_
        Its equations.
    """
    memory, slow, _, arguments = _symbols(filter_)
    predicted = ca.SX(arguments[1])
    predicted[0] = filter_.expected_states(memory, slow)[filter_.angle]
    return ca.Function("expected", arguments, [predicted])


def first_states(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> the states of a machine that rests at its first reading, and after a gap.

    What has been learned stays: after a gap only the angle follows the reading.

    Parameters
    ----------
    filter_
        Its equations.
    """
    memory, slow, state, arguments = _symbols(filter_)
    n, count, inner = filter_.n, filter_.slow, filter_.step.inner
    angle, none = arguments[1][0], ca.SX.zeros(count, 1)
    following = filter_.matrix("next", n, n + 1 + len(filter_.plant.rows), none)
    prior = filter_.matrix("prior", n, 1, none)
    offset = [following[i, filter_.angle] * angle + following[i, n] + prior[i] for i in range(inner)]
    rest = at_rest([[following[i, j] for j in range(inner)] for i in range(inner)], offset)
    begun, resumed, at = ca.SX(state), ca.SX(state), ca.SX.zeros(n, 1)
    for i in range(inner):
        at[i] = rest[i]
    at[filter_.angle] = angle
    begun[:n] = at - prior
    if inner:
        begun[:n] -= ca.mtimes(filter_.matrix("coupling", n, inner, none), at[:inner])
    resumed[filter_.angle] += angle - filter_.expected_states(memory, slow)[filter_.angle]
    followed = n + count + 1
    begun[followed], resumed[followed] = angle, angle
    return ca.Function("begin", arguments, [begun, resumed])


def _symbols(filter_: FilterEquations) -> tuple[Expression, Expression, Expression, list[Expression]]:
    """Return memory, slow states, all states, and the arguments (x, u, p, w) of functions of a sample."""
    size = filter_.n + filter_.slow
    memory, slow = ca.SX.sym("memory", filter_.n), ca.SX.sym("slow", filter_.slow)
    others = ca.SX.sym("others", 2 + size * (size + 1) // 2)
    state = ca.SX(ca.vertcat(memory, slow, others))
    inputs = ca.SX.sym("u", 1 + len(filter_.plant.inputs))
    return memory, slow, state, [state, inputs, ca.SX(0, 1), filter_.w]
