"""Fits by simulation: multiple shooting, Gauss–Newton with exact derivatives, several records at once.

Each record is cut into windows that begin at states of their own. Joined windows are held together by
constraints, which are linearised like the residuals and eliminated, so what is left to solve has the size of
the parameters and of the records' first states. Windows apart each begin at the measured state: that is the
error of a prediction over the length of a window. Source: Bock 1987 (condensing).

:func:`predict_in_windows` tells how far a simulation runs away from a record within a window. CMA-ES, which
needs no derivatives but many simulations, is the yardstick.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, MeasurementError, missing_library
from ...model import FlatModel
from .least_squares import Fit, Loss, covariance_of
from .parameters import Parameter
from .records.measurement import Record
from .residuals import effective_size, rmse
from .simulation_error import Linear, Point, Shots, SimulationError, Weights
from .windowed_simulation import Wiring

_ITERATIONS = 60
_GAIN, _JOINED = 1e-8, 1e-6
_SHARES = (1.0, 0.5, 0.25, 0.1, 0.02)
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-6, 1e-12, 1e8
_FAILED = 1e12
_STEP = 0.3
"""First step on the fitted scale, where a logarithm of 0.3 is a third."""


@dataclass(frozen=True, eq=False)
class SimulatedFit:
    """A fit by simulation."""

    fit: Fit  # fitted numbers and how well they are known
    point: Point  # fitted scale, and the state at the beginning of each window
    problem: SimulationError  # what was minimised; its residual can be asked at other points
    iterations: int  # steps taken


class _Place(NamedTuple):
    """A point with what it gave, seen through a loss."""

    point: Point
    linear: Linear
    weight: Array
    cost: float

    @property
    def residual(self) -> Array:
        return self.weight * self.linear.residual

    @property
    def ahead(self) -> Array:
        """Residuals as they would be if the windows joined."""
        return self.weight * (self.linear.residual + self.linear.closing)

    @property
    def slope(self) -> Array:
        return self.weight[:, None] * self.linear.slope


def fit_by_simulation(
    model: FlatModel,
    records: Sequence[Record],
    parameters: Sequence[Parameter],
    *,
    shots: Shots,
    wiring: Wiring | None = None,
    loss: Loss | None = None,
    weights: Weights | None = None,
) -> SimulatedFit:
    """Fit parameters so that the simulated model follows the records.

    Parameters
    ----------
    model
        Continuous, without tables.
    records
        To be fitted; the caller leaves out what is held out.
    parameters
        What is free, with bounds and priors; delays of ``wiring.late_by`` among them.
    shots
        Windows: joined for multiple shooting, apart for predictions from the measured state.
    wiring
        Of measured signals to inputs and outputs; by name where ``None``.
    loss
        Squares by default; :class:`Huber` where some samples are outliers.
    weights
        What counts how much, among it what earlier fits have found; see :class:`Weights`.

    Raises
    ------
    ConvergenceError
        If there is no simulation at the start, or the descent stops before the windows join.
    """
    problem = SimulationError(model, records, parameters, shots=shots, wiring=wiring, weights=weights)
    loss = loss or Loss()
    place, iterations, converged = _descended(problem, loss)
    priors, size = problem.priors, len(problem.parameters)
    covariance = covariance_of(place.residual[priors:], place.slope, priors)[:size, :size]
    misfit, at = {}, priors
    for each in problem.windows:
        own = place.linear.residual[at : at + each.measured.size]
        misfit["simulation", each.record.name] = 0.5 * float(own @ own)
        at += each.measured.size
    fit = Fit(problem.parameters, problem.values(place.point.x), covariance, place.cost, misfit, converged)
    return SimulatedFit(fit, place.point, problem, iterations)


def _descended(problem: SimulationError, loss: Loss) -> tuple[_Place, int, bool]:
    place, damping, penalty = _place(problem, problem.start(), loss), _FIRST_DAMPING, 0.0
    for count in range(_ITERATIONS):
        step = _bounded(place.ahead, place.slope, damping, problem.room(place.point))
        after = place.ahead + place.slope @ step
        gain = 0.5 * float(place.residual @ place.residual - after @ after)
        defect = place.linear.defect
        if abs(gain) < _GAIN * max(place.cost, 1.0) and defect < _JOINED:
            return place, count, True
        if defect > 0.0:
            penalty = max(penalty, -2.0 * gain / defect)
        better = _searched(problem, place, step, gain, (penalty, loss))
        if better is not None:
            place, damping = better, max(0.1 * damping, _LEAST_DAMPING)
        elif damping < _MOST_DAMPING:
            damping = 100.0 * damping
        elif defect < _JOINED:
            return place, count, True
        else:
            break
    if place.linear.defect > _JOINED:
        raise ConvergenceError(
            "multiple shooting",
            f"the windows do not join (relative gaps {place.linear.defect:.2g})",
            next_step="take shorter windows, other starts or narrower bounds",
        )
    return place, _ITERATIONS, False


def _place(problem: SimulationError, point: Point, loss: Loss) -> _Place:
    linear, priors = problem.rows(point), problem.priors
    weight = np.ones_like(linear.residual)
    weight[priors:] = loss.weight(linear.residual[priors:])
    prior = linear.residual[:priors]
    return _Place(point, linear, weight, 0.5 * float(prior @ prior) + loss.value(linear.residual[priors:]))


def _searched(
    problem: SimulationError, place: _Place, step: Array, gain: float, merit: tuple[float, Loss]
) -> _Place | None:
    """Return the first point along a step that is better, judged by cost and gaps together."""
    penalty, loss = merit
    before = place.cost + penalty * place.linear.defect
    promised = gain + penalty * place.linear.defect
    for share in _SHARES:
        try:
            tried = _place(problem, problem.moved(place.point, place.linear, step, share), loss)
        except ConvergenceError:
            continue
        after = tried.cost + penalty * tried.linear.defect
        if after <= before - 1e-4 * share * promised + 1e-12 * abs(before):
            return tried
    return None


def _bounded(residual: Array, slope: Array, damping: float, room: tuple[Array, Array]) -> Array:
    """Return the step that minimises the damped linear problem inside the box."""
    size = np.linalg.norm(slope, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    q, r = np.linalg.qr(slope / size)
    rotated = q.T @ residual
    n = len(size)
    rows = np.vstack([r, np.sqrt(damping) * np.eye(n)])
    target = np.concatenate([-rotated, np.zeros(n)])
    walls = room[0] * size - 1e-300, room[1] * size + 1e-300
    step: Array = scipy.optimize.lsq_linear(rows, target, walls, method="bvls", tol=1e-14, max_iter=20 * n).x
    return step / size


def coloured_sigma(simulated: SimulatedFit) -> dict[str, float]:
    """Return the standard deviation with which each independent number of the residuals counts as one.

    What a model leaves over is rarely noise: neighbouring samples say the same. With these as ``sigma`` a
    fit weighs the records against priors by their effective number of samples.

    Parameters
    ----------
    simulated
        A fit of the same model and records; with any sigma.
    """
    problem = simulated.problem
    residual = problem.residual(simulated.point)[problem.priors :]
    rows: dict[str, list[Array]] = {name: [] for name in problem.wiring.outputs}
    place = 0
    for each in problem.windows:
        for name in rows:
            rows[name].append(residual[place : place + each.measured.shape[1]])
            place += each.measured.shape[1]
    sigma = dict(zip(rows, problem.sigma, strict=True))
    return {
        name: float(
            sigma[name] * rmse(np.concatenate(r)) * np.sqrt(sum(map(len, r)) / sum(map(effective_size, r)))
        )
        for name, r in rows.items()
    }


class Prediction(NamedTuple):
    """A record as predicted in windows.

    Parameters
    ----------
    time
        Of the samples in whole windows, in s, shape (n,).
    error
        Predicted minus measured by name of the measured signal, in SI, shape (n,).
    """

    time: Array
    error: dict[str, Array]

    def rmse(self, signal: str) -> float:
        """Return the root mean square error over all windows.

        Parameters
        ----------
        signal
            Name of the measured signal.
        """
        return rmse(self.error[signal])


def predict_in_windows(
    model: FlatModel, record: Record, length: float, *, wiring: Wiring | None = None, substeps: int = 1
) -> Prediction:
    """Simulate a record in windows, each from the measured state, driven by the measured inputs.

    Parameters
    ----------
    model
        Continuous, without tables.
    record
        Measured.
    length
        Of a window in s; a last window that is not whole is left out.
    wiring
        By name where ``None``.
    substeps
        Integration steps from sample to sample.

    Raises
    ------
    MeasurementError
        If the record is shorter than one window.
    ConvergenceError
        If a simulation is not finite.
    """
    if length > record.trace.time[-1] - record.trace.time[0] + 0.5 * record.step:
        raise MeasurementError(
            f"record '{record.name}'",
            f"lasts {record.trace.time[-1] - record.trace.time[0]:g} s, which is less than {length:g} s",
            next_step="take shorter windows",
        )
    problem = SimulationError(
        model, [record], [], shots=Shots(length, False, substeps), wiring=wiring, slopes=False
    )
    (windows,) = problem.windows
    kept = (len(record.trace) // windows.count) * windows.count
    rows = problem.residual(problem.start()).reshape(len(problem.sigma), -1) * problem.sigma[:, None]
    error = {name: rows[i, :kept] for i, name in enumerate(problem.wiring.outputs)}
    return Prediction(record.trace.time[:kept], error)


def least_by_cma(
    cost: Callable[[Array], float], within: tuple[Array, Array, Array], *, seed: int, simulations: int
) -> tuple[Array, float, int]:
    """Return where CMA-ES ends, the cost there, and how often it was asked for.

    ``within``: lower ends, upper ends, first point.
    """
    try:
        cma = importlib.import_module("cma")
    except ModuleNotFoundError:
        raise missing_library("a fit by CMA-ES", "cma", "cma") from None
    low, high, first = within
    options = {"bounds": [list(low), list(high)], "seed": seed, "maxfevals": simulations, "verbose": -9}
    best, strategy = cma.fmin2(cost, first, _STEP, options)
    least = float(strategy.result.fbest)
    if not least < _FAILED:
        raise ConvergenceError("a fit by CMA-ES", "no simulation was finite", next_step="narrow the bounds")
    return np.asarray(best), least, int(strategy.result.evaluations)
