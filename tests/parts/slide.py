"""One instance of each part that moves along a line."""

from __future__ import annotations

from nlsdesign.components import TRANSLATION, ConstantLoad, CoulombFriction, LinearDrive, Part, Regularised

EXAMPLES: tuple[Part, ...] = (
    LinearDrive(mass=95.1, force_constant=35.15, voltage_limit=10.0),
    CoulombFriction(sliding_effort=20.4, contact=Regularised(creep_speed=1e-3), domain=TRANSLATION),
    ConstantLoad(load=-3.16),
)
