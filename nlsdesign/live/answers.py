"""What a designer gets back: typed, in SI, with names and units; JSON by one function."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

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
    """A row of numbers over the cam angle, in SI.

    Parameters
    ----------
    name, unit, description
        What it is.
    values
        Shape (n,).
    """

    name: str
    unit: str
    description: str
    values: Array


@dataclass(frozen=True)
class LimitMargin:
    """How a design stands to one side of a limit, in SI.

    Parameters
    ----------
    limit, of
        Name of the limit and what it bounds.
    value, bound
        The value that comes closest, and the bound.
    margin
        Distance to the bound in the unit; negative where the limit is broken.
    unit, shown_unit
        SI unit and that in which people read it.
    upper
        Whether the bound is the largest that is allowed.
    active
        Whether the design sits on it.
    """

    limit: str
    of: str
    value: float
    bound: float
    margin: float
    unit: str
    shown_unit: str
    upper: bool
    active: bool

    def shown(self, value: float) -> str:
        """Return a number in the unit of the limit as text."""
        return with_unit(f"{value / parse_unit(self.shown_unit).factor:.4g}", self.shown_unit)


@dataclass(frozen=True)
class ShownNumber:
    """A number of the design in SI.

    Parameters
    ----------
    name, value, unit, shown_unit
        As in the deck.
    free
        Whether the design chose it.
    """

    name: str
    value: float
    unit: str
    shown_unit: str
    free: bool


@dataclass(frozen=True, eq=False)
class LiveControls:
    """What a designer can move, as it stands now; numbers in SI.

    Parameters
    ----------
    title, material
        Of the actuator; the material is empty for that of the deck.
    points
        Rows (angle, torque) of the target.
    limits
        Rows (kind, words, value, unit, shown unit, upper, by default).
    numbers
        Rows (name, value, unit, shown unit, free, minimum, maximum, source); infinite where there is no end.
    contour
        Name of the contour.
    contour_free
        Whether it may change.
    can_undo, can_redo
        Whether there is a step back or forth.
    """

    title: str
    material: str
    points: tuple[Any, ...]
    limits: tuple[Any, ...]
    numbers: tuple[Any, ...]
    contour: str
    contour_free: bool
    can_undo: bool
    can_redo: bool


@dataclass(frozen=True, eq=False)
class DesignView:
    """One design over the angle.

    Parameters
    ----------
    revision
        Of the question that it answers.
    checked
        Whether the torque is that of the finished assembly, flattened anew; otherwise it is what the program
        saw at the nodes of the contour.
    columns
        Torque, target, error, lever arm, stiffness, radius of curvature, extension, tension, and strain and
        stress of each piece of rubber, all over ``columns[0]``, the angle.
    rms_error, largest_error
        Of the torque over the angle in N·m.
    relative_error
        Rms error over the largest torque of the target.
    met
        Whether that is within the 1 % that a design may miss.
    margins
        To each limit.
    active
        Names of the limits that the design sits on.
    numbers
        That the design chose or was given.
    contour
        Points of the lip in the frame of the cam, shape (n, 2), in m.
    rubber_volume
        In m³.
    strain_end
        Strain to which the rubber may be believed; infinite without rubber.
    beyond
        In words where it is stretched further, how far, and what to change.
    made_error
        Rms error in N·m that 95 % of the springs stay below whose numbers lie within their declared spreads;
        ``None`` before the check, and where no number is spread.
    """

    revision: int
    checked: bool
    columns: tuple[LiveColumn, ...]
    rms_error: float
    largest_error: float
    relative_error: float
    met: bool
    margins: tuple[LimitMargin, ...]
    active: tuple[str, ...]
    numbers: tuple[ShownNumber, ...]
    contour: Array
    rubber_volume: float
    strain_end: float = math.inf
    beyond: tuple[str, ...] = ()
    made_error: float | None = None

    def column(self, name: str) -> LiveColumn:
        """Return one column."""
        return {each.name: each for each in self.columns}[name]


@dataclass(frozen=True, eq=False)
class LiveAnswer:
    """The answer to an edit.

    Parameters
    ----------
    revision
        Number of the question; each edit, undo and redo makes a new one.
    state
        Whether there is a design of this question.
    message
        In words: why there is no design, or what to know of it.
    source
        How it was found.
    design
        The last good design; ``None`` before the first. Where its revision is not that of the answer it
        belongs to an earlier question and must be shown as such.
    controls
        What can be moved.
    seconds
        It took to answer.
    conflicts
        Limits that contradict each other, where they do.
    """

    revision: int
    state: AnswerState
    message: str
    source: AnswerSource
    design: DesignView | None
    controls: LiveControls
    seconds: float
    conflicts: tuple[str, ...] = ()

    @property
    def stale(self) -> bool:
        """Whether the design shown is that of an earlier question."""
        return self.design is not None and self.design.revision != self.revision


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Cam, cable and rubber in the plane at one angle, in m; the cable pulls to the right.

    Parameters
    ----------
    angle
        Of the cam in rad.
    halves
        Closed outlines of the cam, the right one and, for a cable through the centre, its twin.
    cables
        Lines from the cam to the rubber, one for each side.
    contacts, guides
        Where each cable leaves the cam, and the end of its free length as it is drawn.
    rubbers
        Corners of each piece of rubber (stretched to scale), shape (4, 2).
    extent
        Half the width and height of a frame that holds the mechanism at any angle.
    remark
        What is not to scale.
    """

    angle: float
    halves: tuple[Array, ...]
    cables: tuple[Array, ...]
    contacts: tuple[Array, ...]
    guides: tuple[Array, ...]
    rubbers: tuple[Array, ...]
    extent: tuple[float, float]
    remark: str


