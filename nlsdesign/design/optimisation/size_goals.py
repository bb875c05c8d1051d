"""Goals on what is built: size, mass, and how much a deviation of the stiffness shows in the torque."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..curves.numbers import in_si, plain
from .design_point import DesignPoint
from .goals import Goal, GoalMeasure, rms_of_mean_square

_RADIUS = 0.01
"""Radius in m whose cost is the weight."""
_MASS = 0.1
"""Mass in kg whose cost is the weight."""
_POWER = 32
"""Of the mean that stands for the largest radius; it is at most 12 % above the largest of 41 equal ones."""


def _store(goal: Goal, name: str, unit: str, minimum: float, maximum: float) -> None:
    given = getattr(goal, name)
    value = in_si(f"{type(goal).__name__}: {name}", given, unit, minimum=minimum, maximum=maximum)
    object.__setattr__(goal, name, value)


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
        _store(self, "weight", "1", 0.0, 1e9)

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
        _store(self, "rubber_density", "kg/m^3", 100.0, 5e3)
        _store(self, "plate_thickness", "m", 1e-5, 0.2)
        _store(self, "plate_density", "kg/m^3", 100.0, 3e4)
        _store(self, "weight", "1", 0.0, 1e9)

    def cost(self, design: DesignPoint) -> Expression:
        """Return weight · mass / 100 g."""
        return self.weight * self.measured(design).expression / _MASS

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the mass."""
        plates = plain(self.plate_density) * plain(self.plate_thickness) * _plate_area(design)
        return GoalMeasure("mass", plain(self.rubber_density) * design.rubber_volume + plates, "g")


def _plate_area(design: DesignPoint) -> Expression:
    """Return the area of the sectors below the contour, with p and ρ linear between nodes."""
    p, rho, phi = design.lever_arms, design.radii_of_curvature, design.directions
    steps = phi[1:] - phi[:-1]
    middle = (p[1:] + p[:-1]) * (rho[1:] + rho[:-1])
    products = (p[1:] * rho[1:] + p[:-1] * rho[:-1] + middle) / 6.0
    halves = 2.0 if design.through_centre else 1.0
    return halves * ca.dot(products, steps) / 2.0


@dataclass(frozen=True)
class InsensitiveStiffness(Goal):
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

    deviation: float = 0.1

    def __post_init__(self) -> None:
        _store(self, "deviation", "1", 1e-6, 1.0)

    def cost(self, design: DesignPoint) -> Expression:
        """Return (rms error by the deviation / 0.1 % of the largest torque)²."""
        return self._mean_square(design) / (1e-3 * design.target.largest) ** 2

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the rms torque error by the deviation."""
        return rms_of_mean_square("rms torque error by stiffness", self._mean_square(design), design)

    def _mean_square(self, design: DesignPoint) -> Expression:
        force, stiffness = design.forces, design.stiffnesses
        per_factor = force - stiffness * force[0] / stiffness[0]
        squared = (self.deviation * design.elements * design.lever_arms * per_factor) ** 2
        steps = design.angles[1:] - design.angles[:-1]
        return ca.dot((squared[1:] + squared[:-1]) / 2, steps) / design.target.last_angle
