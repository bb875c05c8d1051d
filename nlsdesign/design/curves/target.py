"""Target curves: the torque that a spring should give over its angle, and the energy below it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import overload

import casadi as ca
import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...foundation.arrays import Array, Mask
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, with_unit
from ...foundation.symbolic import Expression
from .numbers import hold_in_si, in_si, plain

EXACT = 1e-9
"""Work given beyond what was taken up, relative to the largest work, that is but rounding."""


@dataclass(frozen=True, kw_only=True)
class Target(ABC):
    """Base of the target curves; torque resists a positive angle, and the curve is odd.

    Parameters
    ----------
    tolerance
        Half width of the tolerance band in N·m; zero for no band.
    """

    tolerance: Quantity | float = 0.0

    def __post_init__(self) -> None:
        hold_in_si(self, "tolerance", "N*m", maximum=1e6)

    @property
    @abstractmethod
    def last_angle(self) -> float:
        """Angle in rad up to which the curve is asked for."""

    @abstractmethod
    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque in N·m at an angle in rad, 0 ≤ angle."""

    @abstractmethod
    def energy_law(self, angle: Expression) -> Expression:
        """Return ∫₀ torque in J."""

    def weight_law(self, angle: Expression) -> Expression:
        """Return the weight of the error at an angle: the square of the error counts as often; one.

        Only the ratio of weights matters: the mean square error of a design is ∫w·e² dθ / ∫w dθ.
        """
        return 0.0 * angle + 1.0

    def weight(self, angle: ArrayLike) -> Array:
        """Return the weight of the error, of the same shape.

        Parameters
        ----------
        angle
            Numbers of any shape in rad.
        """
        return np.asarray(_over(self.weight_law, np.asarray(angle, dtype=float)))

    @overload
    def torque(self, angle: Expression) -> Expression: ...
    @overload
    def torque(self, angle: ArrayLike) -> Array: ...
    def torque(self, angle: Expression | ArrayLike) -> Expression | Array:
        """Return the torque.

        Parameters
        ----------
        angle
            In rad, symbolic (scalar) or numbers of any shape, from zero to ``last_angle``.

        Returns
        -------
        casadi.SX or numpy.ndarray
            Of the same shape, in N·m.
        """
        return _over(self.torque_law, angle)

    @overload
    def energy(self, angle: Expression) -> Expression: ...
    @overload
    def energy(self, angle: ArrayLike) -> Array: ...
    def energy(self, angle: Expression | ArrayLike) -> Expression | Array:
        """Return the energy ∫₀ torque that the spring stores.

        Parameters
        ----------
        angle
            As for :meth:`torque`.

        Returns
        -------
        casadi.SX or numpy.ndarray
            Of the same shape, in J.
        """
        return _over(self.energy_law, angle)

    @property
    def initial_stiffness(self) -> float:
        """Slope of the curve at angle zero in N·m/rad, as the one-sided limit."""
        step = 1e-7 * self.last_angle
        return float(self.torque(step) / step)

    @property
    def falls(self) -> bool:
        """Whether the torque falls anywhere: there the stiffness is negative, and a cam may snap through."""
        torque = self.torque(np.linspace(0.0, self.last_angle, 401))
        return bool(np.min(np.diff(torque)) < -1e-9 * float(np.max(torque)))

    @property
    def largest(self) -> float:
        """Largest magnitude of the torque in N·m."""
        return float(np.max(np.abs(self.torque(np.linspace(0.0, self.last_angle, 201)))))

    def band(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Return the lower and upper edge of the tolerance band.

        Parameters
        ----------
        angle
            Numbers of any shape in rad.
        """
        middle, half = self.torque(np.asarray(angle, dtype=float)), plain(self.tolerance)
        return middle - half, middle + half


@dataclass(frozen=True, kw_only=True)
class ExponentialTorque(Target):
    """τ(θ) = τ_max·(e^{cθ} − 1)/(e^{cθ_max} − 1); gentle near zero, stiff at the end.

    Source: Schepelmann et al. 2014, with c = 1, 5 N·m, 53°.

    Parameters
    ----------
    maximum
        Torque in N·m at the last angle.
    angle
        Last angle in rad.
    shape
        c of the law, a bare number in 1/rad; negative for a softening curve. Zero would be a straight line:
        see :class:`PowerTorque`.

    Raises
    ------
    ValueRangeError
        If the shape is zero, which would be a straight line.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import degrees
    >>> curve = ExponentialTorque(maximum=5.0, angle=degrees(53.0), shape=1.0)
    >>> round(float(curve.torque(degrees(53.0))), 9), round(curve.initial_stiffness, 3)
    (5.0, 3.285)
    """

    maximum: Quantity | float
    angle: Quantity | float
    shape: Quantity | float

    def __post_init__(self) -> None:
        super().__post_init__()
        hold_in_si(self, "maximum", "N*m", minimum=1e-6, maximum=1e6)
        hold_in_si(self, "angle", "rad", minimum=1e-3, maximum=6.3)
        hold_in_si(self, "shape", "1", minimum=-50.0, maximum=50.0)
        if abs(plain(self.shape)) < 1e-6:
            raise ValueRangeError(
                "shape = 0", "the curve would be a straight line",
                next_step="use PowerTorque(coefficient=maximum/angle, exponent=1.0, angle=angle)",
            )  # fmt: skip

    @property
    def last_angle(self) -> float:
        """The last angle."""
        return plain(self.angle)

    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque."""
        shape = plain(self.shape)
        return plain(self.maximum) * ca.expm1(shape * angle) / math.expm1(shape * self.last_angle)

    def energy_law(self, angle: Expression) -> Expression:
        """Return the energy."""
        shape = plain(self.shape)
        grown = ca.expm1(shape * angle) / shape - angle
        return plain(self.maximum) * grown / math.expm1(shape * self.last_angle)


@dataclass(frozen=True, kw_only=True)
class PowerTorque(Target):
    """τ(θ) = C·θⁿ, with n ≥ 1; n = 1 is a linear spring.

    Parameters
    ----------
    coefficient
        C in N·m/radⁿ, a bare number.
    exponent
        n of the law, a pure number from 1 on.
    angle
        Last angle in rad.

    Examples
    --------
    >>> float(PowerTorque(coefficient=2.0, exponent=2.0, angle=1.0).energy(0.5))
    0.08333333333333333
    """

    coefficient: float
    exponent: float
    angle: Quantity | float

    def __post_init__(self) -> None:
        super().__post_init__()
        hold_in_si(self, "coefficient", "1", minimum=1e-9)
        hold_in_si(self, "exponent", "1", minimum=1.0, maximum=20.0)
        hold_in_si(self, "angle", "rad", minimum=1e-3, maximum=6.3)

    @property
    def last_angle(self) -> float:
        """The last angle."""
        return plain(self.angle)

    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque."""
        return self.coefficient * angle**self.exponent

    def energy_law(self, angle: Expression) -> Expression:
        """Return the energy."""
        return self.coefficient * angle ** (self.exponent + 1.0) / (self.exponent + 1.0)


@dataclass(frozen=True, kw_only=True)
class TabulatedTorque(Target):
    """A curve through given points, interpolated without new bumps, C¹.

    Source: Fritsch and Butland 1984 (the monotone cubic of ``scipy.interpolate.PchipInterpolator``).

    Parameters
    ----------
    angles
        Ascending from zero, in rad.
    torques
        From zero, in N·m. They may fall below zero where the spring has taken up enough work before; a cam
        with a cable cannot follow there, one with a roller can.
    weights
        Weight of the error at each point, see :meth:`Target.weight_law`; straight between them. Empty for one
        everywhere.
    slopes
        Stiffness at each point in N·m/rad, where it is known; empty for the monotone cubic.

    Raises
    ------
    ValueRangeError
        If the points are out of order, the curve does not start at zero or gives work that it has not taken
        up, or a weight is negative.
    """

    angles: tuple[float, ...]
    torques: tuple[float, ...]
    weights: tuple[float, ...] = ()
    slopes: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "angles", tuple(float(item) for item in self.angles))
        object.__setattr__(self, "torques", tuple(float(item) for item in self.torques))
        points = table_of_curve("target table", "torque", self.angles, self.torques)
        if points[1, 0] != 0.0:
            raise ValueRangeError("target table", "torques must start at zero")
        work = scipy.integrate.cumulative_trapezoid(points[1], points[0])
        given = np.flatnonzero(work < -EXACT * np.max(np.abs(work)))
        if len(given):
            raise ValueRangeError(
                f"target table, row {given[0] + 2}", "gives more work than the spring has taken up before",
                next_step="torque resists a positive angle: turn the sign of the torques, or of the angle",
            )  # fmt: skip
        if self.slopes:
            object.__setattr__(self, "slopes", tuple(float(item) for item in self.slopes))
            table_of_curve("target table", "slope", self.angles, self.slopes)
        if self.weights:
            object.__setattr__(self, "weights", tuple(float(item) for item in self.weights))
            weights = table_of_curve("target table", "weight", self.angles, self.weights)[1]
            if np.any(weights < 0.0) or not np.any(weights > 0.0):
                raise ValueRangeError(
                    "target table", "weights must be nowhere negative and somewhere positive"
                )

    @property
    def _curve(self) -> scipy.interpolate.PPoly:
        if self.slopes:
            return scipy.interpolate.CubicHermiteSpline(self.angles, self.torques, self.slopes)
        return scipy.interpolate.PchipInterpolator(self.angles, self.torques)

    @property
    def last_angle(self) -> float:
        """The last angle of the table."""
        return self.angles[-1]

    def torque_law(self, angle: Expression) -> Expression:
        """Return the interpolated torque."""
        return piecewise(self._curve, angle)

    def energy_law(self, angle: Expression) -> Expression:
        """Return the exact integral of the interpolation."""
        return piecewise(self._curve.antiderivative(), angle)

    def weight_law(self, angle: Expression) -> Expression:
        """Return the weight, straight between the points."""
        return piecewise(straight(self.angles, self.weights), angle) if self.weights else 0.0 * angle + 1.0


def table_of_curve(table: str, what: str, angles: tuple[float, ...], values: tuple[float, ...]) -> Array:
    """Return the points of a curve over the angle, shape (2, n), after a check of their order."""
    points = np.array([angles, values]) if len(angles) == len(values) else np.zeros(0)
    if points.size < 6 or not np.all(np.isfinite(points)):
        raise ValueRangeError(
            f"{table} of {len(angles)} angles and {len(values)} {what}s",
            f"needs at least three points, one finite {what} for each angle",
        )
    steps = np.diff(points[0])
    if points[0, 0] != 0.0 or np.any(steps <= 0.0) or points[0, -1] > 6.3:
        row = 0 if points[0, 0] != 0.0 else int(np.argmax(steps <= 0.0)) + 1
        raise ValueRangeError(
            f"{table}, row {row + 1}", "angles must ascend from zero, in rad",
            next_step="sort the table by angle and convert degrees to rad",
        )  # fmt: skip
    return points


def straight(at: tuple[float, ...], values: tuple[float, ...]) -> scipy.interpolate.PPoly:
    """Return the straight lines between points."""
    return scipy.interpolate.PPoly(np.array([np.diff(values) / np.diff(at), values[:-1]]), np.array(at))


def piecewise(polynomial: scipy.interpolate.PPoly, at: Expression) -> Expression:
    """Return a piecewise polynomial as an expression; beyond its ends the outer pieces go on."""
    inner = [float(item) for item in polynomial.x[1:-1]]
    local = at - ca.pw_const(at, inner, [float(item) for item in polynomial.x[:-1]])
    result = ca.SX(0)
    for row in polynomial.c:
        result = result * local + ca.pw_const(at, inner, [float(item) for item in row])
    return result


def _over(law: Callable[[Expression], Expression], angle: Expression | ArrayLike) -> Expression | Array:
    if isinstance(angle, ca.SX):
        return law(angle)
    given = np.asarray(angle, dtype=float)
    symbol = ca.SX.sym("angle")
    function = ca.Function("law", [symbol], [law(symbol)])
    return np.array(function(given.reshape(1, -1)), dtype=float).reshape(given.shape)


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
        hold_in_si(self, "angle", "rad", minimum=1e-3, maximum=6.3)
        if not any(each != 0.0 for each in given):
            raise ValueRangeError(
                f"PolynomialTorque of {len(given)} coefficients", "is zero everywhere",
                next_step="give c₁, c₂, … in N·m/rad, N·m/rad², …",
            )  # fmt: skip
        # Where torque per angle is least, and the torque there.
        per_angle = np.polynomial.Polynomial(self.coefficients)
        flat = per_angle.deriv().roots()
        real = np.real(flat[np.abs(np.imag(flat)) < 1e-9])
        inner = [float(each) for each in real if 0.0 < float(each) < self.last_angle]
        least_angle = min((0.0, self.last_angle, *inner), key=lambda angle: float(per_angle(angle)))
        # At zero the torque is zero whatever its slope; a little beyond it has the sign of that slope.
        at = least_angle or 1e-6 * self.last_angle
        lowest = float(per_angle(at)) * at
        if lowest < 0.0:
            raise ValueRangeError(
                f"PolynomialTorque at {at:.4g} rad",
                f"the torque is {with_unit(f'{lowest:.3g}', 'N*m')}, and must be nowhere negative",
                next_step="end the curve before that angle, or give a larger c1",
            )

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
