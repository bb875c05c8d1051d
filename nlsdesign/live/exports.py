"""A design as files: deck, drawing, C, FMU; made in a process of its own, given back as bytes."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..components.assembly.deck_writer import deck_text
from ..components.assembly.named_parts import Assembly
from ..design import Contour, write_drawings
from ..design.jobs.written_design import declared_edge
from ..foundation.errors import ValueRangeError, unknown_name
from ..model import flatten
from ..model.roles import measured_motion, series_cam, series_spring
from ..model.transform import with_outputs
from .at_angle import AngleView
from .question import LiveQuestion
from .work import LiveTask

_SAMPLE_TIME = 1e-3
_OLD = (1980, 1, 1, 0, 0, 0)
"""Date of files in an archive, so that the same design gives the same bytes."""


@dataclass(frozen=True)
class ExportedDesign:
    """One file."""

    name: str
    media_type: str
    content: bytes


@dataclass(frozen=True, eq=False)
class ShownDesign:
    """The design that is exported: the changed machine, the contour of its cam, and a note for the files."""

    machine: Assembly
    contour: Contour
    note: str = ""


@dataclass(frozen=True)
class ExportDesign(LiveTask):
    """The design as a file: :class:`ExportedDesign`.

    Parameters
    ----------
    what
        ``"deck"``, ``"svg"``, ``"dxf"``, ``"c"`` or ``"fmu"``.
    note
        What the head of the file says; empty for nothing.
    """

    what: str
    note: str = ""

    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the export of the last good design."""
        if self.what not in EXPORTS:
            raise unknown_name("export", self.what[:80], EXPORTS)
        if shown is None:
            raise ValueRangeError("export", "there is no design yet", next_step="widen a limit first")
        return EXPORTS[self.what], (ShownDesign(shown.machine, shown.contour, self.note),)


def exported_deck(stage: Callable[[str], None], design: ShownDesign) -> ExportedDesign:
    """Return the machine as a deck."""
    text = f"# {design.note}\n{deck_text(design.machine)}" if design.note else deck_text(design.machine)
    return ExportedDesign(f"{design.machine.name}.toml", "application/toml", text.encode())


def exported_svg(stage: Callable[[str], None], design: ShownDesign) -> ExportedDesign:
    """Return the drawing of the cam as SVG."""
    return _drawing(design, "svg")


def exported_dxf(stage: Callable[[str], None], design: ShownDesign) -> ExportedDesign:
    """Return the drawing of the cam as DXF."""
    return _drawing(design, "dxf")


def exported_c(stage: Callable[[str], None], design: ShownDesign) -> ExportedDesign:
    """Return cascade observer and PID controller as C, in an archive."""
    from ..export import export_c
    from ..feedback.control import joined, torque_controller
    from ..feedback.observer import CascadeGain, design_observer

    whole = flatten(design.machine)
    plant = with_outputs(whole, [measured_motion(whole), series_spring(whole).effort])
    stage("designs observer and controller")
    observer = design_observer(plant, sample_time=_SAMPLE_TIME, gain=CascadeGain())
    both = joined(observer, torque_controller(plant, sample_time=_SAMPLE_TIME))
    stage("writes C")
    with tempfile.TemporaryDirectory() as folder:
        files = export_c(both, folder, name="observer_and_controller")
        head = f"/* {design.note} */\n" if design.note else ""
        content = _archive([files.header, files.source, files.selftest], head)
    return ExportedDesign("observer_and_controller.zip", "application/zip", content)


def exported_fmu(stage: Callable[[str], None], design: ShownDesign) -> ExportedDesign:
    """Return the plant as an FMU for co-simulation."""
    from ..export import export_fmu

    stage("compiles the plant")
    with tempfile.TemporaryDirectory() as folder:
        plant = flatten(design.machine)
        if design.note:
            plant = replace(plant, description=f"{design.note}. {plant.description}")
        file = export_fmu(plant, Path(folder) / "plant.fmu")
        return ExportedDesign("plant.fmu", "application/zip", file.read_bytes())


EXPORTS: dict[str, Callable[[Callable[[str], None], ShownDesign], ExportedDesign]] = {
    "deck": exported_deck,
    "svg": exported_svg,
    "dxf": exported_dxf,
    "c": exported_c,
    "fmu": exported_fmu,
}
"""What a design can be saved as."""


_MEDIA = {"svg": "image/svg+xml", "dxf": "image/vnd.dxf"}


def _drawing(design: ShownDesign, ending: str) -> ExportedDesign:
    kind, radius = declared_edge(design.machine, series_cam(flatten(design.machine)))
    machined = None if radius is None else kind(cable_radius=radius)
    centre = "" if machined else "the cable is not declared: this is the curve of its centre line"
    note = "; ".join(filter(None, (design.note, centre)))
    with tempfile.TemporaryDirectory() as folder:
        files = write_drawings(Path(folder), design.contour, machined=machined, note=note, formats=(ending,))
        content = next(file for file in files if file.suffix == f".{ending}").read_bytes()
    return ExportedDesign(f"cam.{ending}", _MEDIA[ending], content)


def _archive(files: list[Path], head: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            archive.writestr(zipfile.ZipInfo(file.name, _OLD), head.encode() + file.read_bytes())
    return buffer.getvalue()
