"""Limits of a cam on which a roller runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from ...foundation.symbolic import Expression
from ..curves.numbers import plain
from .design_point import DesignPoint
from .edges import RollerEdge
from .limits import Bound, Limit


def _edge(limit: Limit, design: DesignPoint) -> RollerEdge:
    if not isinstance(design.edge, RollerEdge):
        raise ArrangementError(
            f"{type(limit).__name__} of '{design.cam.name}'", "is of a cam with a roller, not a cable",
            next_step="leave the limit out, or give the spring a RollerCam",
        )  # fmt: skip
    return design.edge


_FRICTION = (0.05, 0.2)
"""Coefficient of friction of guides, from greased bronze to dry polymer. Assumed."""


def side_forces(design: DesignPoint, value: Callable[[Expression], Array]) -> Iterator[str]:
    """Yield what a follower's guide bears, and how far its friction moves the torque from the curve at rest.

    ``value``: gives the numbers of an expression at the design.
    """
    roller = design.cam.roller
    if roller is None or not isinstance(design.edge, RollerEdge):
        return
    slopes = np.tan(value(design.edge.pressure_angles))
    force = float(np.max(value(design.elements * design.forces) * slopes))
    friction, of = _FRICTION, "that is not declared (SlidingGuide),"
    if roller.guide_friction is not None:
        friction, of = (design.model.values[roller.guide_friction],) * 2, "as declared,"
    shares = [100.0 * each * float(slopes.max()) / (1.0 - each * float(slopes.max())) for each in friction]
    least, most = (f"at {each:.3g} up to {share:.2g} %" for each, share in zip(friction, shares, strict=True))
    yield (
        f"the guide of the follower bears up to {force:.3g} N sideways; with a friction {of} "
        f"{least if least == most else f'{least} and {most}'} more torque lifts it than the curve at "
        "rest, and less lets it down; the roller's bearing is left out"
    )


@dataclass(frozen=True)
class MaximumPressureAngle(Limit):
    """Angle between the normal of the edge and the line of the follower ≤ angle, or its guide jams.

    The guide takes the side force F·tan α. Source: Norton 2009, ch. 7 (30° for a follower that slides).

    Parameters
    ----------
    angle
        Largest pressure angle, in rad.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import degrees
    >>> round(MaximumPressureAngle(degrees(30.0)).angle, 4)
    0.5236
    """

    angle: Quantity | float

    def __post_init__(self) -> None:
        self.number("angle", "rad", 0.01, math.radians(85.0))

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the angle.

        Raises
        ------
        ArrangementError
            If no roller runs on the cam.
        """
        angles = _edge(self, design).pressure_angles
        yield self.bound("pressure angle", angles, plain(self.angle), upper=True, unit="deg")


@dataclass(frozen=True)
class MinimumHollowRadius(Limit):
    """Radius of curvature of the edge where it is hollow ≥ radius: wider than the roller, and than the tool.

    Parameters
    ----------
    radius
        Least radius of a hollow, in m; larger than that of the roller, which else touches two places.

    Examples
    --------
    >>> MinimumHollowRadius(0.004).radius
    0.004
    """

    radius: Quantity | float

    def __post_init__(self) -> None:
        self.number("radius", "m", 1e-4, 0.5)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the angle.

        Raises
        ------
        ArrangementError
            If no roller runs on the cam.
        ValueRangeError
            If the roller would not fit into the hollow.
        """
        edge, radius = _edge(self, design), plain(self.radius)
        if radius <= edge.radius * (1.0 + 1e-6):
            raise ValueRangeError(
                f"MinimumHollowRadius: radius = {MM * radius:.4g} mm",
                f"must exceed that of the roller, {MM * edge.radius:.4g} mm",
                next_step=f"ask for {MM * 1.25 * edge.radius:.4g} mm, or take a smaller roller",
            )
        yield self.along(edge.least_hollow(radius))
