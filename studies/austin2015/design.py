"""Joint design of cam, pretension and rubber for the torque curve of 2014."""

from __future__ import annotations

from pathlib import Path

import nlsdesign as nls
from nlsdesign.design import CamDesign

FREE = ("spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length")


def design_spring(actuator: nls.Assembly, out: Path) -> CamDesign:
    """Design for 5 N·m at 53°, and write deck and drawings."""
    design = nls.design_cam(
        actuator,
        target=nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0),
        free=FREE,
        keep=[
            nls.MinimumRadiusOfCurvature(1e-3),
            nls.MaximumCamRadius(20e-3),
            nls.MaximumStrain(1.0),
            nls.RestLengthRange(8e-3, 20e-3),
        ],
    )
    nls.write_drawings(out / "drawing", design.contour, note=f"design {design.fingerprint}")
    nls.write_deck(design.actuator, out / "designed.toml")
    return design
