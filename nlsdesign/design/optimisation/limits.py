"""What a design must keep: each limit is an object with its number, and gives way in its own unit."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import casadi as ca

from ...foundation.errors import UnitError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity, same_dimension, typeset_unit
from ...foundation.symbolic import Expression
from ..curves.numbers import hold_in_si, in_unit, plain
from ..curves.target import TorqueBand
from ..statics.contour import STRAIGHT
from .design_point import DesignPoint, anchor_of
from .edges import EdgeRow
from .goals import Goal


@dataclass(frozen=True, eq=False)
class Bound:
    """One side of a limit on one quantity: expression ≤ value (upper) or ≥ value."""

    limit: str
    of: str
    expression: Expression
    value: float
    upper: bool
    unit: str
    scale: float
    offset: float | None = None  # see EdgeRow: what is read is a radius, what is held a curvature

    def read(self, value: float) -> float:
        """Return what a value of the expression means to a designer, in SI."""
        return value if self.offset is None else 1.0 / max(value, 1.0 / STRAIGHT) + self.offset

    @property
    def at_most(self) -> bool:
        """Whether what is read is the largest that is allowed, or the least."""
        return self.upper == (self.offset is None)

    def shown(self, value: float) -> str:
        """Return a value of the expression in the unit of the limit as text."""
        return in_unit(self.read(value), self.unit)

    def __str__(self) -> str:
        return f"{self.of} {'<=' if self.at_most else '>='} {self.shown(self.value)}"


def limits_in_words(pairs: Iterable[tuple[str, str]]) -> tuple[str, ...]:
    """Return what limits bound, each with its name in brackets; of pairs of name and what it bounds."""
    what: dict[str, dict[str, None]] = {}
    for limit, of in pairs:
        what.setdefault(limit, {})[of] = None
    return tuple(f"{' and '.join(of)} ({limit})" for limit, of in what.items())


@dataclass(frozen=True)
class OneNumber:
    """What a limit with one number says of itself, to messages and to whoever sets it.

    Parameters
    ----------
    field
        In which the number stands.
    words
        What is limited.
    unit, shown_unit
        SI unit, and that in which people read it; "%" for a ratio.
    upper
        Whether the number is the largest that is allowed, or the least.
    of_shape
        Whether the contour alone decides it.
    within
        Least and largest number that may be given, in SI.
    """

    field: str
    words: str
    unit: str
    shown_unit: str
    upper: bool
    of_shape: bool = False
    within: tuple[float, float] = (-math.inf, math.inf)


@dataclass(frozen=True)
class Limit(ABC):
    """Base of the limits.

    A limit whose class has ``described`` can be set on the live page; one of another package is found by
    being there.
    """

    described: ClassVar[OneNumber | None] = None

    def __post_init__(self) -> None:
        if (one := self.described) is not None:
            self.number(one.field, one.unit, *one.within)

    @abstractmethod
    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield what must hold.

        Parameters
        ----------
        design
            The design in symbols.
        """

    def number(self, name: str, unit: str, minimum: float, maximum: float) -> None:
        """Hold a field as a number in SI, checked; for ``__post_init__``.

        Parameters
        ----------
        name
            Of the field.
        unit
            That it must be convertible to, in SI.
        minimum, maximum
            Between which it must lie.

        Raises
        ------
        NlsError
            If it is in another unit, or out of range.
        """
        hold_in_si(self, name, unit, minimum=minimum, maximum=maximum, with_class=True)

    def bound(
        self,
        of: str,
        expression: Expression,
        value: float,
        *,
        upper: bool,
        unit: str,
        scale: float | None = None,
    ) -> Bound:
        """Return one side of this limit.

        Parameters
        ----------
        of
            What is bounded, in words.
        expression
            Column of any length, in SI.
        value
            Bound in SI.
        upper
            Whether it is the largest that is allowed, or the least.
        unit
            In which it is shown.
        scale
            Typical size in SI; that of the bound if it is left out.
        """
        # A scale that follows from the target is symbolic where the target can be moved.
        size = abs(value) or 1.0 if scale is None else scale
        return Bound(type(self).__name__, of, ca.SX(expression), value, upper, unit, size)

    def along(self, row: EdgeRow) -> Bound:
        """Return what must hold along an edge.

        Parameters
        ----------
        row
            Of the edge.
        """
        bound = self.bound(row.of, row.expression, row.value, upper=row.upper, unit="mm")
        return replace(bound, offset=row.offset)


