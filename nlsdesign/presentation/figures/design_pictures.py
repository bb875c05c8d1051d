"""The pictures of a finished design as files, handed to :func:`nlsdesign.design.write_design`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ...design import CamDesign, CamPart
from .curves import torque_against_target
from .data_sheet import data_sheet
from .design_figures import design_picture, limit_margins, tolerance_bars
from .svg import write_figures
from .workshop_drawing import InspectionRow, TitleBlock, workshop_drawing


@dataclass(frozen=True, kw_only=True)
class DesignPictures:
    """What draws a design, its limits and its part.

    Parameters
    ----------
    deck
        Deck or design that the part belongs to, for the title block.
    title
        Name of the part.
    material
        Of the plate.
    sheet
        Name of the files of the workshop's page, without suffix.
    inspected
        Number of angles at which the finished spring is to be measured.
    """

    deck: str
    title: str = "cam"
    material: str = TitleBlock.material
    sheet: str = "drawing"
    inspected: int = 11

    def of_design(self, design: CamDesign, folder: Path) -> list[Path]:
        """Write picture, torque, margins to the limits, what spreads do where there are any, data sheet."""
        curve = {"design": (design.check.angles, design.check.torques)}
        pictures: dict[str, Figure] = {
            "picture": design_picture(design),
            "torque": torque_against_target(design.target, curve),
        }
        if design.limits:
            pictures["margins"] = limit_margins(design)
        if design.tolerance is not None and design.tolerance.causes:
            pictures["tolerance"] = tolerance_bars(design.tolerance)
        sheet = {"data_sheet": data_sheet(design, deck=self.deck)}
        return [*write_figures(folder, pictures), *write_figures(folder, sheet, suffix=".pdf")]

    def of_part(self, design: CamDesign, part: CamPart, folder: Path) -> list[Path]:
        """Write the page for the workshop as SVG and PDF."""
        title = TitleBlock(
            title=self.title, deck=self.deck, fingerprint=design.fingerprint, material=self.material
        )
        page = workshop_drawing(part, title=title, rows=inspection_rows(design, self.inspected))
        return [
            *write_figures(folder, {self.sheet: page}),
            *write_figures(folder, {self.sheet: page}, suffix=".pdf"),
        ]


def inspection_rows(design: CamDesign, count: int) -> list[InspectionRow]:
    """Return torque, lever arm and cable tension at some angles, to be measured on the finished spring.

    ``count``: number of angles, from zero to the last one.
    """
    curves, check, contour = design.curves, design.check, design.contour
    return [
        InspectionRow(
            angle=float(angle),
            torque=float(np.interp(angle, check.angles, check.torques)),
            lever_arm=float(np.interp(angle, contour.angles, contour.lever_arms)),
            tension=float(np.interp(angle, curves.angles, curves.forces)),
        )
        for angle in np.linspace(0.0, design.target.last_angle, count)
    ]
