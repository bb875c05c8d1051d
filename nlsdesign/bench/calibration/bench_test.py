"""Kinds of calibration that take an afternoon: how the machine then stands on the bench."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from ...components.assembly.changed_copies import law_of_part
from ...components.assembly.named_parts import Assembly
from ...components.core.contacts import Regularised, WithFriction
from ...components.core.element import tie
from ...components.mechanics.bodies import Fixed
from ...components.mechanics.loads import ConstantLoad
from ...components.sensing.sensors import TorqueSensor
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import quantity
from ...model import FlatModel, flatten
from ...model.roles import driven_body, series_spring
from ...model.structure import SpringNames, top_part

WEIGHT, CELL = "hung_weight", "load_cell"
_SLIDING = {"rad/s": 1e-6, "m/s": 1e-9}
"""Creep speed at which smooth dry friction is as good as sharp: only moving samples count."""


@dataclass(frozen=True)
class Instruments:
    """How far what a bench adds may itself be wrong, one standard deviation each.

    Parameters
    ----------
    zero_angle
        Between the zero of the encoder and that of the cam, in the unit of the motion (rad).
    weight
        Relative: of the mass and its lever together.
    cell
        Relative: of the gain of a load cell, where the deck does not say how well it is known.
    offset
        Of current and cell, relative to the largest value on the record.

    Raises
    ------
    ValueRangeError
        If one is negative.
    """

    zero_angle: float = 5e-3
    weight: float = 3e-3
    cell: float = 5e-3
    offset: float = 5e-3

    def __post_init__(self) -> None:
        for name in ("zero_angle", "weight", "cell", "offset"):
            if not getattr(self, name) >= 0.0:
                raise ValueRangeError(f"{name} = {getattr(self, name)!r}", "must be zero or above")


@dataclass(frozen=True)
class CalibrationTest(ABC):
    """Base of the kinds of calibration.

    Parameters
    ----------
    instruments
        How good the instruments of the bench are; assumed where a laboratory does not say otherwise.
    """

    title: ClassVar[str]
    instruments: Instruments = Instruments()

    def on_bench(self, actuator: Assembly) -> Assembly:
        """Return the declared machine as it stands on the bench: everything but the drive is clamped.

        Raises
        ------
        ArrangementError
            If there is no drive, or no spring where one is needed.
        """
        # The machine with dry friction whose sign is that of the measured speed.
        rubbing = [path for path, part in actuator.walk() if isinstance(law_of_part(part), WithFriction)]
        for path in sorted(rubbing, key=lambda p: -p.count(".")):
            law = law_of_part(actuator[path])
            assert isinstance(law, WithFriction)
            unit = law.domain.rate_unit
            speed = quantity(_SLIDING[unit], unit, source="assumed: moving samples alone count")
            actuator = actuator.with_part(path, replace(law, contact=Regularised(creep_speed=speed)))
        return self._equipped(_clamped(actuator))

    @abstractmethod
    def _equipped(self, clamped: Assembly) -> Assembly:
        """Return the clamped machine with what this kind adds or takes away."""


@dataclass(frozen=True)
class HungWeightTest(CalibrationTest):
    """A weight on a lever at the drive's side of the spring, while the motor sweeps slowly.

    The torque of the weight is known; approaching each angle from both sides tells friction from torque.
    """

    title: ClassVar[str] = "hung weight"

    def _equipped(self, clamped: Assembly) -> Assembly:
        if WEIGHT in dict(clamped.parts):
            raise ArrangementError(
                f"part '{WEIGHT}'", "is the name of the weight on the bench", next_step="rename it"
            )
        model = flatten(clamped)
        moved = moved_end(model)
        body = next(b for b in model.bodies if b.name == driven_body(model).name)
        load = ConstantLoad(
            load=quantity(0.0, body.domain.effort_unit, source="measured"), domain=body.domain
        )
        return clamped.with_part(WEIGHT, tie(load, moved))


@dataclass(frozen=True)
class LoadCellTest(CalibrationTest):
    """A load cell between the output and the ground, while the motor sweeps slowly and at 1 to 5 Hz."""

    title: ClassVar[str] = "load cell"

    def _equipped(self, clamped: Assembly) -> Assembly:
        spring = series_spring(flatten(clamped))
        inside = {s.of for s in clamped.sensors().values() if s.of.startswith(f"{spring.name}.")}
        if inside:
            return clamped  # the machine carries a cell of its own
        if CELL in dict(clamped.parts):
            raise ArrangementError(
                f"part '{CELL}'", "is the name of the cell on the bench", next_step="rename it"
            )
        return clamped.with_part(CELL, TorqueSensor(of=spring.effort))


@dataclass(frozen=True)
class FreeRunTest(CalibrationTest):
    """The spring taken off, the motor runs free: steps of current and coasting."""

    title: ClassVar[str] = "free run"

    def _equipped(self, clamped: Assembly) -> Assembly:
        model = flatten(clamped)
        removed = {top_part(spring.name) for spring in model.springs}
        if not removed:
            return clamped
        kept = clamped
        for name, sensor in clamped.sensors().items():
            if top_part(clamped.measured(sensor.of)[0]) in removed:
                kept = kept.without_part(name)
        for name in removed:
            kept = kept.without_part(name)
        return kept


KINDS: Mapping[str, CalibrationTest] = {
    "hung_weight": HungWeightTest(),
    "load_cell": LoadCellTest(),
    "free_run": FreeRunTest(),
}
"""The kinds of calibration by the names that commands and files give them."""


def moved_end(model: FlatModel) -> str:
    """Return the body at the drive's end of the series spring; the driven body where there is no spring."""
    if not model.springs:
        return driven_body(model).name
    spring: SpringNames = series_spring(model)
    driven = driven_body(model)
    moving = {driven.name, *driven.geared}
    return next((name for name in spring.between if name in moving), driven.name)


def _clamped(actuator: Assembly) -> Assembly:
    model = flatten(actuator)
    lead = driven_body(model)
    clamped = actuator
    for body in model.bodies:
        if body.name == lead.name:
            continue
        for name, sensor in actuator.sensors().items():
            if top_part(actuator.measured(sensor.of)[0]) == body.name:
                clamped = clamped.without_part(name)
        clamped = clamped.with_part(body.name, Fixed(domain=body.domain))
    return clamped
