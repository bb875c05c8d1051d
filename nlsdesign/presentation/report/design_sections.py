"""Sections on a finished design: picture, a cam to turn, torque against the target, limits, tolerance."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...design import CamDesign, ToleranceResult
from ...foundation.errors import NlsError
from ...foundation.written_numbers import prefixed
from ...model import flatten
from ..figures import (
    cam_motion_of,
    inline_svg,
    tolerance_bars,
    torque_against_target,
    torque_band,
)
from ..figures.cam_motion import MARKER, CamMotion, cam_picture
from ..figures.design_figures import design_picture, limit_margins
from .sections import (
    FigureSection,
    FileSection,
    Html,
    KeyNumber,
    NumbersSection,
    PagePosition,
    Section,
    TableSection,
    TextSection,
    data_link,
    write_report,
)
from .tables import numbers_table


@dataclass(frozen=True, eq=False)
class CamSection(Section):
    """Cam, cable, rubber and contact point over the angle, with a slider; a single frame without JavaScript.

    Parameters
    ----------
    motion
        Cam over its range.
    caption, means, assumed
        As for :class:`FigureSection`.
    start
        Angle in rad that is shown first; 60 % of the range by default.
    """

    motion: CamMotion
    _: KW_ONLY
    caption: str
    means: str = ""
    assumed: str = ""
    start: float | None = None
    template: ClassVar[str] = "cam.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return picture, frames and texts."""
        picture = cam_picture(self.motion, start=self.start)
        return {
            "key": place.key,
            "picture": picture,
            "frame": picture.frames[picture.start],
            "frames": json.dumps(picture.frames, ensure_ascii=False, separators=(",", ":")),
            "marker": f"{place.key}-{MARKER}",
            "curve": Html(inline_svg(picture.curve, place.key)),
            "warning": self.motion.warning,
            "data": data_link(picture.curve, self.title),
            "caption": self.caption,
            "means": self.means,
            "assumed": self.assumed,
        }


FILES = {
    "model.toml": "deck with the designed spring",
    "design.json": "numbers of the design, for programs",
    "picture.svg": "cam, cable and rubber to scale",
    "torque.svg": "torque against the target",
    "margins.svg": "use of each limit",
    "tolerance.svg": "torque error of made springs, by cause",
    "data_sheet.pdf": "the spring on one page A4",
    "cam.dxf": "edges for the machine: lines and arcs, in millimetres",
    "cam.svg": "picture of the part at scale 1:1",
    "cam.csv": "lines and arcs as a table",
    "cam_centre_line.csv": "curve of the cable's centre line",
    "drawing.svg": "page for the workshop, with dimensions and torque table",
    "drawing.pdf": "the same as PDF",
}
"""What the files of a design are."""


def write_design_report(
    path: Path,
    design: CamDesign,
    *,
    deck: str,
    remarks: Sequence[str] = (),
    files: Sequence[Path] = (),
) -> Path:
    """Write the report on a design, whether it meets its target or not."""
    missed = [] if design.miss is None else [f"The design misses its target: {design.miss.words}."]
    words = [*missed, *remarks]
    sections: list[Section] = [NumbersSection("Key numbers", _key_numbers(design))]
    if words:
        sections.append(
            TextSection("Remarks", "\n\n".join(f"{each[:1].upper()}{each[1:]}" for each in words))
        )
    sections += [*_moved(design), *design_sections(design)]
    if design.tolerance is not None and design.tolerance.causes:
        sections += tolerance_sections(design.tolerance)
    sections.append(numbers_table("Numbers of the deck", design.actuator.quantities(), folded=True))
    if files:
        sections.append(
            FileSection(
                "Files",
                {each: FILES.get(each.name, "drawing of the cam") for each in files},
                caption="Written beside this report.",
            )
        )
    facts = {"deck": f"`{deck}`", "fingerprint": f"`{design.fingerprint}`"}
    rows = dict(design.rows())
    abstract = (
        f"Asked for: {rows['target']}. The design {rows['verdict']}. "
        f"Torque error over the spread: {rows['torque error over the spread']}."
    )
    title = f"{Path(deck).stem}: designed spring"
    return write_report(path, *sections, title=title, abstract=abstract, facts=facts)