@dataclass(frozen=True)
class MinimumRadiusOfCurvature(Limit):
    """ρ ≥ radius everywhere: what a tool can cut and a cable can bend around; under a roller where convex.

    Parameters
    ----------
    radius
        Least radius of curvature, in m.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "radius", "radius of curvature", unit="m", shown_unit="mm",
        upper=False, of_shape=True, within=(0.0, 0.5),
    )  # fmt: skip

    radius: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the contour."""
        yield self.along(design.edge.least_radius(plain(self.radius)))


@dataclass(frozen=True)
class MaximumCamRadius(Limit):
    """Distance of the contour from the centre ≤ radius.

    Parameters
    ----------
    radius
        Largest distance from the centre, in m.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "radius", "cam radius", unit="m", shown_unit="mm", upper=True, of_shape=True, within=(1e-5, 0.5)
    )

    radius: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the contour."""
        yield self.bound("cam radius", design.radii, plain(self.radius), upper=True, unit="mm")


@dataclass(frozen=True)
class MaximumStrain(Limit):
    """Nominal strain of each piece of rubber ≤ strain; 1 means twice the rest length.

    Parameters
    ----------
    strain
        Largest nominal strain, a pure number.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "strain", "strain of the rubber", unit="1", shown_unit="%", upper=True, within=(1e-4, 10.0)
    )

    strain: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each piece of rubber."""
        design.of_rubber("rest_length")
        for path, strain in design.strains.items():
            yield self.bound(f"strain of {path}", strain, plain(self.strain), upper=True, unit="1")


@dataclass(frozen=True)
class MaximumLastingStrain(Limit):
    """Nominal strain of each piece of rubber at angle zero, where a machine rests for good, ≤ strain.

    Rubber that stays stretched creeps and keeps a part of its strain as set; see :func:`safe_limits`.

    Parameters
    ----------
    strain
        Largest nominal strain at rest, a pure number; 1 means twice the rest length.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> MaximumLastingStrain(quantity(60.0, "%")).strain
    0.6
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "strain", "strain of the rubber at rest", unit="1", shown_unit="%", upper=True, within=(1e-4, 10.0)
    )

    strain: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each piece of rubber."""
        design.of_rubber("rest_length")
        for path, strain in design.strains.items():
            of = f"strain at rest of {path}"
            yield self.bound(of, strain[0], plain(self.strain), upper=True, unit="%")


@dataclass(frozen=True)
class MaximumStress(Limit):
    """Nominal stress in equilibrium ≤ stress / safety factor.

    Parameters
    ----------
    stress
        Strength as nominal stress in Pa.
    safety_factor
        What the strength is divided by, a pure number of at least 1.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "stress", "nominal stress of the rubber", unit="Pa", shown_unit="MPa", upper=True, within=(1e3, 1e11)
    )

    stress: Quantity | float
    safety_factor: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.number("safety_factor", "1", 1.0, 100.0)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each piece of rubber."""
        design.of_rubber("area")
        allowed = plain(self.stress) / self.safety_factor
        for path, stress in design.stresses.items():
            yield self.bound(f"stress of {path}", stress, allowed, upper=True, unit="MPa")


@dataclass(frozen=True)
class MaximumCableTension(Limit):
    """Force of one cable ≤ tension.

    Parameters
    ----------
    tension
        Largest force of one cable, in N.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "tension", "tension of a cable", unit="N", shown_unit="N", upper=True, within=(1e-3, 1e7)
    )

    tension: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the angle."""
        yield self.bound("cable tension", design.forces, plain(self.tension), upper=True, unit="N")


