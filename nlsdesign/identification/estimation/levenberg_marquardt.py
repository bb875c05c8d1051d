"""Bounded nonlinear least squares: Levenberg–Marquardt, each step the exact minimum inside the box."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ...errors import ConvergenceError

Array = NDArray[np.float64]
Rows = Callable[[Array], tuple[Array, Array]]

ENOUGH = 0.02
"""A predicted gain of half a sum of squares below this cannot matter to any decision on noisy data."""
_LONGEST = 1.5
_ENDLESS = "has slopes that are not finite"
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-9, 1e8


class Minimum(NamedTuple):
    """Where the descent ended.

    Parameters
    ----------
    x
        Point inside the bounds.
    cost
        Half the sum of squares there.
    converged
        Whether no step promised any more; otherwise the number of evaluations ran out.
    """

    x: Array
    cost: float
    converged: bool


def minimise(
    rows: Rows,
    start: Array,
    box: tuple[Array, Array],
    *,
    evaluations: int,
    share: float = 0.0,
    least: float = 0.0,
) -> Minimum:
    """Return the minimum of half a sum of squares within bounds.

    Parameters
    ----------
    rows
        Residuals and their derivatives at a point.
    start
        Inside the bounds.
    box
        Lower and upper bounds.
    evaluations
        At most so many; a point where there is no response counts as a bad one.
    share
        Ends when the predicted gain is below this share of the cost, or below :data:`ENOUGH`.
    least
        Ends too when the predicted gain is below this.

    Raises
    ------
    ConvergenceError
        If there is no response at the start, or its slopes are not finite.
    """
    low, high = box
    x, damping = start, _FIRST_DAMPING
    residual, slope = rows(x)
    cost = 0.5 * float(residual @ residual)
    if not x.size:
        return Minimum(x, cost, True)  # nothing is free: what is known is all there is
    derivatives = _quadratic(residual, slope)
    if derivatives is None:
        raise ConvergenceError("fit", _ENDLESS, next_step="narrow the bounds")
    gradient, curvature = derivatives
    for _ in range(evaluations):
        step = _step(gradient, curvature, damping, (x, low, high))
        gain = -float(gradient @ step) - 0.5 * float(step @ curvature @ step)
        if gain < max(ENOUGH, share * cost, least) * (1.0 if damping <= 1.0 else 1e-2):
            return Minimum(x, cost, True)
        try:
            residual, slope = rows(x + step)
        except ConvergenceError:
            damping *= 10.0
            continue
        new = 0.5 * float(residual @ residual)
        derivatives = _quadratic(residual, slope) if np.isfinite(new) and new < cost else None
        if derivatives is not None:
            good = (cost - new) / gain
            x, (gradient, curvature), cost = x + step, derivatives, new
            damping = max(damping * (0.1 if good > 0.5 else 1.0 if good > 0.1 else 4.0), _LEAST_DAMPING)
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                return Minimum(x, cost, True)
    return Minimum(x, cost, False)


def _quadratic(residual: Array, slope: Array) -> tuple[Array, Array] | None:
    """Return gradient and curvature of half the sum of squares; ``None`` where they overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        gradient, curvature = slope.T @ residual, slope.T @ slope
    finite = np.all(np.isfinite(gradient)) and np.all(np.isfinite(curvature))
    return (gradient, curvature) if finite else None


def _step(gradient: Array, curvature: Array, damping: float, place: tuple[Array, Array, Array]) -> Array:
    """Return the step that minimises the damped quadratic model inside the box."""
    x, low, high = place
    diagonal = np.diag(curvature)
    lower = _root(curvature + np.diag(damping * diagonal), float(diagonal.max()))
    target = -np.linalg.solve(lower, gradient)
    walls = np.maximum(low - x, -_LONGEST), np.minimum(high - x, _LONGEST)
    step: Array = lsq_linear(lower.T, target, walls, method="bvls", tol=1e-14, max_iter=20 * len(x)).x
    return step


def _root(matrix: Array, largest: float) -> Array:
    """Return a lower triangular root of a matrix, lifted where rounding has left it indefinite."""
    lift = 1e-12
    while lift < 1.0:
        try:
            return np.asarray(
                np.linalg.cholesky(matrix + (lift * largest + 1e-300) * np.eye(len(matrix))), dtype=np.float64
            )
        except np.linalg.LinAlgError:
            lift *= 100.0
    raise ConvergenceError("fit", _ENDLESS, next_step="narrow the bounds")
