"""The best linear estimate at one angle: steady-state Kalman filter, and what it gains over the model.

Where nobody states the noise it is assumed, from the deck's sensors and the sizes of its variables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from ...foundation.arrays import Array, Mask
from ...foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ...model import FlatModel, Variable
from ...model.roles import spring_torque
from .rest_points import RestPoints
from .sweep import (
    Columns,
    View,
    covariance_without_measurement,
    exponential_and_gramian,
    riccati,
    symmetric,
    transposed,
)


@dataclass(frozen=True)
class NoiseAssumptions:
    """Noise in shares of the sizes that a model has over a sweep; each is a stated guess.

    Parameters
    ----------
    torque
        Torque that changes from sample to sample, as a share of the largest torque at rest.
    inner
        Standard deviation of what the inner states do of their own, as a share of their typical sizes.
    sample_time
        In s.
    """

    torque: float = 0.01
    inner: float = 0.01
    sample_time: float = 1e-3

    def __post_init__(self) -> None:
        if not (self.torque >= 0.0 and self.inner >= 0.0 and 0.0 < self.sample_time < math.inf):
            raise ValueRangeError(str(self), "shares must not be negative, and a sample time positive")

    def process(self, points: RestPoints) -> dict[str, float]:
        """Return the density of white noise of each state, in its unit per √s."""
        names, largest = points.state_names, np.max(np.abs(points.moving.rates), axis=0)
        decay = np.median(np.abs(np.einsum("Nii->Ni", points.moving.a)), axis=0)
        densities = {}
        for i, name in enumerate(names):
            if name == points.rate:
                densities[name] = self.torque * float(largest[i]) * math.sqrt(self.sample_time)
            elif name != points.angle:
                # With its own decay λ a state of this density has the standard deviation q/√(2λ).
                densities[name] = self.inner * points.sizes[name] * math.sqrt(2.0 * float(decay[i]))
        return densities

    def __str__(self) -> str:
        return (
            f"assumed: a torque of {self.torque:.2g} of the largest one that changes from sample to sample, "
            f"inner states that wander by {self.inner:.2g} of their size, sampled every "
            f"{1e3 * self.sample_time:g} ms"
        )


def declared_deviation(model: FlatModel, name: str) -> float:
    """Return the standard deviation with which a declared sensor shows a variable; quantum/√12 and noise."""
    deviations = []
    for reading in model.readings:
        if reading.measured == name:
            numbers = [(model.values.get(f"{s}.noise", 0.0), model.values.get(f"{s}.quantum", 0.0))
                       for s in reading.sensors]  # fmt: skip
            square = sum(noise**2 + quantum**2 / 12.0 for noise, quantum in numbers)
            deviations += [math.sqrt(square)] if square > 0.0 else []
    if not deviations:
        raise ValueRangeError(
            f"measurement of '{name}'", "no sensor in the deck declares its quantum or noise",
            next_step=f"give it: measurement={{'{name}': standard deviation}}, or declare an Encoder of it",
        )  # fmt: skip
    return min(deviations)


def discrete_noise(a: Array, density: Array, sample_time: float) -> tuple[Array, Array]:
    """Return Φ = e^(AT) and the covariance ∫₀ᵀ e^(At)·W·e^(Aᵀt) dt of white noise over one sample.

    Source: Van Loan 1978.

    ``a``: shape (n, n), in 1/s. ``density``: W, shape (n, n), in unit² / s.
    """
    n = len(a)
    block = np.block([[-a, density], [np.zeros((n, n)), a.T]]) * sample_time
    whole = scipy.linalg.expm(block)
    transition: Array = whole[n:, n:].T
    covariance = transition @ whole[:n, n:]
    return transition, (covariance + covariance.T) / 2


def steady_state_kalman(
    transition: Array, measured: Array, noise: Array, spread: Array
) -> tuple[Array, Array]:
    """Return the gain M of x̂ = x̂⁻ + M·(y − C·x̂⁻) and the covariance of x − x̂.

    ``transition``, ``measured``: Φ and C, shapes (n, n) and (r, n). ``noise``: covariance of the process
    noise over one sample, shape (n, n).
    """
    # In units in which states have size one: the Riccati solver works on entries of like size.
    unit = np.sqrt(np.where(np.diag(noise) > 0.0, np.diag(noise), 1.0))
    phi, c = transition * unit[None, :] / unit[:, None], measured * unit[None, :] / spread[:, None]
    w = noise / unit[:, None] / unit[None, :]
    try:
        prior = scipy.linalg.solve_discrete_are(phi.T, c.T, w, np.eye(len(c)))
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
    The machine slides; while it sticks the angle corrects nothing. Every number is exactly known here; what
    the spread of the numbers adds is shown by
    :func:`~nlsdesign.feedback.analysis.sensor_ranking.rank_sensors`.

    Parameters
    ----------
    process
        Density of white process noise of each state by name, in unit of the state per √s. Speed needs one. By
        default that of :class:`~nlsdesign.feedback.analysis.kalman.NoiseAssumptions`, said by the
        columns.
    measurement
        Standard deviation of each measured output by name; an encoder has quantum/√12. By default the
        measured angle with the resolution that its sensor declares.
    estimate
        Output that is wanted; by default the torque of the series spring.
    sample_time
        In s.
    """

    process: Mapping[str, float] | None = None
    measurement: Mapping[str, float] | None = None
    estimate: str | None = None
    sample_time: float = 1e-3

    def over(self, points: RestPoints) -> Columns:
        """Return both deviations; in words where there is no steady state, and the number is infinite.

        Raises
        ------
        UnknownNameError
            If an output or a state has another name in the model.
        ValueRangeError
            If a standard deviation of the measurement is not positive, or no sensor declares one.
        """
        estimate = spring_torque(points.model, self.estimate)
        assumed = NoiseAssumptions(sample_time=self.sample_time)
        process = assumed.process(points) if self.process is None else self.process
        measurement = self.measurement or {points.angle: declared_deviation(points.model, points.angle)}
        for named in (estimate, *measurement):
            if named not in points.output_names:
                raise unknown_name("output", named, points.output_names)
        for named in process:
            if named not in points.state_names:
                raise unknown_name("state", named, points.state_names)
        if not all(value > 0.0 for value in measurement.values()):
            raise ValueRangeError("measurement", "a standard deviation must be positive")
        density = np.diag([process.get(name, 0.0) ** 2 for name in points.state_names])
        wanted = points.moving.c[:, points.output_names.index(estimate)]
        rows = [points.output_names.index(name) for name in measurement]
        spread = np.array(list(measurement.values()))
        best, steady = best_covariances(
            points.moving.a, density, (points.moving.c[:, rows], spread), self.sample_time
        )
        alone = self._model_alone(points, density, measurement)
        values = np.column_stack([deviation_of(wanted, each) for each in (alone, best)])
        unit, stated = (
            points.model.variable(estimate).unit,
            "as given" if self.process is not None else str(assumed),
        )
        columns = (
            Variable("deviation.model", unit, f"standard deviation of {estimate} from the model alone"),
            Variable(
                "deviation.best",
                unit,
                f"standard deviation of {estimate} with the best correction, exact numbers; noise: {stated}",
            ),
        )
        none = "no steady state: something that does not decay is not seen"
        return Columns(columns, values, {"estimate": tuple("" if each else none for each in steady)})

    def _model_alone(self, points: RestPoints, density: Array, measurement: Mapping[str, float]) -> Array:
        states = list(points.state_names)
        angle, speed = states.index(points.angle), states.index(points.rate)
        inner = [i for i in range(len(states)) if i not in (angle, speed)]
        alone = np.zeros_like(points.a)
        if inner:
            own = points.moving.a[:, inner][:, :, inner]
            sampled = noise_over_a_sample(own, density[np.ix_(inner, inner)], self.sample_time)
            alone[np.ix_(range(len(alone)), inner, inner)] = covariance_without_measurement(*sampled)
        alone[:, angle, angle] = measurement.get(points.angle, 0.0) ** 2
        return alone