@dataclass(frozen=True)
class PositiveStiffness(Limit):
    """Tangent stiffness dτ/dθ ≥ minimum at every angle.

    Parameters
    ----------
    minimum
        Least tangent stiffness, in N·m/rad.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "minimum", "slope of the torque", unit="N*m/rad", shown_unit="N*m/rad", upper=False, within=(0.0, 1e7)
    )

    minimum: Quantity | float = 0.0

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound over the angle."""
        scale = design.target.largest / design.target.last_angle
        yield self.bound(
            "tangent stiffness", design.tangent_stiffness, plain(self.minimum), upper=False,
            unit="N*m/rad", scale=scale,
        )  # fmt: skip


@dataclass(frozen=True)
class MaximumTorqueError(Limit):
    """Rms torque error over the angle ≤ rms: makes the target itself a limit that can be in conflict.

    Parameters
    ----------
    rms
        Largest rms torque error, in N·m.
    """

    rms: Quantity | float

    def __post_init__(self) -> None:
        self.number("rms", "N*m", 1e-5, 1e6)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound."""
        # The tiny addend keeps the root smooth where the error vanishes.
        floor = (1e-3 * plain(self.rms)) ** 2
        rms = ca.sqrt(design.mean_square_error + floor)
        yield self.bound("rms torque error", rms, plain(self.rms), upper=True, unit="mN*m")


@dataclass(frozen=True)
class ParameterRange(Limit):
    """Base of the limits that hold one parameter between two numbers.

    Parameters
    ----------
    minimum, maximum
        Least and largest value of the parameter, in SI.

    Raises
    ------
    ValueRangeError
        If the minimum exceeds the maximum.
    """

    possible: ClassVar[tuple[str, float, float]]
    """Unit of the parameter, and the least and largest number that either end may be."""

    minimum: Quantity | float
    maximum: Quantity | float

    def __post_init__(self) -> None:
        unit, lowest, highest = self.possible
        self.number("minimum", unit, lowest, highest)
        self.number("maximum", unit, lowest, highest)
        if plain(self.minimum) > plain(self.maximum):
            bounds = f"{plain(self.minimum):g}, {plain(self.maximum):g}"
            raise ValueRangeError(
                f"{type(self).__name__}({bounds}) in {typeset_unit(unit)}",
                "the minimum exceeds the maximum",
                next_step="exchange the two",
            )

    def _both(self, of: str, expression: Expression, unit: str) -> Iterator[Bound]:
        scale = plain(self.maximum) or 1e-3
        yield self.bound(of, expression, plain(self.minimum), upper=False, unit=unit, scale=scale)
        yield self.bound(of, expression, plain(self.maximum), upper=True, unit=unit, scale=scale)


@dataclass(frozen=True)
class NumberRange(Limit):
    """Any single number of the actuator between two numbers, for instance the thickness of a strip.

    Parameters
    ----------
    name
        Full name of the number, as the deck has it.
    minimum, maximum
        Least and largest value: quantities in a unit of the number, or bare numbers in SI.

    Raises
    ------
    ValueRangeError
        If the minimum exceeds the maximum.
    """

    name: str
    minimum: Quantity | float
    maximum: Quantity | float

    def __post_init__(self) -> None:
        for end in ("minimum", "maximum"):
            given = getattr(self, end)
            object.__setattr__(self, end, given.number if isinstance(given, Quantity) else float(given))
        if plain(self.minimum) > plain(self.maximum):
            raise ValueRangeError(
                f"NumberRange('{self.name}')", "the minimum exceeds the maximum", next_step="exchange the two"
            )

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides.

        Raises
        ------
        UnknownNameError
            If there is no such number.
        """
        if self.name not in design.parameters:
            raise unknown_name("NumberRange of", self.name, design.parameters)
        low, high, value = plain(self.minimum), plain(self.maximum), design.parameters[self.name]
        unit = design.shown_units.get(self.name, "1")
        scale = max(abs(low), abs(high)) or 1.0
        yield self.bound(self.name, value, low, upper=False, unit=unit, scale=scale)
        yield self.bound(self.name, value, high, upper=True, unit=unit, scale=scale)


