"""Where a model rests at a held angle, how large its variables are, and which law leaves its range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ConvergenceError, unknown_name
from ...foundation.quantity import with_unit
from ...foundation.symbolic import Expression, depends
from ...model import FlatModel
from ...model.flat import Symbols
from ...model.roles import measured_motion
from ...model.transform import named
from ...simulation.buffered import Buffered


def rate_state(model: FlatModel, angle: str, s: Symbols | None = None) -> str:
    """Return the name of the state that is the derivative of another one."""
    states = [v.name for v in model.states]
    if angle not in states:
        raise unknown_name("state", angle, states)
    s = s or model.symbols()
    rate = s.derivative[states.index(angle)]
    for i, name in enumerate(states):
        if ca.is_equal(rate, s.state[i]):
            return name
    raise ArrangementError(
        f"'{angle}'", "its derivative is not a state", next_step="choose the angle of a moving body"
    )


def rest_states(
    model: FlatModel,
    angles: Array,
    *,
    angle: str | None = None,
    consistent: Mapping[str, str] | None = None,
    unmoved: bool = False,
) -> Array:
    """Return the states in which everything rests while the angle is held, at many angles at once.

    ``model``: continuous; inputs are at their start values. ``angle``: state that is held, its rate at zero;
    by default the motion of the driven body. ``consistent``: states that have to agree with a signal of the
    same model, such as the extension of the published form with ``"spring.rubber.extension.geometric"``;
    state name to signal name. ``unmoved``: whether states that no state moves at standstill, as those of
    hysteresis that the speed leads, stay as they start; else they are an error.
    """
    return RestSolver(model, angle=angle, consistent=consistent, unmoved=unmoved)(model, angles)


def unmoved_states(model: FlatModel, rate: str) -> list[str]:
    """Return the states that no state moves at standstill: of hysteresis that the speed leads, of a clock."""
    s, names = model.symbols(), [v.name for v in model.states]
    still = ca.substitute(s.derivative, s.state[names.index(rate)], 0)
    return [
        name
        for name, moved in zip(names, ca.vertsplit(still), strict=True)
        if name != rate and not depends(moved, s.state)
    ]


class RestSolver:
    """Finds rest states of one model with many sets of numbers; its functions are built once.

    ``model``: continuous; inputs are at their start values.
    """

    def __init__(
        self,
        model: FlatModel,
        *,
        angle: str | None = None,
        consistent: Mapping[str, str] | None = None,
        unmoved: bool = False,
    ) -> None:
        angle = measured_motion(model, angle)
        names, tied = [v.name for v in model.states], dict(consistent or {})
        s = model.symbols()
        self._angle, self._rate = names.index(angle), names.index(rate_state(model, angle, s))
        held = {self._angle, self._rate, *(names.index(name) for name in tied)}
        known, arguments = named(model, s), [s.time, s.state, s.input, s.parameter]
        self._tied = [
            (names.index(name), ca.Function("follow", arguments, [known[signal]]))
            for name, signal in tied.items()
        ]
        if unmoved:
            held |= {names.index(name) for name in unmoved_states(model, names[self._rate])}
        self._free = free = [i for i in range(len(names)) if i not in held]
        rate = ca.vertcat(*[s.derivative[i] for i in free])
        slope = ca.jacobian(rate, ca.vertcat(*[s.state[i] for i in free])) if free else ca.SX(0, 0)
        self._newton = ca.Function("rate", arguments, [rate, ca.densify(slope)])

    def __call__(self, model: FlatModel, angles: Array) -> Array:
        """Return rest states, shape (n, states)."""
        x = np.tile(model.start(model.states), (len(angles), 1))
        x[:, self._angle] = angles
        x[:, self._rate] = 0.0
        p, u = model.start(model.parameters), model.start(model.inputs)
        for place, follow in self._tied:
            x[:, place] = evaluate_rows(follow, x, u, p)[0][:, 0]
        return _newton(self._newton, x, (u, p), self._free, model.name)


def typical_sizes(model: FlatModel, angles: Array, *, angle: str | None = None) -> dict[str, float]:
    """Return a typical size of every state and output over a range of angles, for scaling.

    Angle: the largest in the range. Other states: the largest of their rest values and of what they would
    jump to if the angle moved there at once from zero. Speed: that of a swing with this amplitude and the
    largest acceleration at rest. What stays zero has size one.

    ``angle``: name of the state that is swept; by default the motion of the driven body.
    """
    angle = measured_motion(model, angle)
    names = [v.name for v in model.states]
    speed = rate_state(model, angle)
    grid = np.linspace(0.0, float(np.max(np.abs(angles))), 65)
    rest = rest_states(model, grid, angle=angle)
    s = model.symbols()
    column = s.state[names.index(speed)]
    wanted = [s.derivative, ca.jacobian(s.derivative, column), s.output]
    rates, driven, outputs = evaluate_at(model, s, wanted, rest)
    steps = np.diff(grid)[:, None]
    jump = np.abs(np.cumsum((driven[1:] + driven[:-1]) / 2 * steps, axis=0)[-1])
    sizes = np.maximum(np.max(np.abs(rest), axis=0), jump)
    at, of = names.index(angle), names.index(speed)
    sizes[at] = grid[-1]
    sizes[of] = np.sqrt(grid[-1] * np.max(np.abs(rates[:, of])))
    result = {name: float(size) if size > 0.0 else 1.0 for name, size in zip(names, sizes, strict=True)}
    for i, v in enumerate(model.outputs):
        size = float(np.max(np.abs(outputs[:, i])))
        result.setdefault(v.name, size if size > 0.0 else 1.0)
    return result


def evaluate_at(model: FlatModel, s: Symbols, wanted: Sequence[Expression], states: Array) -> list[Array]:
    """Evaluate expressions in symbols of a model at many states; all else is at its start value."""
    dense = [ca.densify(each) for each in wanted]
    function = ca.Function("wanted", [s.time, s.state, s.input, s.parameter], dense)
    return evaluate_rows(function, states, model.start(model.inputs), model.start(model.parameters))


def evaluate_rows(function: ca.Function, x: Array, u: Array, p: Array) -> list[Array]:
    """Evaluate a function of (time, state, input, parameter) at many states, at time zero.

    ``x``: shape (n, states). ``u``: shape (inputs,), the same for all, or (n, inputs).
    """
    count = len(x)
    mapped = _mapped(function, count, (0, 3) if u.ndim == 2 else (0, 2, 3))
    # A matrix with a column for each row is that row after row.
    given = [np.ascontiguousarray(each, dtype=np.float64) for each in (np.zeros(1), x, u, p)]
    call = Buffered(mapped, given)
    call.evaluate()
    rows = []
    for i, values in enumerate(call.results):
        down, across = function.sparsity_out(i).get_triplet()
        wide = function.size2_out(i)
        dense = np.zeros((count, function.size1_out(i) * wide))
        dense[:, np.array(down, int) * wide + np.array(across, int)] = values.reshape(count, len(down))
        rows.append(dense)
    return rows


@lru_cache(maxsize=128)
def _mapped(function: ca.Function, count: int, shared: tuple[int, ...]) -> ca.Function:
    """Return a function of many columns; arguments that are shared are not copied for each."""
    return function.map("rows", "serial", count, list(shared), [])


_RESTS = 1e-9
"""Last step relative to the size of a state."""


def _newton(function: ca.Function, x: Array, fixed: tuple[Array, Array], free: list[int], name: str) -> Array:
    """Solve for the free states of all rows at once; done when the steps are small or down to rounding."""
    if not free or not len(x):
        return x
    last = np.full(len(free), np.inf)
    for _ in range(60):
        rate, slope = evaluate_rows(function, x, *fixed)
        try:
            step = np.linalg.solve(slope.reshape(len(x), len(free), len(free)), rate[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(
                f"rest states of {name}", "a state has no rest of its own: at standstill nothing moves it",
                next_step="leave out hysteresis that is led by the speed, and bodies that nothing holds",
            ) from error  # fmt: skip
        if not np.all(np.isfinite(step)):
            break
        x = x.copy()
        x[:, free] -= step
        largest = np.max(np.abs(step), axis=0)
        size = np.maximum(np.max(np.abs(x[:, free]), axis=0), 1e-3)
        rounding = (largest > 0.5 * last) & (largest <= 1e3 * _RESTS * size)
        if np.all((largest <= _RESTS * size) | rounding):
            return x
        last = largest
    raise ConvergenceError(
        f"rest states of {name}", "not all states come to rest while the angle is held",
        next_step="hold further states, or leave out what only drifts",
    )  # fmt: skip


_ROUNDING = 1e-9
"""Excess over a range that is rounding, relative to the nominal size."""


class RangeAtRest(NamedTuple):
    """A signal that leaves the stated range of its law at some angles."""

    name: str
    unit: str
    first: float
    last: float
    furthest: float
    minimum: float
    maximum: float

    @property
    def part(self) -> str:
        """Full name of the part that holds the law."""
        return self.name.rpartition(".")[0]

    def __str__(self) -> str:
        limits = with_unit(f"[{self.minimum:g}, {self.maximum:g}]", self.unit)
        angles = [f"{math.degrees(angle):.3g}" for angle in (self.first, self.last)]
        where = f"at {angles[0]}°" if angles[0] == angles[1] else f"from {angles[0]}° to {angles[1]}°"
        return (
            f"{self.name} leaves {limits}, where its law is stated to hold, {where} "
            f"and reaches {with_unit(f'{self.furthest:.3g}', self.unit)}"
        )


def ranges_at_rest(model: FlatModel, angles: Array, *, angle: str) -> tuple[RangeAtRest, ...]:
    """Return the laws that are used outside of their stated range while the machine rests at some angles."""
    bounded = [(i, v) for i, v in enumerate(model.signals) if v.bounded]
    if not bounded:
        return ()
    s = model.symbols()
    watched = ca.vertcat(*[s.signal[i] for i, _ in bounded])
    (values,) = evaluate_at(model, s, [watched], rest_states(model, angles, angle=angle))
    result = []
    for (_, v), row in zip(bounded, values.T, strict=True):
        over = np.maximum(v.minimum - row, row - v.maximum)
        outside = angles[over > _ROUNDING * v.nominal]
        if outside.size:
            near = outside[np.argsort(np.abs(outside))]
            furthest = float(row[int(np.argmax(over))])
            result.append(
                RangeAtRest(v.name, v.unit, float(near[0]), float(near[-1]), furthest, v.minimum, v.maximum)
            )
    return tuple(result)
