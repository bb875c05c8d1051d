"""The model at rest at many angles with its exact slopes, and the slopes of its modes, sliding and stuck.

At rest the slope of smoothed dry friction is that of its corner, friction over creep speed: a number of the
smoothing, not of the plant. Two linear plants lie behind it. *Sliding*: the friction has its sliding level,
so it has no slope but that of a machine that moves. *Stuck*: the rate is held at zero, and only the inner
states move. No part is looked for by its name:

- A sharp model says which of its switches hold a rate. Those whose mode is another one forward than backward
  are dry friction; the branches of its equations are differentiated.
- In a smooth model dry friction is where the accelerations jump between a slow motion forward and one
  backward. Limits at zero speed are extrapolated from three speeds that lie far above the creep speed. What
  the slope at rest has beyond that limit is the corner −g·hᵀ, and stuck is its limit for infinite steepness:
  hᵀx = 0, whatever acts along g.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ValueRangeError
from ...model import FlatModel
from ...model.flat import Switching
from .rest import evaluate_at, evaluate_rows, rate_state, rest_states, typical_sizes

JUMP = 1e-6
"""Accelerations that jump by less than this share of the largest one have no dry friction behind them."""
DIFFERENT = 1e-9
"""Relative difference of the slopes forward and backward up to which they count as the same."""
_DOUBLINGS = 24
_SHARES = (0.25, 0.5, 1.0)
_TO_ZERO = (8.0 / 3.0, -2.0, 1.0 / 3.0)
"""Weights that extrapolate from these shares of a speed to zero, exact for parabolas."""


@dataclass(frozen=True, eq=False)
class PlantMode:
    """The linear plant in one mode, at N angles."""

    # name: "free" without dry friction, else "sliding", or "sliding_forward" and "sliding_backward" where
    # these differ, and "stuck"
    name: str
    words: str  # what is linearised, in words
    # a, b: slopes of the rates of the states in states and inputs, shapes (N, n, n) and (N, n, m)
    a: Array
    b: Array
    c: Array  # slopes of the outputs in the states, shape (N, r, n)
    # rates: what the states would do if the angle were let go, in the mean of both directions, so without dry
    # friction; shape (N, n)
    rates: Array
    held: int = 0  # number of rates that are held: as many motions stand still
    # allowed: projection onto the states in which nothing that is held moves, shape (N, n, n); None where
    # nothing is held
    allowed: Array | None = None

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues, shape (N, n − 2·held): without those of what is held and of where it stands."""
        eigenvalues = np.linalg.eigvals(self.a).astype(complex)
        order = np.argsort(np.abs(eigenvalues), axis=-1)
        return np.take_along_axis(eigenvalues, order, axis=-1)[:, 2 * self.held :]


class _Side(NamedTuple):
    """One direction: rates at a speed and their limit at zero; limits of the slopes; and the modes.

    ``moving`` and ``outputs`` have the slopes in the speeds at the speed itself.
    """

    at_speed: Array
    rates: Array
    slopes: Array
    moving: Array
    inputs: Array
    outputs: Array
    modes: Array


def plant_modes(
    model: FlatModel, states: Array, at_rest: tuple[Array, Array, Array, Array], *, rate: str, speed: float
) -> tuple[PlantMode, ...]:
    """Return the modes of a plant; those in which it moves come first.

    ``states``: rest states, shape (N, n). ``at_rest``: slopes there of rates in states and inputs, and of
    outputs in states, and the rates: shapes (N, n, n), (N, n, m), (N, r, n) and (N, n). ``speed``: typical
    speed in rad/s, at which the slopes in the speeds are taken; it is doubled until dry friction has its
    sliding level.
    """
    names = [v.name for v in model.states]
    rates = [names.index(b.rate) for b in model.bodies if not b.prescribed and b.rate in names]
    rates = list(dict.fromkeys([names.index(rate), *rates]))
    equations = _Branches(model, rates)
    for _ in range(_DOUBLINGS):
        ahead, back = (equations.side(states, sign * speed) for sign in (1.0, -1.0))
        jump = (ahead.rates - back.rates)[:, rates]
        size = float(np.max(np.abs([ahead.at_speed[:, rates], back.at_speed[:, rates]])))
        if not np.any(np.abs(jump) > JUMP * size):
            return (PlantMode("free", "no dry friction; at rest", *at_rest),)
        twice = [equations.side(states[:1], sign * 2.0 * speed).rates[:, rates] for sign in (1.0, -1.0)]
        if np.all(np.abs(twice[0] - twice[1] - jump[:1]) <= JUMP * size):
            break
        speed *= 2.0
    else:
        raise ConvergenceError(
            f"friction of {model.name}", f"turns with the direction, but has no level up to {speed:g} rad/s",
            next_step="smooth it over a smaller speed, or take the sharp law",
        )  # fmt: skip
    return (*_moving((ahead, back), speed), *equations.stuck(states, at_rest, ahead))


