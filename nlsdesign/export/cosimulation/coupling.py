"""How continuous FMUs are coupled between communication points: the input that each is given over a step.

Sampled values are constant between samples, so wires from sampled instances need no choice: only wires
between continuous instances, and signals from outside into them, have an error of coupling. Within a step
each instance gets constant inputs, the value at the middle of the step; what is taken for it decides the
order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ValueRangeError
from ...foundation.progress import Progress, Quiet
from .feeds import Curve


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
        """Take one step with zero slopes.

        Parameters
        ----------
        system, time, length
            See :class:`Coupling`.
        """
        for curve in system.curves:
            curve.slope = 0.0
        system.advance()


@dataclass(frozen=True)
class Extrapolated:
    """Inputs continue along the line through their last two values: second order, for any FMU."""

    order: int = field(default=2, init=False)
    rolls_back: bool = field(default=False, init=False)

    def step(self, system: Steppable, time: float, length: float) -> None:
        """Take one step with the slopes of the last.

        Parameters
        ----------
        system, time, length
            See :class:`Coupling`.
        """
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
