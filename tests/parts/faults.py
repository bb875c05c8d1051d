"""Faulty motors, encoders and cams with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import DelayedMotor, EccentricEncoder, MisshapenCam, Part, SaturatingMotor

_PARTS: tuple[Part, ...] = (
    DelayedMotor(inertia=0.009, gear_ratio=25.0, torque_constant=0.03, delay=4e-3),
    SaturatingMotor(inertia=0.009, gear_ratio=25.0, torque_constant=0.03, saturation_current=6.0),
    EccentricEncoder(of="motor.angle", quantum=7.7e-4, sine=0.01, cosine=-0.006),
    MisshapenCam(
        lever_arm=(0.016, 0.014, 0.013, 0.013, 0.014, 0.015),
        last_angle=0.98,
        changeover=1e-3,
        error=(0.0, 4e-4, 9e-4, -2e-4, 1e-4),
    ),
)
EXAMPLES: tuple[Part, ...] = _PARTS
