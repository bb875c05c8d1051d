"""What is taken of a measured input: a reading, or what stands in for one that cannot be true.

A reading is refused when it is not finite, outside its range, or further from the last good one than the
machine can have moved since. Three refused readings in a row that agree with one another are believed: then
it was the last good one that no longer holds. Where the model expects a reading, that takes the place of a
refused one, so an observer goes on as its model does; elsewhere the last readings are extrapolated for three
samples and held from then on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...foundation.errors import ExportError
from ...model.flat import FlatModel, Variable
from .c_text import Real
from .status_bits import INPUT_HELD, INPUT_JUMPED, INPUT_OUT_OF_RANGE, INPUT_STALE, RECOVERED

AGREEING = 3
"""Refused readings in a row that must agree with one another to be believed."""
GAP = 3
"""Samples without a usable reading that are extrapolated, and from which on a model resumes from the next."""
MOST = 1_000_000
"""Samples up to which gaps and rests are counted; a window of so many samples admits any reading."""


@dataclass(frozen=True)
class ReadingNumbers:
    """Numbers of one measured input, per sample.

    Parameters
    ----------
    lowest, highest
        Range of the reading.
    change
        Largest change from sample to sample.
    noticeable
        Change of what moves the machine that the reading cannot fail to show; negative where that is unknown.
    patience
        Samples without change after which the reading is stale.
    """

    lowest: float
    highest: float
    change: float
    noticeable: float
    patience: int


def reading_numbers(variable: Variable, sample_time: float, real: Real) -> ReadingNumbers | None:
    """Return the numbers of an input, ``None`` where it is a command.

    Parameters
    ----------
    variable
        Input of a sampled model.
    sample_time
        In s.
    real
        Number type.
    """
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
    """Return the group, ``"inputs"`` or ``"states"``, and the place of what moves a reading.

    Parameters
    ----------
    model
        Sampled.
    variable
        Measured input of it.

    Raises
    ------
    ExportError
        If the name is neither an input nor a state.
    """
    name = variable.plausibility.moved_by if variable.plausibility is not None else None
    if name is None:
        return None
    for group, variables in (("inputs", model.inputs), ("states", model.states)):
        for place, each in enumerate(variables):
            if each.name == name:
                return group, place
    raise ExportError(
        f"input '{variable.name}' of '{model.name}'", f"is moved by '{name}', which is no input or state"
    )


@dataclass
class ReadingGuard:
    """The guard of one measured input, sample by sample; the reference for the C code.

    Parameters
    ----------
    numbers
        Of the input.
    real
        Number type whose range counts as finite.
    last
        Last good reading; the start value before the first.
    """

    numbers: ReadingNumbers
    real: Real
    last: float

    def __post_init__(self) -> None:
        self.slope = self.candidate = self.mover = 0.0
        self.missed = self.agreeing = self.unchanged = 0
        self.seen = self.moved = False

    def take(self, given: float, mover: float) -> tuple[float, int, bool]:
        """Return what is used, the flags of the status word, and whether the model has to resume.

        Parameters
        ----------
        given
            The reading.
        mover
            What moves the machine, at this sample.
        """
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
