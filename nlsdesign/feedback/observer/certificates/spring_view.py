"""The spring as a certificate sees it: torque and inner states as functions of angle and parameters."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....foundation.errors import ArrangementError
from ....model import FlatModel
from ....model.transform import with_outputs, without_idle_states
from .intervals import Bounds, Range, enclose

Array = NDArray[np.float64]

NARROWEST = 1e-7
"""Width in rad below which a range of angles around the knot of a contour is not divided further."""


@dataclass(frozen=True, eq=False)
class SpringView:
    """ż = a·(r(θ) − z) for each inner state, and the torque τ(θ, z), with their slopes, all symbolic.

    Parameters
    ----------
    inner
        Names of the inner states z.
    uncertain
        Names of the parameters with a range.
    nominal, spread
        Their values and half ranges, shape (parameters,).
    rest
        ``casadi.Function`` (θ, z, p) -> (r, ∂r/∂θ, a).
    torque
        ``casadi.Function`` (θ, z, p) -> (τ, ∂τ/∂θ, ∂τ/∂z).
    rest_by_parameter, torque_by_parameter
        ``casadi.Function`` (θ, z, p) -> (∂r/∂p,) and (∂τ/∂p,).
    affine
        Whether the torque is affine in z.
    """

    inner: tuple[str, ...]
    uncertain: tuple[str, ...]
    nominal: Array
    spread: Array
    rest: ca.Function
    torque: ca.Function
    rest_by_parameter: ca.Function
    torque_by_parameter: ca.Function
    affine: bool

    def ranges(
        self, function: ca.Function, cells: Bounds, z: Array | None = None, *, whole: bool = False
    ) -> tuple[Range, ...]:
        """Return verified ranges of one of the functions over cells of the angle.

        Parameters
        ----------
        function
            One of the functions above.
        cells
            Lower and upper angles, shape (cells,).
        z
            Bounds of the inner states in each cell, shape (cells, inner, 2); zero if it is left out.
        whole
            Over the whole range of the parameters instead of at their nominal values.
        """
        spread = self.spread if whole else np.zeros_like(self.spread)
        held = np.zeros((1, len(self.inner), 2)) if z is None else z
        boxes: list[list[tuple[ArrayLike, ArrayLike]]] = [
            [cells],
            [(held[:, k, 0], held[:, k, 1]) for k in range(len(self.inner))],
            [(v - s, v + s) for v, s in zip(self.nominal, spread, strict=True)],
        ]
        return enclose(function, boxes).outputs

    def cells(self, edges: Array) -> Bounds:
        """Return cells of the angle, divided where a piece of a contour ends; without the narrowest ones.

        Parameters
        ----------
        edges
            Ascending, shape (n,).
        """
        low, high = edges[:-1], edges[1:]
        kept_low, kept_high = [], []
        empty = [(0.0, 0.0)] * len(self.inner)
        fixed = [(v, v) for v in self.nominal]
        pieces = ca.Function("pieces", self.torque.sx_in(), [self.torque(*self.torque.sx_in())[0]])
        while len(low):  # ends, since what is narrow is not divided
            undecided = enclose(pieces, [[(low, high)], empty, fixed]).undecided
            kept_low.append(low[~undecided])
            kept_high.append(high[~undecided])
            split = undecided & (high - low > NARROWEST)
            middle = (low[split] + high[split]) / 2.0
            low, high = np.concatenate([low[split], middle]), np.concatenate([middle, high[split]])
        low, high = np.concatenate(kept_low), np.concatenate(kept_high)
        order = np.argsort(low)
        return low[order], high[order]


def spring_view(
    model: FlatModel, inner: tuple[str, ...], *, estimate: str, angle: str, spreads: dict[str, float]
) -> SpringView:
    """Return the spring of a model as a certificate sees it.

    Parameters
    ----------
    model
        Continuous.
    inner
        Inner states, in the order of the observer.
    estimate, angle
        Torque and measured state.
    spreads
        Relative half range of each uncertain parameter by name.

    Raises
    ------
    ArrangementError
        If an inner state is led by anything but the angle, or is coupled to another one, or its rate of
        forgetting is not one number; or the torque depends on more than angle and inner states.
    """
    model = without_idle_states(with_outputs(model, [estimate, angle]), [estimate, angle])
    s, names = model.symbols(), [v.name for v in model.states]
    theta = s.state[names.index(angle)]
    places = [names.index(name) for name in inner]
    z = ca.vertcat(*[s.state[i] for i in places]) if places else ca.SX(0, 1)
    others = ca.vertcat(
        s.time, s.input, *[s.state[i] for i in range(len(names)) if i not in places], ca.SX(0, 1)
    )
    others = ca.vertcat(*[others[i] for i in range(others.numel()) if not ca.is_equal(others[i], theta)])
    rates = ca.vertcat(*[s.derivative[i] for i in places]) if places else ca.SX(0, 1)
    torque = ca.densify(s.output[0])
    for what, name in ((torque, estimate), *zip(ca.vertsplit(rates) if places else [], inner, strict=True)):
        if others.numel() and ca.depends_on(what, others):
            raise ArrangementError(
                f"torque bound, '{name}'",
                "depends on more than the measured angle and the inner states",
                next_step="a bound for every motion needs a spring that is led by the angle alone",
            )
    values = model.values
    uncertain = [n for n in spreads if spreads[n] > 0.0]
    p = ca.vertcat(*[s.parameter[list(values).index(n)] for n in uncertain]) if uncertain else ca.SX(0, 1)
    fixed = [i for i, n in enumerate(values) if n not in uncertain]
    numbers = ca.vertcat(*[s.parameter[i] for i in fixed])
    constants = ca.DM([list(values.values())[i] for i in fixed])

    def given(expression: ca.SX) -> ca.SX:
        return ca.densify(ca.substitute(expression, numbers, constants)) if fixed else ca.densify(expression)

    rest, forgetting = _rest(given(rates), theta, z, inner)
    torque = given(torque)
    slope = ca.jacobian(torque, z)

    def function(name: str, outputs: list[ca.SX]) -> ca.Function:
        return ca.Function(name, [theta, z, p], [ca.densify(each) for each in outputs], {"cse": True})

    return SpringView(
        inner=inner,
        uncertain=tuple(uncertain),
        nominal=np.array([values[n] for n in uncertain]),
        spread=np.array([abs(values[n]) * spreads[n] for n in uncertain]),
        rest=function("rest", [rest, ca.jacobian(rest, theta), forgetting]),
        torque=function("torque", [torque, ca.jacobian(torque, theta), slope]),
        rest_by_parameter=function("rest_by_parameter", [ca.jacobian(rest, p)]),
        torque_by_parameter=function("torque_by_parameter", [ca.jacobian(torque, p)]),
        affine=not places or not ca.depends_on(slope, z),
    )


def _rest(rates: ca.SX, theta: ca.SX, z: ca.SX, inner: tuple[str, ...]) -> tuple[ca.SX, ca.SX]:
    """Return where each inner state rests and how fast it goes there, from ż = a·(r(θ) − z)."""
    rest, forgetting = [], []
    led = ca.vertcat(theta, z)
    for i, name in enumerate(inner):
        slopes = ca.jacobian(rates[i], z)
        coupled = any(not slopes[j].is_zero() for j in range(z.numel()) if j != i)
        if coupled or ca.depends_on(slopes[i], led):
            raise ArrangementError(
                f"torque bound, '{name}'",
                "is coupled to another inner state, or forgets at a rate that depends on the angle",
                next_step="the contraction of the whole error is certified without this bound",
            )
        # A common factor, such as k/η, says how fast, not where: without it parameters do not cancel badly.
        bare = _without_factors(rates[i], led)
        start = ca.substitute(bare, z, ca.DM.zeros(z.numel()))
        rest.append(-start / ca.jacobian(bare, z[i]))
        forgetting.append(-slopes[i])
    return (ca.vertcat(*rest), ca.vertcat(*forgetting)) if rest else (ca.SX(0, 1), ca.SX(0, 1))


def _without_factors(expression: ca.SX, led: ca.SX) -> ca.SX:
    """Return an expression without the factors that do not depend on ``led``."""
    if expression.is_op(ca.OP_NEG) or expression.is_op(ca.OP_TWICE):
        return _without_factors(expression.dep(0), led)
    if expression.is_op(ca.OP_MUL) or expression.is_op(ca.OP_DIV):
        first, second = expression.dep(0), expression.dep(1)
        if not ca.depends_on(second, led):
            return _without_factors(first, led)
        if expression.is_op(ca.OP_MUL) and not ca.depends_on(first, led):
            return _without_factors(second, led)
    return expression
