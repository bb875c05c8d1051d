"""Limits on how a design is used: beyond its last angle, within a band, over a task."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...errors import ValueRangeError
from ...quantity import Quantity
from ..curves.numbers import in_si, plain
from .design_point import DesignPoint
from .limits import Bound, Limit, MaximumCableTension, MaximumStrain, MaximumStress


@dataclass(frozen=True)
class OverTravel(Limit):
    """Limits of rubber and cable that hold beyond the last angle too, where the lever arm stays what it was.

    Parameters
    ----------
    angle
        Beyond the last angle of the target, in rad.
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
                yield self._bound(
                    f"{bound.of} at over-travel",
                    bound.expression,
                    bound.value,
                    upper=bound.upper,
                    unit=bound.unit,
                    scale=bound.scale,
                )
