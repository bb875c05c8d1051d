"""Joint design of cam, pretension and rubber for the torque curve of 2014, within sourced limits."""

from __future__ import annotations

from pathlib import Path

import nlsdesign as nls
from nlsdesign.design import DesignSettings, FerruleSeat, RestLengthRange

from .._designed import MadeCam, make_cam, with_machined_contour

FREE = ("spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length")
LARGEST_RADIUS = nls.quantity(20.0, "mm", source="Schepelmann et al. 2014: the cam is to be that small")
LENGTHS = (8e-3, 60e-3)  # m; assumed: shorter rubber cannot be clamped, longer makes the drive too long
ANCHOR = nls.quantity(
    25.0, "mm", spread=0.008, source="assumed: place of the guide in the new design, bored within 0.2 mm"
)
MACHINED = nls.MachinedTwoSidedCam(
    cable_radius=nls.quantity(0.45, "mm", source="half the diameter of the declared cable"),
    groove_depth=nls.quantity(4.0, "mm", source="assumed: four diameters of the cable"),
    hub_bore=nls.quantity(6.0, "mm", source="assumed: shaft of the gear"),
    cable_end=FerruleSeat(diameter=nls.quantity(2.5, "mm", source="assumed: ferrule for this cable")),
)
FIRST_DESIGN = DesignSettings(starts=2, look_for_size_ranges=False, draws=200)
"""Of the fast way: without the ranges of sizes that cost nothing."""


def design_spring(actuator: nls.Assembly, out: Path, settings: DesignSettings) -> MadeCam:
    """Design for 5 N·m at 53°, and write deck and drawings.

    Curvature, cable tension, stress and strain are held by the limits that follow from the declared cable and
    rubber; no one has to ask for them.
    """
    design = nls.design_cam(
        with_machined_contour(actuator, ANCHOR),
        target=nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0),
        free=FREE,
        keep=[nls.MaximumCamRadius(LARGEST_RADIUS), RestLengthRange(*LENGTHS)],
        settings=settings,
    )
    nls.write_deck(design.actuator, out / "designed.toml")
    return make_cam(design, MACHINED, out / "drawing", title="Cam of the designed actuator")
