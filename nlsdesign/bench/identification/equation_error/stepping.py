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
import scipy

from ....foundation.symbolic import Expression

_HALVINGS = 8
_SHORT = 200
_PARTS = 4
_GAMMA = 1.0 - 0.5**0.5
_SHORT_STEPS, _GUESSES = 4, 1
STIFF = 2.0
"""A stage is stiff if the norm of its derivative times the step is above this."""


class BlockEquations(NamedTuple):
    """A block's expressions: f(x, v, p) and y(x, v, p), with v for all that neither state nor p enters."""

    state: Expression
    digested: Expression  # v, worked out once per record
    parameter: Expression  # p: those that are free
    now: Expression  # the delays at which v was read
    derivative: Expression
    output: Expression


class Stage(NamedTuple):
    """States that act on each other, and whether they do so linearly with constant coefficients."""

    states: list[int]
    linear: bool


def stages_of(derivative: Expression, state: Expression, moving: Expression) -> list[Stage]:
    """Return the stages, earlier ones first."""
    n = state.numel()
    coupled = np.array([[ca.depends_on(derivative[i], state[j]) for j in range(n)] for i in range(n)])
    count, label = scipy.sparse.csgraph.connected_components(coupled, directed=True, connection="strong")
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


def _is_short(expression: Expression) -> bool:
    """Tell whether an expression is cheap enough to be differentiated twice in every step."""
    return bool(
        ca.Function("f", [ca.vertcat(*ca.symvar(expression))], [expression]).n_instructions() < _SHORT
    )


def _placed(
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


class _Step(NamedTuple):
    """One step of the states: what they are later, and the mean output over it where that is asked for.

    ``tables`` are those of the exact steps, ``symbols`` stand for them; ``matrices`` are the derivatives of
    the stages that take theirs from the start of the record. ``guesses`` are symbols of iterates and what
    they stand for, earlier ones first.
    """

    later: Expression
    tables: Expression
    symbols: Expression
    matrices: Expression
    guesses: list[tuple[Expression, Expression]]
    near: list[list[int]]  # the states of these stages


def _step(
    e: BlockEquations,
    stages: Sequence[Stage],
    stiff: Sequence[bool],
    *,
    right: Expression,
    h: Expression,
    mean: bool,
) -> _Step:
    """Return a step of length ``h`` to the samples ``right``, stage after stage.

    With ``mean`` it gives out the mean of the output over a stiff stage's short steps as well.
    """
    tables, symbols, matrices, outputs, near = [], [], [], [], []
    guesses: list[tuple[Expression, Expression]] = []
    new = ca.SX(e.state)
    for stage, fast in zip(stages, stiff, strict=True):
        inner = ca.SX(ca.vertcat(*[e.state[i] for i in stage.states]))
        rate = ca.SX(ca.vertcat(*[e.derivative[i] for i in stage.states]))
        n, ends = inner.numel(), (ca.vertcat(e.state, e.digested), ca.vertcat(new, right))
        at = _placed(rate, (e.state, e.digested), stage.states)
        if stage.linear:
            table = ca.SX.sym("table", n, 3 * n)
            tables.append(ca.vec(ca.densify(exact_step(ca.jacobian(rate, inner), h))))
            symbols.append(ca.vec(table))
            zero = ca.SX.zeros(n)
            later = table @ ca.vertcat(inner, at(zero, ends[0]), at(zero, ends[1]))
        elif fast:
            short_steps = implicit_steps(at, inner, ends, h)
            later = short_steps.states[-1]
            guesses += zip(short_steps.guess, short_steps.guessed, strict=True)
            seen, count = _placed(e.output, (e.state, e.digested), stage.states), len(short_steps.states)
            corners = [ends[0] + (ends[1] - ends[0]) * ((k + 1) / count) for k in range(count)]
            outputs += [seen(x, v) / count for x, v in zip(short_steps.states, corners, strict=True)]
        else:
            w = None if _is_short(rate) else ca.SX.sym("w", n, n)
            matrices += [] if w is None else [ca.vec(w)]
            near += [] if w is None else [stage.states]
            later = rosenbrock_step(at, inner, ends, w, h)
        for k, i in enumerate(stage.states):
            new[i] = later[k]
    later = ca.vertcat(new, sum(outputs, start=ca.SX(0))) if mean else new
    return _Step(later, _column(tables), _column(symbols), _column(matrices), guesses, near)


def step_functions(
    e: BlockEquations, stages: Sequence[Stage], stiff: Sequence[bool], *, mean: bool
) -> tuple[list[ca.Function], list[list[int]]]:
    """Return the functions of a step, and the states of the stages that take their derivative at its start.

    These are the tables of the exact steps over the parameters, the step, its slopes by the states at its
    beginning and by the free parameters, column after column, and what carries the derivatives of the states
    on. With ``mean`` the mean output over a stiff step goes with the states.
    """
    h, free, right = ca.SX.sym("h"), ca.vertcat(e.parameter, e.now), ca.SX.sym("right", e.digested.shape)
    step = _step(e, stages, stiff, right=right, h=h, mean=mean)
    dependence = ca.jacobian(step.tables, e.parameter)
    prepare = ca.Function("tables", [free, h], [ca.densify(ca.horzcat(step.tables, dependence))])
    along = ca.SX.sym("along", *dependence.shape)
    by_table = ca.jacobian(step.later, step.symbols) @ ca.project(along, dependence.sparsity())
    by = ca.horzcat(ca.jacobian(step.later, e.state), ca.jacobian(step.later, e.parameter) + by_table)
    columns = [step.later, ca.vec(ca.densify(by))]
    # Backwards: each symbol stands for an expression of those before it.
    for symbol, value in reversed(step.guesses):
        columns = ca.substitute(columns, [symbol], [value])
    before = ca.vertcat(e.state, ca.SX.sym("before")) if mean else e.state
    constant = ca.vertcat(free, step.symbols, ca.vec(along), step.matrices, h)
    given = [before, e.digested, right, constant]
    named = zip(("step", "slopes"), columns, strict=True)
    one, slopes = (ca.Function(name, given, [ca.cse(ca.densify(column))]) for name, column in named)
    # The derivatives of the states one step later.
    size = e.state.numel()
    before, by = (ca.SX.sym(name, size, e.parameter.numel()) for name in ("before", "by_parameter"))
    by_state = ca.SX.sym("by_state", size, size)
    both = ca.vertcat(ca.vec(by_state), ca.vec(by))
    carried = ca.Function("carried", [ca.vec(before), both], [ca.vec(by_state @ before + by)])
    return [prepare, one, slopes, carried], step.near


def _column(items: Sequence[Expression]) -> Expression:
    return ca.SX(ca.vertcat(*items)) if items else ca.SX(0, 1)
