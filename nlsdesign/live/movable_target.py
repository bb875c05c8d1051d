"""A target curve whose points are symbols, so that one program answers all of its shapes."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
from scipy.interpolate import PchipInterpolator

from ..design import TabulatedTorque
from ..foundation.arrays import Array
from ..foundation.symbolic import Expression


class MovableTarget:
    """The curve of :class:`~nlsdesign.design.TabulatedTorque` with its pieces as symbols.

    It has what the design problem asks of a target, and is none itself: it has no numbers.

    Parameters
    ----------
    pieces
        Number of pieces between the points.
    last_angle
        In rad, from which bounds and starts of variables follow.
    """

    def __init__(self, pieces: int, last_angle: float) -> None:
        self.symbols = ca.SX.sym("target", 5 * pieces + 3)
        self._breaks = self.symbols[: pieces + 1]
        self._rows = ca.reshape(self.symbols[pieces + 1 : 5 * pieces + 1], 4, pieces)
        self.largest: Expression = self.symbols[5 * pieces + 1]
        self._energy: Expression = self.symbols[5 * pieces + 2]
        self.end: Expression = self._breaks[pieces]
        self._pieces = pieces
        self.last_angle = last_angle

    def energy(self, angle: float) -> Expression:
        """Return the energy below the whole curve."""
        return self._energy

    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque; beyond the ends the outer pieces go on."""
        passed = [angle >= self._breaks[k] for k in range(1, self._pieces)]

        def picked(row: Expression) -> Expression:
            steps = [there * (row[k + 1] - row[k]) for k, there in enumerate(passed)]
            return sum(steps, start=row[0])

        local, result = angle - picked(self._breaks), ca.SX(0)
        for row in range(4):
            result = result * local + picked(self._rows[row, :])
        return result

    def weight_law(self, angle: Expression) -> Expression:
        """Return one: the error counts alike everywhere."""
        return 0.0 * angle + 1.0

    def numbers(self, target: TabulatedTorque) -> Array:
        """Return the numbers of the symbols for a curve with as many pieces."""
        return _numbers_of(target)


@functools.lru_cache(maxsize=8)
def _numbers_of(target: TabulatedTorque) -> Array:
    """Return the numbers of a curve; the same array where it is asked for again, so it cannot be changed."""
    curve = PchipInterpolator(target.angles, target.torques)
    # The curve is monotone between its points, so the largest torque is that of a point.
    ends = [max(target.torques), float(curve.integrate(0.0, target.last_angle))]
    numbers: Array = np.concatenate([curve.x, curve.c.T.ravel(), ends])
    numbers.flags.writeable = False
    return numbers
