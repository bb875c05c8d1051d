"""What goals and limits see of a design, over the angle and in symbols of the unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..errors import ArrangementError
from ..symbolic import Expression
from .target import Target


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cam with its rubber at nodes over the angle; columns of shape (n,), all in SI.

    Parameters
    ----------
    spring
        Path of the cam spring.
    target
        Torque curve.
    angles
        θ at the nodes, from zero to the last angle of the target.
    lever_arms, lever_arm_slopes
        h and dh/dθ.
    radii_of_curvature, radii
        Of the contour: ρ and the distance from the centre.
    directions
        φ, the direction of the cable seen from the cam.
    extensions, forces, stiffnesses
        e₀ + δ, F and dF/de of one element.
    strains, stresses
        Nominal strain and nominal stress by path of the piece of rubber.
    torque_errors
        N·h·F minus target.
    parameters
        All parameters of the flat model by name; symbols where they are free.
    """

    spring: str
    target: Target
    angles: Expression
    lever_arms: Expression
    lever_arm_slopes: Expression
    radii_of_curvature: Expression
    radii: Expression
    directions: Expression
    extensions: Expression
    forces: Expression
    stiffnesses: Expression
    strains: Mapping[str, Expression]
    stresses: Mapping[str, Expression]
    torque_errors: Expression
    parameters: Mapping[str, Expression]

    @property
    def elements(self) -> Expression:
        """Number of elements that share the torque."""
        return self.parameters[f"{self.spring}.cam.elements"]

    @property
    def tangent_stiffness(self) -> Expression:
        """dτ/dθ = N·(h'·F + h²·K) in N·m/rad."""
        return self.elements * (self.lever_arm_slopes * self.forces + self.lever_arms**2 * self.stiffnesses)

    @property
    def mean_square_error(self) -> Expression:
        """Mean over the angle of the squared torque error in (N·m)², by the trapezoidal rule."""
        squared, steps = self.torque_errors**2, self.angles[1:] - self.angles[:-1]
        return ca.dot((squared[1:] + squared[:-1]) / 2, steps) / self.target.last_angle

    def of_rubber(self, field: str) -> dict[str, Expression]:
        """Return a parameter of each piece of rubber behind the cam by full name.

        Parameters
        ----------
        field
            ``"area"`` or ``"rest_length"``.

        Raises
        ------
        ArrangementError
            If there is no piece of rubber behind the cam.
        """
        if not self.strains:
            raise ArrangementError(
                f"part '{self.spring}'",
                f"has no specimen behind its cam, so it has no {field.replace('_', ' ')}",
                next_step="leave this limit out, or declare the rubber with specimen(...)",
            )
        return {f"{path}.{field}": self.parameters[f"{path}.{field}"] for path in self.strains}
