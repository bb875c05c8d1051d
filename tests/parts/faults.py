"""Faulty motors, encoders and cams with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import CamWithProfileError, DriveDelay, DriveSaturation, Eccentricity, Part

_PARTS: tuple[Part, ...] = (
    DriveDelay(delay=4e-3),
    DriveSaturation(saturation_current=6.0),
    Eccentricity(of="motor.angle", sine=0.01, cosine=-0.006),
    CamWithProfileError(
        lever_arm=(0.016, 0.014, 0.013, 0.013, 0.014, 0.015),
        last_angle=0.98,
        changeover=1e-3,
        error=(0.0, 4e-4, 9e-4, -2e-4, 1e-4),
    ),
)
EXAMPLES: tuple[Part, ...] = _PARTS
