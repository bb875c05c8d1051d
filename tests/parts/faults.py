"""Faulty motors, encoders and cams with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    TRANSLATION,
    Cable,
    CamWithProfileError,
    ClockDrift,
    CommandCompression,
    CommandSaturation,
    DriveDelay,
    DriveSaturation,
    Eccentricity,
    EncoderOffset,
    GradualSaturation,
    LoadNonlinearity,
    Part,
    SpotFriction,
    TorqueConstantDrift,
    WavyFriction,
    WindingHeat,
)

_PARTS: tuple[Part, ...] = (
    DriveDelay(delay=4e-3),
    DriveSaturation(saturation_current=6.0),
    CommandCompression(halving=40.0),
    CommandSaturation(saturation=9.0),
    GradualSaturation(saturation=9.0),
    WindingHeat(halving=12.0, cooling_time=60.0),
    TorqueConstantDrift(drift=-2e-3, settling_time=30.0),
    LoadNonlinearity(of="spring.rubber.force", nonlinearity=0.02, full_scale=200.0),
    ClockDrift(of="spring.rubber.force", rate=2e-4),
    SpotFriction(sliding_effort=0.02, place=0.3, width=0.05).smooth(),
    SpotFriction(sliding_effort=0.02, place=0.3, width=0.05),
    SpotFriction(sliding_effort=2.0, place=0.03, width=0.01, domain=TRANSLATION).smooth(),
    WavyFriction(sliding_effort=0.02, sine=0.005, cosine=0.01),
    WavyFriction(sliding_effort=0.02, sine=0.005, cosine=0.01).smooth(),
    EncoderOffset(of="motor.angle", offset=0.02),
    EncoderOffset(of="carriage.position", offset=1e-3, domain=TRANSLATION),
    Eccentricity(of="motor.angle", sine=0.01, cosine=-0.006),
    CamWithProfileError(
        lever_arm=(0.016, 0.014, 0.013, 0.013, 0.014, 0.015),
        last_angle=0.98,
        changeover=1e-3,
        error=(0.0, 4e-4, 9e-4, -2e-4, 1e-4),
    ),
    CamWithProfileError(
        lever_arm=(0.016, 0.014, 0.013, 0.013, 0.014, 0.015),
        last_angle=0.98,
        error=(0.0, 4e-4, 9e-4, -2e-4, 1e-4),
        cable=Cable(cable_diameter=9e-4, cable_breaking_force=1285.0, cable_bend_ratio=5.0),
    ),
)
EXAMPLES: tuple[Part, ...] = _PARTS
