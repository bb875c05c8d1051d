"""Which combinations of uncertain numbers a machine notices: few directions in the space of all of them.

Every number of the prior is p = p₀·exp(x) with x = L·ξ and independent ξ of unit variance. Most ξ change
nothing that matters, and many change the same: the moduli of a rubber, its section and its length all scale
the torque. The effects of the ξ, each in N·m, are the columns of one matrix:

- the torque of the spring at rest, over the angles of the duty;
- the part of it that relaxes at the frequencies of the duty, and what another rate of relaxation does to it;
- what the drive adds: torque by which the balance of the driven body changes along the duty.

Its singular value decomposition gives orthonormal directions in ξ, so each has unit variance and they stay
independent, in the order of the torque that they move. Those below a stated torque are left out, and their
sum is stated: no observer of this form can know that part.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ArrangementError
from ....simulation.prior import Prior
from ...analysis.rest import evaluate_rows
from ..scheduling.angle_form import AngleForm
from .duty import Duty, OperatingPoints, operating_points

Array = NDArray[np.float64]

STEP = 0.5
"""Change of each ξ for its effect: half a standard deviation to both sides, so that curvature cancels."""


@dataclass(frozen=True, eq=False)
class UncertainDirections:
    """Directions in the space of uncertain numbers, each with unit variance.

    Parameters
    ----------
    names
        Numbers that move, in the order of the rows.
    slopes
        Change of the logarithm of each number per unit of each direction, shape (numbers, directions).
    effect
        Root mean square torque that each direction moves per standard deviation, in the unit of the torque,
        descending, shape (directions,).
    torque_share
        Part of that effect that is one on the estimated torque itself, not on the drive, shape (directions,).
    left_out
        Root mean square torque of all directions that were left out.
    """

    names: tuple[str, ...]
    slopes: Array
    effect: Array
    torque_share: Array
    left_out: float

    def values(self, nominal: Mapping[str, float], at: Array) -> dict[str, float]:
        """Return the numbers at a point.

        Parameters
        ----------
        nominal
            Declared values by name.
        at
            Coordinates along the directions, shape (directions,).
        """
        factors = np.exp(self.slopes @ at)
        return {name: nominal[name] * float(f) for name, f in zip(self.names, factors, strict=True)}

    def in_words(self, direction: int) -> str:
        """Return the numbers that change most along a direction, per standard deviation.

        Parameters
        ----------
        direction
            Counted from zero.
        """
        column = self.slopes[:, direction]
        order = np.argsort(-np.abs(column))
        largest = [int(i) for i in order if abs(column[i]) >= 0.3 * abs(column[order[0]])][:4]
        parts = [f"{self.names[i]} {np.expm1(column[i]):+.1%}" for i in largest]
        return ", ".join(parts) + (", …" if len(order) > len(largest) else "")


def uncertain_directions(
    form: AngleForm, prior: Prior, duty: Duty, *, resolution: float, most: int
) -> UncertainDirections:
    """Return the directions that move more torque than a resolution, the largest first.

    Parameters
    ----------
    form
        Of the model as declared.
    prior
        What is known of the numbers.
    duty
        The motion over which torques are compared.
    resolution
        Torque in its unit below which a direction is left out.
    most
        Largest number of directions.

    Raises
    ------
    ArrangementError
        If no number of the model is uncertain enough to matter.
    """
    known = prior.only([name for name in prior.names if name in form.model.values])
    count = 0
    if np.any(known.deviations):
        root = _root_of(known.covariance)
        features, own = _features(form, operating_points(form, duty), known, root)
        left, singular, right = np.linalg.svd(features, full_matrices=False)
        count = min(int(np.sum(singular > resolution)), most)
    if count == 0:
        raise ArrangementError(
            f"model '{form.model.name}'",
            f"has no uncertain numbers that move the torque by more than {resolution:.2g}",
            next_step="an observer without slow states is enough: leave the adaptation out",
        )
    slopes = root @ right[:count].T
    # The sign of a singular vector is arbitrary: the largest change is upward.
    signs = np.sign(slopes[np.argmax(np.abs(slopes), axis=0), np.arange(count)])
    share = np.linalg.norm(left[:own, :count], axis=0)
    moved = np.flatnonzero(np.max(np.abs(slopes), axis=1) > 1e-6)
    return UncertainDirections(
        tuple(known.names[i] for i in moved),
        (slopes * signs)[moved],
        singular[:count],
        share,
        float(np.linalg.norm(singular[count:])),
    )


def _root_of(covariance: Array) -> Array:
    if np.array_equal(covariance, np.diag(np.diag(covariance))):
        # Independent numbers keep their own directions.
        return np.diag(np.sqrt(np.diag(covariance)))
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * float(values[-1])
    root: Array = vectors[:, kept] * np.sqrt(values[kept])
    return root


def _features(form: AngleForm, points: OperatingPoints, prior: Prior, root: Array) -> tuple[Array, int]:
    """Return the effects in units of torque, shape (rows, ξ), and how many rows are of the torque itself."""
    columns = []
    for k in range(root.shape[1]):
        effects = []
        for sign in (1.0, -1.0):
            factors = np.exp(sign * STEP * root[:, k])
            changed = form.with_values(dict(zip(prior.names, prior.values * factors, strict=True)))
            effects.append(_effects(changed, points))
        up, down = effects
        columns.append([(a - b) / (2.0 * STEP) for a, b in zip(up, down, strict=True)])
    own = np.array([column[0] for column in columns]).T
    drive = np.array([column[1] for column in columns]).T
    return np.vstack([own, drive]), len(own)


def _effects(form: AngleForm, points: OperatingPoints) -> tuple[Array, Array]:
    """Return what the spring gives and what the drive adds, as torques along the duty."""
    k, c = form.inner, form.at(points.angles)
    rest = np.einsum("aj,aj->a", c.estimate[:, :-1], form.rest(points.angles) - c.shift) + c.estimate[:, -1]
    rows = [rest]
    jump = c.estimate[:, :k] * points.carried[:, :k]
    rates = np.maximum(np.abs(np.einsum("aii->ai", c.a[:, :k, :k])), 1e-12)
    for omega in points.pulsations:
        # A relaxing part that follows a sine: jω/(jω + a) of its jump, with a the rate of relaxation.
        passed = 1j * omega / (1j * omega + rates) / np.sqrt(len(points.pulsations))
        rows.extend((jump * passed.real).T)
        rows.extend((jump * passed.imag).T)
    own = np.concatenate(rows) / np.sqrt(len(points.angles))
    rate, wanted = evaluate_rows(form.rates_and_estimate, points.states, points.inputs, form.p)
    drive = (points.inertia * rate[:, form.speed] + wanted[:, 0]) / np.sqrt(len(rate))
    return own, drive
