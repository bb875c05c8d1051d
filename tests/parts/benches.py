"""One instance of each part that benches have around a joint: loads, drives with controllers."""

from __future__ import annotations

from nlsdesign.components import (
    AsymmetricFriction,
    ConstantLoad,
    DriveLag,
    GravityLoad,
    HorizontalTorque,
    Integral,
    MassOnArm,
    Part,
    PositionLoop,
    RateFeedback,
    Regularised,
    ResistiveMotor,
    SpeedLoop,
)
from nlsdesign.foundation.quantity import Quantity

_GAIN, _SPEED_GAIN = Quantity(8.5, "V/rad"), Quantity(0.6, "V*s/rad")
_LIMIT = Quantity(7.4, "V")

EXAMPLES: tuple[Part, ...] = (
    GravityLoad(weight=MassOnArm(mass=0.49, arm=0.1), hanging_angle=0.2),
    GravityLoad(weight=HorizontalTorque(horizontal_torque=2.7)),
    ConstantLoad(load=Quantity(0.3, "N*m")),
    AsymmetricFriction(sliding_effort=0.2, asymmetry=0.1),
    AsymmetricFriction(sliding_effort=0.2, asymmetry=0.1, contact=Regularised(creep_speed=0.01)),
    ResistiveMotor(inertia=2e-3, torque_constant=0.5, resistance=4.0, voltage_limit=7.4),
    DriveLag(time_constant=0.012),
    PositionLoop(proportional=_GAIN, limit=_LIMIT),
    PositionLoop(
        proportional=_GAIN,
        limit=_LIMIT,
        rate=RateFeedback(derivative=_SPEED_GAIN),
        memory=Integral(reset_time=0.2),
    ),
    SpeedLoop(proportional=_SPEED_GAIN, limit=_LIMIT),
    SpeedLoop(proportional=_SPEED_GAIN, limit=_LIMIT, memory=Integral(reset_time=0.2)),
)
