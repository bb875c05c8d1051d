"""Goals with the relaxing rubber in the loop: energy lost per cycle, and the target on both strokes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..curves.numbers import in_si, plain
from .design_point import DesignPoint
from .goals import Goal, GoalMeasure, rms_of_mean_square
from .steady_cycle import steady_cycle


def _frequency(goal: str, given: Quantity | float) -> float:
    return in_si(f"{goal}: frequency", given, "Hz", minimum=1e-6, maximum=1e4)


def _amplitude(goal: str, given: Quantity | float | None) -> float | None:
    return None if given is None else in_si(f"{goal}: amplitude", given, "rad", minimum=1e-3, maximum=6.3)


@dataclass(frozen=True)
class EnergyLost(Goal):
    """Energy lost in a steady cycle, relative to the energy stored up to its amplitude in equilibrium.

    Both count each time the rubber is stretched: twice a cycle where the cable passes through the centre.

    Parameters
    ----------
    frequency
        Frequency of the cam angle, which turns as a sine, in Hz.
    amplitude
        Largest angle in rad; the last angle of the target if it is left out.
    weight
        Cost of losing 1 %.
    """

    frequency: Quantity | float
    amplitude: Quantity | float | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        name = type(self).__name__
        object.__setattr__(self, "frequency", _frequency(name, self.frequency))
        object.__setattr__(self, "amplitude", _amplitude(name, self.amplitude))
        in_si(f"{name}: weight", self.weight, "1", maximum=1e9)

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · lost / stored / 1 %."""
        return self.weight * self.measured(design).expression / 0.01

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the share of the stored energy that is lost."""
        amplitude = None if self.amplitude is None else plain(self.amplitude)
        cycle = steady_cycle(design, plain(self.frequency), amplitude)
        return GoalMeasure("energy lost per cycle", cycle.lost / cycle.stored, "%")


@dataclass(frozen=True)
class BothStrokes(Goal):
    """Mean square torque error against the target over the angle, both strokes and a band of frequencies.

    At a frequency of zero this is the goal :class:`TorqueError`.

    Parameters
    ----------
    frequencies
        Frequencies of the cam angle, which turns as a sine, in Hz; all count alike.
    amplitude
        Largest angle in rad; the last angle of the target if it is left out.

    Raises
    ------
    ValueRangeError
        If there is no frequency, or a number lies outside its range.
    """

    frequencies: Sequence[Quantity | float]
    amplitude: Quantity | float | None = None

    def __post_init__(self) -> None:
        name = type(self).__name__
        if isinstance(self.frequencies, Quantity | float | int) or not len(self.frequencies):
            raise ValueRangeError(
                f"{name}: frequencies = {self.frequencies}", "must be a row of at least one frequency",
                next_step="write for instance BothStrokes((1.0, 5.0))",
            )  # fmt: skip
        object.__setattr__(self, "frequencies", tuple(_frequency(name, f) for f in self.frequencies))
        object.__setattr__(self, "amplitude", _amplitude(name, self.amplitude))

    def cost(self, design: DesignPoint) -> Expression:
        """Return (rms error / 0.1 % of the largest torque)²."""
        return self._mean_square(design) / (1e-3 * design.target.largest) ** 2

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the rms error."""
        return rms_of_mean_square("rms torque error on both strokes", self._mean_square(design), design)

    def _mean_square(self, design: DesignPoint) -> Expression:
        amplitude = None if self.amplitude is None else plain(self.amplitude)
        cycles = [steady_cycle(design, plain(f), amplitude) for f in self.frequencies]
        return sum((cycle.mean_square_error for cycle in cycles), start=Expression(0)) / len(cycles)