@dataclass(frozen=True)
class PretensionRange(ParameterRange):
    """Extension at angle zero between two lengths in m.

    Parameters
    ----------
    minimum, maximum
        Least and largest extension, in m.
    """

    possible: ClassVar[tuple[str, float, float]] = ("m", 0.0, 1.0)

    minimum: Quantity | float
    maximum: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides."""
        name = design.cam.pretension
        yield from self._both(name, design.parameters[name], "mm")


@dataclass(frozen=True)
class AreaRange(ParameterRange):
    """Cross-section of each piece of rubber between two areas in m².

    Parameters
    ----------
    minimum, maximum
        Least and largest cross-section, in m².
    """

    possible: ClassVar[tuple[str, float, float]] = ("m^2", 1e-8, 0.1)

    minimum: Quantity | float
    maximum: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides for each piece."""
        for name, value in design.of_rubber("area").items():
            yield from self._both(name, value, "mm^2")


@dataclass(frozen=True)
class RestLengthRange(ParameterRange):
    """Rest length of each piece of rubber between two lengths in m.

    Parameters
    ----------
    minimum, maximum
        Least and largest rest length, in m.
    """

    possible: ClassVar[tuple[str, float, float]] = ("m", 1e-4, 1.0)

    minimum: Quantity | float
    maximum: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides for each piece."""
        for name, value in design.of_rubber("rest_length").items():
            yield from self._both(name, value, "mm")


@dataclass(frozen=True)
class AnchorDistance(ParameterRange):
    """Distance from the centre to the anchor of the cable between two lengths in m.

    Parameters
    ----------
    minimum, maximum
        Least and largest distance, in m.
    """

    possible: ClassVar[tuple[str, float, float]] = ("m", 1e-3, 1e6)

    minimum: Quantity | float
    maximum: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides."""
        anchor = anchor_of(design.cam)
        yield from self._both(anchor, design.parameters[anchor], "mm")


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
        hold_in_si(self, "angle", "rad", maximum=3.2, with_class=True)
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


@dataclass(frozen=True, kw_only=True)
class LimitKind(OneNumber):
    """A limit with one number: what its class says of the number, and the class."""

    kind: type[Limit]

    @property
    def name(self) -> str:
        """Name of the class."""
        return self.kind.__name__

    @property
    def title(self) -> str:
        """What it limits, and to which side."""
        return f"{'largest' if self.upper else 'least'} {self.words}"

    def shown(self, value: float) -> str:
        """Return a number in the unit in which people read it."""
        return f"{100.0 * value:.4g} %" if self.shown_unit == "%" else in_unit(value, self.shown_unit)

    @property
    def read_unit(self) -> str:
        """SI unit, or "%" for a ratio that is read in per cent."""
        return self.shown_unit if self.shown_unit == "%" else self.unit

    def limit(self, value: float) -> Limit:
        """Return the limit."""
        if not abs(value) < math.inf:
            raise ValueRangeError(f"{self.title} = {value:g}", "is no finite number")
        return self.kind(**{self.field: value})

    def value_of(self, limit: Limit) -> float:
        """Return the number of a limit of this kind in SI: what is allowed, with its safety factor."""
        return plain(getattr(limit, self.field)) / float(getattr(limit, "safety_factor", 1.0))


def limit_kinds() -> dict[str, LimitKind]:
    """Return the limits with one number by name, those of other packages that are loaded among them."""
    known: dict[str, LimitKind] = {}
    classes = list(Limit.__subclasses__())
    while classes:
        kind = classes.pop(0)
        if kind.described is not None:
            known[kind.__name__] = LimitKind(kind=kind, **vars(kind.described))
        classes += kind.__subclasses__()
    return known