@dataclass(frozen=True, eq=False)
class PoleGroup:
    """Poles of the plant in one mode at one angle.

    Parameters
    ----------
    mode, words
        Which mode of the dry friction, and what was linearised.
    real, imaginary
        In 1/s and rad/s, shape (n,).
    """

    mode: str
    words: str
    real: Array
    imaginary: Array


@dataclass(frozen=True, eq=False)
class SeenStates:
    """What a sensor of the angle shows of the states at one angle.

    Parameters
    ----------
    measured
        Signal.
    rank, states
        Rank of the observability matrix and number of states.
    condition
        Of that matrix, scaled; infinite where the rank is not full.
    verdict
        In words.
    """

    measured: str
    rank: int
    states: int
    condition: float
    verdict: str


@dataclass(frozen=True, eq=False)
class LoopResponse:
    """The torque loop at one angle, linearised between the counts.

    Parameters
    ----------
    frequencies
        In Hz.
    magnitude, phase
        Of torque over wanted torque, in dB and degrees.
    stable
        Whether the loop is stable there.
    mode
        Of the plant's dry friction.
    words
        Which controller and observer, and what the response holds for.
    """

    frequencies: Array
    magnitude: Array
    phase: Array
    stable: bool
    mode: str
    words: str


@dataclass(frozen=True, eq=False)
class Lazy:
    """Something that is computed when asked for.

    Parameters
    ----------
    state
        How far it is.
    revision
        Of the design that it holds for.
    value
        Where it is done.
    message
        Why it failed, or how far it is.
    """

    state: WorkStage
    revision: int
    value: Any = None
    message: str = ""


@dataclass(frozen=True, eq=False)
class AngleAnswer:
    """What holds at one angle.

    Parameters
    ----------
    angle
        In rad.
    revision
        Of the design.
    mechanism
        Cam, cable and rubber to scale; ``None`` where the contour has no outline.
    readings
        The columns of the design at this angle, by interpolation; each with one value.
    observability, poles, loop
        Each with a state of its own; the value is :class:`SeenStates`, a tuple of :class:`PoleGroup`, and
        :class:`LoopResponse`.
    """

    angle: float
    revision: int
    mechanism: Mechanism | None
    readings: tuple[LiveColumn, ...]
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
    if isinstance(value, list | tuple):
        return [to_json(each) for each in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, int | np.integer):
        return int(value)
    return value if value is None or isinstance(value, str) else str(value)
