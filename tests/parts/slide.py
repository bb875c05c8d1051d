"""One instance of each part that moves along a line."""

from __future__ import annotations

from nlsdesign.components import (
    TRANSLATION,
    ConstantLoad,
    CoulombFriction,
    Encoder,
    LinearDrive,
    Part,
    Rack,
    Regularised,
    Screw,
)
from nlsdesign.foundation.quantity import quantity

EXAMPLES: tuple[Part, ...] = (
    LinearDrive(mass=95.1, force_constant=35.15, voltage_limit=10.0),
    CoulombFriction(sliding_effort=20.4, contact=Regularised(creep_speed=1e-3), domain=TRANSLATION),
    ConstantLoad(load=-3.16),
    Rack(between=("motor", "carriage"), radius=0.012),
    Screw(between=("motor", "carriage"), lead=0.005),
    Encoder(of="carriage.position", quantum=quantity(5.0, "um")),
)
