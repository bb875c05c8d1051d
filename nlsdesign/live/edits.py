"""What a designer does, one step at a time: each edit makes another question of one."""

from __future__ import annotations

import dataclasses
import typing
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ..components.assembly.library_rubber import with_rubber
from ..components.materials.library import material
from ..design.optimisation.limits import limit_kinds
from ..design.parametric.cam_question import ChosenMachine, TargetPoint
from ..foundation.errors import ArrangementError, ValueRangeError, brief, unknown_name
from .at_angle import AngleView
from .gallery import gallery_question
from .limit_words import in_words
from .question import LARGEST_ANGLE, LARGEST_TORQUE, LEAST_STEP, LiveQuestion, finite_in

_LONGEST_NAME = 200


@dataclass(frozen=True)
class LiveEdit(ABC):
    """Base of the edits; numbers are in SI."""

    begins_anew: ClassVar[bool] = False
    """Whether the question has nothing to do with the one before, so that no design is begun beside its."""

    @abstractmethod
    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question after the edit."""


@dataclass(frozen=True)
class MovePoint(LiveEdit):
    """Move a point of the target.

    Parameters
    ----------
    index
        Of the point, from 0 at angle zero.
    angle, torque
        Where to, in rad and N·m.
    """

    index: int
    angle: float
    torque: float

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with the point there, between its neighbours."""
        points = list(question.points)
        points[_index(self.index, len(points))] = TargetPoint(float(self.angle), float(self.torque))
        return question.with_points(tuple(points))


@dataclass(frozen=True)
class AddPoint(LiveEdit):
    """Add a point to the target, wherever its angle belongs.

    Parameters
    ----------
    angle, torque
        In rad and N·m.
    """

    angle: float
    torque: float

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with one point more."""
        point = TargetPoint(float(self.angle), float(self.torque))
        return question.with_points(tuple(sorted([*question.points, point], key=lambda each: each.angle)))


@dataclass(frozen=True)
class RemovePoint(LiveEdit):
    """Remove a point of the target.

    Parameters
    ----------
    index
        Of the point, from 1: the first stays.
    """

    index: int

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with one point less."""
        index = _index(self.index, len(question.points))
        return question.with_points(question.points[:index] + question.points[index + 1 :])


@dataclass(frozen=True)
class ScaleTarget(LiveEdit):
    """Scale the whole target, so that its last point has another angle and torque and its form stays.

    Parameters
    ----------
    angle, torque
        Of the last point, in rad and N·m.
    """

    angle: float
    torque: float

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with all points scaled."""
        last = question.points[-1]
        if not last.torque > 0.0:
            raise ValueRangeError(
                "target", "ends without torque, so that nothing can be scaled to one",
                next_step="give its last point a torque",
            )  # fmt: skip
        least = len(question.points) * LEAST_STEP
        angle = finite_in("last angle", self.angle, lowest=least, highest=LARGEST_ANGLE, unit="rad")
        torque = finite_in("last torque", self.torque, lowest=1e-6, highest=LARGEST_TORQUE, unit="N*m")
        across, up = angle / last.angle, torque / last.torque
        scaled = [TargetPoint(across * each.angle, up * each.torque) for each in question.points[:-1]]
        return question.with_points((*scaled, TargetPoint(angle, torque)))


@dataclass(frozen=True)
class ChangeLimit(LiveEdit):
    """Set a limit, or change one that follows from the deck.

    Parameters
    ----------
    limit
        Name of its kind, for instance ``"MaximumStrain"``.
    value
        In SI; for a stress what is allowed, safety included.
    """

    limit: str
    value: float

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with that limit."""
        if self.limit not in limit_kinds():
            raise unknown_name("limit", self.limit, limit_kinds())
        kind = limit_kinds()[self.limit]
        value = finite_in(kind.title, self.value, lowest=0.0, highest=1e12, unit=kind.read_unit)
        try:
            kind.limit(value)
        except ValueRangeError as error:
            # Its advice is for somebody who writes Python, and may have meant another unit.
            raise ValueRangeError(
                f"{kind.title} = {kind.shown(value)}", error.rule, next_step="give a number in that range"
            ) from error
        return replace(question, limits={**question.limits, self.limit: value})


@dataclass(frozen=True)
class DropLimit(LiveEdit):
    """Take a limit away; where the deck gives one of its kind, that one holds again."""

    limit: str

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question without it."""
        if self.limit not in question.limits:
            raise ValueRangeError(
                f"limit '{in_words(self.limit[:80])}'", "was not set here, so it cannot be dropped",
                next_step="a limit that follows from the deck can be changed to another number",
            )  # fmt: skip
        rest = {name: value for name, value in question.limits.items() if name != self.limit}
        return replace(question, limits=rest)


@dataclass(frozen=True)
class SetNumber(LiveEdit):
    """Give a number, for instance pretension or a size of the rubber; it is held from then on."""

    name: str
    value: float

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with that number held."""
        question.number(self.name)
        variable = question.machine.model.variable(self.name)
        value = finite_in(
            self.name, self.value, lowest=variable.minimum, highest=variable.maximum, unit=variable.unit
        )
        held = without_free(question, self.name)
        return replace(held, given={**question.given, self.name: value})


