"""The limits that have one number, as a designer sets them: name, unit, side."""

from __future__ import annotations

from dataclasses import dataclass

from ..design.curves.numbers import plain
from ..design.optimisation.limits import (
    Limit,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumStrain,
    MaximumStress,
    MinimumRadiusOfCurvature,
    PositiveStiffness,
)
from ..foundation.errors import ValueRangeError
from ..foundation.quantity import parse_unit, with_unit


@dataclass(frozen=True)
class LimitKind:
    """A limit with one number.

    Parameters
    ----------
    kind
        Its class.
    field
        In which the number stands.
    words
        What is limited.
    unit, shown_unit
        SI unit, and that in which people read it.
    upper
        Whether the number is the largest that is allowed, or the least.
    of_shape
        Whether the contour alone decides it.
    """

    kind: type[Limit]
    field: str
    words: str
    unit: str
    shown_unit: str
    upper: bool
    of_shape: bool = False

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
        if self.shown_unit == "%":
            return f"{100.0 * value:.4g} %"
        return with_unit(f"{value / parse_unit(self.shown_unit).factor:.4g}", self.shown_unit)

    @property
    def read_unit(self) -> str:
        """SI unit, or "%" for a ratio that is read in per cent."""
        return self.shown_unit if self.shown_unit == "%" else self.unit

    def limit(self, value: float) -> Limit:
        """Return the limit."""
        if not abs(value) < float("inf"):
            raise ValueRangeError(f"{self.title} = {value:g}", "is no finite number")
        return self.kind(**{self.field: value})

    def value_of(self, limit: Limit) -> float:
        """Return the number of a limit of this kind in SI: what is allowed, with its safety factor."""
        return plain(getattr(limit, self.field)) / float(getattr(limit, "safety_factor", 1.0))


_ALL = (
    LimitKind(MinimumRadiusOfCurvature, "radius", "radius of curvature", "m", "mm", False, True),
    LimitKind(MaximumCamRadius, "radius", "cam radius", "m", "mm", True, True),
    LimitKind(MaximumStrain, "strain", "strain of the rubber", "1", "%", True),
    LimitKind(MaximumStress, "stress", "nominal stress of the rubber", "Pa", "MPa", True),
    LimitKind(MaximumCableTension, "tension", "tension of a cable", "N", "N", True),
    LimitKind(PositiveStiffness, "minimum", "slope of the torque", "N*m/rad", "N*m/rad", False),
)
LIMIT_KINDS: dict[str, LimitKind] = {each.name: each for each in _ALL}
"""The limits with one number, by name."""
