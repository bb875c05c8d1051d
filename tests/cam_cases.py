"""Actuators and a rubber law for the tests of cam design."""

from __future__ import annotations

from dataclasses import dataclass

from nlsdesign.components import (
    Assembly,
    Domain,
    Element,
    Fixed,
    GearedMotor,
    LinearElastic,
    Rounded,
    StrainStiffening,
    TwoSidedCam,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.element import MATERIAL, Scope
from nlsdesign.components.core.part import parameter
from nlsdesign.components.core.springs import Elastic
from nlsdesign.design import (
    DesignSettings,
    ExponentialTorque,
    MaximumCamRadius,
    MaximumStrain,
    MinimumRadiusOfCurvature,
)
from nlsdesign.foundation.quantity import Quantity, degrees, quantity
from nlsdesign.foundation.symbolic import Expression

CONTOUR = ["spring.cam.contour"]
PRETENSION = [*CONTOUR, "spring.pretension"]
RUBBER = [*PRETENSION, "spring.rubber.area", "spring.rubber.rest_length"]

TARGET = ExponentialTorque(maximum=5.0, angle=degrees(53.0), shape=1.0)
"""Schepelmann, Geberth and Geyer, ICRA 2014."""

KEEP = [MinimumRadiusOfCurvature(1e-3), MaximumCamRadius(20e-3), MaximumStrain(1.0)]

ALONE = DesignSettings(starts=2, look_for_size_ranges=False, draws=0)
"""The contour and nothing else: no spring as made, no range of a size; a few starts find the same optimum."""


@dataclass(frozen=True, kw_only=True)
class NeoHooke(Elastic):
    """σ = G·(λ − 1/λ²) with λ = 1 + ε: nominal stress of rubber, concave in tension."""

    modulus: Quantity = parameter("Pa", "shear modulus", minimum=1.0, maximum=1e9)

    @property
    def domain(self) -> Domain:
        return MATERIAL

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        stretch = 1 + motion
        return scope.parameter("modulus") * (stretch - 1 / stretch**2)


CONCAVE = NeoHooke(modulus=quantity(0.8456, "MPa", spread=0.15))
"""Modulus times area is 84.56 N: the neo-Hookean reading of the tensile curve of 2014."""

CONVEX = StrainStiffening(
    modulus=quantity((0.92, 0.58, 0.74, 0.77), "MPa", spread=0.06),
    knots=(0.0, 0.016, 0.0848, 0.212),
    contact=Rounded(width=0.01),
)
"""The printed moduli of 2015 up to 9 mm extension, with rounded knots."""


def actuator(law: Element, *, pretension: float = 0.0, anchor: float = 25e-3) -> Assembly:
    """The published arrangement with a given equilibrium law: two elements of 1 cm² and 12.5 mm."""
    rubber = specimen(
        area=quantity(1.0, "cm^2"),
        rest_length=quantity(12.5, "mm"),
        stiff=law,
        relaxing=series(spring=LinearElastic(modulus=0.58e6), dashpot=ViscousMaterial(viscosity=411.0)),
    )
    cam = TwoSidedCam(
        lever_arm=tuple(0.010 + 0.0002 * i for i in range(12)),
        last_angle=1.0,
        elements=2.0,
        anchor_distance=anchor,
    )
    return assembly(
        "bench",
        motor=GearedMotor(inertia=5.97e-4, gear_ratio=4.0, torque_constant=0.055),
        load=Fixed(),
        spring=tie(through(cam, rubber=rubber, pretension=pretension), "motor", "load"),
    )
