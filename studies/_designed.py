"""What the studies of designed cams share: the part with its drawings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import nlsdesign as nls
from nlsdesign.design import CamDesign, CamPart, MachinedCam, ToleranceResult, write_part
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.presentation.report import FileSection, Section

INSPECTED = 8  # rows of the torque table on the drawing
DRAWINGS = {
    "cam.dxf": "edges for the machine: lines and arcs, in millimetres",
    "cam.svg": "picture of the part at scale 1:1",
    "cam.csv": "lines and arcs as a table",
    "cam_centre_line.csv": "curve of the cable's centre line",
    "sheet.svg": "page for the workshop, with dimensions and torque table",
    "sheet.pdf": "the same as PDF",
}


@dataclass(frozen=True, eq=False)
class MadeCam:
    """The designed cam as it is made."""

    design: CamDesign
    part: CamPart
    files: tuple[Path, ...]

    @property
    def tolerance(self) -> ToleranceResult:
        """What the spreads do to it."""
        return tolerance_of(self.design)


def tolerance_of(design: CamDesign) -> ToleranceResult:
    """Return the tolerance analysis of a design."""
    if design.tolerance is None:
        raise ValueRangeError("design", "; ".join(design.remarks) or "has no tolerance analysis")
    return design.tolerance


def with_machined_contour(actuator: nls.Assembly, anchor: nls.Quantity | None = None) -> nls.Assembly:
    """Return an actuator whose contour has no spread of its own, for one that is cut anew.

    The spread of a deck's lever arm is that of the published figure that it was computed from; the errors of
    a machined contour are counted by the tolerance analysis itself.

    ``anchor``: place of the cable's anchor in the new design; as declared if it is left out.
    """
    arm = actuator.quantities()["spring.cam.lever_arm"]
    values = {"spring.cam.lever_arm": arm.with_spread(0.0)}
    if anchor is not None:
        values["spring.cam.anchor_distance"] = anchor
    return actuator.with_values(values)


def make_cam(design: CamDesign, machined: MachinedCam, folder: Path, *, title: str) -> MadeCam:
    """Write the edge for the machine and the page for the workshop, and return the part."""
    pictures = nls.figures.DesignPictures(
        deck=design.actuator.name, title=title, material="EN AW-7075", sheet="sheet", inspected=INSPECTED
    )
    files = write_part(design, machined, folder, pictures=pictures)
    return MadeCam(design, machined.part(design.contour), tuple(files))


def drawing_section(cam: MadeCam) -> Section:
    """List the drawings, with the cable that they are for."""
    return FileSection(
        "Drawings of the cam as it is made",
        {path: DRAWINGS.get(path.name, "drawing of the cam") for path in cam.files},
        caption=f"For a cable of {2e3 * cam.part.number('cable_radius'):.2g} mm: edge under the cable, "
        "run-out, seat of the ferrule, bore.",
    )
