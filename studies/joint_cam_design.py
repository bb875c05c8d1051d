"""Two designs of the torque curve of 2014, 5 N·m at 53°, each with less and with more left free.

The first spring is that of 2014 as the design text of this project has it: two elements of 1 cm² and 12.5 mm,
anchor at 25 mm, and limits that are asked for (radius of curvature, cam radius, strain). Nothing is known of
its cable and of the strength of its rubber. The second is the actuator of 2015 with its declared cable and
rubber, so the limits that follow from these hold without being asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import nlsdesign as nls
from nlsdesign.components import (
    Fixed,
    GearedMotor,
    NeoHooke,
    TwoSidedCam,
)
from nlsdesign.design import CamDesign, DesignSettings, Limit
from nlsdesign.presentation.report import Chapter, TableSection, design_sections

from ._published import declared_actuator

TARGET = nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0)
CAM, RUBBER = ("spring.cam.contour", "spring.pretension"), ("spring.rubber.area", "spring.rubber.rest_length")
LARGEST = nls.MaximumCamRadius(nls.quantity(20.0, "mm"))
ASKED = (nls.MinimumRadiusOfCurvature(nls.quantity(1.0, "mm")), LARGEST, nls.MaximumStrain(1.0))


@dataclass(frozen=True, eq=False)
class Results:
    """The designs: of 2014 with fixed and with free rubber, of 2015 with the section and with both free."""

    fixed_rubber: CamDesign
    free_rubber: CamDesign
    free_section: CamDesign
    free_section_and_length: CamDesign

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        made = self.free_section_and_length
        return {
            "of_2014_fixed_rubber_mNm_rms": 1e3 * self.fixed_rubber.rms,
            "of_2014_free_rubber_mNm_rms": 1e3 * self.free_rubber.rms,
            "of_2015_free_section_percent": 100.0 * self.free_section.rms / TARGET.largest,
            "of_2015_free_section_and_length_mNm_rms": 1e3 * made.rms,
            "of_2015_stress_over_allowed": max(_use(made, "MaximumStress")),
            "of_2015_tension_over_allowed": max(_use(made, "MaximumCableTension")),
        }


def main(out: Path, fast: bool = False) -> Results:
    """Design all four and write a report."""
    older, newer = spring_of_2014(), declared_actuator()
    results = Results(
        designed(older, CAM, ASKED, fast=fast),
        designed(older, CAM + RUBBER, ASKED, fast=fast),
        designed(newer, CAM + RUBBER[:1], [LARGEST], fast=fast),
        designed(newer, CAM + RUBBER, [LARGEST], fast=fast),
    )
    write(out, results)
    return results


def designed(actuator: nls.Assembly, free: Sequence[str], keep: Sequence[Limit], *, fast: bool) -> CamDesign:
    """Return one design; what to free is looked for where it misses."""
    settings = DesignSettings(draws=0, look_for_size_ranges=not fast)
    return nls.design_cam(actuator, target=TARGET, free=free, keep=keep, settings=settings)


def spring_of_2014() -> nls.Assembly:
    """Return the spring of 2014: two pieces of PMC-770, neo-Hookean, no relaxation; anchor at 25 mm."""
    law = NeoHooke(
        shear_modulus=nls.quantity(
            0.8456, "MPa", spread=0.15,
            source="one constant fitted to Schepelmann, Geberth, Geyer, ICRA 2014, Fig. 3, to a stretch of 3",
        )
    )  # fmt: skip
    size = "Schepelmann, Geberth, Geyer, ICRA 2014"
    rubber = nls.specimen(
        area=nls.quantity(1.0, "cm^2", source=size),
        rest_length=nls.quantity(12.5, "mm", source=size),
        law=law,
    )
    arm = nls.quantity((10.0,) * 12, "mm", source="assumed: a start; the contour is designed")
    cam = TwoSidedCam(
        lever_arm=arm, last_angle=nls.quantity(60.0, "deg"), elements=nls.quantity(2.0, "1"),
        anchor_distance=nls.quantity(25.0, "mm"),
    )  # fmt: skip
    motor = GearedMotor(
        inertia=nls.quantity(5.97e-4, "kg*m^2"), gear_ratio=nls.quantity(4.0, "1"),
        torque_constant=nls.quantity(55.0, "mN*m/A"),
    )  # fmt: skip
    spring = nls.tie(nls.through(cam, rubber=rubber, pretension=nls.quantity(0.0, "mm")), "motor", "load")
    return nls.assembly("spring_of_2014", motor=motor, load=Fixed(), spring=spring)


def _use(design: CamDesign, limit: str) -> list[float]:
    return [state.value / state.bound for state in design.limits if state.limit == limit]


def write(out: Path, results: Results) -> None:
    """Write the report."""
    labels = {
        "2014, fixed rubber": results.fixed_rubber,
        "2014, free rubber": results.free_rubber,
        "2015, fixed length": results.free_section,
        "2015, free length": results.free_section_and_length,
    }
    rows = tuple(
        (
            label,
            "met" if each.met else "missed",
            1e3 * each.rms,
            f"{each.curves.forces.max():.0f}",
            f"{1e3 * each.contour.radii.max():.1f}",
            f"{1e6 * each.rubber_volume:.1f}",
        )
        for label, each in labels.items()
    )
    heads = ("design", "target", "error, mN·m", "cable, N", "cam, mm", "rubber, cm³")
    sections = [section for label, each in labels.items() for section in design_sections(each, of=label)]
    nls.write_report(
        out / "report.html",
        TableSection(
            "Side by side",
            heads,
            rows,
            caption="Rms error; 5 N·m at 53° in all four. Fixed rubber "
            "has the declared section and rest length, fixed length the declared rest length alone.",
        ),
        Chapter("The designs"),
        *sections,
        title="Joint design of cam, pretension and rubber",
        abstract="Fixed rubber leaves an error that no contour can remove; what is freed decides what is "
        "reached, and what cable and rubber bear decides how large the rubber must be.",
    )
