"""What a finished design is as a part and as files: deck, numbers, pictures, drawings for the workshop."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ...components.assembly.deck_writer import write_deck
from ...components.assembly.named_parts import Assembly
from ...foundation.errors import DeckError, NlsError
from ...foundation.quantity import Quantity, parse_unit, with_unit
from ...foundation.text_files import discard, make_folder, write_text
from ...model.structure import CamNames
from ..curves.numbers import in_unit
from ..drawing.cam_drawing import write_drawings
from ..drawing.cam_part import CamPart
from ..drawing.machined_cam import MachinedCam, MachinedOneSidedCam, MachinedTwoSidedCam
from ..drawing.making import Mounting
from ..drawing.rolling_cam import MachinedPair, MachinedRollerCam
from ..optimisation.result import CamDesign
from ..optimisation.solve import SidesDesign
from ..statics.declared_cam import declared_cam
from .job_file import DesignJob, built


def machined_cam(design: CamDesign, job: DesignJob | None = None) -> MachinedCam:
    """Return the sizes of the part for a finished design: those of the design file, the cable as declared.

    The table ``[drawing]`` names the sizes as :class:`MachinedTwoSidedCam` does; without a file they are
    those that are usual. A cable that is neither declared nor in the file is a ``DeckError``.
    """
    kind, radius = declared_edge(design.actuator, design.cam)
    sizes: dict[str, object] = {} if job is None else dict(job.drawing)
    inside = "cable_radius" if design.cam.rolling is None else "roller_radius"
    if inside not in sizes and kind is not MachinedPair:
        if radius is None:
            raise DeckError(
                design.cam.name, "declares no cable, so the machined edge is not known",
                next_step='declare cable_diameter, or write [drawing] cable_radius = "0.5 mm"',
            )  # fmt: skip
        sizes[inside] = radius
    if job is None:
        return kind(**sizes)  # type: ignore[arg-type]
    result: MachinedCam = built(job.deck, kind, sizes, job.deck.place("drawing"))
    return result


def declared_edge(actuator: Assembly, cam: CamNames) -> tuple[type[MachinedCam], Quantity | None]:
    """Return the kind of part that a cam is, and the radius of its roller or cable, where declared."""
    if cam.rolling is not None:
        of_roller = cam.rolling.radius
        return (MachinedRollerCam, actuator.quantities()[of_roller]) if of_roller else (MachinedPair, None)
    two_sided = declared_cam(actuator[cam.name]).through_centre
    radius = None
    if cam.cable is not None:
        diameter = actuator.quantities()[cam.cable.diameter]
        radius = diameter.with_value(diameter.number / 2.0, f"half of {cam.cable.diameter}")
    return MachinedTwoSidedCam if two_sided else MachinedOneSidedCam, radius


DESIGN_FILES = (
    "report.html",
    *(
        "model.toml",
        "design.json",
        "picture.svg",
        "torque.svg",
        "margins.svg",
        "tolerance.svg",
        "data_sheet.pdf",
    ),
    *("cam.csv", "cam_centre_line.csv", "cam.svg", "cam.dxf", "drawing.svg", "drawing.pdf"),
)
"""Names of all files that a design can have, its report among them, which is written above."""


class PicturesOfDesign(Protocol):
    """What draws a design, handed in from above: :class:`nlsdesign.figures.DesignPictures`."""

    def of_design(self, design: CamDesign, folder: Path) -> list[Path]:
        """Write the pictures of a design, and return their files."""

    def of_part(self, design: CamDesign, part: CamPart, folder: Path) -> list[Path]:
        """Write the page for the workshop, and return its files."""


@dataclass(frozen=True)
class WrittenDesign:
    """The files of a design."""

    files: tuple[Path, ...]  # in the order in which they were written
    remarks: tuple[str, ...]  # what a designer should know before a part is made


def write_design(
    design: CamDesign,
    folder: Path | str,
    *,
    job: DesignJob | None = None,
    pictures: PicturesOfDesign | None = None,
) -> WrittenDesign:
    """Write a finished design into a folder; files of an earlier design there are removed.

    That is the deck (``model.toml``), the numbers (``design.json``), the pictures, and for a design that
    meets its target the drawings of the part: of the contour alone where no part can be made of it.

    Parameters
    ----------
    design
        Finished.
    folder
        Is made where it does not exist.
    job
        What was asked for; its table ``[drawing]`` gives the sizes of the part.
    pictures
        What draws it, :class:`nlsdesign.figures.DesignPictures`; without it there are no pictures.

    Returns
    -------
    WrittenDesign
        Files and remarks.

    Raises
    ------
    NlsError
        If a file cannot be written.
    """
    folder = Path(folder)
    make_folder(folder)
    for name in DESIGN_FILES:
        # What an earlier run has left here belongs to another design.
        discard(folder / name)
    model, numbers = folder / "model.toml", folder / "design.json"
    write_deck(design.actuator, model)
    # How many iterations it took depends on the processor, the design does not.
    rows = [row for row in design.rows() if row[0] not in ("solver", "starts")]
    content = {**design_summary(design), "rows": rows}
    write_text(numbers, json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n")
    files = [model, numbers, *(pictures.of_design(design, folder) if pictures else ())]
    remarks = list(trim_remarks(design))
    if not design.met:
        return WrittenDesign(tuple(files), tuple(remarks))
    try:
        machined = machined_cam(design, job)
        part = machined.part(design.contour)
    except NlsError as error:
        # The contour is worth having even where hub, channel and cable do not fit it yet.
        remarks.append(f"no machined part, only the line of the cable's centre: {error}")
        files += write_drawings(folder, design.contour, note=f"design {design.fingerprint}")
    else:
        remarks += part_remarks(design, machined, part)
        files += _written_part(design, part, folder, pictures)
    return WrittenDesign(tuple(files), tuple(remarks))


def write_part(
    design: CamDesign, machined: MachinedCam, folder: Path, *, pictures: PicturesOfDesign | None = None
) -> list[Path]:
    """Write the drawings of the part that is made of a design, and the page for the workshop.

    Parameters
    ----------
    design
        Finished.
    machined
        Sizes of the part.
    folder
        Is made where it does not exist.
    pictures
        What draws the page; without it there is none.

    Returns
    -------
    list of Path
        Their files.

    Raises
    ------
    NlsError
        If the part cannot be made of the contour.
    """
    return _written_part(design, machined.part(design.contour), folder, pictures)


def write_sides(
    design: SidesDesign, folder: Path | str, *, machined: MachinedCam | None = None
) -> tuple[Path, ...]:
    """Write a cam whose sides were designed: its deck, and where both sides meet their targets the part.

    Parameters
    ----------
    design
        Of both sides.
    folder
        Is made where it does not exist.
    machined
        Sizes of the part; the usual ones, with the declared cable, if it is left out.

    Returns
    -------
    tuple of Path
        ``model.toml``, then the drawings, with the centre line of the back in ``cam_back.csv``.

    Raises
    ------
    NlsError
        If a file cannot be written or the part cannot be made.
    """
    folder = Path(folder)
    make_folder(folder)
    write_deck(design.actuator, folder / "model.toml")
    if not design.met:
        return (folder / "model.toml",)
    front, back = design.front.contour, design.back.contour
    part = (machined or machined_cam(design.front)).part(front, back=back)
    note = f"front {design.front.fingerprint}, back {design.back.fingerprint}"
    files = write_drawings(folder, front, machined=part, note=note)
    return (folder / "model.toml", *files, *write_drawings(folder, back, name="cam_back", formats=("csv",)))


def _written_part(
    design: CamDesign, part: CamPart, folder: Path, pictures: PicturesOfDesign | None
) -> list[Path]:
    """Write the drawings of a part, and the page for the workshop where something draws it."""
    files = write_drawings(folder, design.contour, machined=part, note=f"design {design.fingerprint}")
    return [*files, *(pictures.of_part(design, part, folder) if pictures else ())]


def design_summary(design: CamDesign) -> dict[str, Any]:
    """Return the result of a design in numbers that JSON can hold, rounded to what they are good for."""
    spread = {}
    if design.tolerance is not None:
        spread = {f"{100 * q.share:g} %": _rounded(q.value) for q in design.tolerance.quantiles}
    return {
        "met": design.met,
        "rms_error_over_spreads": spread,
        "torque_error_rms": _rounded(design.rms),
        "miss": None if design.miss is None else str(design.miss),
        "advice": [] if design.miss is None else list(design.miss.advice),
        "values": {name: quantity.value for name, quantity in design.values.items()},
        "active_limits": list(design.active_limits),
        "limits_reached": list(design.limits_reached),
        "largest_cable_force": _rounded(float(design.curves.forces.max())),
        "energy": _rounded(design.curves.energy),
    }


def _rounded(value: float) -> float:
    """Return a number with six digits, which are the same on every processor."""
    return float(f"{value:.6g}")


def trim_remarks(design: CamDesign) -> Iterator[str]:
    """Yield where made springs have to be set beyond a limit that holds for the nominal one."""
    for trim in design.tolerance.trims[:1] if design.tolerance is not None else ():
        low, high = trim.needed
        for state in design.limits:
            if state.of == trim.name and (high > state.bound if state.upper else low < state.bound):
                factor = parse_unit(state.unit).factor
                needed = with_unit(f"{low / factor:.4g} to {high / factor:.4g}", state.unit)
                yield (
                    f"the limit {in_unit(state.bound, state.unit)} of {trim.name} ({state.limit}) "
                    f"holds for the nominal spring; to trim 95 % of the made ones it is set "
                    f"from {needed} -> leave it that travel, or narrow the spreads"
                )


def part_remarks(design: CamDesign, machined: MachinedCam, part: CamPart) -> Iterator[str]:
    """Yield how far a made part reaches, which process it asks for, and what does not carry its torque."""
    yield (
        f"the made part reaches {1e3 * part.reach:.4g} mm from its axis, the contour "
        f"{1e3 * float(design.contour.radii.max()):.4g} mm: run-out and corners come on top"
    )
    torque = float(abs(design.check.torques).max())
    tension = float(design.curves.forces.max())
    yield from Mounting(machined, design.contour, part, torque, tension).remarks()
