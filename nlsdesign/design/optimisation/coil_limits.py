"""What a design with a coil must keep: its travel, a spring index that can be wound, a wire that endures.

Limits of a cam on which a roller runs, or that rolls on its mirror image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from ...foundation.symbolic import Expression
from ..curves.numbers import plain
from .design_point import DesignPoint
from .edges import PairEdge, RollerEdge
from .limits import Bound, Limit, OneNumber

_SIZE = 0.01
"""Typical length between pivots in m."""
_MOST = 1000.0
"""Safety beyond which it is not told apart."""


def _require(design: DesignPoint, known: bool, what: str, step: str) -> None:
    if not known:
        raise ArrangementError(f"part '{design.cam.drive}'", f"has no {what} behind its cam", next_step=step)


@dataclass(frozen=True)
class MaximumTravel(Limit):
    """Extension of each coil that is pulled, or shortening of one that is pushed, ≤ travel.

    Parameters
    ----------
    travel
        Largest extension or shortening, in m.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "travel", "travel of the coil", unit="m", shown_unit="mm", upper=True, within=(1e-5, 2.0)
    )

    travel: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil."""
        _require(design, bool(design.coils), "coil", "leave this limit out, or declare an ExtensionCoil")
        for path, coil in design.coils.items():
            yield self.bound(f"travel of {path}", coil.extension, plain(self.travel), upper=True, unit="mm")


@dataclass(frozen=True)
class SpringIndexLimit(Limit):
    """Base of the limits on mean diameter over wire diameter.

    Parameters
    ----------
    index
        Spring index, a pure number.
    """

    index: Quantity | float

    def __post_init__(self) -> None:
        self.number("index", "1", 2.0, 50.0)

    def _indices(self, design: DesignPoint, *, upper: bool) -> Iterator[Bound]:
        wound = [coil for coil in design.cam.coils if coil.winding]
        _require(design, bool(wound), "coil of declared wire", "declare its Winding, or leave this limit out")
        for coil in wound:
            wire, mean = (design.parameters[name] for name in coil.winding[:2])
            of = f"spring index of {coil.name}"
            yield self.bound(of, mean / wire, plain(self.index), upper=upper, unit="1")


@dataclass(frozen=True)
class MinimumSpringIndex(SpringIndexLimit):
    """Mean diameter over wire diameter ≥ index: below 4 wire is hard to coil, and cracks.

    Parameters
    ----------
    index
        Least spring index, a pure number.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "index", "spring index of the coil", unit="1", shown_unit="1", upper=False
    )

    index: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared."""
        yield from self._indices(design, upper=False)


@dataclass(frozen=True)
class MaximumSpringIndex(SpringIndexLimit):
    """Mean diameter over wire diameter ≤ index: above 16 coils tangle, and do not keep their diameter.

    Parameters
    ----------
    index
        Largest spring index, a pure number.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "index", "spring index of the coil", unit="1", shown_unit="1", upper=True
    )

    index: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared."""
        yield from self._indices(design, upper=True)


@dataclass(frozen=True)
class GoodmanSafety(Limit):
    """Safety of the wire of each coil by Goodman ≥ safety, from angle zero to the last and back for good.

    τ_a/S_e + τ_m/S_su ≤ 1/safety with the amplitude τ_a and the mean τ_m of the shear stress at the inside of
    the coil, S_su = 0.67·S_ut and S_e = S_a/(1 − S_m/S_su). The amplitude S_a that any spring wire up to
    10 mm bears for good around the mean S_m is Zimmerli's, for wire that is not peened; peened wire bears
    398 MPa around 534 MPa. Hooks are not looked at. Source: Zimmerli 1957, as in Budynas and Nisbett 2015,
    eqs. (10-28) to (10-30).

    Parameters
    ----------
    safety
        Least factor, a pure number of at least 1.
    amplitude, mean
        S_a and S_m in Pa.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "safety", "safety of the wire against fatigue", unit="1", shown_unit="1",
        upper=False, within=(1.0, 20.0),
    )  # fmt: skip

    safety: Quantity | float
    amplitude: Quantity | float = 241e6
    mean: Quantity | float = 379e6

    def __post_init__(self) -> None:
        super().__post_init__()
        self.number("amplitude", "Pa", 1e6, 2e9)
        self.number("mean", "Pa", 1e6, 2e9)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared with its strength."""
        strong = [coil.name for coil in design.cam.coils if coil.tensile_strength]
        step = "declare its Winding and WireStrength, or leave this limit out"
        _require(design, bool(strong), "coil of a wire with a strength", step)
        for path in strong:
            coil = design.coils[path]
            # Lever arms are not negative, so the extension rises from angle zero on.
            low, high = coil.shear_stress[0], coil.shear_stress[-1]
            shear_strength = 0.67 * coil.tensile_strength[0]
            # Of soft wire the strength alone decides: Zimmerli's point lies beyond it.
            slope = ca.fmax(1 - plain(self.mean) / shear_strength, plain(self.amplitude) / shear_strength)
            endured = plain(self.amplitude) / slope
            used = (high - low) / 2 / endured + (high + low) / 2 / shear_strength
            # A coil that is hardly loaded has no finite safety.
            safety = 1 / ca.fmax(used, 1 / _MOST)
            yield self.bound(f"safety of {path}", safety, plain(self.safety), upper=False, unit="1")


def _edge(limit: Limit, design: DesignPoint) -> RollerEdge:
    if not isinstance(design.edge, RollerEdge):
        raise ArrangementError(
            f"{type(limit).__name__} of '{design.cam.name}'", "is of a cam with a roller, which this is not",
            next_step="leave the limit out, or give the spring a RollerCam",
        )  # fmt: skip
    return design.edge


_FRICTION = (0.05, 0.2)
"""Coefficient of friction of guides, from greased bronze to dry polymer. Assumed."""


def side_forces(design: DesignPoint, value: Callable[[Expression], Array]) -> Iterator[str]:
    """Yield what a follower's guide bears, and how far its friction moves the torque from the curve at rest.

    ``value``: gives the numbers of an expression at the design.
    """
    rolling = design.cam.rolling
    if rolling is None or not isinstance(design.edge, RollerEdge):
        return
    slopes = np.tan(value(design.edge.pressure_angles))
    force = float(np.max(value(design.elements * design.forces) * slopes))
    friction, of = _FRICTION, "that is not declared (SlidingGuide),"
    if rolling.guide_friction is not None:
        friction, of = (design.model.values[rolling.guide_friction],) * 2, "as declared,"
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


@dataclass(frozen=True)
class RoomBetweenPivots(Limit):
    """The element, stretched by the pretension, fits between the pivots of a rolling pair.

    Parameters
    ----------
    beside
        Length in m between the pivots that hooks, clamps or links take up beside the element.

    Examples
    --------
    >>> RoomBetweenPivots(beside=0.004).beside
    0.004
    """

    beside: Quantity | float = 0.0

    def __post_init__(self) -> None:
        self.number("beside", "m", 0.0, 1.0)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each piece of rubber and each coil.

        Raises
        ------
        ArrangementError
            If the cam rolls on no other.
        """
        rolling = design.cam.rolling
        if rolling is None or not isinstance(design.edge, PairEdge):
            raise ArrangementError(
                f"RoomBetweenPivots of '{design.cam.name}'", "is of a cam that rolls on an equal one",
                next_step="leave the limit out, or give the spring a RollingPair",
            )  # fmt: skip
        free = design.parameters[rolling.base] - design.parameters[design.cam.pretension]
        for name in design.cam.lengths:
            room = free - design.parameters[name]
            least = plain(self.beside)
            yield self.bound(f"room beside {name}", room, least, upper=False, unit="mm", scale=_SIZE)


@dataclass(frozen=True)
class PressedContact(Limit):
    """The element is stretched at every angle, so that it presses what rolls on a cam against it.

    Examples
    --------
    >>> PressedContact()
    PressedContact()
    """

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the angle."""
        yield self.bound("extension", design.extensions, 0.0, upper=False, unit="mm", scale=_SIZE)