@dataclass(frozen=True)
class FreeNumber(LiveEdit):
    """Let the design choose a number, or the contour.

    Parameters
    ----------
    name
        Full name.
    minimum, maximum
        Range in SI; that of the part where it is left out.
    """

    name: str
    minimum: float | None = None
    maximum: float | None = None

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with that number free."""
        free = (*(each for each in question.free if each != self.name), self.name)
        if self.name == question.contour:
            return replace(question, free=free)
        question.number(self.name)
        if self.name == question.cam.anchor_distance and question.contour not in free:
            raise ValueRangeError(
                f"free '{self.name}'", "the anchor shapes the contour, so it is free only together with it",
                next_step=f"free '{question.contour}' first",
            )  # fmt: skip
        variable = question.machine.model.variable(self.name)
        low = variable.minimum if self.minimum is None else self.minimum
        high = variable.maximum if self.maximum is None else self.maximum
        if self.minimum is None and self.maximum is None:
            ranges = {name: each for name, each in question.ranges.items() if name != self.name}
            return replace(question, free=free, ranges=ranges)
        most, unit = variable.maximum, variable.unit
        finite_in(f"least {self.name}", low, lowest=variable.minimum, highest=most, unit=unit)
        finite_in(f"largest {self.name}", high, lowest=low, highest=most, unit=unit)
        return replace(question, free=free, ranges={**question.ranges, self.name: (low, high)})


@dataclass(frozen=True)
class HoldNumber(LiveEdit):
    """Hold a number, or the contour, where the design has it now."""

    name: str

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with that number held."""
        held = without_free(question, self.name)
        if self.name == question.contour:
            if question.cam.anchor_distance in held.free:
                raise ValueRangeError(
                    f"hold '{self.name}'", "the anchor shapes the contour, so it is held first",
                    next_step=f"hold '{question.cam.anchor_distance}'",
                )  # fmt: skip
            return held if shown is None else replace(held, machine=_with_cam_of(question.machine, shown))
        value = question.number(self.name).value
        if shown is not None:
            value = {each.name: each.value for each in shown.view.numbers}.get(self.name, value)
        return replace(held, given={**question.given, self.name: value})


@dataclass(frozen=True)
class ChooseMaterial(LiveEdit):
    """Take another rubber of the library; sizes stay."""

    material: str

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with that rubber."""
        pieces = question.cam.specimens
        if not pieces:
            raise ArrangementError(
                f"spring '{question.cam.drive}'", "has no piece of rubber", next_step="choose another deck"
            )
        changed = question.machine.assembly
        for piece in pieces:
            changed = with_rubber(changed, material(self.material), piece=piece.name)
        machine = ChosenMachine(changed, self.material, question.machine.designed)
        return kept_names(replace(question, machine=machine))


@dataclass(frozen=True)
class ChooseDeck(LiveEdit):
    """Begin from another actuator of the gallery.

    Parameters
    ----------
    name
        Of the deck or template.
    """

    begins_anew: ClassVar[bool] = True

    name: str

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question with which that actuator begins."""
        return gallery_question(self.name)


def kept_names(question: LiveQuestion) -> LiveQuestion:
    """Return a question without numbers that its machine no longer has."""
    names = {*question.machine.sizes, question.contour}
    return replace(
        question,
        free=tuple(name for name in question.free if name in names),
        ranges={name: each for name, each in question.ranges.items() if name in names},
        given={name: each for name, each in question.given.items() if name in names},
    )


def without_free(question: LiveQuestion, name: str) -> LiveQuestion:
    """Return a question in which a number, or the contour, is not free."""
    if name != question.contour:
        question.number(name)
    free = tuple(each for each in question.free if each != name)
    if not free:
        raise ValueRangeError(
            f"hold '{name}'", "leaves nothing that may change",
            next_step=f"free '{question.contour}' first",
        )  # fmt: skip
    return replace(question, free=free)


def _with_cam_of(machine: ChosenMachine, shown: AngleView) -> ChosenMachine:
    """Return the machine with the cam of a design, and the contour that it was fitted to."""
    cam = machine.cam
    finished = shown.machine.quantities()
    names = [name for name in finished if name.startswith(f"{cam.name}.")]
    changed = machine.assembly.with_values({name: finished[name] for name in names})
    return replace(machine, assembly=changed, designed=shown.contour)


def edit_from(message: Mapping[str, Any]) -> LiveEdit:
    """Return the edit of a message: ``{"edit": "MovePoint", "index": 1, "angle": 0.4, "torque": 2.0}``."""
    kinds = {kind.__name__: kind for kind in LiveEdit.__subclasses__()}
    name = message.get("edit")
    if not isinstance(name, str) or name not in kinds:
        raise unknown_name("edit", str(name)[:80], kinds)
    kind = kinds[name]
    hints = typing.get_type_hints(kind)
    fields = {each.name: each for each in dataclasses.fields(kind)}
    given = {key: value for key, value in message.items() if key != "edit"}
    for key, value in given.items():
        if key not in fields:
            raise unknown_name(f"{name}: field", str(key)[:80], fields)
        _require_kind(f"{name}: {key}", value, hints[key])
    missing = [
        key for key, each in fields.items() if key not in given and each.default is dataclasses.MISSING
    ]
    if missing:
        raise ValueRangeError(name, f"lacks {', '.join(missing)}", next_step=f"fields: {', '.join(fields)}")
    return kind(**given)


def _require_kind(what: str, value: object, hint: Any) -> None:
    allowed = typing.get_args(hint) or (hint,)
    if value is None and type(None) in allowed:
        return
    if str in allowed and isinstance(value, str) and len(value) <= _LONGEST_NAME:
        return
    if int in allowed and isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1_000_000:
        return
    if float in allowed:
        finite_in(what, value, lowest=-1e300, highest=1e300)
        return
    raise ValueRangeError(
        f"{what} = {brief(value)}", "is of the wrong kind", next_step="see the edit's fields"
    )


def _index(index: int, count: int) -> int:
    if not 1 <= index < count:
        raise ValueRangeError(
            f"point {index + 1} of the target", f"cannot be changed; those that can are 2 to {count}",
            next_step="point 1 stays at angle zero",
        )  # fmt: skip
    return index
