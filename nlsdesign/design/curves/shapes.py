"""More ways to say a target: a polynomial, the stiffness over the angle, and a band of torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...foundation.arrays import Mask
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, with_unit
from ...foundation.symbolic import Expression
from .numbers import in_si, plain
from .target import Target, piecewise, straight, table_of_curve


@dataclass(frozen=True, kw_only=True)
class PolynomialTorque(Target):
    """τ(θ) = c₁·θ + c₂·θ² + …; zero at angle zero by construction. It may fall: see :attr:`Target.falls`.

    Parameters
    ----------
    coefficients
        c₁, c₂, … in N·m/rad, N·m/rad², …, bare numbers.
    angle
        Last angle in rad.

    Raises
    ------
    ValueRangeError
        If there is no coefficient, or the torque is negative anywhere.

    Examples
    --------
    >>> float(PolynomialTorque(coefficients=(1.0, 0.0, 3.0), angle=1.0).torque(0.5))
    0.875
    """

    coefficients: tuple[float, ...]
    angle: Quantity | float

    def __post_init__(self) -> None:
        super().__post_init__()
        given = tuple(
            in_si(f"coefficients[{number}]", each, "1", minimum=-1e9, maximum=1e9)
            for number, each in enumerate(self.coefficients, start=1)
        )
        object.__setattr__(self, "coefficients", given)
        object.__setattr__(self, "angle", in_si("angle", self.angle, "rad", minimum=1e-3, maximum=6.3))
        if not any(each != 0.0 for each in given):
            raise ValueRangeError(
                f"PolynomialTorque of {len(given)} coefficients", "is zero everywhere",
                next_step="give c₁, c₂, … in N·m/rad, N·m/rad², …",
            )  # fmt: skip
        at, lowest = self._lowest()
        if lowest < 0.0:
            raise ValueRangeError(
                f"PolynomialTorque at {at:.4g} rad",
                f"the torque is {with_unit(f'{lowest:.3g}', 'N*m')}, and must be nowhere negative",
                next_step="end the curve before that angle, or give a larger c1",
            )

    def _lowest(self) -> tuple[float, float]:
        """Return where torque per angle is least, and the torque there."""
        per_angle = np.polynomial.Polynomial(self.coefficients)
        flat = per_angle.deriv().roots()
        real = np.real(flat[np.abs(np.imag(flat)) < 1e-9])
        inner = [float(each) for each in real if 0.0 < float(each) < self.last_angle]
        at = min((0.0, self.last_angle, *inner), key=lambda angle: float(per_angle(angle)))
        # At zero the torque is zero whatever its slope; a little beyond it has the sign of that slope.
        beside = at or 1e-6 * self.last_angle
        return beside, float(per_angle(beside)) * beside

    @property
    def last_angle(self) -> float:
        """The last angle."""
        return plain(self.angle)

    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque."""
        total = 0.0 * angle
        for coefficient in reversed(self.coefficients):
            total = (total + coefficient) * angle
        return total

    def energy_law(self, angle: Expression) -> Expression:
        """Return the energy."""
        total = 0.0 * angle
        for power, coefficient in reversed(list(enumerate(self.coefficients, start=2))):
            total = (total + coefficient / power) * angle
        return total * angle


@dataclass(frozen=True, kw_only=True)
class TabulatedStiffness(Target):
    """The stiffness over the angle; the torque is its integral from zero, so it never falls.

    Parameters
    ----------
    angles
        Ascending from zero, in rad.
    stiffnesses
        dτ/dθ in N·m/rad at these angles, nowhere negative; straight between them.

    Raises
    ------
    ValueRangeError
        If the points are out of order, a stiffness is negative, or all are zero.

    Examples
    --------
    >>> curve = TabulatedStiffness(angles=(0.0, 0.5, 1.0), stiffnesses=(2.0, 2.0, 4.0))
    >>> float(curve.torque(1.0))
    2.5
    """

    angles: tuple[float, ...]
    stiffnesses: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "angles", tuple(float(item) for item in self.angles))
        object.__setattr__(self, "stiffnesses", tuple(float(item) for item in self.stiffnesses))
        values = table_of_curve("stiffness table", "stiffness", self.angles, self.stiffnesses)[1]
        if np.any(values < 0.0) or not np.any(values > 0.0):
            row = int(np.argmax(values < 0.0)) + 1
            raise ValueRangeError(
                f"stiffness table, row {row}" if np.any(values < 0.0) else "stiffness table",
                "stiffness must be nowhere negative and somewhere positive",
                next_step="for a curve that falls give the torque itself: TabulatedTorque(angles, torques)",
            )

    @classmethod
    def sampled(
        cls, stiffness: Callable[[float], float], *, angle: Quantity | float, count: int = 101
    ) -> TabulatedStiffness:
        """Return the target of a function of the angle, taken at equally spaced angles.

        Parameters
        ----------
        stiffness
            From angle in rad to N·m/rad.
        angle
            Last angle in rad.
        count
            Number of angles.
        """
        last = in_si("angle", angle, "rad", minimum=1e-3, maximum=6.3)
        grid = [float(each) for each in np.linspace(0.0, last, count)]
        return cls(angles=tuple(grid), stiffnesses=tuple(float(stiffness(each)) for each in grid))

    @property
    def last_angle(self) -> float:
        """The last angle of the table."""
        return self.angles[-1]

    def torque_law(self, angle: Expression) -> Expression:
        """Return the exact integral of the stiffness."""
        return piecewise(straight(self.angles, self.stiffnesses).antiderivative(), angle)

    def energy_law(self, angle: Expression) -> Expression:
        """Return the exact integral of the torque."""
        return piecewise(straight(self.angles, self.stiffnesses).antiderivative(2), angle)


