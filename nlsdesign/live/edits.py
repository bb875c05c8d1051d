"""What a designer does, one step at a time: each edit makes another question of one."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ..components.assembly.library_rubber import with_rubber
from ..components.assembly.named_parts import Assembly
from ..design import RubberStock
from ..design.optimisation.limits import limit_kinds
from ..design.optimisation.stock import StockChoice, combinations
from ..design.parametric.cam_question import TargetPoint
from ..foundation import rubber_library as library
from ..foundation.errors import ArrangementError, ValueRangeError, brief, unknown_name
from .at_angle import AngleView
from .gallery import gallery_question
from .question import LARGEST_ANGLE, LARGEST_TORQUE, LEAST_STEP, LiveQuestion, finite_in
from .tasks import drop_task, follow_tasks, set_motor, set_task, take_gear_ratio
from .views import in_words

_LONGEST_NAME = 200


class LiveEdit(NamedTuple):
    """One step: what changes a question, and its fields by name; numbers are in SI."""

    change: Callable[..., LiveQuestion]
    fields: Mapping[str, Any]

    @property
    def begins_anew(self) -> bool:
        """Whether the question has nothing to do with the one before, and no design is begun beside its."""
        return self.change is choose_deck

    def applied(self, question: LiveQuestion, shown: AngleView | None = None) -> LiveQuestion:
        """Return the question after the edit; ``shown``: the last good design."""
        return self.change(question, shown, **self.fields)


def edit(change: Callable[..., LiveQuestion], *values: Any, **fields: Any) -> LiveEdit:
    """Return an edit with its fields, for instance ``edit(move_point, 1, 0.4, 2.0)``."""
    return LiveEdit(change, {**dict(zip(_fields(change), values, strict=False)), **fields})


def _fields(change: Callable[..., LiveQuestion]) -> dict[str, inspect.Parameter]:
    """Return the fields of an edit: what its function takes besides the question and the design."""
    return dict(list(inspect.signature(change).parameters.items())[2:])


def move_point(
    question: LiveQuestion, _: AngleView | None, index: int, angle: float, torque: float
) -> LiveQuestion:
    """Move a point of the target, counted from 0 at angle zero, between its neighbours."""
    points = list(question.points)
    points[_index(index, len(points))] = TargetPoint(float(angle), float(torque))
    return question.with_points(tuple(points))


def add_point(question: LiveQuestion, _: AngleView | None, angle: float, torque: float) -> LiveQuestion:
    """Add a point to the target, wherever its angle belongs."""
    point = TargetPoint(float(angle), float(torque))
    return question.with_points(tuple(sorted([*question.points, point], key=lambda other: other.angle)))


def remove_point(question: LiveQuestion, _: AngleView | None, index: int) -> LiveQuestion:
    """Remove a point of the target, counted from 1: the first stays."""
    index = _index(index, len(question.points))
    return question.with_points(question.points[:index] + question.points[index + 1 :])


def scale_target(question: LiveQuestion, _: AngleView | None, angle: float, torque: float) -> LiveQuestion:
    """Scale the whole target, so that its last point has another angle and torque and its form stays."""
    last = question.points[-1]
    if not last.torque > 0.0:
        raise ValueRangeError(
            "target", "ends without torque, so that nothing can be scaled to one",
            next_step="give its last point a torque",
        )  # fmt: skip
    least = len(question.points) * LEAST_STEP
    angle = finite_in("last angle", angle, lowest=least, highest=LARGEST_ANGLE, unit="rad")
    torque = finite_in("last torque", torque, lowest=1e-6, highest=LARGEST_TORQUE, unit="N*m")
    across, up = angle / last.angle, torque / last.torque
    scaled = [TargetPoint(across * point.angle, up * point.torque) for point in question.points[:-1]]
    return question.with_points((*scaled, TargetPoint(angle, torque)))


def change_limit(question: LiveQuestion, _: AngleView | None, limit: str, value: float) -> LiveQuestion:
    """Set a limit by the name of its kind, or change one that follows from the deck.

    ``value``: in SI; for a stress what is allowed, safety included.
    """
    if limit not in limit_kinds():
        raise unknown_name("limit", limit, limit_kinds())
    kind = limit_kinds()[limit]
    value = finite_in(kind.title, value, lowest=0.0, highest=1e12, unit=kind.read_unit)
    try:
        kind.limit(value)
    except ValueRangeError as error:
        # Its advice is for somebody who writes Python, and may have meant another unit.
        raise ValueRangeError(
            f"{kind.title} = {kind.shown(value)}", error.rule, next_step="give a number in that range"
        ) from error
    return replace(question, limits={**question.limits, limit: value})


def drop_limit(question: LiveQuestion, _: AngleView | None, limit: str) -> LiveQuestion:
    """Take a limit away; where the deck gives one of its kind, that one holds again."""
    if limit not in question.limits:
        raise ValueRangeError(
            f"limit '{in_words(limit[:80])}'", "was not set here, so it cannot be dropped",
            next_step="a limit that follows from the deck can be changed to another number",
        )  # fmt: skip
    rest = {name: value for name, value in question.limits.items() if name != limit}
    return replace(question, limits=rest)


def set_number(question: LiveQuestion, _: AngleView | None, name: str, value: float) -> LiveQuestion:
    """Give a number, for instance pretension or a size of the rubber; it is held from then on."""
    question.number(name)
    variable = question.machine.model.variable(name)
    value = finite_in(name, value, lowest=variable.minimum, highest=variable.maximum, unit=variable.unit)
    return replace(without_free(question, name), given={**question.given, name: value})


def free_number(
    question: LiveQuestion,
    _: AngleView | None,
    name: str,
    minimum: float | None = None,
    maximum: float | None = None,
) -> LiveQuestion:
    """Let the design choose a number within a range in SI, or the contour.

    ``minimum``, ``maximum``: those of the part where they are left out.
    """
    free = (*(other for other in question.free if other != name), name)
    if name == question.contour:
        return replace(question, free=free)
    question.number(name)
    if name == question.cam.anchor_distance and question.contour not in free:
        raise ValueRangeError(
            f"free '{name}'", "the anchor shapes the contour, so it is free only together with it",
            next_step=f"free '{question.contour}' first",
        )  # fmt: skip
    variable = question.machine.model.variable(name)
    if minimum is None and maximum is None:
        ranges = {other: ends for other, ends in question.ranges.items() if other != name}
        return replace(question, free=free, ranges=ranges)
    low = variable.minimum if minimum is None else minimum
    high = variable.maximum if maximum is None else maximum
    most, unit = variable.maximum, variable.unit
    finite_in(f"least {name}", low, lowest=variable.minimum, highest=most, unit=unit)
    finite_in(f"largest {name}", high, lowest=low, highest=most, unit=unit)
    return replace(question, free=free, ranges={**question.ranges, name: (low, high)})


def hold_number(question: LiveQuestion, shown: AngleView | None, name: str) -> LiveQuestion:
    """Hold a number, or the contour, where the design has it now."""
    fixed = without_free(question, name)
    if name != question.contour:
        value = question.number(name).value
        if shown is not None:
            value = {number.name: number.value for number in shown.view.numbers}.get(name, value)
        return replace(fixed, given={**question.given, name: value})
    if question.cam.anchor_distance in fixed.free:
        raise ValueRangeError(
            f"hold '{name}'", "the anchor shapes the contour, so it is held first",
            next_step=f"hold '{question.cam.anchor_distance}'",
        )  # fmt: skip
    if shown is None:
        return fixed
    # The cam of the design, and the contour that it was fitted to.
    machine, finished = question.machine, shown.machine.quantities()
    cam = {number: finished[number] for number in finished if number.startswith(f"{machine.cam.name}.")}
    changed = replace(machine, assembly=machine.assembly.with_values(cam), designed=shown.contour)
    return replace(fixed, machine=changed)


def choose_material(question: LiveQuestion, _: AngleView | None, material: str) -> LiveQuestion:
    """Take another rubber of the library; sizes stay."""
    pieces = question.cam.specimens
    if not pieces:
        raise ArrangementError(
            f"spring '{question.cam.drive}'", "has no piece of rubber", next_step="choose another deck"
        )
    changed = question.machine.assembly
    for piece in pieces:
        changed = with_rubber(changed, library.material(material), piece=piece.name)
    return _of(question, changed, material, set())


def take_from_stock(
    question: LiveQuestion, _: AngleView | None, choices: tuple[StockChoice, ...], row: int
) -> LiveQuestion:
    """Take one combination of a stock, counted from 0; what was chosen from it is held."""
    options = combinations(question.actuator, choices)
    if not 0 <= row < len(options):
        raise ValueRangeError(f"row {row + 1} of the stock", f"is not there; there are {len(options)}")
    rubbers = [each for each in choices if isinstance(each, RubberStock)]
    material = question.machine.material
    if rubbers:  # stands first among the choices
        material = rubbers[0].materials[row * len(rubbers[0].materials) // len(options)]
    return _of(replace(question, given={}), options[row][1], material, {each.chosen for each in choices})


def _of(question: LiveQuestion, changed: Assembly, material: str, held: set[str]) -> LiveQuestion:
    """Return a question about another machine, without the numbers that it has not; ``held``: not free."""
    machine = replace(question.machine, assembly=changed, material=material)
    names = {*machine.sizes, question.contour}
    return replace(
        question,
        machine=machine,
        free=tuple(number for number in question.free if number in names - held),
        ranges={number: ends for number, ends in question.ranges.items() if number in names},
        given={number: value for number, value in question.given.items() if number in names},
    )


def choose_deck(_question: LiveQuestion, _: AngleView | None, name: str) -> LiveQuestion:
    """Begin from another actuator of the gallery."""
    return gallery_question(name)


def without_free(question: LiveQuestion, name: str) -> LiveQuestion:
    """Return a question in which a number, or the contour, is not free."""
    if name != question.contour:
        question.number(name)
    free = tuple(other for other in question.free if other != name)
    if not free:
        raise ValueRangeError(
            f"hold '{name}'", "leaves nothing that may change",
            next_step=f"free '{question.contour}' first",
        )  # fmt: skip
    return replace(question, free=free)


EDITS: Mapping[str, Callable[..., LiveQuestion]] = {
    "MovePoint": move_point,
    "AddPoint": add_point,
    "RemovePoint": remove_point,
    "ScaleTarget": scale_target,
    "ChangeLimit": change_limit,
    "DropLimit": drop_limit,
    "SetNumber": set_number,
    "FreeNumber": free_number,
    "HoldNumber": hold_number,
    "ChooseMaterial": choose_material,
    "ChooseDeck": choose_deck,
    "SetTask": set_task,
    "DropTask": drop_task,
    "SetMotor": set_motor,
    "FollowTasks": follow_tasks,
    "TakeGearRatio": take_gear_ratio,
}
"""What each edit does, by the name that messages of the page give it."""


def edit_from(message: Mapping[str, Any]) -> LiveEdit:
    """Return the edit of a message: ``{"edit": "MovePoint", "index": 1, "angle": 0.4, "torque": 2.0}``."""
    name = message.get("edit")
    if not isinstance(name, str) or name not in EDITS:
        raise unknown_name("edit", str(name)[:80], EDITS)
    fields, hints = _fields(EDITS[name]), typing.get_type_hints(EDITS[name])
    given = {key: value for key, value in message.items() if key != "edit"}
    for key, value in given.items():
        if key not in fields:
            raise unknown_name(f"{name}: field", str(key)[:80], fields)
        _require_kind(f"{name}: {key}", value, hints[key])
    missing = [key for key, field in fields.items() if key not in given and field.default is field.empty]
    if missing:
        raise ValueRangeError(name, f"lacks {', '.join(missing)}", next_step=f"fields: {', '.join(fields)}")
    return LiveEdit(EDITS[name], given)


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
