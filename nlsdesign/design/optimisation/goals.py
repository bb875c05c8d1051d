"""What a design should be good at; goals add up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..curves.numbers import hold_in_si, in_si, plain
from .design_point import DesignPoint
from .steady_cycle import steady_cycle

_FLOOR = 1e-6
"""Rms error relative to the largest torque that keeps the root smooth where the error vanishes."""


class GoalMeasure(NamedTuple):
    """What a goal is about: a column in SI of which the largest counts, and the unit in which it is shown."""

    what: str
    expression: Expression
    unit: str


@dataclass(frozen=True)
class Goal(ABC):
    """Base of the goals."""

    @abstractmethod
    def cost(self, design: DesignPoint) -> Expression:
        """Return a pure number; one per mille of the largest torque as rms error counts as 1.

        Parameters
        ----------
        design
            The design in symbols.
        """

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return what the goal is about, as it is compared between designs; the cost by itself.

        Parameters
        ----------
        design
            The design in symbols.
        """
        return GoalMeasure(f"cost of {type(self).__name__}", ca.SX(self.cost(design)), "1")


@dataclass(frozen=True)
class SquaredTorqueGoal(Goal):
    """Base of the goals that are a mean square of a torque."""

    what: ClassVar[str]
    """Of which torque its root is."""

    @abstractmethod
    def mean_square(self, design: DesignPoint) -> Expression:
        """Return the mean square in (N·m)²."""

    def cost(self, design: DesignPoint) -> Expression:
        """Return (root of the mean square / 0.1 % of the largest torque)²."""
        return self.mean_square(design) / (1e-3 * design.target.largest) ** 2

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the root of the mean square, smooth where it vanishes."""
        floor = (_FLOOR * design.target.largest) ** 2
        return GoalMeasure(self.what, ca.sqrt(self.mean_square(design) + floor), "mN*m")


@dataclass(frozen=True)
class TorqueError(SquaredTorqueGoal):
    """Mean over the angle of the squared torque error."""

    what: ClassVar[str] = "rms torque error"

    def mean_square(self, design: DesignPoint) -> Expression:
        """Return the mean square error."""
        return design.mean_square_error


@dataclass(frozen=True)
class SmoothContour(Goal):
    """Mean of the squared slope of the radius of curvature over the cable's direction.

    The default weight only decides between contours of equal torque: a slope of 10 mm/rad costs as much as
    0.003 ‰ of the largest torque.

    Parameters
    ----------
    weight
        Cost of a slope of 10 mm/rad.
    """

    weight: float = 1e-5

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · mean((dρ/dφ)²) / (10 mm/rad)², under a roller that of d²h/dθ² and a base radius."""
        return self.weight * design.edge.roughness


@dataclass(frozen=True)
class LeastRubber(Goal):
    """Volume of rubber, relative to what the energy below the target needs at a strain energy of 0.6 MJ/m³.

    Where area, rest length and pretension are free, many rubbers give the same torque; the default weight
    lets the smallest of them win: all that volume costs as much as 0.03 ‰ of the largest torque.

    Parameters
    ----------
    weight
        Cost of that volume.
    energy_density
        Strain energy by which the volume is scaled, in J/m³.
    """

    weight: float = 1e-3
    energy_density: float = 6e5

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the volume."""
        return GoalMeasure("rubber volume", ca.SX(design.rubber_volume), "cm^3")

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · volume / typical volume."""
        needed = design.target.energy(design.target.last_angle) / self.energy_density
        return self.weight * design.rubber_volume / needed


_RADIUS = 0.01
"""Radius in m whose cost is the weight."""
_MASS = 0.1
"""Mass in kg whose cost is the weight."""
_POWER = 32
"""Of the mean that stands for the largest radius; it is at most 12 % above the largest of 41 equal ones."""


