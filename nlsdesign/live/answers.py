"""What a designer gets back: typed, in SI, with names and units; JSON by one function."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from ..design.parametric.cam_question import NumberState
from ..foundation.arrays import Array
from ..foundation.quantity import parse_unit, with_unit


class AnswerState(StrEnum):
    """Whether there is a design: ``NOT_SOLVED`` where there was no answer in time, or the solver stopped."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    NOT_SOLVED = "not solved"


class AnswerSource(StrEnum):
    """From the previous design, or from several starts with the check on the finished assembly."""

    QUICK = "quick"
    FULL = "full"


class WorkStage(StrEnum):
    """How far long work is; ``LATER`` is what nobody has asked for yet."""

    NOT_BEGUN = "not begun"
    LATER = "asked for later"
    COMPUTING = "computing"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, eq=False)
class LiveColumn:
    """A row of numbers over the cam angle, in SI."""

    # name, unit, description: what it is
    name: str
    unit: str
    description: str
    values: Array  # shape (n,)


@dataclass(frozen=True)
class LimitMargin:
    """How a design stands to one side of a limit, in SI."""

    # limit, of: name of the limit and what it bounds
    limit: str
    of: str
    # value, bound: the value that comes closest, and the bound
    value: float
    bound: float
    margin: float  # distance to the bound in the unit; negative where the limit is broken
    # unit, shown_unit: SI unit and that in which people read it
    unit: str
    shown_unit: str
    upper: bool  # whether the bound is the largest that is allowed
    active: bool  # whether the design sits on it

    def shown(self, value: float) -> str:
        """Return a number in the unit of the limit as text."""
        return with_unit(f"{value / parse_unit(self.shown_unit).factor:.4g}", self.shown_unit)


@dataclass(frozen=True, eq=False)
class LiveControls:
    """What a designer can move, as it stands now; numbers in SI."""

    # title, material: of the actuator; the material is empty for that of the deck
    title: str
    material: str
    points: tuple[Any, ...]  # rows (angle, torque) of the target
    limits: tuple[Any, ...]  # rows (kind, words, value, unit, shown unit, upper, by default)
    # numbers: rows (name, value, unit, shown unit, free, minimum, maximum, source); infinite where there is
    # no end
    numbers: tuple[Any, ...]
    contour: str  # name of the contour
    contour_free: bool  # whether it may change
    tasks: tuple[Any, ...]  # rows (joint, body mass, part of the torque, share of the time, kind)
    stock: tuple[str, ...]  # what of the spring can be bought: "rubber", "coil"
    motor: Mapping[str, float]  # numbers of the motor that were given
    # can_undo, can_redo: whether there is a step back or forth
    can_undo: bool
    can_redo: bool


@dataclass(frozen=True, eq=False)
class DesignView:
    """One design over the angle."""

    revision: int  # of the question that it answers
    # checked: whether the torque is that of the finished assembly, flattened anew; otherwise it is what the
    # program saw at the nodes of the contour
    checked: bool
    # columns: torque, target, error, lever arm, stiffness, radius of curvature, extension, tension, and
    # strain and stress of each piece of rubber, all over columns[0], the angle
    columns: tuple[LiveColumn, ...]
    # rms_error, largest_error: of the torque over the angle in N·m
    rms_error: float
    largest_error: float
    relative_error: float  # rms error over the largest torque of the target
    met: bool  # whether that is within the 1 % that a design may miss
    margins: tuple[LimitMargin, ...]  # to each limit
    active: tuple[str, ...]  # names of the limits that the design sits on
    numbers: tuple[NumberState, ...]  # that the design chose or was given
    contour: Array  # points of the lip in the frame of the cam, shape (n, 2), in m
    rubber_volume: float  # in m³
    strain_end: float = math.inf  # strain to which the rubber may be believed; infinite without rubber
    beyond: tuple[str, ...] = ()  # in words where it is stretched further, how far, and what to change
    # made_error: rms error in N·m that 95 % of the springs stay below whose numbers lie within their declared
    # spreads; None before the check, and where no number is spread
    made_error: float | None = None
    lights: tuple[Any, ...] = ()  # whether it can be made, will hold and be known; empty before the check

    def column(self, name: str) -> LiveColumn:
        """Return one column."""
        return {each.name: each for each in self.columns}[name]


