"""Measures of disagreement between simulation and measurement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....foundation.arrays import Array


class Agreement(NamedTuple):
    """How well a prediction meets a measurement.

    Parameters
    ----------
    rmse
        Root mean square error, in the unit of the signal.
    relative
        Mean relative error in per cent, as in Austin et al. 2015: mean of |error|/|measured|.
    of_spread
        RMSE in per cent of the measurement's standard deviation.
    noise_ratio
        RMSE over the noise floor; 1 is as good as it can be.
    """

    rmse: float
    relative: float
    of_spread: float
    noise_ratio: float


def rmse(error: Array) -> float:
    """Return the root mean square of an error.

    Parameters
    ----------
    error
        Shape (n,).
    """
    return float(np.sqrt(np.mean(np.square(error))))


def agreement(measured: Array, predicted: Array, *, noise: float = 0.0) -> Agreement:
    """Compare a prediction with a measurement.

    Parameters
    ----------
    measured, predicted
        Shape (n,).
    noise
        Noise floor in the unit of the signal; with zero the ratio is infinite.

    Returns
    -------
    Agreement
        The relative error leaves out samples below a tenth of the largest measured size, where the quotient
        says nothing.
    """
    error = predicted - measured
    size = np.abs(measured)
    large = size > 0.1 * size.max()
    spread = float(np.std(measured))
    size_of_error = rmse(error)
    return Agreement(
        size_of_error,
        float(100.0 * np.mean(np.abs(error[large]) / size[large])) if np.any(large) else float("nan"),
        100.0 * size_of_error / spread if spread > 0.0 else float("inf"),
        size_of_error / noise if noise > 0.0 else float("inf"),
    )