@dataclass(frozen=True)
class LeastSize(Goal):
    """Radius of the cam: the largest distance of its contour from the centre.

    Parameters
    ----------
    weight
        Cost of a radius of 10 mm.
    """

    weight: float = 1.0

    def __post_init__(self) -> None:
        hold_in_si(self, "weight", "1", minimum=0.0, maximum=1e9, with_class=True)

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · radius / 10 mm; a power mean of the nodes stands for the largest of them."""
        return self.weight * ca.sum1((design.radii / _RADIUS) ** _POWER) ** (1.0 / _POWER)

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the distances of the contour from the centre."""
        return GoalMeasure("cam radius", design.radii, "mm")


@dataclass(frozen=True)
class LeastMass(Goal):
    """Mass of the rubber and of the plates from which the cam is cut, the parts that a design changes.

    A cam through whose centre the cable passes has two equal halves. Each plate is the sector that the
    contour encloses with the centre, ½∫p·ρ dφ, without hub and run-out.
    Source: geometry.

    Parameters
    ----------
    rubber_density
        Mass of the rubber per volume, in kg/m³.
    plate_thickness
        Thickness of the plates of the cam, in m.
    plate_density
        Mass of the plates per volume, in kg/m³.
    weight
        Cost of 100 g.
    """

    rubber_density: Quantity | float
    plate_thickness: Quantity | float
    plate_density: Quantity | float
    weight: float = 1.0

    def __post_init__(self) -> None:
        hold_in_si(self, "rubber_density", "kg/m^3", minimum=100.0, maximum=5e3, with_class=True)
        hold_in_si(self, "plate_thickness", "m", minimum=1e-5, maximum=0.2, with_class=True)
        hold_in_si(self, "plate_density", "kg/m^3", minimum=100.0, maximum=3e4, with_class=True)
        hold_in_si(self, "weight", "1", minimum=0.0, maximum=1e9, with_class=True)

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · mass / 100 g."""
        return self.weight * self.measured(design).expression / _MASS

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the mass."""
        plates = plain(self.plate_density) * plain(self.plate_thickness) * design.edge.sector
        return GoalMeasure("mass", plain(self.rubber_density) * design.rubber_volume + plates, "g")


@dataclass(frozen=True)
class InsensitiveStiffness(SquaredTorqueGoal):
    """Torque error that a deviation of the rubber's stiffness leaves when the pretension is set by its force.

    All moduli deviate by one factor. If the pretension stays as a length, the torque deviates by that factor
    whatever the design. If after assembly it is trimmed until the force at angle zero is the designed one
    again, the force at extension e deviates per factor by F(e) − F₀·K(e)/K₀, so that a design which carries
    its torque by pretension notices the deviation less. Johnston, Orekhov and Simaan 2023 have insensitivity
    to the spring constant as a goal for wire-wrapped cams; this definition is not taken from there, as only
    their abstract was at hand.

    Parameters
    ----------
    deviation
        Relative deviation of the stiffness; its rms torque error counts as one of :class:`TorqueError` does.
    """

    what: ClassVar[str] = "rms torque error by stiffness"

    deviation: float = 0.1

    def __post_init__(self) -> None:
        hold_in_si(self, "deviation", "1", minimum=1e-6, maximum=1.0, with_class=True)

    def mean_square(self, design: DesignPoint) -> Expression:
        """Return the mean square error by the deviation."""
        force, stiffness = design.forces, design.stiffnesses
        per_factor = force - stiffness * force[0] / stiffness[0]
        squared = (self.deviation * design.elements * design.lever_arms * per_factor) ** 2
        steps = design.angles[1:] - design.angles[:-1]
        return ca.dot((squared[1:] + squared[:-1]) / 2, steps) / design.target.last_angle


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
class BothStrokes(SquaredTorqueGoal):
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

    what: ClassVar[str] = "rms torque error on both strokes"

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

    def mean_square(self, design: DesignPoint) -> Expression:
        """Return the mean square error over all strokes."""
        amplitude = None if self.amplitude is None else plain(self.amplitude)
        cycles = [steady_cycle(design, plain(f), amplitude) for f in self.frequencies]
        return sum((cycle.mean_square_error for cycle in cycles), start=Expression(0)) / len(cycles)
