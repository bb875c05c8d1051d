"""The edge of a cam as limits and goals see it: under a cable, on its mirror image, or under a roller."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from ...foundation.symbolic import Expression

_LENGTH = 0.01
"""Typical radius of curvature in m; it only scales the roughness."""


class EdgeRow(NamedTuple):
    """What must hold along an edge for a least radius; columns in SI.

    Where ``offset`` is a number, the expression is a curvature, which stays finite where the edge is
    straight, and the radius is its inverse plus the offset.
    """

    of: str
    expression: Expression
    value: float
    upper: bool
    offset: float | None = None


class Edge(ABC):
    """What the shape of a cam comes to besides its lever arm."""

    @property
    @abstractmethod
    def roughness(self) -> Expression:
        """How uneven the edge is: a pure number, 1 for a slope of 10 mm/rad."""

    @property
    @abstractmethod
    def sector(self) -> Expression:
        """Area in m² between the edge and the axis."""

    @abstractmethod
    def least_radius(self, radius: float) -> EdgeRow:
        """Return what keeps the radius of curvature where the edge is convex at or above a number."""


def _mean_square(column: Expression, along: Expression) -> Expression:
    """Return the mean of the squared slope of a column."""
    changes, steps = column[1:] - column[:-1], along[1:] - along[:-1]
    return ca.sum1(changes**2 / steps) / (along[-1] - along[0])


@dataclass(frozen=True, eq=False)
class CableEdge(Edge):
    """A convex contour on which a cable lies; columns over the nodes."""

    directions: Expression
    supports: Expression
    radii_of_curvature: Expression
    halves: int

    @property
    def roughness(self) -> Expression:
        """Mean of (dρ/dφ)² relative to (10 mm/rad)²."""
        return _mean_square(self.radii_of_curvature, self.directions) / _LENGTH**2

    @property
    def sector(self) -> Expression:
        """½∫p·ρ dφ of all halves, with p and ρ linear between nodes."""
        p, rho, phi = self.supports, self.radii_of_curvature, self.directions
        steps = phi[1:] - phi[:-1]
        middle = (p[1:] + p[:-1]) * (rho[1:] + rho[:-1])
        products = (p[1:] * rho[1:] + p[:-1] * rho[:-1] + middle) / 6.0
        return self.halves * ca.dot(products, steps) / 2.0

    def least_radius(self, radius: float) -> EdgeRow:
        """Return ρ ≥ radius."""
        return EdgeRow("radius of curvature", self.radii_of_curvature, radius, False)


@dataclass(frozen=True, eq=False)
class PairEdge(CableEdge):
    """A convex contour that rolls on its mirror image: two cams of two halves each."""

    @property
    def roughness(self) -> Expression:
        """That of the contour, and half the distance of the pivots squared, relative to 2 mm.

        A pair is convex by itself, so it is sooner to be small than smooth.
        """
        return super().roughness + self.supports[0] ** 2 / (0.2 * _LENGTH) ** 2


@dataclass(frozen=True, eq=False)
class RollerEdge(Edge):
    """An edge on which a roller runs, by the way of its centre; columns over the nodes."""

    bearings: Expression
    centre_radii: Expression
    lever_arms: Expression
    lever_arm_slopes: Expression
    radius: float  # of the roller in m

    @property
    def speeds(self) -> Expression:
        """Way of the roller's centre per angle, in m."""
        return ca.sqrt(self.centre_radii**2 + self.lever_arms**2)

    @property
    def curvatures(self) -> Expression:
        """Curvature κ of the way of the roller's centre in 1/m, below zero where it is hollow."""
        rho, h = self.centre_radii, self.lever_arms
        return (rho**2 + 2.0 * h**2 - rho * self.lever_arm_slopes) / self.speeds**3

    @property
    def pressure_angles(self) -> Expression:
        """Angle |α| between the normal of the edge and the line of the follower."""
        return ca.atan(ca.fabs(self.lever_arms) / self.centre_radii)

    @property
    def radii(self) -> Expression:
        """Distance of the edge from the axis."""
        rho, r = self.centre_radii, self.radius
        return ca.sqrt(rho**2 + r**2 - 2.0 * r * rho**2 / self.speeds)

    @property
    def radii_of_curvature(self) -> Expression:
        """Radius of curvature of the edge, below zero where it is hollow; 10 m where it is straight."""
        kappa, least = self.curvatures, 0.1
        straight = ca.if_else(kappa < 0.0, -least, least)
        return 1.0 / ca.if_else(ca.fabs(kappa) < least, straight, kappa) - self.radius

    @property
    def roughness(self) -> Expression:
        """Mean of (d²h/dθ²)², and the base radius squared, relative to 10 mm: small and smooth is better."""
        bends = _mean_square(self.lever_arm_slopes, self.bearings)
        return (bends + self.centre_radii[0] ** 2) / _LENGTH**2

    @property
    def sector(self) -> Expression:
        """½∫(ρ·cos α − r)·(1 − κ·r)·s dθ of both sides, by trapezoids."""
        speed, r = self.speeds, self.radius
        grown = (self.centre_radii**2 / speed - r) * speed * (1.0 - r * self.curvatures)
        steps = self.bearings[1:] - self.bearings[:-1]
        return ca.dot((grown[1:] + grown[:-1]) / 2.0, steps)

    def least_radius(self, radius: float) -> EdgeRow:
        """Return κ ≤ 1/(radius + r), or the roller undercuts the edge."""
        most = 1.0 / (radius + self.radius)
        return EdgeRow("radius of the convex edge", self.curvatures, most, True, -self.radius)

    def least_hollow(self, radius: float) -> EdgeRow:
        """Return −κ ≤ 1/(radius − r): the hollow edge is wider than the roller by that."""
        most = 1.0 / (radius - self.radius)
        return EdgeRow("radius of the hollow edge", -self.curvatures, most, True, self.radius)