def _moving(sides: tuple[_Side, _Side], speed: float) -> list[PlantMode]:
    words = f"dry friction at its sliding level, slopes in the speed at {{}}{speed:.3g} rad/s"
    mean = (sides[0].rates + sides[1].rates) / 2.0
    ahead, back = sides
    if np.max(np.abs(ahead.moving - back.moving)) <= DIFFERENT * np.max(np.abs(ahead.moving)):
        return [PlantMode("sliding", words.format("±"), ahead.moving, ahead.inputs, ahead.outputs, mean)]
    return [
        PlantMode(f"sliding_{name}", words.format(sign), side.moving, side.inputs, side.outputs, mean)
        for name, sign, side in zip(("forward", "backward"), "+−", sides, strict=True)
    ]


def _stuck(side: _Side, allowed: Array, held: int) -> list[PlantMode]:
    """Return the mode of the equations of one side, projected onto what may move."""
    if allowed.shape[-1] <= 2 * held:
        return []
    words = "dry friction holds the speed at zero, the inner states move"
    a, b = allowed @ side.slopes @ allowed, allowed @ side.inputs
    rates = np.einsum("Nij,Nj->Ni", allowed, side.rates)
    return [PlantMode("stuck", words, a, b, side.outputs, rates, held, allowed)]


