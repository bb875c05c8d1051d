"""Cams and pulleys: angle to extension. The lever arm is the derivative of the extension.

With an inextensible cable, virtual work gives dδ/dθ = r·sin β = lever arm: one function, not two.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, uniform_spline, uniform_spline_integral
from ..core.element import Scope
from ..core.part import Part, parameter
from ..core.part_numbers import NotDeclared, Reading, read_as


@dataclass(frozen=True)
class Cable(Reading):
    """The cable of a cam and what it bears; it does not enter the law. Source: definition (of these terms).

    Examples
    --------
    >>> Cable(cable_diameter=9e-4, cable_breaking_force=1285.0, cable_bend_ratio=5.0).cable_bend_ratio
    5.0
    """

    cable_diameter: Quantity = parameter("m", "diameter of the cable", minimum=1e-5, maximum=0.05)
    cable_breaking_force: Quantity = parameter(
        "N", "force at which the cable breaks", minimum=0.1, maximum=1e7
    )
    cable_bend_ratio: Quantity = parameter(
        "1",
        "least diameter of a bend of the cable over the diameter of the cable",
        minimum=0.5,
        maximum=200.0,
    )


@dataclass(frozen=True, kw_only=True)
class Cam(Part):
    """Base of everything that turns an angle into an extension."""

    elements: Quantity = parameter(
        "1",
        "number of equal elements that the cam stretches and that share the torque",
        minimum=1.0,
        maximum=100.0,
        default=1.0,
        whole=True,
    )
    cable: Reading = read_as(NotDeclared, Cable, default=NotDeclared())

    @property
    def needs_rate(self) -> bool:
        """False: by itself a cam loses nothing."""
        return False

    def raised(self, scope: Scope, arm: Expression, lift: tuple[Expression, Expression]) -> Expression:
        """Return the factor on the force by what the cam loses; ``lift``: extension in m and its rate."""
        return ca.SX(1)

    @abstractmethod
    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return the extension in m at an angle in rad; zero at angle zero."""

    @abstractmethod
    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return d(extension)/d(angle) in m."""


@dataclass(frozen=True, kw_only=True)
class Pulley(Cam):
    """Round pulley: δ = r·θ, for both signs of the angle; a rack or a gear is the same law.

    Source: definition (rolling without slip).
    """

    radius: Quantity = parameter("m", "radius", minimum=1e-5, maximum=10.0)

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ = r·θ."""
        return scope.parameter("radius") * angle

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return r."""
        return scope.parameter("radius")


def side_of(angle: Expression, width: Expression) -> tuple[Expression, Expression]:
    """Return the angle on the side of a two-sided cam, q = √(θ² + w²) − w, and its derivative; both C∞."""
    root = ca.sqrt(angle * angle + width * width)
    # Without cancellation near zero.
    return angle * angle / (root + width), angle / root


@dataclass(frozen=True, kw_only=True)
class TwoSidedCam(Cam):
    """Cam through whose centre the cable passes: it stretches the rubber for both signs of the angle.

    The lever arm is h(θ) = H(q)·θ/√(θ² + w²) with q = √(θ² + w²) − w, and δ(θ) = ∫₀^q H. H is a uniform cubic
    B-spline with the control values ``lever_arm`` on [0, ``last_angle``], C²; w is the angle over which the
    cable changes sides. δ is even, h odd, and h ≡ dδ/dθ exactly. ``anchor_distance`` is the distance from
    the centre to the fixed end of the cable; it shapes the contour, not the law. Beyond the contour's end
    the lever arm stays what it was there, as on a round run-out; no stop is modelled.
    Source: de Boor 1978 (B-splines); Austin et al. 2015, Fig. 2 (this cam).

    Raises
    ------
    ValueRangeError
        If there are fewer than five control values.
    """

    lever_arm: Quantity = parameter(
        "m", "control values of the lever arm over the angle", minimum=-0.05, maximum=1.0, row=True
    )
    last_angle: Quantity = parameter("rad", "angle at the end of the contour", minimum=0.01, maximum=6.3)
    changeover: Quantity = parameter(
        "rad", "angle over which the cable changes sides", minimum=1e-6, maximum=0.5, default=1e-3
    )
    anchor_distance: Quantity = parameter(
        "m", "distance from the centre to the fixed end of the cable", minimum=1e-3, maximum=1e9, default=1e6
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.lever_arm.values) < 5:
            raise ValueRangeError(
                f"lever_arm with {len(self.lever_arm.values)} control values", "a contour needs at least 5"
            )

    @property
    def step(self) -> float:
        """Distance of the knots in rad."""
        return self.last_angle.number / (len(self.lever_arm.values) - 3)

    def _spacing(self, scope: Scope) -> Expression:
        return scope.parameter("last_angle") / (len(self.lever_arm.values) - 3)

    def extension(self, scope: Scope, angle: Expression) -> Expression:
        """Return δ(θ) = ∫₀^q H."""
        on_side, _ = side_of(angle, scope.parameter("changeover"))
        on_contour = ca.fmin(on_side, scope.parameter("last_angle"))
        row, spacing = scope.row("lever_arm"), self._spacing(scope)
        run_out = uniform_spline(row, 0.0, spacing, on_contour) * (on_side - on_contour)
        return uniform_spline_integral(row, 0.0, spacing, on_contour) + run_out

    def lever_arm_at(self, scope: Scope, angle: Expression) -> Expression:
        """Return h(θ) = dδ/dθ."""
        on_side, slope = side_of(angle, scope.parameter("changeover"))
        on_contour = ca.fmin(on_side, scope.parameter("last_angle"))
        return uniform_spline(scope.row("lever_arm"), 0.0, self._spacing(scope), on_contour) * slope


def control_values(angles: Array, lever_arms: Array, count: int = 40) -> tuple[float, ...]:
    """Return the control values of a uniform cubic B-spline through a tabulated lever arm.

    Parameters
    ----------
    angles
        Ascending from 0, shape (n,), in rad.
    lever_arms
        Shape (n,), in m.
    count
        Number of control values.

    Returns
    -------
    tuple of float
        Least-squares control values; where n is small an interpolating spline is sampled first.

    Raises
    ------
    ValueRangeError
        If the table does not start at zero or is not ascending.
    """
    from scipy.interpolate import make_interp_spline  # a list of parts needs no SciPy

    if angles[0] != 0.0 or np.any(np.diff(angles) <= 0.0):
        raise ValueRangeError(
            "cam table", "angles must ascend from zero", next_step="sort the table by angle"
        )
    dense = np.linspace(0.0, angles[-1], max(6 * count, len(angles)))
    values = make_interp_spline(angles, lever_arms, k=3)(dense)
    position = dense / angles[-1] * (count - 3)
    distance = np.abs(position[:, None] - (np.arange(count) - 1)[None, :])
    basis = (np.clip(2 - distance, 0, None) ** 3 - 4 * np.clip(1 - distance, 0, None) ** 3) / 6
    control_points, *_ = np.linalg.lstsq(basis, values, rcond=None)
    return tuple(float(item) for item in control_points)
