"""The page for the workshop: true to scale, complete, the same every time; read back from SVG and PDF."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from nlsdesign.design import (
    BoltCircle,
    CamPart,
    ClampScrew,
    FerruleSeat,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
    contour_from_lever_arm,
)
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.foundation.quantity import degrees, quantity
from nlsdesign.presentation import figures

SVG = "{http://www.w3.org/2000/svg}"
CABLE = quantity(0.25, "mm", source="example")
TITLE = figures.TitleBlock(
    title="Cam <A> & co", deck="austin2015_figure_consistent", fingerprint="0123456789ab", file="lip.dxf"
)
ROWS = [figures.InspectionRow(degrees(a), 0.05 * a, 2e-4 * a, 20.0 + a) for a in (0.0, 20.0, 40.0, 53.0)]


def long() -> CamPart:
    """As wide at 5:1 as there is room for the view."""
    bare = contour_from_curvature(
        [0.0, 0.5, 1.0, 1.5], [14e-3, 12e-3, 8e-3, 2e-3], first_slope=2e-3, anchor_distance=math.inf
    )
    # The same curve 4 mm higher.
    contour = replace(
        bare,
        lever_arms=bare.lever_arms + 4e-3 * np.cos(bare.directions),
        slopes=bare.slopes - 4e-3 * np.sin(bare.directions),
    )
    seat = FerruleSeat(diameter=1.5e-3)
    return MachinedOneSidedCam(cable_radius=CABLE, lead_in=8e-3, cable_end=seat).part(contour)


def two_sided(*, groove: bool = False) -> CamPart:
    nodes = np.linspace(0.0, 1.35, 8)
    radii = 1e-3 * np.array([2.6, 4.0, 9.0, 12.6, 12.0, 8.0, 6.0, 5.0])
    contour = contour_from_curvature(nodes, radii, first_slope=8e-3, anchor_distance=30e-3)
    bolts = BoltCircle(count=4, circle=13e-3, hole=1.6e-3)
    if not groove:
        return MachinedTwoSidedCam(
            cable_radius=CABLE, bolts=bolts, cable_end=FerruleSeat(diameter=1.5e-3)
        ).part(contour)
    return MachinedTwoSidedCam(
        cable_radius=CABLE, bolts=bolts, groove_depth=1.5e-3, hub_bore=3e-3,
        cable_end=ClampScrew(diameter=1e-3),
    ).part(contour)  # fmt: skip


def one_sided(last: float = 1.2) -> CamPart:
    angles = np.linspace(0.0, last, 100)
    contour = contour_from_lever_arm(angles, 6e-3 + 4e-3 * (angles / last) ** 2, anchor_distance=math.inf)
    return MachinedOneSidedCam(cable_radius=CABLE, hub_bore=4e-3).part(contour)


def keyed() -> CamPart:
    angles = np.linspace(0.0, 1.2, 100)
    contour = contour_from_lever_arm(angles, 12e-3 + 3e-3 * angles**2, anchor_distance=math.inf)
    return MachinedOneSidedCam(cable_radius=CABLE, hub_bore=9e-3, keyway=True).part(contour)


PARTS = {
    "two-sided": two_sided(),
    "keyed": keyed(),
    "groove": two_sided(groove=True),
    "one-sided": one_sided(),
    "wound": one_sided(3.5),
    "long": long(),
}


def texts_of(file: Path) -> list[str]:
    return [item.text or "" for item in ET.parse(file).getroot().iter(f"{SVG}text")]


def written(folder: Path, name: str, suffix: str) -> Path:
    page = figures.workshop_drawing(PARTS[name], title=TITLE, rows=ROWS)
    return figures.write_figures(folder, {"page": page}, suffix=suffix)[0]


@pytest.mark.parametrize("name", PARTS)
def test_the_page_is_a4_and_the_view_true_to_its_stated_scale(name: str, tmp_path: Path) -> None:
    file = written(tmp_path, name, ".svg")
    root = ET.parse(file).getroot()
    size = [float(root.attrib[key].removesuffix("pt")) for key in ("width", "height")]
    assert np.array(size) / 72 * 25.4 == pytest.approx([297.0, 210.0], abs=0.01)
    assert [float(item) for item in root.attrib["viewBox"].split()] == pytest.approx([0, 0, *size])
    scales = [text for text in texts_of(file) if re.match(r"\d+:\d+, A4, mm", text)]
    assert len(scales) == 1
    over, under = (float(item) for item in scales[0].partition(",")[0].split(":"))
    part = PARTS[name]
    wanted = np.ptp(np.vstack([outline.polygon() for outline in part.outlines]), axis=0) * 1e3 * over / under
    # The outlines are the areas of the main view: together as wide and high as the part.
    corners = []
    for patch in root.iter(f"{SVG}path"):
        numbers = np.array([float(item) for item in re.findall(r"-?\d+\.?\d*", patch.attrib["d"])])
        if "#dde2e7" in patch.attrib.get("style", "") and "clip-path" in patch.attrib and len(numbers) > 60:
            corners.append(numbers.reshape(-1, 2))
    shown = np.ptp(np.vstack(corners[: len(part.outlines)]), axis=0) / 72 * 25.4
    assert shown == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize("name", PARTS)
def test_the_page_says_what_the_workshop_needs(name: str, tmp_path: Path) -> None:
    texts = texts_of(written(tmp_path, name, ".svg"))
    joined = "\n".join(texts)
    for wanted in ("Cam <A> & co", "austin2015_figure_consistent", "0123456789ab", "Ø0.5 mm", "53.0",
                   "2.650", "10.600", "73.0", "torque in N·m", "Run-out beyond last angle *", "± 0.02 mm",
                   "lip.dxf"):  # fmt: skip
        assert wanted in joined, wanted
    outline = np.vstack([item.polygon() for item in PARTS[name].outlines])
    for size in 1e3 * np.ptp(outline, axis=0):
        assert f"{round(size, 2):g}" in texts
    wanted_here = {
        "two-sided": ["0.5 at the mouth", "0.6 inside", "4 × Ø1.6 through, on Ø13"],
        "groove": ["Ø3 hub bore, base only", "2 × Ø1 for the clamp", "1.5"],
        "one-sided": ["Ø4 hub bore", "Lead-in"],
        "keyed": ["Ø9 hub bore, keyway 3 JS9, 10.4 across"],
        "long": ["Ferrule seat *", "5:1, A4, mm"],
        "wound": ["contact at 200.5°,", "then run-out 10°"],
    }
    for line in wanted_here[name]:
        assert line in texts


@pytest.mark.parametrize("name", PARTS)
def test_no_two_texts_and_no_text_and_frame_overlap(name: str) -> None:
    page = figures.workshop_drawing(PARTS[name], title=TITLE, rows=ROWS)
    renderer = FigureCanvasAgg(page).get_renderer()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in page.axes[0].texts]
    width, height = page.canvas.get_width_height()
    for index, (one, box) in enumerate(boxes):
        assert box.x0 > 0.025 * width, one
        assert box.x1 < 0.975 * width, one
        assert box.y0 > 0.035 * height, one
        assert box.y1 < 0.965 * height, one
        for other, second in boxes[index + 1 :]:
            # Letters of neighbouring rows may come within half a point.
            apart = max(second.x0 - box.x1, box.x0 - second.x1, second.y0 - box.y1, box.y0 - second.y1)
            assert apart > -1.0, f"'{one}' overlaps '{other}'"


def test_the_pdf_is_one_page_a4_without_a_date_and_holds_the_text_as_fonts(tmp_path: Path) -> None:
    content = written(tmp_path, "two-sided", ".pdf").read_bytes()
    assert content.startswith(b"%PDF")
    box = re.search(rb"/MediaBox \[ ?([\d. ]+) ?\]", content)
    assert box is not None
    assert [float(item) / 72 * 25.4 for item in box[1].split()] == pytest.approx([0, 0, 297, 210], abs=0.01)
    assert b"/CreationDate" not in content
    assert len(re.findall(rb"/Type /Page\b", content)) == 1
    streams = [
        zlib.decompress(item)
        for item in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, flags=re.DOTALL)
        if item[:1] == b"x"
    ]
    assert any(b" Tj" in item or b" TJ" in item for item in streams)


# Quicker: the same in unit/design/test_machined_cam.py
@pytest.mark.slow
def test_the_same_part_gives_the_same_bytes(tmp_path: Path) -> None:
    for suffix in (".svg", ".pdf"):
        first, second = (written(tmp_path / folder, "groove", suffix).read_bytes() for folder in ("a", "b"))
        assert first == second


def test_a_table_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueRangeError, match="torque table of 20 rows: at most 16 fit"):
        figures.workshop_drawing(PARTS["one-sided"], title=TITLE, rows=ROWS * 5)