class _Branches:
    """The equations of a model on chosen sides of its switches; a model without holding ones has one side."""

    def __init__(self, model: FlatModel, rates: list[int]) -> None:
        s = model.symbols()
        self.rates, self.u, self.p = rates, model.start(model.inputs), model.start(model.parameters)
        self.sharp: Switching | None = None
        if model.switching is not None and any(model.switching.holds):
            self.sharp = model.switching
        count = len(self.sharp.switches) if self.sharp else 0
        modes = ca.SX.sym("modes", count)
        given = [s.time, s.state, s.input, s.parameter]
        f, held = s.derivative, ca.SX(0, 1)
        if self.sharp:
            f, _, held = self.sharp.branch(*given, modes)
            self._natural = self.sharp.natural
        slopes = [ca.jacobian(f, s.state), ca.jacobian(held, s.state), ca.jacobian(f, s.input)]
        # In motion the outputs are those of the modes that the motion has by nature.
        slopes.append(ca.jacobian(s.output, s.state))
        # The modes follow the inputs, so that all rows can be evaluated in one call.
        self._function = ca.Function(
            "branch",
            [s.time, s.state, ca.vertcat(s.input, modes), s.parameter],
            [f, *(ca.densify(each) for each in slopes)],
        )
        self._name = model.name

    def side(self, states: Array, speed: float) -> _Side:
        """Return what the equations are at a speed of all bodies, and their limit at zero."""
        modes = self._modes(states, speed)
        at_speeds = [self._at(self._moved(states, share * speed), modes) for share in _SHARES]
        limits = [_extrapolated([each[i] for each in at_speeds]) for i in range(5)]
        last, (rates, slopes, _, inputs, outputs) = at_speeds[-1], limits
        moving = slopes.copy()
        moving[:, :, self.rates] = last[1][:, :, self.rates]
        outputs[:, :, self.rates] = last[4][:, :, self.rates]
        return _Side(last[0], rates, slopes, moving, inputs, outputs, modes)

    def stuck(self, states: Array, at_rest: tuple[Array, ...], ahead: _Side) -> list[PlantMode]:
        """Return the mode in which dry friction holds; none where nothing else moves."""
        if self.sharp:
            other = self._modes(states, -1.0)
            rubs = np.array(self.sharp.holds) & np.any(ahead.modes != other, axis=0)
            modes = np.where(rubs, 0.0, ahead.modes)
            rates, a, rows, b, _ = self._at(states, modes)
            onto = np.eye(states.shape[1]) - np.linalg.pinv(rows[:, rubs]) @ rows[:, rubs]
            held = int(np.max(np.linalg.matrix_rank(rows[:, rubs])))
            return _stuck(ahead._replace(rates=rates, slopes=a, inputs=b), onto, held)
        corner = np.zeros_like(at_rest[0])
        corner[:, :, self.rates] = (at_rest[0] - ahead.slopes)[:, :, self.rates]
        left, size, right = np.linalg.svd(corner)
        held = int(np.max(np.sum(size > JUMP * size[:, :1], axis=-1)))
        g, h = left[:, :, :held], right[:, :held]
        across = np.eye(states.shape[1]) - g @ np.linalg.pinv(h @ g) @ h
        return _stuck(ahead, across, held)

    def _modes(self, states: Array, speed: float) -> Array:
        if not self.sharp:
            return np.zeros((len(states), 0))
        return evaluate_rows(self._natural, self._moved(states, speed), self.u, self.p)[0]

    def _moved(self, states: Array, speed: float) -> Array:
        moved = states.copy()
        # Not all alike: where one body rubs on another, it is the difference that counts.
        moved[:, self.rates] = speed / (1.0 + 0.5 * np.arange(len(self.rates)))
        return moved

    def _at(self, states: Array, modes: Array) -> tuple[Array, Array, Array, Array, Array]:
        given = np.column_stack([np.tile(self.u, (len(states), 1)), modes])
        rates, slopes, rows, inputs, outputs = evaluate_rows(self._function, states, given, self.p)
        if not all(np.all(np.isfinite(each)) for each in (slopes, inputs)):
            raise ValueRangeError(
                f"slopes of {self._name}", "are not finite in motion",
                next_step="move away from the corner or use the smooth form of the law",
            )  # fmt: skip
        many, n = states.shape
        return (
            rates,
            slopes.reshape(many, n, n),
            rows.reshape(many, -1, n),
            inputs.reshape(many, n, len(self.u)),
            outputs.reshape(many, -1, n),
        )


def limit_at_zero_speed(at_speed: Callable[[float], Array], speed: float) -> Array:
    """Return the limit of numbers for a speed that goes to zero from one side, far above any creep speed.

    ``speed``: from which, and shares of which, the limit is extrapolated; its sign says from which side.
    """
    return _extrapolated([at_speed(share * speed) for share in _SHARES])


def _extrapolated(values: list[Array]) -> Array:
    """Return the limit at zero speed; exactly what they are where all are equal."""
    limit = sum((weight * value for weight, value in zip(_TO_ZERO, values, strict=True)), np.zeros(1))
    same = (values[0] == values[1]) & (values[1] == values[2])
    return np.where(same, values[0], limit)


