"""Fits by CMA-ES, the yardstick of the paper: no derivatives, many simulations."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.errors import ConvergenceError, missing_library
from ....model import FlatModel
from ..estimation.parameters import Parameter, box
from ..records.measurement import Record
from .simulation_error import Point, Shots, SimulationError, Weights

_FAILED = 1e12
_STEP = 0.3
"""First step on the fitted scale, where a logarithm of 0.3 is a third."""


@dataclass(frozen=True)
class Evolved:
    """Where CMA-ES ended.

    Parameters
    ----------
    values
        In SI by name.
    cost
        Half the sum of squares of residuals and priors, as of :func:`fit_by_simulation`.
    simulations
        How often all records were simulated.
    """

    values: dict[str, float]
    cost: float
    simulations: int


def fit_by_cma(
    model: FlatModel,
    records: Sequence[Record],
    parameters: Sequence[Parameter],
    *,
    shots: Shots,
    weights: Weights | None = None,
    seed: int = 1,
    simulations: int = 5000,
) -> Evolved:
    """Fit parameters with the evolution strategy of Hansen and Ostermeier 2001.

    ``model``, ``records``, ``parameters``, ``shots``, ``weights``: as for :func:`fit_by_simulation`; the
    windows must be apart, since nothing here joins them. ``seed``: of the random numbers; the same seed gives
    the same result.
    """
    try:
        cma = importlib.import_module("cma")
    except ModuleNotFoundError:
        raise missing_library("a fit by CMA-ES", "cma", "cma") from None
    if shots.joined:
        raise ConvergenceError(
            "a fit by CMA-ES", "cannot join windows", next_step="use Shots(length, joined=False)"
        )
    problem = SimulationError(model, records, parameters, shots=shots, weights=weights, slopes=False)
    starts = problem.start().starts

    def cost(x: np.ndarray) -> float:
        try:
            residual = problem.residual(Point(x, starts))
        except ConvergenceError:
            return _FAILED
        return 0.5 * float(residual @ residual)

    low, high, first = box(parameters)
    options = {"bounds": [list(low), list(high)], "seed": seed, "maxfevals": simulations, "verbose": -9}
    best, strategy = cma.fmin2(cost, first, _STEP, options)
    least = float(strategy.result.fbest)
    if not least < _FAILED:
        raise ConvergenceError("a fit by CMA-ES", "no simulation was finite", next_step="narrow the bounds")
    return Evolved(problem.values(np.asarray(best)), least, int(strategy.result.evaluations))
