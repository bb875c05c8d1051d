"""How values go from instance to instance: what an input reads, and how an output goes on meanwhile.

What an input reads at a communication point, and over a step, depends on its source. Values are read off one
row of numbers, ``now``, that holds the present value of every output. A continuous output is a :class:`Curve`
over time, of which the coupling says how it goes on beyond the present; a sampled one is held.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ValueRangeError
from ...foundation.progress import Progress, Quiet

_ROUNDING = 1e-6
"""Part of a sample time by which a time may fall short of a sample."""


class Feed(Protocol):
    """Source of one input."""

    moves: ClassVar[bool]
    """Whether the value changes between samples."""

    def initial(self) -> float:
        """Return the value during initialization."""
        ...

    def at(self, row: int, time: float) -> float:
        """Return the value at a communication point."""
        ...

    def before(self, row: int, time: float) -> float:
        """Return the value just before a communication point."""
        ...

    def over(self, row: int, time: float, length: float) -> float:
        """Return the value that stands for the step from a communication point."""
        ...


@dataclass(frozen=True, eq=False)
class GivenFeed:
    """A signal from outside."""

    # values, left, middle: at each communication point, just before it, and in the middle of the step from it
    values: Array
    left: Array
    middle: Array
    moves: ClassVar[bool] = True

    def initial(self) -> float:
        """Return the first value."""
        return float(self.values[0])

    def at(self, row: int, time: float) -> float:
        """Return the value at a communication point."""
        return float(self.values[row])

    def before(self, row: int, time: float) -> float:
        """Return the value just before a communication point."""
        return float(self.left[row])

    def over(self, row: int, time: float, length: float) -> float:
        """Return the value to be held over a step."""
        return float(self.middle[row])


@dataclass(frozen=True, eq=False)
class HeldFeed:
    """The value that stands in ``now``."""

    now: Array
    column: int
    gain: float
    samples: list[float] | None = None
    first: float = 0.0
    moves: ClassVar[bool] = False

    def initial(self) -> float:
        """Return the present value."""
        return self.at(0, 0.0)

    def at(self, row: int, time: float) -> float:
        """Return the present value."""
        if self.samples is not None and not self.samples:
            return self.first
        return self.gain * float(self.now[self.column])

    def before(self, row: int, time: float) -> float:
        """Return the present value."""
        return self.at(row, time)

    def over(self, row: int, time: float, length: float) -> float:
        """Return the present value."""
        return self.at(row, time)


@dataclass(eq=False)
class LateFeed:
    """An earlier value of a sampled output."""

    held: HeldFeed  # the present value
    samples: list[float]  # everything that the source has computed, by sample
    # period, delay: sample time of the source and delay in s
    period: float
    delay: float
    # first: value of the input before the first sample arrives; None for what the source shows before it
    first: float | None
    moves: ClassVar[bool] = False

    def initial(self) -> float:
        """Return the value before the first sample."""
        return self.at(0, 0.0)

    def begin(self) -> None:
        """Keep what the source shows before its first sample."""
        if self.first is None:
            self.first = self.held.at(0, 0.0)

    def at(self, row: int, time: float) -> float:
        """Return the value that was computed the delay ago."""
        number = int((time - self.delay) / self.period + 1.0 + _ROUNDING) - 1
        number = min(number, len(self.samples) - 1)
        if number >= 0:
            return self.held.gain * self.samples[number]
        return self.held.at(row, time) if self.first is None else self.first

    def before(self, row: int, time: float) -> float:
        """Return the value just before a time."""
        return self.at(row, time - 2 * _ROUNDING * self.period)

    def over(self, row: int, time: float, length: float) -> float:
        """Return the value at the beginning of the step; it does not change within."""
        return self.at(row, time)


@dataclass(eq=False)
class Curve:
    """A continuous output over time: known up to the present, and a slope beyond."""

    column: int  # in the row of present values
    smooth: bool  # whether a slope makes sense; that of a discrete output is zero
    times: list[float] = field(default_factory=list, init=False)
    ends: list[float] = field(default_factory=list, init=False)
    """Values at the end of the step that leads to each time."""
    begins: list[float] = field(default_factory=list, init=False)
    """Values at each time after inputs have jumped there."""
    slope: float = field(default=0.0, init=False)
    size: float = field(default=0.0, init=False)
    """Largest absolute value so far."""

    def arrive(self, time: float, value: float) -> None:
        """Note the value at the end of a step."""
        self.times.append(time)
        self.ends.append(value)
        self.begins.append(value)
        self.size = max(self.size, abs(value))

    def depart(self, value: float) -> None:
        """Note the value at the same time after sampled inputs have changed."""
        self.begins[-1] = value

    def past_slope(self) -> float:
        """Return the slope over the last step, zero before there is one."""
        if not self.smooth or len(self.times) < 2:
            return 0.0
        return (self.ends[-1] - self.begins[-2]) / (self.times[-1] - self.times[-2])

    def at(self, time: float) -> float:
        """Return the value at a time, linear between what is known and along the slope beyond."""
        if time >= self.times[-1]:
            return self.begins[-1] + self.slope * (time - self.times[-1])
        after = max(1, bisect_right(self.times, time))
        begin, end = self.times[after - 1], self.times[after]
        part = (time - begin) / (end - begin)
        return self.begins[after - 1] + part * (self.ends[after] - self.begins[after - 1])


@dataclass(frozen=True, eq=False)
class CurveFeed:
    """A continuous output."""

    now: Array
    curve: Curve
    gain: float
    delay: float
    first: float
    moves: ClassVar[bool] = True

    def initial(self) -> float:
        """Return the present value, or that before one arrives through a delay."""
        return self.first if self.delay else self.gain * float(self.now[self.curve.column])

    def at(self, row: int, time: float) -> float:
        """Return the value at a communication point that the source has reached."""
        if self.delay == 0.0:
            return self.gain * float(self.now[self.curve.column])
        return self._delayed(time)

    def before(self, row: int, time: float) -> float:
        """Return the value at a communication point; it does not jump."""
        return self.at(row, time)

    def over(self, row: int, time: float, length: float) -> float:
        """Return the value at the middle of the step."""
        return self._delayed(time + 0.5 * length)

    def _delayed(self, time: float) -> float:
        at = time - self.delay
        return self.gain * self.curve.at(at) if at >= self.curve.times[0] else self.first


class Steppable(Protocol):
    """Continuous instances that are stepped together."""

    curves: Sequence[Curve]
    now: Array

    def advance(self) -> None:
        """Take the present step with the slopes that the curves have."""

    def again(self) -> None:
        """Take the present step of coupled instances once more, from its beginning."""

    def rolling_back(self, work: Callable[[], None]) -> None:
        """Do work within which a step may be taken again."""


class Coupling(Protocol):
    """A way to couple continuous FMUs."""

    @property
    def order(self) -> int:
        """Power of the step with which the error falls."""
        ...

    @property
    def rolls_back(self) -> bool:
        """Whether coupled FMUs must be able to keep and restore their state."""
        ...

    def step(self, system: Steppable, time: float, length: float) -> None:
        """Take one step."""
        ...


@dataclass(frozen=True)
class Held:
    """Inputs are held at their value at the communication point: first order, the most robust."""

    order: int = field(default=1, init=False)
    rolls_back: bool = field(default=False, init=False)

    def step(self, system: Steppable, time: float, length: float) -> None:
        """Take one step with zero slopes."""
        for curve in system.curves:
            curve.slope = 0.0
        system.advance()


@dataclass(frozen=True)
class Extrapolated:
    """Inputs continue along the line through their last two values: second order, for any FMU."""

    order: int = field(default=2, init=False)
    rolls_back: bool = field(default=False, init=False)

    def step(self, system: Steppable, time: float, length: float) -> None:
        """Take one step with the slopes of the last."""
        for curve in system.curves:
            curve.slope = curve.past_slope()
        system.advance()


@dataclass(frozen=True)
class Iterated:
    """Inputs go on a line to the value at the end of the step, found by taking the step again and again.

    Second order, and stable for stiffer couplings than :class:`Extrapolated`. The FMUs must be able to keep
    and restore their state.

    Parameters
    ----------
    rounds
        Most repetitions of a step.
    tolerance
        Change of a value from one repetition to the next, relative to its largest size, that ends them.

    Raises
    ------
    ValueRangeError
        If rounds or tolerance is not possible.
    """

    rounds: int = 20
    tolerance: float = 1e-9
    order: int = field(default=2, init=False)
    rolls_back: bool = field(default=True, init=False)

    def __post_init__(self) -> None:
        if self.rounds < 1 or not 0.0 < self.tolerance < 1.0:
            raise ValueRangeError(
                f"rounds {self.rounds}, tolerance {self.tolerance}", "must be at least 1, and within (0, 1)"
            )

    def step(self, system: Steppable, time: float, length: float) -> None:
        """Take one step until its end no longer changes.

        Parameters
        ----------
        system, time, length
            See :class:`Coupling`.

        Raises
        ------
        ConvergenceError
            If it still changes after all rounds.
        """
        columns = [curve.column for curve in system.curves]

        def repeat() -> None:
            for curve in system.curves:
                curve.slope = curve.past_slope()
            system.advance()
            for _ in range(self.rounds):
                ends = system.now[columns]
                for curve, end in zip(system.curves, ends.tolist(), strict=True):
                    curve.slope = (end - curve.begins[-1]) / length if curve.smooth else 0.0
                system.again()
                change = np.abs(system.now[columns] - ends)
                sizes = np.maximum([curve.size for curve in system.curves], np.abs(ends))
                if np.all(change <= self.tolerance * sizes):
                    return
            raise ConvergenceError(
                f"step from {time:g} s",
                f"the wires between continuous FMUs still change after {self.rounds} rounds",
                next_step="take a shorter step",
            )

        system.rolling_back(repeat)


@dataclass(frozen=True)
class Stepping:
    """How a co-simulation is stepped.

    Parameters
    ----------
    step
        Longest communication step in s; by default the shortest sample time of the instances. Samples need
        not be multiples of it: the time between two is divided equally.
    coupling
        Of continuous FMUs: :class:`Extrapolated`, :class:`Iterated` or :class:`Held`.
    estimate
        Whether the error of coupling is estimated by a second run with half the step. It is made only where
        continuous FMUs are coupled or driven from outside; elsewhere there is no such error.
    patience
        Most seconds that one call into an FMU may take before it counts as hanging; 30 s are assumed to be
        enough for any step of 1 ms of any model.
    progress
        Told how far the run is.

    Raises
    ------
    ValueRangeError
        If step or patience is not a positive number of seconds.
    """

    step: float | None = None
    coupling: Coupling = field(default_factory=Extrapolated)
    estimate: bool = True
    patience: float = 30.0
    progress: Progress = field(default_factory=Quiet)

    def __post_init__(self) -> None:
        if self.step is not None and not (math.isfinite(self.step) and self.step > 0.0):
            raise ValueRangeError(f"step={self.step}", "must be a positive number of seconds")
        if not self.patience > 0.0:
            raise ValueRangeError(f"patience={self.patience}", "must be a positive number of seconds")