def noise_over_a_sample(a: Array, density: Array, sample_time: float) -> tuple[Array, Array]:
    """Return Φ = e^(AT) and the covariance of white noise over one sample at many angles.

    ``a``: shape (N, n, n), in 1/s. ``density``: W, shape (n, n) or (N, n, n), in unit² / s.
    """
    backward, noise = exponential_and_gramian(transposed(a), np.broadcast_to(density, a.shape), sample_time)
    return transposed(backward), noise


def best_covariances(
    a: Array, density: Array, measurement: tuple[Array, Array], sample_time: float
) -> tuple[Array, Mask]:
    """Return the covariance of the best estimate at many angles, and where it has a steady state.

    ``measurement``: C, shape (N, r, n), and the standard deviations, shape (r,). Result: shape (N, n, n),
    infinite where there is no steady state; and shape (N,), whether there is one.
    """
    transition, noise = noise_over_a_sample(a, density, sample_time)
    diagonal = np.einsum("Nii->Ni", noise)
    # In units in which states have size one.
    unit = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    phi = transition * unit[:, None, :] / unit[:, :, None]
    c = measurement[0] * unit[:, None, :] / measurement[1][None, :, None]
    information = transposed(c) @ c
    prior, steady = riccati(phi, information, noise / unit[:, None, :] / unit[:, :, None])
    start = np.where(steady[:, None, None], prior, 0.0)
    posterior = np.linalg.solve(np.eye(a.shape[-1]) + start @ information, start)
    scaled = symmetric(np.asarray(posterior, dtype=float)) * unit[:, None, :] * unit[:, :, None]
    return np.where(steady[:, None, None], scaled, np.inf), steady


def deviation_of(row: Array, covariance: Array) -> Array:
    """Return the standard deviation of what a row of numbers makes of the states; infinite stays infinite.

    ``row``: shape (N, n). ``covariance``: shape (N, n, n).
    """
    known = np.all(np.isfinite(covariance), axis=(-1, -2))
    square = np.einsum("Ni,Nij,Nj->N", row, np.where(known[:, None, None], covariance, 0.0), row)
    return np.where(known, np.sqrt(np.maximum(square, 0.0)), np.inf)