@dataclass(frozen=True, eq=False)
class LiveAnswer:
    """The answer to an edit."""

    revision: int  # number of the question; each edit, undo and redo makes a new one
    state: AnswerState  # whether there is a design of this question
    message: str  # in words: why there is no design, or what to know of it
    source: AnswerSource  # how it was found
    # design: the last good design; None before the first. Where its revision is not that of the answer it
    # belongs to an earlier question and must be shown as such.
    design: DesignView | None
    controls: LiveControls  # what can be moved
    seconds: float  # that answering took
    conflicts: tuple[str, ...] = ()  # limits that contradict each other, where they do

    @property
    def stale(self) -> bool:
        """Whether the design shown is that of an earlier question."""
        return self.design is not None and self.design.revision != self.revision


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Cam, cable and rubber in the plane at one angle, in m; the cable pulls to the right."""

    angle: float  # of the cam in rad
    # halves: closed outlines of the cam, the right one and, for a cable through the centre, its twin
    halves: tuple[Array, ...]
    cables: tuple[Array, ...]  # lines from the cam to the rubber, one for each side
    # contacts, guides: where each cable leaves the cam, and the end of its free length as it is drawn
    contacts: tuple[Array, ...]
    guides: tuple[Array, ...]
    rubbers: tuple[Array, ...]  # corners of each piece of rubber (stretched to scale), shape (4, 2)
    edges: tuple[Array, ...]  # closed edges of the part as it is cut; empty before the check
    holes: tuple[tuple[float, float, float], ...]  # centre and radius of each hole of the part
    # dimensions: rows (words, one end x, y, other end x, y, size), each parallel to an axis
    dimensions: tuple[tuple[str, float, float, float, float, float], ...]
    extent: tuple[float, float]  # half the width and height of a frame that holds the mechanism at any angle
    remark: str  # what is not to scale


@dataclass(frozen=True, eq=False)
class PoleGroup:
    """Poles of the plant in one mode at one angle."""

    # mode, words: which mode of the dry friction, and what was linearised
    mode: str
    words: str
    # real, imaginary: in 1/s and rad/s, shape (n,)
    real: Array
    imaginary: Array


@dataclass(frozen=True, eq=False)
class SeenStates:
    """What a sensor of the angle shows of the states at one angle."""

    measured: str  # signal
    # rank, states: rank of the observability matrix and number of states
    rank: int
    states: int
    condition: float  # of that matrix, scaled; infinite where the rank is not full
    verdict: str  # in words


@dataclass(frozen=True, eq=False)
class LoopResponse:
    """The torque loop at one angle, linearised between the counts."""

    frequencies: Array  # in Hz
    # magnitude, phase: of torque over wanted torque, in dB and degrees
    magnitude: Array
    phase: Array
    stable: bool  # whether the loop is stable there
    mode: str  # of the plant's dry friction
    words: str  # which controller and observer, and what the response holds for


@dataclass(frozen=True, eq=False)
class Lazy:
    """Something that is computed when asked for."""

    state: WorkStage  # how far it is
    revision: int  # of the design that it holds for
    value: Any = None  # where it is done
    message: str = ""  # why it failed, or how far it is


@dataclass(frozen=True, eq=False)
class AngleAnswer:
    """What holds at one angle, besides the mechanism."""

    angle: float  # in rad
    # observability, poles, loop: each with a state of its own; the value is SeenStates, a tuple of PoleGroup,
    # and LoopResponse
    observability: Lazy
    poles: Lazy
    loop: Lazy


def to_json(value: Any) -> Any:
    """Return an answer as what JSON can hold; numbers that are not finite become ``None``."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        content = {f.name: to_json(getattr(value, f.name)) for f in dataclasses.fields(value)}
        return content | ({"stale": value.stale} if isinstance(value, LiveAnswer) else {})
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return {name: to_json(each) for name, each in value._asdict().items()}
    if isinstance(value, np.ndarray):
        return to_json(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): to_json(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json(each) for each in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, int | np.integer):
        return int(value)
    return value if value is None or isinstance(value, str) else str(value)
