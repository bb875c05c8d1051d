"""Steps of fixed length for models driven by samples: exact where the model is linear, L-stable elsewhere.

The states fall into stages: groups that act on each other, ordered so that each is driven by the inputs and
by earlier stages only. A stage that is linear with constant coefficients, ẋ = A(p)·x + b(t), takes an exact
step; between samples b runs linearly:

    x⁺ = φ₀(Ah)·x + h·(φ₁ − φ₂)(Ah)·b₀ + h·φ₂(Ah)·b₁

A stage whose own rates are faster than a sample, such as a stop that is hit, takes short implicit steps.
Any other takes a Rosenbrock step with a matrix W ≈ ∂f/∂x, second order whatever W is, L-stable if W is near:
the present derivative where that is cheap, else that at the start of the record.
Source: Hochbruck and Ostermann 2010 (φ functions); Verwer et al. 1999 (ROS2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from graphlib import TopologicalSorter
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.sparse.csgraph import connected_components

from ....foundation.symbolic import Expression

_HALVINGS = 8
_SHORT = 200
_PARTS = 4
_GAMMA = 1.0 - 0.5**0.5
_SHORT_STEPS, _GUESSES = 4, 1
STIFF = 2.0
"""A stage is stiff if the norm of its derivative times the step is above this."""


class Stage(NamedTuple):
    """States that act on each other, and whether they do so linearly with constant coefficients."""

    states: list[int]
    linear: bool


def stages_of(derivative: Expression, state: Expression, moving: Expression) -> list[Stage]:
    """Return the stages, earlier ones first."""
    n = state.numel()
    coupled = np.array([[ca.depends_on(derivative[i], state[j]) for j in range(n)] for i in range(n)])
    count, label = connected_components(coupled, directed=True, connection="strong")
    groups = [[i for i in range(n) if label[i] == k] for k in range(count)]
    acts_on = {
        k: {m for m in range(count) if m != k and coupled[np.ix_(groups[m], groups[k])].any()}
        for k in range(count)
    }
    order = TopologicalSorter(
        {k: {m for m in acts_on if k in acts_on[m]} for k in range(count)}
    ).static_order()
    ordered = []
    for k in order:
        inside = ca.vertcat(*[state[i] for i in groups[k]])
        slope = ca.jacobian(ca.vertcat(*[derivative[i] for i in groups[k]]), inside)
        ordered.append(Stage(groups[k], not ca.depends_on(slope, ca.vertcat(state, moving))))
    return ordered


def exact_step(matrix: Expression, length: Expression) -> Expression:
    """Return φ₀, h·(φ₁ − φ₂) and h·φ₂ of A·h side by side.

    The argument is halved eight times, there the (2, 3) Padé approximations with a common denominator are
    taken, which stay bounded for any decay, and then it is doubled again. Relative error below 1e-12 for
    ‖A·h‖ ≤ 4, and decaying with the mode beyond.

    ``matrix``: A, shape (n, n).
    """
    n = matrix.shape[0]
    one = ca.SX.eye(n)
    z = matrix * (length / 2**_HALVINGS)
    zz = z @ z
    below = one - 0.6 * z + 0.15 * zz - zz @ z / 60
    phi1 = ca.solve(below, one - z / 10 + zz / 60)
    phi2 = ca.solve(below, one / 2 - z * (2 / 15) + zz / 60)
    phi0 = one + z @ phi1
    for _ in range(_HALVINGS):
        phi2 = (phi1 @ phi1 + 2 * phi2) / 4
        phi1 = (phi0 + one) @ phi1 / 2
        phi0 = phi0 @ phi0
    return ca.SX(ca.horzcat(phi0, length * (phi1 - phi2), length * phi2))


def rosenbrock_step(
    rate: Callable[[Expression, Expression], Expression],
    state: Expression,
    ends: tuple[Expression, Expression],
    w: Expression | None,
    length: Expression,
) -> Expression:
    """Return the state one step later.

    ``w``: any approximation of ∂f/∂x for one step; ``None`` for several shorter steps, each with its own
    derivative.
    """
    x, left, right, h = state, ends[0], ends[1], length
    if w is not None:
        return _stages(rate, (x, left, right), w, h)
    begin, end, at = (
        ca.SX.sym("begin", left.shape),
        ca.SX.sym("end", right.shape),
        ca.SX.sym("at", state.shape),
    )
    part, own = ca.SX.sym("part"), rate(at, begin)
    new = _stages(rate, (at, begin, end), ca.jacobian(own, at), part)
    step = ca.Function("part", [at, begin, end, part], [new], {"allow_free": True})
    free = step.free_sx()
    step = ca.Function("part", [at, begin, end, part, *free], [new])
    for k in range(_PARTS):
        corners = [left + (right - left) * (j / _PARTS) for j in (k, k + 1)]
        x = step(x, *corners, h / _PARTS, *free)
    return x


class ImplicitSteps(NamedTuple):
    """What :func:`implicit_steps` returns."""

    states: list[Expression]  # at the end of each short step; they contain guess symbols
    # guess, guessed: symbols of iterates, and what to put in for them, earlier ones first. Derivatives are
    # taken with the symbols in place: at the root the derivative of one more Newton step is that of the root
    # itself.
    guess: list[Expression]
    guessed: list[Expression]


def implicit_steps(
    rate: Callable[[Expression, Expression], Expression],
    state: Expression,
    ends: tuple[Expression, Expression],
    length: Expression,
) -> ImplicitSteps:
    """Return the states along short implicit Euler steps, each solved by two Newton iterations.

    These end at the root where the right-hand side is piecewise linear, as contact is; there the first goes
    to the wrong side of a stop and the second comes back. Nothing rebounds. First order.
    """
    (left, right), h = ends, length / _SHORT_STEPS
    at, old, now = (ca.SX.sym(n, x.shape) for n, x in (("at", state), ("old", state), ("now", left)))
    own, short = rate(at, now), ca.SX.sym("short")
    system = ca.SX.eye(state.numel()) - short * ca.jacobian(own, at)
    better = ca.cse(at - ca.solve(system, at - old - short * own))
    newton = ca.Function("newton", [at, old, now, short], [better], {"allow_free": True})
    free = newton.free_sx()
    newton = ca.Function("newton", [at, old, now, short, *free], [better])
    steps, x = ImplicitSteps([], [], []), state
    for k in range(1, _SHORT_STEPS + 1):
        corner = left + (right - left) * (k / _SHORT_STEPS)
        guess = x
        for _ in range(_GUESSES):
            guess = newton(guess, x, corner, h, *free)
        symbol = ca.SX.sym(f"guess_{k}", state.shape)
        x = newton(symbol, x, corner, h, *free)
        steps.states.append(x)
        steps.guess.append(symbol)
        steps.guessed.append(guess)
    return steps


def _stages(
    rate: Callable[[Expression, Expression], Expression],
    given: tuple[Expression, Expression, Expression],
    w: Expression,
    h: Expression,
) -> Expression:
    x, left, right = given
    system = ca.SX.eye(x.numel()) - _GAMMA * h * w
    first = ca.solve(system, rate(x, left))
    second = ca.solve(system, rate(x + h * first, right) - 2 * first)
    return x + h * (1.5 * first + 0.5 * second)


def is_short(expression: Expression) -> bool:
    """Tell whether an expression is cheap enough to be differentiated twice in every step."""
    return bool(
        ca.Function("f", [ca.vertcat(*ca.symvar(expression))], [expression]).n_instructions() < _SHORT
    )


def placed(
    value: Expression, symbols: tuple[Expression, Expression], states: Sequence[int]
) -> Callable[[Expression, Expression], Expression]:
    """Return an expression as a function of some states and of everything else, all states and samples."""
    state, digested = symbols

    def at(x: Expression, v: Expression) -> Expression:
        place = ca.SX(v)
        for k, i in enumerate(states):
            place[i] = x[k]
        return ca.SX(ca.substitute(value, ca.vertcat(state, digested), place))

    return at
