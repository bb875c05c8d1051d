"""A cable laid around the machined edge, read back from the DXF, gives the torque of the design.

The string, the reading of DXF and the law of the spring are those of this file and ``tests/dxf_reading.py``;
nothing of the package takes part but the drawing itself and the curve that it claims.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from nlsdesign.design import (
    BoltCircle,
    Contour,
    FerruleSeat,
    MachinedCam,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
    contour_from_lever_arm,
    write_drawings,
)
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import quantity
from tests.dxf_reading import TautString, header_of, offset_points, polylines_of

CABLE = quantity(0.25, "mm", source="example: cable of 0.5 mm")
FAR = 1e7
"""Distance in mm that stands for infinity: 20 mm of lever arm turn the cable there by 2 µrad."""


def two_sided(anchor: float) -> Contour:
    """Sizes like those of the cam of 2014: 53° and more, radii of curvature of 2.6 to 12.6 mm."""
    nodes = np.linspace(0.0, 1.35, 8)
    radii = 1e-3 * np.array([2.6, 4.0, 9.0, 12.6, 12.0, 8.0, 6.0, 5.0])
    return contour_from_curvature(nodes, radii, first_slope=8e-3, anchor_distance=anchor)


def sharp(anchor: float) -> Contour:
    """Radii of curvature down to 1 mm, four times the cable."""
    nodes = np.linspace(0.0, 1.3, 9)
    radii = 1e-3 * np.array([4.0, 1.0, 9.0, 12.0, 2.0, 6.0, 6.0, 3.0, 8.0])
    return contour_from_curvature(nodes, radii, first_slope=7e-3, anchor_distance=anchor)


def one_sided(anchor: float, *, last: float = 1.2) -> Contour:
    angles = np.linspace(0.0, last, 200)
    return contour_from_lever_arm(angles, 6e-3 + 5e-3 * (angles / last) ** 2, anchor_distance=anchor)


BOLTS = BoltCircle(count=4, circle=quantity(13.0, "mm"), hole=quantity(1.6, "mm"))
SEAT = FerruleSeat(diameter=quantity(1.5, "mm"))
CASES: dict[str, tuple[Contour, MachinedCam]] = {
    "two-sided, anchor 25 mm": (two_sided(25e-3), MachinedTwoSidedCam(cable_radius=CABLE)),
    "two-sided, anchor 40 mm, bolts, ferrule": (
        two_sided(40e-3), MachinedTwoSidedCam(cable_radius=CABLE, bolts=BOLTS, cable_end=SEAT),
    ),
    "two-sided, parallel cable": (two_sided(math.inf), MachinedTwoSidedCam(cable_radius=CABLE)),
    "two-sided, sharp, anchor 22 mm": (sharp(22e-3), MachinedTwoSidedCam(cable_radius=CABLE)),
    "two-sided, groove and bore": (
        two_sided(25e-3), MachinedTwoSidedCam(cable_radius=CABLE, groove_depth=1.5e-3, hub_bore=3e-3),
    ),
    "one-sided, parallel cable": (
        one_sided(math.inf), MachinedOneSidedCam(cable_radius=CABLE, hub_bore=4e-3),
    ),
    "one-sided, anchor 30 mm": (
        one_sided(30e-3), MachinedOneSidedCam(cable_radius=CABLE, hub_bore=4e-3, cable_end=SEAT),
    ),
    "one-sided, 200°": (
        one_sided(math.inf, last=math.radians(200.0)),
        MachinedOneSidedCam(cable_radius=CABLE, cable_end=SEAT),
    ),
}  # fmt: skip


def strings(text: str) -> list[TautString]:
    """The cable of both senses of a two-sided cam, or of a one-sided, from a DXF; in mm."""
    radius = 1e3 * CABLE.number
    edges, cables = polylines_of(text, "EDGE"), polylines_of(text, "CABLE")
    if len(edges) == 1:
        return [TautString(offset_points(edges[0], radius), cables[0][0, :2])]
    found = []
    for edge, side in zip(edges, (1.0, -1.0), strict=True):
        points = offset_points(edge, radius)
        # The right half of one lip; the cable comes through the axis. The other sense is its mirror image.
        found.append(TautString(points[points[:, 0] > 0.0] * [1.0, side], np.zeros(2)))
    return found


def force(extension: np.ndarray) -> np.ndarray:
    """Rubber that stiffens: about 140 N at 12 mm, with 4 mm of pretension; extension in mm."""
    stretched = extension + 4.0
    return 6.0 * stretched + 8e-3 * stretched**3


@pytest.mark.long_cases(
    "two-sided, anchor 40 mm, bolts, ferrule",
    "one-sided, parallel cable",
    "one-sided, anchor 30 mm",
    "two-sided, anchor 25 mm",
    "two-sided, parallel cable",
    "two-sided, sharp, anchor 22 mm",
    "two-sided, groove and bore",
)
@pytest.mark.parametrize("name", CASES)
def test_a_cable_on_the_machined_edge_gives_the_claimed_torque(name: str, tmp_path: Path) -> None:
    contour, machined = CASES[name]
    *_, file = write_drawings(tmp_path, contour, machined=machined)
    text = file.read_text(encoding="utf-8")
    assert header_of(text)["$INSUNITS"].strip() == "4", "drawing units are not millimetres"
    anchor = 1e3 * contour.anchor_distance if math.isfinite(contour.anchor_distance) else FAR
    angles = np.linspace(contour.angles[0], contour.angles[-1], 20)
    arms = 1e3 * np.interp(angles, contour.angles, contour.lever_arms)
    wound = 1e3 * np.interp(angles, contour.angles, contour.taken_lengths)
    claimed = force(wound) * arms
    for string in strings(text):
        lengths, laid, _ = np.array([string.pulled(angle, anchor) for angle in angles]).T
        torque = force(lengths - lengths[0]) * laid
        assert np.abs(torque - claimed).max() < 1e-3 * claimed.max()
        # The arcs of the edge are within half a micrometre, what they were made from within less.
        assert laid == pytest.approx(arms, abs=2e-3)
    assert len(strings(text)) == (1 if name.startswith("one") else 2)


@pytest.mark.long_cases("0.022", "inf")
@pytest.mark.parametrize("anchor", [22e-3, math.inf])
def test_the_arcs_keep_the_stated_distance_from_the_offset_of_the_integrated_curve(
    anchor: float, tmp_path: Path
) -> None:
    part = MachinedTwoSidedCam(cable_radius=CABLE).part(sharp(anchor))
    stated = 1e3 * part.number("edge_deviation")
    assert stated <= 1e-3
    *_, file = write_drawings(tmp_path, sharp(anchor), machined=MachinedTwoSidedCam(cable_radius=CABLE))
    edge = max(polylines_of(file.read_text(encoding="utf-8"), "EDGE"), key=lambda item: -item[:, 1].mean())
    drawn = offset_points(edge, 0.0, step=4e-5)
    # dx = ρ·t·dφ from the mouth at 7 mm, less the radius of the cable along the normal.
    phi = np.linspace(0.0, 1.3, 40001)
    rho = np.interp(phi, np.linspace(0.0, 1.3, 9), [4.0, 1.0, 9.0, 12.0, 2.0, 6.0, 6.0, 3.0, 8.0])
    place = np.array([7.0, 0.0]) + np.column_stack(
        [cumulative_simpson(rho * f, x=phi, initial=0.0) for f in (np.cos(phi), -np.sin(phi))]
    )
    wanted = (place - 0.25 * np.column_stack([np.sin(phi), np.cos(phi)]))[::1000]
    away = [np.min(np.hypot(*(drawn - point).T)) for point in wanted]
    # Drawn points are up to 0.5 µm apart, so the nearest of them may lie 0.25 µm further along.
    assert max(np.sqrt(np.maximum(np.square(away) - 0.25e-3**2, 0.0))) < 1.05 * stated


@pytest.mark.long_cases(
    "two-sided, anchor 40 mm, bolts, ferrule",
    "one-sided, anchor 30 mm",
    "two-sided, anchor 25 mm",
    "two-sided, groove and bore",
    "two-sided, parallel cable",
)
@pytest.mark.parametrize("name", CASES)
def test_the_lever_arm_is_the_change_of_the_string_s_length(name: str, tmp_path: Path) -> None:
    contour, machined = CASES[name]
    *_, file = write_drawings(tmp_path, contour, machined=machined)
    anchor = 1e3 * contour.anchor_distance if math.isfinite(contour.anchor_distance) else 1e4
    string = strings(file.read_text(encoding="utf-8"))[0]
    step = 1e-3
    for angle in np.linspace(contour.angles[0] + 0.02, contour.angles[-1] - 0.02, 5):
        after, before = (string.pulled(angle + change, anchor)[0] for change in (step, -step))
        assert (after - before) / (2 * step) == pytest.approx(string.pulled(angle, anchor)[1], abs=2e-3)


@pytest.mark.parametrize("name", CASES)
def test_beyond_the_last_angle_the_cable_lies_on_a_round_of_the_last_radius(
    name: str, tmp_path: Path
) -> None:
    contour, machined = CASES[name]
    *_, file = write_drawings(tmp_path, contour, machined=machined)
    string = strings(file.read_text(encoding="utf-8"))[0]
    anchor = 1e3 * contour.anchor_distance if math.isfinite(contour.anchor_distance) else FAR
    for beyond in (3.0, 9.0):
        _, _, at = string.pulled(contour.angles[-1] + math.radians(beyond), anchor)
        a, b, c = string.corners[at - 8], string.corners[at], string.corners[at + 8]
        sides = [math.hypot(*(p - q)) for p, q in ((a, b), (b, c), (a, c))]
        (ux, uy), (vx, vy) = b - a, c - a
        radius = math.prod(sides) / (2 * abs(ux * vy - uy * vx))
        assert radius == pytest.approx(1e3 * contour.radii_of_curvature[-1], rel=2e-3), beyond


def test_an_edge_for_a_thinner_cable_is_seen_by_this_string(tmp_path: Path) -> None:
    contour, _ = CASES["two-sided, anchor 25 mm"]
    *_, file = write_drawings(tmp_path, contour, machined=MachinedTwoSidedCam(cable_radius=2.5e-5))
    string = strings(file.read_text(encoding="utf-8"))[0]
    _, laid, _ = string.pulled(contour.angles[-1], 25.0)
    # Drawn for a cable a tenth as thick, the thick one lies 0.225 mm farther out.
    assert laid - 1e3 * contour.lever_arms[-1] > 0.2


def test_a_cam_with_unequal_sides_is_drawn_with_both_contours(tmp_path: Path) -> None:
    front, back = two_sided(25e-3), sharp(25e-3)
    part = MachinedTwoSidedCam(cable_radius=CABLE).part(front, back=back)
    *_, file = write_drawings(tmp_path, front, machined=part)
    for contour, string in zip((front, back), strings(file.read_text(encoding="utf-8")), strict=True):
        angles = np.linspace(contour.angles[0], contour.angles[-1], 30)
        laid = np.array([string.pulled(angle, 25.0)[1] for angle in angles])
        assert laid == pytest.approx(1e3 * np.interp(angles, contour.angles, contour.lever_arms), abs=2e-3)
    assert part.number("back_last_angle") == pytest.approx(float(back.angles[-1]))
    assert part.number("sharpest_edge") == pytest.approx(0.75e-3, rel=1e-3), "that of the sharper side"
    with pytest.raises(ArrangementError, match="no second contour"):
        MachinedOneSidedCam(cable_radius=CABLE).part(one_sided(math.inf), back=back)
