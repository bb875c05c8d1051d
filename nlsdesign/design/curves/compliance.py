"""Springs by their compliance over the torque, which makes the motion of the motor linear in the unknowns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy

from ...foundation.arrays import Array
from .task import TaskCycle

_MARGIN = 1.001
"""The range goes a thousandth beyond the largest sampled torque, which a finer sampling may pass a little."""


@dataclass(frozen=True, eq=False)
class ComplianceSpline:
    """Compliance dδ/dτ as a quadratic B-spline in the torque: positive where its coefficients are.

    The deflection δ(τ) is its exact integral from zero torque, twice continuously differentiable.
    """

    # low, high: range of torque in N·m, which holds zero
    low: float
    high: float
    pieces: int  # number of equal pieces

    @property
    def knots(self) -> Array:
        """Knots in N·m, the outer ones three times."""
        inner = np.linspace(self.low, self.high, self.pieces + 1)
        return np.concatenate([[self.low] * 2, inner, [self.high] * 2])

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.pieces + 2

    def matrices(self, torque: Array) -> tuple[Array, Array, Array]:
        """Return what maps coefficients to deflection and its first two derivatives, shape (n, size) each."""
        spline = scipy.interpolate.BSpline(self.knots, np.eye(self.size), 2)
        integral = spline.antiderivative()
        at = np.clip(torque, self.low, self.high)
        zero = integral(np.array([0.0]))
        return integral(at) - zero, spline(at), spline.derivative()(at)


class SpringSymmetry(ABC):
    """What one direction of a spring says of the other; a small object, chosen with the cam."""

    @abstractmethod
    def spline(self, cycle: TaskCycle, pieces: int) -> ComplianceSpline:
        """Return the spline over the torques of a task."""

    @abstractmethod
    def freedom(self, spline: ComplianceSpline, floor: float) -> tuple[Array, Array]:
        """Return matrix M, shape (size, m), and offset o: coefficients s = o + M·y with y ≥ floor."""


@dataclass(frozen=True)
class OddSpring(SpringSymmetry):
    """The same curve in both directions, as a cam with two equal sides gives."""

    def spline(self, cycle: TaskCycle, pieces: int) -> ComplianceSpline:
        """Return the spline over ± the largest torque."""
        most = _MARGIN * float(np.max(np.abs(cycle.torque)))
        return ComplianceSpline(-most, most, pieces + pieces % 2)

    def freedom(self, spline: ComplianceSpline, floor: float) -> tuple[Array, Array]:
        """Return what couples each coefficient with that of the opposite torque."""
        half = (spline.size + 1) // 2
        matrix = np.zeros((spline.size, half))
        for number in range(half):
            matrix[number, number] = matrix[spline.size - 1 - number, number] = 1.0
        return matrix, np.zeros(spline.size)


@dataclass(frozen=True)
class OneSidedSpring(SpringSymmetry):
    """A curve for positive torque; a stop carries negative torque, as stiff as the stiffest spring."""

    def spline(self, cycle: TaskCycle, pieces: int) -> ComplianceSpline:
        """Return the spline over the torques of the task, with a knot at zero."""
        return _with_knot_at_zero(cycle, pieces)

    def freedom(self, spline: ComplianceSpline, floor: float) -> tuple[Array, Array]:
        """Return what leaves the coefficients free that act on positive torque alone."""
        free = spline.knots[: spline.size] >= -1e-9 * (spline.high - spline.low)
        if spline.low == 0.0:
            free[:] = True
        return np.eye(spline.size)[:, free], np.where(free, 0.0, floor)


@dataclass(frozen=True)
class TwoBranchSpring(SpringSymmetry):
    """Each direction with a curve of its own: the best that any spring could do; no odd cam gives it."""

    def spline(self, cycle: TaskCycle, pieces: int) -> ComplianceSpline:
        """Return the spline over the torques of the task."""
        return _with_knot_at_zero(cycle, pieces)

    def freedom(self, spline: ComplianceSpline, floor: float) -> tuple[Array, Array]:
        """Return what leaves all coefficients free."""
        return np.eye(spline.size), np.zeros(spline.size)


def _with_knot_at_zero(cycle: TaskCycle, pieces: int) -> ComplianceSpline:
    """Return equal pieces over the torques, with zero at a knot; the range grows to a whole piece."""
    low, high = (_MARGIN * each for each in (min(*cycle.torque, 0.0), max(*cycle.torque, 0.0)))
    width = (high - low) / pieces
    below, above = int(np.ceil(-low / width - 1e-9)), int(np.ceil(high / width - 1e-9))
    return ComplianceSpline(-below * width, above * width, below + above)