@dataclass(frozen=True, eq=False)
class RestPoints:
    """The model at rest at N angles.

    Parameters
    ----------
    model
        Whole model: n states, m inputs, r outputs.
    angle
        Name of the state that is swept.
    at
        Its values, shape (N,).
    states
        Rest states, shape (N, n).
    rates
        What the states would do if the angle were let go, shape (N, n).
    outputs
        Values of the outputs, shape (N, r).
    a, b, c, d
        Exact linearisation, shapes (N, n, n), (N, n, m), (N, r, n) and (N, r, m).
    sizes
        Typical size of states and outputs over the sweep.
    typical_speed
        Of a swing over the whole range with the largest acceleration at rest, in rad/s; else 1.
    """

    model: FlatModel
    angle: str
    at: Array
    states: Array
    rates: Array
    outputs: Array
    a: Array
    b: Array
    c: Array
    d: Array
    sizes: Mapping[str, float]
    typical_speed: float

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(v.name for v in self.model.states)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(v.name for v in self.model.outputs)

    @cached_property
    def rate(self) -> str:
        """Name of the state that is the rate of the angle."""
        return rate_state(self.model, self.angle)

    @cached_property
    def modes(self) -> tuple[PlantMode, ...]:
        """The modes of the plant: moving ones first, each with its matrices at all angles."""
        at_rest = (self.a, self.b, self.c, self.rates)
        return plant_modes(self.model, self.states, at_rest, rate=self.rate, speed=self.typical_speed)

    @property
    def moving(self) -> PlantMode:
        """The mode in which the machine moves forward."""
        return self.modes[0]


def rest_points(
    model: FlatModel,
    angles: Array,
    *,
    angle: str,
    consistent: Mapping[str, str] | None = None,
    like: RestPoints | None = None,
) -> RestPoints:
    """Return a model at rest at many angles, with its exact slopes; all in one call of the equations.

    Parameters
    ----------
    model
        Continuous.
    angles, angle
        N angles in rad, shape (N,), and the state that takes them.
    consistent
        States that have to agree with a signal, as for :func:`~nlsdesign.feedback.analysis.rest.rest_states`.
    like
        Another sweep of the same model whose typical sizes and speed are taken.

    Raises
    ------
    ValueRangeError
        If an angle is not finite, or the model has no finite slope at one, or it is not continuous.
    ConvergenceError
        If the model does not come to rest.
    """
    if model.sample_time is not None:
        raise ValueRangeError(
            f"model '{model.name}'", f"is discrete, every {model.sample_time:g} s; a plant is continuous",
            next_step="for an observer take nlsdesign.feedback.observer.check_stability",
        )  # fmt: skip
    at = np.asarray(angles, dtype=float)
    if at.ndim != 1 or len(at) == 0 or not np.all(np.isfinite(at)):
        raise ValueRangeError("angles", "must be a row of finite numbers in rad")
    states = rest_states(model, at, angle=angle, consistent=consistent)
    if like is not None:
        sizes = like.sizes
    elif consistent:
        largest = [float(size) if size > 0.0 else 1.0 for size in np.max(np.abs(states), axis=0)]
        sizes = dict(zip((v.name for v in model.states), largest, strict=True))
    else:
        sizes = typical_sizes(model, at, angle=angle)
    s = model.symbols()
    slopes = [ca.jacobian(of, by) for of in (s.derivative, s.output) for by in (s.state, s.input)]
    results = evaluate_at(model, s, [s.derivative, s.output, *slopes], states)
    broken = np.flatnonzero(~np.all([np.all(np.isfinite(each), axis=1) for each in results[2:]], axis=0))
    if len(broken):
        raise ValueRangeError(
            f"linearisation of {model.name} at {states[broken[0]].tolist()}",
            "the slope is not finite there",
            next_step="move away from the corner or use the smooth form of the law",
        )
    n, m, r = len(model.states), len(model.inputs), len(model.outputs)
    shapes = ((n, n), (n, m), (r, n), (r, m))
    a, b, c, d = (each.reshape(len(at), *shape) for each, shape in zip(results[2:], shapes, strict=True))
    speed = (
        like.typical_speed if like is not None else _speed(model, at, results[0], rate_state(model, angle))
    )
    return RestPoints(model, angle, at, states, results[0], results[1], a, b, c, d, sizes, speed)


def _speed(model: FlatModel, at: Array, rates: Array, rate: str) -> float:
    place = [v.name for v in model.states].index(rate)
    speed = float(np.sqrt(np.max(np.abs(at)) * np.max(np.abs(rates[:, place]))))
    return speed if speed > 0.0 else 1.0
