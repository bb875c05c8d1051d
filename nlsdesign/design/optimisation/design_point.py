"""What goals and limits see of a design, over the angle and in symbols of the unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.symbolic import Expression
from ...model import FlatModel
from ...model.structure import CamNames
from ..curves.target import Target
from ..statics.equilibrium import ElasticLaw, RelaxingLaw, relaxing_law
from .edges import Edge


def anchor_of(cam: CamNames) -> str:
    """Return the name of the distance of the anchor from the centre."""
    if cam.anchor_distance is None:
        raise ArrangementError(
            f"cam '{cam.name}'", "has no anchor", next_step="declare the spring with a TwoSidedCam"
        )
    return cam.anchor_distance


class Stretched(NamedTuple):
    """One element stretched: force, stiffness, strain and stress of each piece of rubber, rows of coils."""

    force: Expression
    stiffness: Expression
    strains: Expression
    stresses: Expression
    coils: Expression


class CoilColumns(NamedTuple):
    """A coil over the angle; what is not known of its wire is zero."""

    extension: Expression
    shear_stress: Expression
    tensile_strength: Expression
    wire_volume: Expression


@dataclass(frozen=True, eq=False)
class DesignPoint:
    """A cam with its rubber at nodes over the angle; columns of shape (n,), all in SI."""

    cam: CamNames  # names around the cam
    target: Target  # torque curve
    angles: Expression  # θ at the nodes, from zero to the last angle of the target
    # lever_arms, lever_arm_slopes: h and dh/dθ
    lever_arms: Expression
    lever_arm_slopes: Expression
    # radii_of_curvature, radii: of the contour: ρ and the distance from the centre
    radii_of_curvature: Expression
    radii: Expression
    directions: Expression  # φ, the direction of the cable seen from the cam
    edge: Edge  # the edge of the cam, under a cable or a roller
    # extensions, forces, stiffnesses: e₀ + δ, F and dF/de of one element
    extensions: Expression
    forces: Expression
    stiffnesses: Expression
    # strains, stresses: nominal strain and nominal stress by path of the piece of rubber
    strains: Mapping[str, Expression]
    stresses: Mapping[str, Expression]
    coil_rows: Expression  # four rows for each coil: the columns of CoilColumns
    torque_errors: Expression  # N·h·F minus target
    # parameters: all parameters of the flat model by name; symbols where they are free
    parameters: Mapping[str, Expression]
    element: Callable[[Expression], Stretched]  # what one element does at an extension in m
    # through_centre: whether the cable passes through the centre, so that both signs of the angle stretch the
    # rubber alike
    through_centre: bool
    shown_units: Mapping[str, str]  # unit in which each parameter is shown
    model: FlatModel  # flat model of the actuator, with its numbers as they are declared
    law: ElasticLaw  # equilibrium law of one element

    @cached_property
    def relaxing(self) -> RelaxingLaw:
        """Law of one element with its inner states free."""
        return relaxing_law(self.model, self.cam.drive)

    @property
    def elements(self) -> Expression:
        """Number of elements that share the torque."""
        return self.parameters[self.cam.elements]

    @property
    def torques(self) -> Expression:
        """Torque N·h·F in N·m."""
        return self.elements * self.lever_arms * self.forces

    def turned_beyond(self, angle: float) -> DesignPoint:
        """Return the design at one angle beyond the end of its contour, with the last lever arm held.

        Result: with columns of shape (1,); directions, slopes and torque errors are those of the last node.
        """
        arm = self.lever_arms[-1]
        extension = self.extensions[-1] + arm * angle
        at = self.element(extension)
        return replace(
            self,
            angles=self.angles[-1] + angle,
            directions=self.directions[-1] + angle,
            lever_arms=arm,
            lever_arm_slopes=ca.SX(0),
            radii_of_curvature=arm,
            radii=self.radii[-1],
            extensions=extension,
            forces=at.force,
            stiffnesses=at.stiffness,
            strains={path: at.strains[i] for i, path in enumerate(self.strains)},
            stresses={path: at.stresses[i] for i, path in enumerate(self.stresses)},
            coil_rows=at.coils,
            torque_errors=self.torque_errors[-1],
        )

    @property
    def coils(self) -> dict[str, CoilColumns]:
        """What coils do, by path."""
        width = len(CoilColumns._fields)
        return {
            coil.name: CoilColumns(*(self.coil_rows[width * i + k, :].T for k in range(width)))
            for i, coil in enumerate(self.cam.coils)
        }

    @property
    def tangent_stiffness(self) -> Expression:
        """dτ/dθ = N·(h'·F + h²·K) in N·m/rad."""
        return self.elements * (self.lever_arm_slopes * self.forces + self.lever_arms**2 * self.stiffnesses)

    @property
    def mean_square_error(self) -> Expression:
        """Mean of the squared torque error in (N·m)², weighted as the target says, by trapezoids."""
        rows = range(self.angles.shape[0])
        weights = ca.vertcat(*[self.target.weight_law(self.angles[i]) for i in rows])
        steps = self.angles[1:] - self.angles[:-1]
        squared = weights * self.torque_errors**2
        whole = ca.dot((weights[1:] + weights[:-1]) / 2, steps)
        return ca.dot((squared[1:] + squared[:-1]) / 2, steps) / whole

    @property
    def rubber_volume(self) -> Expression:
        """Volume of all rubber and wire behind the cam in m³; zero where nothing is declared that has one."""
        pieces = [
            math.prod((self.parameters[name] for name in (*piece.section, piece.rest_length)), start=ca.SX(1))
            for piece in self.cam.specimens
            if piece.name in self.strains
        ]
        pieces += [coil.wire_volume[0] for coil in self.coils.values()]
        return self.elements * sum(pieces, start=ca.SX(0))

    def of_rubber(self, field: Literal["area", "rest_length"]) -> dict[str, Expression]:
        """Return a parameter of each piece of rubber behind the cam by full name."""
        if not self.strains:
            raise ArrangementError(
                f"part '{self.cam.drive}'",
                f"has no specimen behind its cam, so it has no {field.replace('_', ' ')}",
                next_step="leave this limit out, or declare the rubber with specimen(...)",
            )
        rows = [
            piece.section if field == "area" else (piece.rest_length,)
            for piece in self.cam.specimens
            if piece.name in self.strains
        ]
        return {" * ".join(row): math.prod((self.parameters[n] for n in row), start=ca.SX(1)) for row in rows}
