"""Few directions in the space of uncertain numbers along which a machine differs from its deck noticeably.

Most numbers of a prior change nothing that matters, and many change the same: the moduli of a rubber, its
section and its length all scale the torque. The effects of the independent ξ of the prior along the duty
(:mod:`nlsdesign.feedback.observer.corrected.duty`), each in N·m, are the columns of one matrix. Its singular
value decomposition gives orthonormal directions in ξ, so each has unit variance and they stay independent, in
the order of the torque that they move. Those below a stated torque are left out, and their sum is stated: no
observer of this form can know that part.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nlsdesign.feedback.observer import Duty
from nlsdesign.feedback.observer.corrected.duty import (
    STEP,
    OperatingPoints,
    effects_of,
    operating_points,
    root_of,
)
from nlsdesign.feedback.observer.scheduling.angle_form import AngleForm
from nlsdesign.foundation.arrays import Array
from nlsdesign.simulation.prior import Prior


@dataclass(frozen=True, eq=False)
class UncertainDirections:
    """Directions in the space of uncertain numbers, each with unit variance."""

    names: tuple[str, ...]  # numbers that move, in the order of the rows
    slopes: Array  # of the logarithm of each number per unit of each direction, shape (numbers, directions)
    effect: Array  # rms torque that each moves per standard deviation, descending, shape (directions,)
    torque_share: Array  # part of it that is on the torque itself, not on the drive, shape (directions,)
    left_out: float  # rms torque of all directions that were left out

    def values(self, nominal: Mapping[str, float], at: Array) -> dict[str, float]:
        """Return the numbers at a point."""
        factors = np.exp(self.slopes @ at)
        return {name: nominal[name] * float(f) for name, f in zip(self.names, factors, strict=True)}


def uncertain_directions(
    form: AngleForm, prior: Prior, duty: Duty, *, resolution: float, most: int
) -> UncertainDirections:
    """Return the directions that move more torque than a resolution, the largest first."""
    known = prior.only([name for name in prior.names if name in form.model.values])
    root = root_of(known.covariance)
    features, own = _features(form, operating_points(form, duty), known, root)
    left, singular, right = np.linalg.svd(features, full_matrices=False)
    count = min(int(np.sum(singular > resolution)), most)
    slopes = root @ right[:count].T
    # The sign of a singular vector is arbitrary: the largest change is upward.
    slopes = slopes * np.sign(slopes[np.argmax(np.abs(slopes), axis=0), np.arange(count)])
    moved = np.flatnonzero(np.max(np.abs(slopes), axis=1) > 1e-6)
    return UncertainDirections(
        tuple(known.names[i] for i in moved), slopes[moved], singular[:count],
        np.linalg.norm(left[:own, :count], axis=0), float(np.linalg.norm(singular[count:])),
    )  # fmt: skip


def _features(form: AngleForm, points: OperatingPoints, prior: Prior, root: Array) -> tuple[Array, int]:
    """Return the effects in units of torque, shape (rows, ξ), and how many rows are of the torque itself."""
    columns, own = [], 0
    for k in range(root.shape[1]):
        sides = []
        for sign in (STEP, -STEP):
            numbers = prior.numbers(sign * root[:, k])
            spring, drive = effects_of(form.with_values(dict(zip(prior.names, numbers, strict=True))), points)
            sides.append(np.concatenate([spring, drive]))
            own = len(spring)
        columns.append((sides[0] - sides[1]) / (2.0 * STEP))
    return np.array(columns).T, own
