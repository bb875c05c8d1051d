"""A cam for a finger: a tendon drive whose spring pulls to one side, designed, drawn and with its tolerance.

The machine is that of the deck ``one_sided_cable_drive``: motor, gear, drum, steel cable around a guide. Its
drum is replaced by a designed cam, so that the finger is soft when it touches and stiff when it holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import nlsdesign as nls
from nlsdesign.design import DesignSettings, FerruleSeat, MachinedOneSidedCam, RestLengthRange
from nlsdesign.presentation.report import Chapter, design_sections, tolerance_sections

from ._designed import MadeCam, drawing_section, make_cam, with_machined_contour

RUBBER = "spring.cable.rope.rubber"
FREE = ("spring.cam.contour", f"{RUBBER}.area", f"{RUBBER}.rest_length")
# Assumed: of the order of a finger's flexion at its root, 25 N at 40 mm over most of its range.
TARGET = nls.ExponentialTorque(maximum=1.0, angle=nls.degrees(80.0), shape=1.0)
KEEP = (
    nls.MaximumCamRadius(nls.quantity(20.0, "mm", source="assumed: room in a palm")),
    RestLengthRange(10e-3, 60e-3),
)
MACHINED = MachinedOneSidedCam(
    cable_radius=nls.quantity(0.6, "mm", source="half the diameter of the declared cable"),
    hub_bore=nls.quantity(4.0, "mm", source="assumed: shaft of a joint of this size"),
    lead_in=nls.quantity(10.0, "mm", source="assumed: room for the ferrule"),
    cable_end=FerruleSeat(diameter=nls.quantity(3.0, "mm", source="assumed: ferrule for this cable")),
)
AT_REST = {
    "spring.pretension": nls.quantity(
        0.0, "mm", source="assumed: none, so that the cable has a lever arm from the start"
    ),
    "spring.cam.onset": nls.quantity(
        0.05, "deg", source="assumed: so small that the cable pulls from the start; the target begins there"
    ),
}


@dataclass(frozen=True, eq=False)
class Results:
    """The cam as it is made."""

    cam: MadeCam

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        design, tolerance = self.cam.design, self.cam.tolerance
        return {
            "torque_error_percent": 100.0 * design.rms / TARGET.largest,
            "cam_radius_mm": 1e3 * float(design.contour.radii.max()),
            "cable_force_N": float(design.curves.forces.max()),
            "nominal_with_friction_mNm_rms": 1e3 * tolerance.nominal_rms,
            "quantile_mNm_rms": 1e3 * tolerance.quantiles[-1].value,
        }


def main(out: Path, fast: bool = False) -> Results:
    """Design the cam, write its drawings and a report."""
    drive = nls.declare(nls.load_deck("one_sided_cable_drive")).with_values(AT_REST)
    design = nls.design_cam(
        with_machined_contour(drive),
        target=TARGET,
        free=FREE,
        keep=KEEP,
        settings=DesignSettings(draws=200 if fast else 1000, look_for_size_ranges=not fast),
    )
    nls.write_deck(design.actuator, out / "designed.toml")
    results = Results(make_cam(design, MACHINED, out / "drawing", title="Cam of a finger drive"))
    write(out, results)
    return results


def write(out: Path, results: Results) -> None:
    """Write the report."""
    cam = results.cam
    nls.write_report(
        out / "report.html",
        Chapter("Design", "Contour, section and rest length of the rubber for 1 N·m at 80°."),
        *design_sections(cam.design),
        Chapter(
            "Tolerance",
            "The cable slides over a guide, so the torque differs between loading and unloading; the error "
            "counts both strokes, and friction alone leaves "
            f"{1e3 * cam.tolerance.nominal_rms:.0f} mN·m rms that no contour removes.",
        ),
        *tolerance_sections(cam.tolerance),
        drawing_section(cam),
        title="A one-sided cam for a finger",
        abstract="Soft when it touches, stiff when it holds; a tendon that pulls to one side only.",
    )
