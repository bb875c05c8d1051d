"""The part that a workshop makes of a finished design."""

from __future__ import annotations

from ...foundation.errors import DeckError
from ...model import flatten
from ...model.roles import series_cam
from ..drawing.machined_cam import MachinedCam, MachinedOneSidedCam, MachinedTwoSidedCam
from ..optimisation.result import CamDesign
from ..statics.declared_cam import declared_cam
from .job_file import DesignJob, built


def machined_cam(design: CamDesign, job: DesignJob) -> MachinedCam:
    """Return the sizes of the part for a finished design: those of the design file, the cable as declared.

    Parameters
    ----------
    design
        Finished.
    job
        Its table ``[drawing]`` names the sizes as :class:`MachinedTwoSidedCam` does.

    Raises
    ------
    DeckError
        If the cable is neither declared nor in the file.
    NlsError
        If a size is refused.
    """
    model = flatten(design.actuator)
    names = series_cam(model, design.drive)
    kind = (
        MachinedTwoSidedCam
        if declared_cam(design.actuator[names.name]).through_centre
        else MachinedOneSidedCam
    )
    sizes: dict[str, object] = dict(job.drawing)
    if "cable_radius" not in sizes:
        if names.cable is None:
            raise DeckError(
                f"{names.name}", "declares no cable, so the machined edge is not known",
                next_step='declare cable_diameter, or write [drawing] cable_radius = "0.5 mm"',
            )  # fmt: skip
        diameter = design.actuator.quantities()[names.cable.diameter]
        half = diameter.with_value(diameter.number / 2.0, f"half of {names.cable.diameter}")
        sizes["cable_radius"] = half
    return _made(job, kind, sizes)


def _made(job: DesignJob, kind: type[MachinedCam], sizes: dict[str, object]) -> MachinedCam:
    result: MachinedCam = built(job.deck, kind, sizes, job.deck.place("drawing"))
    return result