def _key_numbers(design: CamDesign) -> tuple[KeyNumber, ...]:
    """Return tolerance, error and loads in large letters: what can be made first."""
    share = 100.0 * design.rms / design.target.largest
    verdict = "meets its target" if design.met else "misses its target"
    pulled = "element" if design.cam.rolling else "cable"
    numbers = [
        KeyNumber("torque error, exact numbers", f"{prefixed(design.rms)} rms", f"{share:.2g} %; {verdict}"),
        KeyNumber("largest error", prefixed(design.check.largest), "exact numbers"),
        KeyNumber(f"{pulled} force", prefixed(float(design.curves.forces.max()), "N"), "largest"),
        KeyNumber(
            "limits reached", str(len(design.active_limits)), ", ".join(design.limits_reached) or "none"
        ),
    ]
    if design.tolerance is not None and design.tolerance.causes:
        built = prefixed(design.tolerance.quantiles[-1].value)
        trims = design.tolerance.trims[:1]
        after = [prefixed(each.quantiles[-1].value) for each in trims]
        note = f"as built → {trims[0].name} trimmed" if trims else "as built"
        label = f"torque error, {100 * design.tolerance.quantiles[-1].share:g} % of made springs"
        number = KeyNumber(label, f"{(after or [built])[0]} rms", note, before=built if after else "")
        numbers.insert(0, number)
    return tuple(numbers)


def _moved(design: CamDesign) -> list[Section]:
    """Return the cam that the reader turns; none where its spring has no law at rest."""
    if not np.isfinite(design.contour.anchor_distance):
        return []  # a cable that stays parallel pulls on one side alone
    try:
        motion = cam_motion_of(flatten(design.actuator), design.contour, spring=design.drive)
    except NlsError:
        return []
    caption = "The designed cam. Move the slider to turn it."
    return [CamSection("The cam, to turn", motion, caption=caption, assumed="What is stretched is at rest.")]


def design_sections(design: CamDesign, *, of: str = "") -> list[Section]:
    """Show picture, torque, numbers and limits of a design.

    Parameters
    ----------
    design
        Finished.
    of
        Which one, behind each heading, where a report shows several.
    """
    behind = f", {of}" if of else ""
    curve = {"designed actuator": (design.check.angles, design.check.torques)}
    return [
        FigureSection(
            f"The design to scale{behind}",
            design_picture(design),
            caption="Above at angle zero, below at the last angle; in mm.",
            assumed="" if design.cam.rolling else "What is stretched is at rest; cable without thickness.",
        ),
        FigureSection(
            f"Torque against the target{behind}",
            torque_against_target(design.target, curve),
            caption="Torque of the flattened, changed assembly; nominal numbers.",
        ),
        TableSection(
            f"Result of the design{behind}",
            ("quantity", "value"),
            tuple(design.rows()),
            caption="What was found, with the errors and how much of each limit is used.",
        ),
        FigureSection(
            f"Use of each limit{behind}",
            limit_margins(design),
            caption="Hatched: the design sits on the limit. Limits that nobody asked for follow from the "
            "declared cable and rubber.",
        ),
    ]


def tolerance_sections(result: ToleranceResult) -> list[Section]:
    """Show what the spreads do, and what to trim, measure and tighten.

    Parameters
    ----------
    result
        Of a tolerance analysis in which something deviates.
    """
    head, *rows = result.table()
    built, trim = prefixed(result.quantiles[-1].value, digits=2), result.trims[0] if result.trims else None
    after = (
        ""
        if trim is None
        else f"; {prefixed(trim.quantiles[-1].value, digits=2)} once {trim.name} is trimmed"
    )
    return [
        FigureSection(
            "Torque error of made springs",
            tolerance_bars(result),
            caption="95 % of the springs stay below.",
            means=f"95 % of {len(result.errors)} made springs are within {built} rms as "
            f"built{after}. {_advice(result)}",
            assumed="; ".join(
                dict.fromkeys(
                    c.cause.source.removeprefix("assumed: ") for c in result.causes if c.cause.assumed
                )
            ),
        ),
        FigureSection(
            "Torque of made springs",
            torque_band(result),
            caption="Nine of ten springs lie within the band.",
        ),
        TableSection(
            "Tolerance",
            ("what", "value"),
            tuple(result.rows()),
            caption="Torque errors of made springs, and what to do about them.",
        ),
        TableSection(
            "Causes",
            (*head[:6], "share, trimmed", "halved, trimmed", "known, trimmed"),
            tuple(rows),
            caption=f"Share of the variance in %, and the 95 % quantile in {result.shown_in} rms: of the "
            "cause alone, if it were half as large, and if it were known before the cam is made; then after "
            "the trim.",
            folded=True,
        ),
    ]


def _advice(result: ToleranceResult) -> str:
    """Return what to do first, as a sentence."""
    steps = (
        ("trim", result.trim_first),
        ("measure", result.measure_first),
        ("tighten", result.tighten_first),
    )
    named = [f"{verb} {name}" for verb, name in steps if name]
    return f"First: {'; '.join(named)}." if named else ""
