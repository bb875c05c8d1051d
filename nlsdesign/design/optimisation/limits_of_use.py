"""Limits on how a design is used: beyond its last angle, within a band, over a task."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from ...foundation.errors import UnitError, ValueRangeError
from ...foundation.quantity import Quantity, same_dimension
from ..curves.numbers import in_si, plain
from ..curves.shapes import TorqueBand
from .design_point import DesignPoint
from .goals import Goal
from .limits import Bound, Limit, MaximumCableTension, MaximumStrain, MaximumStress


@dataclass(frozen=True)
class OverTravel(Limit):
    """Limits of rubber and cable that hold beyond the last angle too, where the lever arm stays what it was.

    Parameters
    ----------
    angle
        Travel beyond the last angle of the target, in rad.
    limits
        Those that must hold there: strain, stress, cable tension.

    Raises
    ------
    ValueRangeError
        If no limit is named, or one of another kind.
    """

    angle: Quantity | float
    limits: tuple[Limit, ...]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "angle", in_si("OverTravel: angle", self.angle, "rad", minimum=0.0, maximum=3.2)
        )
        object.__setattr__(self, "limits", tuple(self.limits))
        allowed = (MaximumStrain, MaximumStress, MaximumCableTension)
        if not self.limits or not all(isinstance(limit, allowed) for limit in self.limits):
            raise ValueRangeError(
                "OverTravel: limits", "needs limits of strain, stress or cable tension",
                next_step="OverTravel(angle, limits=(MaximumStrain(1.0),))",
            )  # fmt: skip

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield the bounds of its limits at the end of the over-travel."""
        beyond = design.turned_beyond(plain(self.angle))
        for limit in self.limits:
            for bound in limit.bounds(beyond):
                yield self.bound(
                    f"{bound.of} at over-travel",
                    bound.expression,
                    bound.value,
                    upper=bound.upper,
                    unit=bound.unit,
                    scale=bound.scale,
                )


@dataclass(frozen=True)
class TorqueWithin(Limit):
    """Torque between a lower and an upper curve at every angle of the contour that the band covers.

    Parameters
    ----------
    band
        Lower and upper curve, in N·m over rad; in a design file the columns of the target's file.

    Raises
    ------
    ValueRangeError
        If the band ends before the target does.
    """

    band: TorqueBand

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both edges at the nodes of the contour, without angle zero, where there may be no torque.

        Raises
        ------
        ValueRangeError
            If the band ends before the target does.
        """
        if self.band.last_angle < design.target.last_angle * (1 - 1e-9):
            raise ValueRangeError(
                f"TorqueWithin: band up to {self.band.last_angle:.4g} rad",
                f"ends before the target does, at {design.target.last_angle:.4g} rad",
                next_step="continue both curves to the last angle of the target",
            )
        angles = [design.angles[i] for i in range(1, design.angles.shape[0])]
        low = ca.vertcat(*[self.band.lower_law(angle) for angle in angles])
        high = ca.vertcat(*[self.band.upper_law(angle) for angle in angles])
        torques, scale = design.torques[1:], design.target.largest
        yield self.bound("torque above band", torques - low, 0.0, upper=False, unit="mN*m", scale=scale)
        yield self.bound("torque below band", torques - high, 0.0, upper=True, unit="mN*m", scale=scale)


@dataclass(frozen=True)
class AtMost(Limit):
    """What a goal measures, as a limit: mass, size, energy lost, error on both strokes.

    Parameters
    ----------
    of
        The goal that measures it, for instance :class:`LeastMass`.
    value
        Quantity, or a bare number in SI.

    Examples
    --------
    >>> from nlsdesign.design import LeastSize
    >>> AtMost(LeastSize(), 0.02).value
    0.02
    """

    of: Goal
    value: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound.

        Raises
        ------
        UnitError
            If the value is in a unit of something else.
        """
        measure = self.of.measured(design)
        if isinstance(self.value, Quantity) and not same_dimension(self.value.unit, measure.unit):
            raise UnitError(
                f"AtMost: {measure.what} = {self.value}", f"'{self.value.unit}' is no unit of it",
                next_step=f"give it in a unit like '{measure.unit}'",
            )  # fmt: skip
        yield self.bound(measure.what, measure.expression, plain(self.value), upper=True, unit=measure.unit)
