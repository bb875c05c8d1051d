"""What is asked of a cam at one moment: machine, points of the target, limits, what is free; immutable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import ArrangementError, unknown_name
from ...model import FlatModel, flatten
from ...model.roles import series_cam
from ...model.structure import CamNames
from ..curves.target import TabulatedTorque
from ..optimisation.defaults import StrainEnd, safe_limits, strain_ends
from ..optimisation.limits import Limit, LimitKind, NumberRange, limit_kinds
from ..statics.contour import Contour
from ..statics.declared_cam import with_contour
from ..statics.equilibrium import with_smooth_cables

_GIVEN = "given by the designer"


class TargetPoint(NamedTuple):
    """A point that the torque curve passes through: angle in rad, torque in N·m."""

    angle: float
    torque: float


class NumberState(NamedTuple):
    """A number that a designer may hold or free: all in SI, ``shown_unit`` is that of the deck."""

    name: str
    value: float
    unit: str
    shown_unit: str
    free: bool
    minimum: float
    maximum: float
    source: str


class LimitNumber(NamedTuple):
    """A limit that holds: what it is, its number in SI, and whether it follows from the deck."""

    kind: LimitKind
    value: float
    by_default: bool


def under_cable(cam: CamNames) -> CamNames:
    """Return the names around a cam, or refuse one on which something rolls."""
    if cam.rolling is not None:
        raise ArrangementError(
            f"cam '{cam.name}'", f"has {cam.rolling.what}, which the live page does not design yet",
            next_step="design it with design_cam, or with the command design",
        )  # fmt: skip
    return cam


@dataclass(frozen=True, eq=False)
class ChosenMachine:
    """An actuator with the chosen rubber; questions about it share what follows from its structure."""

    assembly: Assembly
    material: str = ""  # rubber of the library; empty for that of the deck
    designed: Contour | None = None  # contour to which its cam was fitted, where it was designed here

    @cached_property
    def model(self) -> FlatModel:
        """Flat model, with cables that are smooth."""
        return flatten(with_smooth_cables(self.assembly))

    @cached_property
    def cam(self) -> CamNames:
        """Names around its cam, which has a cable."""
        return under_cable(series_cam(self.model))

    @property
    def cam_part(self) -> object:
        """The cam, with the contour that it was designed with where there is one."""
        return with_contour(self.assembly[self.cam.name], self.designed)

    @cached_property
    def sizes(self) -> tuple[str, ...]:
        """Names of the single numbers that may be given or freed: pretension, rubber or coil, anchor."""
        known = self.assembly.quantities()
        return tuple(name for name in self.cam.sizes if name in known)

    @cached_property
    def strain_ends(self) -> dict[str, StrainEnd]:
        """How far each piece of rubber may be stretched, by its path."""
        return strain_ends(self.model)

    @cached_property
    def default_limits(self) -> dict[str, float]:
        """Limits that follow from cable and rubber, in SI, by name of their kind."""
        kinds = [(limit_kinds()[type(each).__name__], each) for each in safe_limits(self.model)]
        return {kind.name: kind.value_of(each) for kind, each in kinds}


@dataclass(frozen=True, eq=False)
class CamQuestion:
    """What is asked of a design; each change gives a new one."""

    machine: ChosenMachine  # actuator and rubber
    # points: of the target, ascending; the first is angle zero without torque. The curve between them is the
    # monotone cubic of TabulatedTorque, C¹ and without bumps of its own; through two points it is a straight
    # line.
    points: tuple[TargetPoint, ...]
    # limits: numbers in SI of the limits that were set, by name of their kind
    limits: Mapping[str, float] = field(default_factory=dict)
    free: tuple[str, ...] = ()  # names of what may change
    # ranges: between which numbers in SI a free number may move, by name
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # given: numbers in SI in place of those of the machine, by name
    given: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def actuator(self) -> Assembly:
        """The machine with the numbers that were given."""
        known = self.machine.assembly.quantities()
        return self.machine.assembly.with_values(
            {name: known[name].with_value(value, _GIVEN) for name, value in self.given.items()}
        )

    @property
    def cam(self) -> CamNames:
        """Names around its cam."""
        return self.machine.cam

    @property
    def contour(self) -> str:
        """Name by which the contour is free."""
        return self.cam.contour

    @cached_property
    def target(self) -> TabulatedTorque:
        """The torque curve through the points."""
        angles, torques = (tuple(column) for column in zip(*self.points, strict=True))
        if len(angles) == 2:
            angles, torques = (0.0, angles[1] / 2.0, angles[1]), (0.0, torques[1] / 2.0, torques[1])
        return TabulatedTorque(angles=angles, torques=torques)

    @property
    def target_size(self) -> float:
        """Largest torque of the target in N·m; between its points the curve is monotone."""
        return max(point.torque for point in self.points)

    @cached_property
    def limit_values(self) -> dict[str, LimitNumber]:
        """All limits that hold by name: those that were set, and those of the machine besides."""
        result = {name: LimitNumber(limit_kinds()[name], value, False) for name, value in self.limits.items()}
        for name, value in self.machine.default_limits.items():
            result.setdefault(name, LimitNumber(limit_kinds()[name], value, True))
        return dict(sorted(result.items()))

    @property
    def keep(self) -> tuple[Limit, ...]:
        """The same as limits of a design, with the ranges of what is free.

        Without limits on the shape of a contour that is held: nothing that is free changes them.
        """
        limits = [
            each.kind.limit(each.value) for each in self.limit_values.values() if self.keeps(each.kind.name)
        ]
        ranges = [NumberRange(name, *self.ranges[name]) for name in self.free if name in self.ranges]
        return (*limits, *ranges)

    @property
    def held_contour(self) -> Contour | None:
        """Contour that was designed here and is held; ``None`` where it is free, or that of a deck."""
        return None if self.contour in self.free else self.machine.designed

    def keeps(self, limit: str) -> bool:
        """Tell whether a limit is kept, and not only shown: whether anything that is free can change it.

        ``limit``: name of its class; ranges of free numbers are always kept.
        """
        kind = limit_kinds().get(limit)
        return kind is None or self.contour in self.free or not kind.of_shape

    @cached_property
    def numbers(self) -> dict[str, NumberState]:
        """The single numbers that may be given or freed, by name."""
        known, result = self.machine.assembly.quantities(), {}
        for name in self.machine.sizes:
            v, declared = self.machine.model.variable(name), known[name]
            low, high = self.ranges.get(name, (v.minimum, v.maximum))
            result[name] = NumberState(
                name, self.given.get(name, declared.number), v.unit, declared.unit, name in self.free,
                low, high, _GIVEN if name in self.given else declared.source,
            )  # fmt: skip
        return result

    def number(self, name: str) -> NumberState:
        """Return one of them."""
        if name not in self.numbers:
            raise unknown_name("number", name, self.numbers)
        return self.numbers[name]
