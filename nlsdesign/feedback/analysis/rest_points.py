"""The model at rest at many angles, with its exact slopes there: what every view of it starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...foundation.errors import ValueRangeError
from ...model import FlatModel
from ...model.linear import LinearModel
from .modes import PlantMode, plant_modes
from .rest import evaluate_rows, rate_state, rest_states, typical_sizes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RestPoint:
    """The model at rest at one angle.

    Parameters
    ----------
    model
        Whole model.
    angle
        Name of the state that is swept.
    state
        Rest state, shape (states,).
    linear
        Exact linearisation there. Where dry friction is smoothed, it is that of its corner; see
        :class:`~nlsdesign.feedback.analysis.modes.PlantMode` for the machine that slides or sticks.
    sizes
        Typical size of states and outputs over the sweep.
    """

    model: FlatModel
    angle: str
    state: Array
    linear: LinearModel
    sizes: Mapping[str, float]


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

    def point(self, row: int) -> RestPoint:
        """Return one of them.

        Parameters
        ----------
        row
            Which one.
        """
        inputs = tuple(v.name for v in self.model.inputs)
        linear = LinearModel(
            self.a[row], self.b[row], self.c[row], self.d[row],
            self.state_names, inputs, self.output_names, self.model.sample_time,
        )  # fmt: skip
        return RestPoint(self.model, self.angle, self.states[row], linear, self.sizes)


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
    angles
        Shape (N,), in rad.
    angle
        State that is swept.
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
    else:
        sizes = _sizes(model, states) if consistent else typical_sizes(model, at, angle=angle)
    s = model.symbols()
    slopes = [ca.jacobian(of, by) for of in (s.derivative, s.output) for by in (s.state, s.input)]
    function = ca.Function(
        "slopes",
        [s.time, s.state, s.input, s.parameter],
        [ca.densify(each) for each in (s.derivative, s.output, *slopes)],
    )
    results = evaluate_rows(function, states, model.start(model.inputs), model.start(model.parameters))
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


def _sizes(model: FlatModel, states: Array) -> dict[str, float]:
    largest = np.max(np.abs(states), axis=0)
    return {v.name: float(size) if size > 0.0 else 1.0 for v, size in zip(model.states, largest, strict=True)}
