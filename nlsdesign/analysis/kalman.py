"""The best linear estimate at one angle: steady-state Kalman filter, and what it gains over the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_are, solve_discrete_lyapunov

from ..errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel, Variable
from ..model.roles import spring_torque
from .rest import rate_state
from .sweep import RestPoint, View

Array = NDArray[np.float64]


def discrete_noise(a: Array, density: Array, sample_time: float) -> tuple[Array, Array]:
    """Return Φ = e^(AT) and the covariance ∫₀ᵀ e^(At)·W·e^(Aᵀt) dt of white noise over one sample.

    Source: Van Loan 1978.

    Parameters
    ----------
    a
        Shape (n, n), in 1/s.
    density
        W, shape (n, n), in unit² / s.
    sample_time
        T in s.
    """
    n = len(a)
    block = np.block([[-a, density], [np.zeros((n, n)), a.T]]) * sample_time
    whole = expm(block)
    transition: Array = whole[n:, n:].T
    covariance = transition @ whole[:n, n:]
    return transition, (covariance + covariance.T) / 2


def steady_state_kalman(
    transition: Array, measured: Array, noise: Array, spread: Array
) -> tuple[Array, Array]:
    """Return the gain M of x̂ = x̂⁻ + M·(y − C·x̂⁻) and the covariance of x − x̂.

    Parameters
    ----------
    transition, measured
        Φ and C, shapes (n, n) and (r, n).
    noise
        Covariance of the process noise over one sample, shape (n, n).
    spread
        Standard deviations of the measurement, shape (r,).

    Raises
    ------
    ConvergenceError
        If there is no steady state: something unstable is not seen.
    """
    # In units in which states have size one: the Riccati solver works on entries of like size.
    unit = np.sqrt(np.where(np.diag(noise) > 0.0, np.diag(noise), 1.0))
    phi, c = transition * unit[None, :] / unit[:, None], measured * unit[None, :] / spread[:, None]
    w = noise / unit[:, None] / unit[None, :]
    try:
        prior = solve_discrete_are(phi.T, c.T, w, np.eye(len(c)))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ConvergenceError(
            "steady-state Kalman filter", f"the Riccati equation has no solution: {error}",
            next_step="give every state that the measurement does not see some process noise or decay",
        ) from error  # fmt: skip
    gain = np.linalg.solve(c @ prior @ c.T + np.eye(len(c)), c @ prior).T
    rest = np.eye(len(phi)) - gain @ c
    posterior = rest @ prior @ rest.T + gain @ gain.T
    return gain * unit[:, None] / spread[None, :], posterior * unit[:, None] * unit[None, :]


@dataclass(frozen=True)
class EstimateDeviation(View):
    """Standard deviation of an estimate: from the model alone, and with the best use of the measurement.

    "Model alone" reads the measured angle and leaves the inner states to their own decay; "best" adds the
    steady-state Kalman correction. That is where the current enters: it says how the angle should have moved.

    Parameters
    ----------
    process
        Density of white process noise of each state by name, in unit of the state per √s. Speed needs one.
    measurement
        Standard deviation of each measured output by name; an encoder has quantum/√12.
    estimate
        Output that is wanted; by default the torque of the series spring.
    sample_time
        In s.
    """

    process: Mapping[str, float]
    measurement: Mapping[str, float]
    estimate: str | None = None
    sample_time: float = 1e-3

    def columns(self, model: FlatModel) -> tuple[Variable, ...]:
        """Return the columns.

        Raises
        ------
        UnknownNameError
            If an output or a state has another name in the model.
        ValueRangeError
            If a standard deviation of the measurement is not positive.
        """
        outputs, states = {v.name for v in model.outputs}, {v.name for v in model.states}
        estimate = spring_torque(model, self.estimate)
        for name in (estimate, *self.measurement):
            if name not in outputs:
                raise unknown_name("output", name, outputs)
        for name in self.process:
            if name not in states:
                raise unknown_name("state", name, states)
        if not all(value > 0.0 for value in self.measurement.values()):
            raise ValueRangeError("measurement", "a standard deviation must be positive")
        unit = model.variable(estimate).unit
        return (
            Variable("deviation.model", unit, f"standard deviation of {estimate} from the model alone"),
            Variable("deviation.best", unit, f"standard deviation of {estimate} with the best correction"),
        )

    def at(self, point: RestPoint) -> tuple[tuple[float, ...], dict[str, str]]:
        """Return both deviations; no words."""
        linear = point.linear
        states, outputs = list(linear.states), list(linear.outputs)
        density = np.diag([self.process.get(name, 0.0) ** 2 for name in states])
        rows = [outputs.index(name) for name in self.measurement]
        spread = np.array(list(self.measurement.values()))
        transition, noise = discrete_noise(linear.A, density, self.sample_time)
        _, best = steady_state_kalman(transition, linear.C[rows], noise, spread)
        wanted = linear.C[outputs.index(spring_torque(point.model, self.estimate))]
        angle, speed = states.index(point.angle), states.index(rate_state(point.model, point.angle))
        inner = [i for i in range(len(states)) if i not in (angle, speed)]
        alone = np.zeros((len(states), len(states)))
        if inner:
            own, inner_noise = discrete_noise(
                linear.A[np.ix_(inner, inner)], density[np.ix_(inner, inner)], self.sample_time
            )
            alone[np.ix_(inner, inner)] = solve_discrete_lyapunov(own, inner_noise)
        alone[angle, angle] = self._spread_of(point) ** 2
        return tuple(float(np.sqrt(wanted @ p @ wanted)) for p in (alone, best)), {}

    def _spread_of(self, point: RestPoint) -> float:
        return self.measurement.get(point.angle, 0.0)
