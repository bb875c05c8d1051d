"""The part that a workshop makes of a finished design."""

from __future__ import annotations

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import DeckError
from ...foundation.quantity import Quantity
from ...model import flatten
from ...model.roles import series_cam
from ..drawing.machined_cam import MachinedCam, MachinedOneSidedCam, MachinedTwoSidedCam
from ..optimisation.result import CamDesign
from ..statics.declared_cam import declared_cam
from .job_file import DesignJob, built


def machined_cam(design: CamDesign, job: DesignJob | None = None) -> MachinedCam:
    """Return the sizes of the part for a finished design: those of the design file, the cable as declared.

    Parameters
    ----------
    design
        Finished.
    job
        Its table ``[drawing]`` names the sizes as :class:`MachinedTwoSidedCam` does; without it all sizes
        are those that are usual.

    Raises
    ------
    DeckError
        If the cable is neither declared nor in the file.
    NlsError
        If a size is refused.
    """
    name, kind, radius = declared_edge(design.actuator, design.drive)
    sizes: dict[str, object] = {} if job is None else dict(job.drawing)
    if "cable_radius" not in sizes:
        if radius is None:
            raise DeckError(
                name, "declares no cable, so the machined edge is not known",
                next_step='declare cable_diameter, or write [drawing] cable_radius = "0.5 mm"',
            )  # fmt: skip
        sizes["cable_radius"] = radius
    if job is None:
        return kind(**sizes)  # type: ignore[arg-type]
    result: MachinedCam = built(job.deck, kind, sizes, job.deck.place("drawing"))
    return result


def declared_edge(
    actuator: Assembly, spring: str | None = None
) -> tuple[str, type[MachinedCam], Quantity | None]:
    """Return the path of the cam, the kind of part it is, and half of its cable, where that is declared."""
    names = series_cam(flatten(actuator), spring)
    two_sided = declared_cam(actuator[names.name]).through_centre
    radius = None
    if names.cable is not None:
        diameter = actuator.quantities()[names.cable.diameter]
        radius = diameter.with_value(diameter.number / 2.0, f"half of {names.cable.diameter}")
    return names.name, MachinedTwoSidedCam if two_sided else MachinedOneSidedCam, radius
