"""Bounded nonlinear least squares: Levenberg–Marquardt, each step the exact minimum inside the box.

Positive numbers are fitted on a logarithmic scale, where most of what is nonlinear is mild. But many laws
are linear in their numbers: friction, drag, inertia. Where two such numbers can nearly stand for each
other and the records are far sharper than the model is right, the valley of the cost is narrow and bent
on that scale, and a step along its tangent leaves it. A step that fails is therefore tried once more as a
straight line in the numbers themselves, which follows such a valley to its end.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ConvergenceError

Rows = Callable[[Array], tuple[Array, Array]]

ENOUGH = 0.02
"""A predicted gain of half a sum of squares below this cannot matter to any decision on noisy data."""
_LONGEST = 1.5
_LONGEST_STRAIGHT = 3.0
"""Largest change of a logarithm in a step that is straight in the number itself."""
_STRAIGHT_FAILURES = 3
"""So many straight steps may fail in a row: then the model is not linear in its numbers."""
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
    logarithmic: Mask | None = None,
) -> Minimum:
    """Return the minimum of half a sum of squares within bounds.

    ``evaluations``: at most so many; a point where there is no response counts as a bad one. ``logarithmic``:
    which coordinates are logarithms of positive numbers, in the shape of the start; by default none.
    """
    x, damping, used = start, _FIRST_DAMPING, 0
    residual, slope = rows(x)
    if not x.size:
        return Minimum(x, 0.5 * float(residual @ residual), True)  # what is known is all there is
    here = _linearised(residual, slope)
    if here is None:
        raise ConvergenceError("fit", _ENDLESS, next_step="narrow the bounds")
    logs = np.zeros(x.shape, dtype=bool) if logarithmic is None else logarithmic
    straight_left = _STRAIGHT_FAILURES if logs.any() else 0
    while used < evaluations:
        step = _step(here, damping, _walls(x, box))
        gain = here.gain(step)
        if gain < max(ENOUGH, share * here.cost, least) * (1.0 if damping <= 1.0 else 1e-2):
            return Minimum(x, here.cost, True)
        used, there = used + 1, _better(rows, x + step, here)
        if there is None and straight_left and used < evaluations:
            straight = _step(here, damping, _straight_walls(x, box, logs))
            step, gain = (
                np.where(logs, np.log1p(np.where(logs, straight, 0.0)), straight),
                here.gain(straight),
            )
            used, there = used + 1, _better(rows, x + step, here)
            straight_left = _STRAIGHT_FAILURES if there else straight_left - 1
        if there is not None:
            good = (here.cost - there.cost) / gain
            x, here = x + step, there
            damping = max(damping * (0.1 if good > 0.5 else 1.0 if good > 0.1 else 4.0), _LEAST_DAMPING)
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                return Minimum(x, here.cost, True)
    return Minimum(x, here.cost, False)


class _Linearised(NamedTuple):
    """Half a sum of squares at a point, its gradient, and the curvature of the linearised residuals."""

    cost: float
    gradient: Array
    curvature: Array

    def gain(self, step: Array) -> float:
        """Return by how much the linearised residuals promise to lower the cost."""
        return -float(self.gradient @ step) - 0.5 * float(step @ self.curvature @ step)


def _linearised(residual: Array, slope: Array) -> _Linearised | None:
    """Return what is needed for a step; ``None`` where it overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        cost, gradient, curvature = 0.5 * float(residual @ residual), slope.T @ residual, slope.T @ slope
    finite = np.all(np.isfinite(gradient)) and np.all(np.isfinite(curvature))
    return _Linearised(cost, gradient, curvature) if finite else None


def _better(rows: Rows, x: Array, here: _Linearised) -> _Linearised | None:
    """Return what is at a point if the cost is lower there than here; no response is a bad one."""
    try:
        residual, slope = rows(x)
    except ConvergenceError:
        return None
    cost = 0.5 * float(residual @ residual)
    return _linearised(residual, slope) if np.isfinite(cost) and cost < here.cost else None


def _walls(x: Array, box: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the least and the largest step."""
    return np.maximum(box[0] - x, -_LONGEST), np.minimum(box[1] - x, _LONGEST)


def _straight_walls(x: Array, box: tuple[Array, Array], logs: Mask) -> tuple[Array, Array]:
    """Return the least and the largest step, of logarithms as shares of the number."""
    usual = _walls(x, box)
    far = np.maximum(box[0] - x, -_LONGEST_STRAIGHT), np.minimum(box[1] - x, _LONGEST_STRAIGHT)
    low, high = (np.where(logs, np.expm1(f), u) for f, u in zip(far, usual, strict=True))
    return low, high


def _step(here: _Linearised, damping: float, walls: tuple[Array, Array]) -> Array:
    """Return the step that minimises the damped quadratic model inside the box."""
    diagonal = np.diag(here.curvature)
    lower = _root(here.curvature + np.diag(damping * diagonal), float(diagonal.max()))
    target = -np.linalg.solve(lower, here.gradient)
    step: Array = lsq_linear(lower.T, target, walls, method="bvls", tol=1e-14, max_iter=20 * len(target)).x
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
