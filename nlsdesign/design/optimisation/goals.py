"""What a design should be good at; goals add up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from ...foundation.symbolic import Expression
from .design_point import DesignPoint

_LENGTH = 0.01
"""Typical radius of curvature in m; it only scales the roughness."""
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
class TorqueError(Goal):
    """Mean over the angle of the squared torque error."""

    def measured(self, design: DesignPoint) -> GoalMeasure:
        """Return the rms torque error."""
        return rms_of_mean_square("rms torque error", design.mean_square_error, design)

    def cost(self, design: DesignPoint) -> Expression:
        """Return (rms error / 0.1 % of the largest torque)²."""
        return design.mean_square_error / (1e-3 * design.target.largest) ** 2


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
        """Return weight · mean((dρ/dφ)²) / (10 mm/rad)²."""
        rho, phi = design.radii_of_curvature, design.directions
        changes, steps = rho[1:] - rho[:-1], phi[1:] - phi[:-1]
        span = phi[-1] - phi[0]
        return self.weight * ca.sum1(changes**2 / steps) / span / _LENGTH**2


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


def rms_of_mean_square(what: str, mean_square: Expression, design: DesignPoint) -> GoalMeasure:
    """Return a mean square torque as its root, smooth where it vanishes."""
    return GoalMeasure(what, ca.sqrt(mean_square + (_FLOOR * design.target.largest) ** 2), "mN*m")
