"""The guards of a step: status word, what stands in for a reading that cannot be true, and both in Python.

A reading is refused when it is not finite, outside its range, or further from the last good one than the
machine can have moved since. Three refused readings in a row that agree with one another are believed: then
it was the last good one that no longer holds. Where the model expects a reading, that takes the place of a
refused one, so an observer goes on as its model does; elsewhere the last readings are extrapolated for three
samples and held from then on.

:class:`GuardedModel` does so in Python with the equations of the model: the reference for the C code.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...model.flat import FlatModel, Variable
from ...simulation.buffered import Buffered
from .c_text import Real

INPUT_HELD = 1 << 0
INPUT_SATURATED = 1 << 1
STATE_RESTARTED = 1 << 2
OUTPUT_HELD = 1 << 3
PARAMETER_REFUSED = 1 << 4
INPUT_OUT_OF_RANGE = 1 << 5
INPUT_JUMPED = 1 << 6
INPUT_STALE = 1 << 7
OUT_OF_TABLE = 1 << 8
RECOVERED = 1 << 9
WAITING = 1 << 10
NOT_STARTED = 1 << 11
COMMAND_SLOWED = 1 << 12
SAMPLE_LATE = 1 << 13
SAMPLE_REPEATED = 1 << 14
INNOVATION_LARGE = 1 << 15
FIRST_INDEX_BIT, LAST_INDEX_BIT = 16, 30

STATUS_BITS = {
    "INPUT_HELD": (
        INPUT_HELD,
        "an input was not finite; its last good value, or what was expected, was used",
    ),
    "INPUT_SATURATED": (INPUT_SATURATED, "a command was outside its range, the limit was used"),
    "STATE_RESTARTED": (
        STATE_RESTARTED,
        "the next state was not finite; the next sample begins anew from its readings",
    ),
    "OUTPUT_HELD": (OUTPUT_HELD, "an output was not finite, the last good outputs were given"),
    "PARAMETER_REFUSED": (
        PARAMETER_REFUSED,
        "a parameter was not finite or outside its range, it was not taken",
    ),
    "INPUT_OUT_OF_RANGE": (INPUT_OUT_OF_RANGE, "a reading was outside its range; what was expected was used"),
    "INPUT_JUMPED": (
        INPUT_JUMPED,
        "a reading changed faster than its largest rate; what was expected was used",
    ),
    "INPUT_STALE": (
        INPUT_STALE,
        "a reading has not changed for its stale time while the drive has; it was used all the same",
    ),
    "OUT_OF_TABLE": (OUT_OF_TABLE, "a table was read beyond its ends, where it holds its last numbers"),
    "RECOVERED": (RECOVERED, "a reading is used again after a gap"),
    "WAITING": (WAITING, "no usable reading has come yet; the outputs are those of the start"),
    "NOT_STARTED": (NOT_STARTED, "init has not been called; all outputs are 0, nothing was taken"),
    "COMMAND_SLOWED": (
        COMMAND_SLOWED,
        "a command changed faster than the drive can follow; what it can reach was used",
    ),
    "SAMPLE_LATE": (SAMPLE_LATE, "of step_at: samples are missing before this one"),
    "SAMPLE_REPEATED": (SAMPLE_REPEATED, "of step_at: the sample came twice; the last outputs were given"),
    "INNOVATION_LARGE": (
        INNOVATION_LARGE,
        "readings have differed from what is expected by more than the deck explains; nothing was changed",
    ),
}


def index_bit(index: int) -> int:
    """Return the bit that names an input or parameter, counted from 0; all from 14 on share the last."""
    return 1 << min(FIRST_INDEX_BIT + index, LAST_INDEX_BIT)


AGREEING = 3
"""Refused readings in a row that must agree with one another to be believed."""
GAP = 3
"""Samples without a usable reading that are extrapolated, and from which on a model resumes from the next."""
MOST = 1_000_000
"""Samples up to which gaps and rests are counted; a window of so many samples admits any reading."""


@dataclass(frozen=True)
class ReadingNumbers:
    """Numbers of one measured input, per sample."""

    # lowest, highest: range of the reading
    lowest: float
    highest: float
    change: float  # largest change from sample to sample
    # noticeable: change of what moves the machine that the reading cannot fail to show; negative where that
    # is unknown
    noticeable: float
    patience: int  # samples without change after which the reading is stale


def reading_numbers(variable: Variable, sample_time: float, real: Real) -> ReadingNumbers | None:
    """Return the numbers of an input of a sampled model, ``None`` where it is a command."""
    limits = variable.plausibility
    if limits is None:
        return None
    patience = limits.stale_time / sample_time - 1e-9
    return ReadingNumbers(
        max(variable.minimum, -real.largest),
        min(variable.maximum, real.largest),
        min(limits.largest_rate * sample_time + limits.resolution, real.largest),
        limits.noticeable if limits.moved_by is not None else -1.0,
        math.ceil(patience) if patience < MOST else MOST + 1,
    )


def mover(model: FlatModel, variable: Variable) -> tuple[str, int] | None:
    """Return the group, ``"inputs"`` or ``"states"``, and the index of what moves a measured reading."""
    name = variable.plausibility.moved_by if variable.plausibility is not None else None
    if name is None:
        return None
    for group, variables in (("inputs", model.inputs), ("states", model.states)):
        for index, candidate in enumerate(variables):
            if candidate.name == name:
                return group, index
    raise ExportError(
        f"input '{variable.name}' of '{model.name}'", f"is moved by '{name}', which is no input or state"
    )


def explained_limit(variable: Variable) -> float:
    """Return what the deck explains of an output at most; infinite where nothing is said of that."""
    can = variable.plausibility
    return can.noticeable if can is not None and can.moved_by is None and can.noticeable else math.inf


@dataclass
class ReadingGuard:
    """The guard of one measured input; ``last`` is its last good reading, or the start value before that."""

    numbers: ReadingNumbers
    real: Real
    last: float

    def __post_init__(self) -> None:
        self.slope = self.candidate = self.mover = 0.0
        self.missed = self.agreeing = self.unchanged = 0
        self.seen = self.moved = False

    def take(self, given: float, mover: float) -> tuple[float, int, bool]:
        """Return what is used, the flags of the status word, and whether the model has to resume."""
        flaw = self._flaw(given)
        if flaw:
            self.missed = min(self.missed + 1, MOST)
            ahead = self.last + min(self.missed, GAP) * self.slope
            return min(max(ahead, self.numbers.lowest), self.numbers.highest), flaw, False
        flags = RECOVERED if self.missed else 0
        resume = self.agreeing >= AGREEING or self.missed >= GAP
        same = self.seen and given == self.last
        if self._stale and not same:
            flags |= RECOVERED
        self.slope = given - self.last if self.seen and not self.missed and not self.agreeing else 0.0
        if same:
            self.unchanged = min(self.unchanged + 1, MOST)
            self.moved = self.moved or abs(mover - self.mover) > self.numbers.noticeable
        else:
            self.unchanged, self.moved, self.mover = 0, False, mover
        if self._stale:
            flags |= INPUT_STALE
        self.last, self.missed, self.agreeing, self.seen = given, 0, 0, True
        return given, flags, resume

    @property
    def _stale(self) -> bool:
        return self.moved and self.unchanged >= self.numbers.patience

    def _flaw(self, given: float) -> int:
        if not self.numbers.lowest <= given <= self.numbers.highest:
            self.agreeing = 0
            return INPUT_OUT_OF_RANGE if abs(given) <= self.real.largest else INPUT_HELD
        if not self.seen or abs(given - self.last) <= self.numbers.change * (self.missed + 1):
            self.agreeing = 0
            return 0
        agrees = self.agreeing > 0 and abs(given - self.candidate) <= self.numbers.change
        self.agreeing = self.agreeing + 1 if agrees else 1
        self.candidate = given
        return 0 if self.agreeing >= AGREEING else INPUT_JUMPED


def first_outputs(model: FlatModel, real: Real = Real.DOUBLE) -> list[float]:
    """Return the outputs held before the first finite ones: those at the start, or 0."""
    start = model.evaluate(model.start(model.states).tolist(), model.start(model.inputs).tolist())
    values = [real.round(start[variable.name]) for variable in model.outputs]
    return [value if math.isfinite(value) else 0.0 for value in values]


@dataclass
class GuardedModel:
    """One running instance of a discrete model, evaluated by CasADi, with the guards of the C code."""

    model: FlatModel
    real: Real = Real.DOUBLE

    def __post_init__(self) -> None:
        model = self.model
        self.state: Array = model.start(model.states)
        self.begun = False
        self._inputs = [min(max(v.start, v.minimum), v.maximum) for v in model.inputs]
        self._outputs = first_outputs(model, self.real)
        self._parameters = model.start(model.parameters)
        self._guards: dict[int, ReadingGuard] = {}
        for i, v in enumerate(model.inputs):
            numbers = reading_numbers(v, float(model.sample_time or 0.0), self.real)
            if numbers is not None:
                self._guards[i] = ReadingGuard(numbers, self.real, self._inputs[i])
        self._movers = {i: mover(model, model.inputs[i]) for i in self._guards}
        symbols = model.equations.sx_in()
        self._given = [np.zeros(max(1, each.numel())) for each in symbols]
        self._given[3][: len(self._parameters)] = self._parameters
        results = [ca.densify(each) for each in model.equations(*symbols)[:2]]
        self._computed = Buffered(ca.Function("step", symbols, results), self._given)

    def step(self, inputs: Sequence[float]) -> tuple[list[float], int]:
        """Advance by one sample of any numbers, shape (inputs,); return the outputs and the status word."""
        status, resume = self._take(inputs)
        if not self.begun:
            if not all(guard.seen for guard in self._guards.values()):
                return list(self._outputs), status | WAITING
            self.state, self.begun = self._settled(self.model.start(self.model.states), 0), True
        elif resume:
            self.state = self._settled(self.state, 1)
        return self._advance(status)

    def _take(self, inputs: Sequence[float]) -> tuple[int, bool]:
        """Take the commands, then the readings; return flags and whether the model has to resume."""
        status, resume = 0, False
        for i, (variable, given) in enumerate(zip(self.model.inputs, inputs, strict=True)):
            if i in self._guards:
                continue
            if not abs(given) <= self.real.largest:
                status |= INPUT_HELD | index_bit(i)
                continue
            usable = min(max(given, variable.minimum), variable.maximum)
            if usable != given:
                status |= INPUT_SATURATED | index_bit(i)
            if self.begun:
                change = variable.largest_rate * float(self.model.sample_time or 0.0)
                followed = min(max(usable, self._inputs[i] - change), self._inputs[i] + change)
                status |= COMMAND_SLOWED | index_bit(i) if followed != usable else 0
                usable = followed
            self._inputs[i] = usable
        for i, guard in self._guards.items():
            moved = self._movers[i]
            driver = 0.0
            if moved is not None:
                driver = float((self._inputs if moved[0] == "inputs" else self.state)[moved[1]])
            self._inputs[i], flags, again = guard.take(inputs[i], driver)
            status |= flags | (index_bit(i) if flags else 0)
            resume = resume or again
        return status, resume

    def _settled(self, state: Array, which: int) -> Array:
        if self.model.begin is None:
            return state
        w = self.model.look_up(state.tolist(), self._inputs)
        return np.array(
            self.model.begin(state, self._inputs, self._parameters, w)[which], dtype=float
        ).ravel()

    def _advance(self, status: int) -> tuple[list[float], int]:
        model, used = self.model, list(self._inputs)
        w = model.look_up(self.state.tolist(), self._inputs)
        if model.expected is not None and any(guard.missed for guard in self._guards.values()):
            expected = np.array(model.expected(self.state, self._inputs, self._parameters, w)).ravel()
            for i, guard in self._guards.items():
                used[i] = float(expected[i]) if guard.missed else used[i]
        at = {v.name: float(x) for v, x in zip(model.states, self.state, strict=True)}
        at |= {v.name: u for v, u in zip(model.inputs, self._inputs, strict=True)}
        if any(not table.ends[0] <= at[table.argument] <= table.ends[1] for table in model.tables):
            status |= OUT_OF_TABLE
        for place, values in ((1, self.state), (2, used), (4, w)):
            self._given[place][: len(values)] = values
        self._computed.evaluate()
        following, outputs = (result.copy() for result in self._computed.results)
        if np.all(np.abs(following) <= self.real.largest):
            self.state = following
        else:
            self.state, self.begun = model.start(model.states), False
            status |= STATE_RESTARTED
        if np.all(np.abs(outputs) <= self.real.largest):
            self._outputs = outputs.tolist()
            large = np.greater(self._outputs, [explained_limit(v) for v in model.outputs])
            status |= INNOVATION_LARGE if large.any() else 0
        else:
            status |= OUTPUT_HELD
        return list(self._outputs), status
