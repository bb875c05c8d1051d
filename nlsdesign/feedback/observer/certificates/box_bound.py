"""What boxes around states say of an estimate that is linear in them, at every angle of a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....foundation.errors import ValueRangeError

Array = NDArray[np.float64]


def clamped_estimate_bound(rows: ArrayLike, estimated: ArrayLike, true: ArrayLike) -> float:
    """Return a bound on the error of an estimate t(θ)·x̂ + t₀(θ) whose states are held in boxes.

    It holds for every motion and every current as long as the boxes do: inner states that are driven by the
    measured angle alone stay in the range of their rest values, slow states where they are clamped. States
    whose error is known better enter by that error: ``estimated`` its range, ``true`` zero. It says
    nothing of the error that an estimator reaches, only of the one that it cannot exceed.

    Parameters
    ----------
    rows
        t at the grid points of a table that is read linearly and held at its ends, shape (points, n); a last
        column t₀ that observer and plant share cancels and is left out.
    estimated, true
        Lower and upper bound of each state of the observer and of the plant, shape (n, 2).

    Returns
    -------
    float
        In the unit of the estimate, rounded up.

    Raises
    ------
    ValueRangeError
        If shapes do not agree, or a number is not finite, or bounds are exchanged.
    """
    t, held, real = (np.asarray(v, dtype=float) for v in (rows, estimated, true))
    if t.ndim != 2 or held.shape != (t.shape[1], 2) or real.shape != held.shape:
        raise ValueRangeError(
            f"rows {t.shape}, boxes {held.shape} and {real.shape}",
            "need shapes (points, n), (n, 2) and (n, 2)",
        )
    if not all(np.all(np.isfinite(v)) for v in (t, held, real)):
        raise ValueRangeError("bound of a clamped estimate", "needs finite numbers")
    if np.any(held[:, 0] > held[:, 1]) or np.any(real[:, 0] > real[:, 1]):
        raise ValueRangeError("bound of a clamped estimate", "a lower bound is above its upper bound")
    # Between two grid points t is a mean of theirs, so no angle is worse than the worse of both.
    ends = np.stack([t * (held[:, 0] - real[:, 1]), t * (held[:, 1] - real[:, 0])])
    above, below = np.sum(np.max(ends, axis=0), axis=1), np.sum(np.min(ends, axis=0), axis=1)
    return float(np.max(np.maximum(above, -below), initial=0.0) * (1.0 + 1e-12))