@dataclass(frozen=True, kw_only=True)
class TorqueBand:
    """Torques between which a spring has to stay, straight between the points.

    Parameters
    ----------
    angles
        Ascending from zero, in rad.
    lower, upper
        In N·m at these angles, the lower below the upper; at angle zero both may be zero, where every
        two-sided spring has no torque.

    Raises
    ------
    ValueRangeError
        If the points are out of order, the band has no width, or angle zero is outside it.

    Examples
    --------
    >>> band = TorqueBand(angles=(0.0, 0.5, 1.0), lower=(0.0, 0.8, 2.0), upper=(0.0, 1.2, 3.0))
    >>> band.contains([0.5, 1.0], [1.0, 3.5]).tolist()
    [True, False]
    """

    angles: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("angles", "lower", "upper"):
            object.__setattr__(self, name, tuple(float(item) for item in getattr(self, name)))
        low = table_of_curve("band", "lower torque", self.angles, self.lower)[1]
        high = table_of_curve("band", "upper torque", self.angles, self.upper)[1]
        closed = high <= low
        closed[0] = high[0] < low[0]
        if np.any(closed):
            row = int(np.argmax(closed))
            raise ValueRangeError(
                f"band, row {row + 1} ({self.angles[row]:.4g} rad)",
                f"the lower torque {low[row]:.4g} must be below the upper {high[row]:.4g}",
                next_step="exchange the columns, or widen the band there",
            )
        if not low[0] <= 0.0 <= high[0]:
            raise ValueRangeError(
                f"band at angle zero, {low[0]:.4g} to {high[0]:.4g} N·m",
                "must hold zero: a two-sided spring has no torque there",
                next_step="let the lower curve start at or below zero and the upper at or above",
            )

    @classmethod
    def between(cls, lower: Target, upper: Target, *, count: int = 101) -> TorqueBand:
        """Return the band between two target curves, taken at equally spaced angles.

        Parameters
        ----------
        lower, upper
            Up to the smaller of their last angles.
        count
            Number of angles.
        """
        grid = np.linspace(0.0, min(lower.last_angle, upper.last_angle), count)
        return cls(angles=tuple(grid), lower=tuple(lower.torque(grid)), upper=tuple(upper.torque(grid)))

    @property
    def last_angle(self) -> float:
        """Angle in rad up to which the band is stated."""
        return self.angles[-1]

    def lower_law(self, angle: Expression) -> Expression:
        """Return the smallest torque in N·m at an angle in rad, 0 ≤ angle."""
        return piecewise(straight(self.angles, self.lower), angle)

    def upper_law(self, angle: Expression) -> Expression:
        """Return the largest torque in N·m at an angle in rad, 0 ≤ angle."""
        return piecewise(straight(self.angles, self.upper), angle)

    def contains(self, angle: ArrayLike, torque: ArrayLike) -> Mask:
        """Tell for each point whether it lies in the band, the edges included.

        Parameters
        ----------
        angle, torque
            Of one shape, in rad and N·m.
        """
        at, given = np.asarray(angle, dtype=float), np.asarray(torque, dtype=float)
        low, high = (np.interp(at, self.angles, edge) for edge in (self.lower, self.upper))
        inside: Mask = (low <= given) & (given <= high)
        return inside
