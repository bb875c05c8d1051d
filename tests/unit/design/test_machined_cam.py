"""Machined cams: what the files hold, read by other code than wrote them, and what cannot be made."""

from __future__ import annotations

import csv
import math
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.design import (
    BoltCircle,
    ClampScrew,
    Contour,
    FerruleSeat,
    MachinedCam,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
    contour_from_lever_arm,
    write_drawings,
)
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.errors import (
    ArrangementError,
    MissingLibraryError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import quantity
from tests.dxf_reading import entities_of, header_of, offset_points, polylines_of


def mm(value: float) -> object:
    return quantity(value, "mm", source="example")


CABLE = quantity(0.25, "mm", source="example")
BOLTS = BoltCircle(count=4, circle=13e-3, hole=1.6e-3)


@pytest.fixture
def contour() -> Contour:
    nodes = np.linspace(0.0, 1.35, 8)
    radii = 1e-3 * np.array([2.6, 4.0, 9.0, 12.6, 12.0, 8.0, 6.0, 5.0])
    return contour_from_curvature(nodes, radii, first_slope=8e-3, anchor_distance=30e-3)


@pytest.fixture
def one_sided() -> Contour:
    angles = np.linspace(0.0, 1.2, 100)
    return contour_from_lever_arm(angles, 6e-3 + 3e-3 * angles**2, anchor_distance=math.inf)


def spiral() -> Contour:
    angles = np.linspace(0.0, 5.0, 200)
    return contour_from_lever_arm(angles, 9e-3 - 6e-4 * angles, anchor_distance=math.inf)


def arcs_of(outline: np.ndarray) -> list[tuple[complex, complex, complex]]:
    """Start, middle and end of each line or arc of a polyline with bulges."""
    found = []
    for (x0, y0, bulge), (x1, y1, _) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        start, end = complex(x0, y0), complex(x1, y1)
        # The middle of an arc to the left lies to the right of its chord by bulge times half of it.
        found.append((start, (start + end) / 2 - 1j * (end - start) / 2 * bulge, end))
    return found


def svg_arcs(data: str) -> list[tuple[complex, complex, complex]]:
    """The same from the data of an SVG path, by its rule for the centre of an arc."""
    found, at, first = [], 0j, 0j
    for kind, numbers in re.findall(r"([MLAZ])([^MLAZ]*)", data):
        values = [float(item) for item in numbers.split()]
        end = first if kind == "Z" else complex(*values[-2:])
        if kind == "M":
            first = end
        elif kind == "A":
            radius, large, positive = values[0], values[3], values[4]
            half = abs(end - at) / 2
            away = math.sqrt(max(0.0, radius**2 - half**2)) * (1 if large != positive else -1)
            across = 1j * (end - at) / (2 * half)
            centre = (at + end) / 2 + away * across
            # On a small arc the middle is on the far side of the chord from the centre.
            towards = ((at + end) / 2 - centre) / abs((at + end) / 2 - centre)
            found.append((at, centre + (-1 if large else 1) * radius * towards, end))
        elif kind == "L" or abs(end - at) > 1e-9:
            found.append((at, (at + end) / 2, end))
        at = end
    return found


def test_dxf_holds_closed_edges_of_arcs_holes_and_layers(tmp_path: Path, contour: Contour) -> None:
    machined = MachinedTwoSidedCam(
        cable_radius=CABLE, bolts=BOLTS, groove_depth=mm(1.5), hub_bore=mm(3),
        cable_end=ClampScrew(diameter=1.2e-3),
    )  # fmt: skip
    file = write_drawings(tmp_path, contour, machined=machined, note="design 0123abcd", formats=["dxf"])[0]
    text = file.read_text(encoding="ascii")
    head, entities = header_of(text), entities_of(text)
    assert (head["$ACADVER"], head["$INSUNITS"].strip(), head["$MEASUREMENT"].strip()) == ("AC1015", "4", "1")
    edges = [item for item in entities if item.layer == "EDGE"]
    assert [item.kind for item in edges] == ["LWPOLYLINE"] * 2
    assert all(int(item.values[70][0]) & 1 for item in edges), "an edge is not closed"
    circles = {
        (item.layer, *(float(item.values[code][0]) for code in (10, 20, 40)))
        for item in entities if item.kind == "CIRCLE"
    }  # fmt: skip
    central = {row[0]: row[3] for row in circles if row[1:3] == (0.0, 0.0)}
    reach = max(np.hypot(*outline[:, :2].T).max() for outline in polylines_of(text, "EDGE"))
    assert central == {"HOLES": 1.5, "BASE": pytest.approx(reach + 1.1, abs=0.2)}
    bolts = sorted(row[1:3] for row in circles if row[3] == pytest.approx(0.8))
    corner = 6.5 / math.sqrt(2)
    assert np.array(bolts) == pytest.approx(
        np.array([[-corner, -corner], [-corner, corner], [corner, -corner], [corner, corner]]), abs=1e-6
    )
    assert sum(row[3] == pytest.approx(0.6) for row in circles) == 2
    assert {item.layer for item in entities} == {"EDGE", "BASE", "HOLES", "CENTRE", "CABLE", "TEXT"}
    assert any("design 0123abcd" in value for item in entities for value in item.values.get(1, []))


@pytest.mark.parametrize("base_only", [False, True])
def test_a_bore_with_a_keyway_is_drawn_as_its_standard_says(tmp_path: Path, base_only: bool) -> None:
    """DIN 6885-1 for 9 mm: 3 wide, 10.4 from the far side of the bore; the area by an integral by hand."""
    angles = np.linspace(0.0, 1.2, 100)
    contour = contour_from_lever_arm(angles, 7e-3 + 3e-3 * angles**2, anchor_distance=math.inf)
    groove = mm(1.5) if base_only else None
    wall = mm(2.0) if base_only else mm(0.5)
    machined = MachinedOneSidedCam(
        cable_radius=CABLE, hub_bore=mm(9), keyway=True, groove_depth=groove, minimum_wall=wall
    )
    part = machined.part(contour)
    assert part.holes[0].base_only is base_only
    files = {file.suffix: file for file in write_drawings(tmp_path, contour, machined=machined)}
    (hole,) = polylines_of(files[".dxf"].read_text(encoding="ascii"), "HOLES")
    edge = offset_points(hole, 0.0)
    assert (edge[:, 1].min(), edge[:, 1].max()) == pytest.approx((-4.5, 5.9), abs=1e-5)
    top = edge[edge[:, 1] > 5.0]
    assert (top[:, 0].min(), top[:, 0].max()) == pytest.approx((-1.5, 1.5), abs=1e-6)
    x, y = edge.T
    area = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    cap = 1.5 * math.sqrt(4.5**2 - 1.5**2) + 4.5**2 * math.asin(1.5 / 4.5)
    assert area == pytest.approx(math.pi * 4.5**2 + 3 * 5.9 - cap, rel=1e-5)
    table = (tmp_path / "cam.csv").read_text(encoding="utf-8").splitlines()
    rows = [line for line in table if line.startswith("hub bore,")]
    assert len(rows) == 5, "three lines and two arcs"
    assert "L -1.50000 5.90000" in files[".svg"].read_text(encoding="utf-8")


def test_the_writer_s_own_audit_finds_no_error(tmp_path: Path, contour: Contour) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    file = write_drawings(
        tmp_path, contour, machined=MachinedTwoSidedCam(cable_radius=CABLE), formats=["dxf"]
    )[0]
    audit = ezdxf.readfile(file).audit()
    assert (len(audit.errors), len(audit.fixes)) == (0, 0)


def test_the_same_part_gives_the_same_files(tmp_path: Path, contour: Contour) -> None:
    machined = MachinedTwoSidedCam(cable_radius=CABLE, bolts=BOLTS)
    both = [write_drawings(tmp_path / name, contour, machined=machined) for name in ("a", "b")]
    assert [file.name for file in both[0]] == ["cam.csv", "cam_centre_line.csv", "cam.svg", "cam.dxf"]
    for first, second in zip(*both, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


@pytest.mark.parametrize("sided", ["two", "one"])
def test_svg_and_csv_hold_the_arcs_of_the_dxf(
    sided: str, tmp_path: Path, contour: Contour, one_sided: Contour
) -> None:
    seat = FerruleSeat(diameter=mm(1.5))  # type: ignore[arg-type]
    made: dict[str, tuple[Contour, MachinedCam]] = {
        "two": (contour, MachinedTwoSidedCam(cable_radius=CABLE, cable_end=seat)),
        "one": (one_sided, MachinedOneSidedCam(cable_radius=CABLE, cable_end=seat, hub_bore=4e-3)),
    }
    curve, machined = made[sided]
    table, _, svg, dxf = write_drawings(tmp_path, curve, machined=machined, note="<5 & 6>")
    wanted = [np.array(arcs_of(outline)) for outline in polylines_of(dxf.read_text(encoding="utf-8"), "EDGE")]
    root = ElementTree.parse(svg).getroot()
    assert root.attrib["viewBox"].split()[2] == root.attrib["width"].removesuffix("mm")
    drawn = [item.attrib["d"] for item in root.iter() if item.attrib.get("class") == "edge"]
    assert len(drawn) == len(wanted) == (2 if sided == "two" else 1)
    for data, arcs in zip(drawn, wanted, strict=True):
        assert np.array(svg_arcs(data)) == pytest.approx(arcs, abs=1e-4)
    lines = [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = [row for row in csv.DictReader(lines) if row["outline"].startswith("edge")]
    for row, (start, middle, end) in zip(rows, np.vstack(wanted), strict=True):
        assert complex(float(row["start_x_mm"]), float(row["start_y_mm"])) == pytest.approx(start, abs=2e-6)
        assert complex(float(row["end_x_mm"]), float(row["end_y_mm"])) == pytest.approx(end, abs=2e-6)
        if row["radius_mm"]:
            centre = complex(float(row["centre_x_mm"]), float(row["centre_y_mm"]))
            assert abs(middle - centre) == pytest.approx(abs(float(row["radius_mm"])), rel=1e-4)


def test_the_edges_have_no_corner_but_at_the_ferrule(tmp_path: Path, contour: Contour) -> None:
    for machined, corners in (
        (MachinedTwoSidedCam(cable_radius=CABLE), 0),
        (MachinedTwoSidedCam(cable_radius=CABLE, cable_end=FerruleSeat(diameter=1.5e-3)), 2),
    ):
        *_, dxf = write_drawings(tmp_path, contour, machined=machined)
        for outline in polylines_of(dxf.read_text(encoding="utf-8"), "EDGE"):
            steps = np.roll(outline, -1, axis=0)[:, :2] - outline[:, :2]
            bearing, half = np.arctan2(steps[:, 1], steps[:, 0]), 2 * np.arctan(outline[:, 2])
            kinks = bearing - half - np.roll(bearing + half, 1)
            kinks = np.abs((kinks + np.pi) % (2 * np.pi) - np.pi)
            assert np.count_nonzero(kinks > 1e-3) == corners, np.degrees(kinks.max())


def test_step_holds_the_solids_in_millimetres(tmp_path: Path, contour: Contour) -> None:
    # Open CASCADE is 380 MB on disk, so it is neither a dependency nor locked; the package works without.
    pytest.importorskip("OCP", reason="STEP is an extra")
    machined = MachinedTwoSidedCam(cable_radius=CABLE, bolts=BOLTS)
    dxf, step = write_drawings(tmp_path, contour, machined=machined, formats=["dxf", "step"])
    text = step.read_text(encoding="ascii")
    flat = "".join(text.split())
    assert "SI_UNIT(.MILLI.,.METRE.)" in flat
    assert flat.count("=MANIFOLD_SOLID_BREP(") == 2
    number = r"(-?[\d.]+(?:E[-+]?\d+)?)"
    points = np.array(re.findall(rf"CARTESIAN_POINT\('',\({number},{number},{number}\)\)", flat), dtype=float)
    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((0.0, 4.0))
    entities = dict(re.findall(r"#(\d+)=([^;]*);", flat))
    circles = []
    for text_of in entities.values():
        if circle := re.fullmatch(rf"CIRCLE\('',#(\d+),{number}\)", text_of):
            place = re.match(r"AXIS2_PLACEMENT_3D\('',#(\d+)", entities[circle[1]])
            if place is None:  # a circle in the plane of a face's own parameters
                continue
            centre = re.findall(number, entities[place[1]].partition("(")[2].partition("(")[2])
            circles.append([float(item) for item in (*centre, circle[2])])
    rows = np.array(circles)
    for outline in polylines_of(dxf.read_text(encoding="utf-8"), "EDGE"):
        for (x, y, bulge), (x1, y1, _) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            for height in (0.0, 4.0):
                assert np.min(np.linalg.norm(points - [x, y, height], axis=1)) < 1e-5
            if bulge:
                half, middle = complex(x1 - x, y1 - y) / 2, complex(x + x1, y + y1) / 2
                centre_of = middle + 1j * half * (1 - bulge**2) / (2 * bulge)
                radius = abs(half) * (1 + bulge**2) / (2 * abs(bulge))
                wanted = [centre_of.real, centre_of.imag, radius]
                assert np.min(np.abs(rows[:, [0, 1, 3]] - wanted).max(axis=1)) < 2e-3 * max(1.0, radius)
    assert np.count_nonzero(np.abs(rows[:, 3] - 0.8) < 1e-9) >= 4, "no bolt holes"
    again = write_drawings(tmp_path, contour, machined=machined, formats=["step"], name="cam")[0]
    assert again.read_text(encoding="ascii") == text


def test_the_solid_lacks_bore_and_keyway_over_the_plate(tmp_path: Path) -> None:
    """The volume taken is that of the closed edge on the layer HOLES times the plate."""
    pytest.importorskip("OCP", reason="STEP is an extra")
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from nlsdesign.design.drawing.cam_drawing import _solid

    angles = np.linspace(0.0, 1.2, 100)
    contour = contour_from_lever_arm(angles, 12e-3 + 3e-3 * angles**2, anchor_distance=math.inf)
    keyed = MachinedOneSidedCam(cable_radius=CABLE, hub_bore=mm(9), keyway=True, body_radius=mm(7))
    volumes = []
    for machined in (replace(keyed, hub_bore=None, keyway=False), keyed):
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(_solid(machined.part(contour)), properties)
        volumes.append(properties.Mass())
    cap = 1.5 * math.sqrt(4.5**2 - 1.5**2) + 4.5**2 * math.asin(1.5 / 4.5)
    assert volumes[0] - volumes[1] == pytest.approx(4 * (math.pi * 4.5**2 + 3 * 5.9 - cap), rel=1e-6)


def test_step_without_its_library_says_how_to_get_it(
    tmp_path: Path, contour: Contour, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OCP", None)
    for name in [name for name in sys.modules if name.startswith("OCP.")]:
        monkeypatch.delitem(sys.modules, name)
    machined = MachinedTwoSidedCam(cable_radius=CABLE)
    with pytest.raises(MissingLibraryError, match=r"pip install 'nlsdesign\[step\]'"):
        write_drawings(tmp_path / "new", contour, machined=machined, formats=["dxf", "step"])
    assert not (tmp_path / "new").exists()


# --- numbers --------------------------------------------------------------------------------------


def test_every_number_has_a_source_and_the_derived_ones_say_how(contour: Contour) -> None:
    part = MachinedTwoSidedCam(cable_radius=CABLE, bolts=BOLTS).part(contour)
    assert part.numbers["channel_width"].number == pytest.approx(0.6e-3)
    assert part.numbers["mouth_width"].number == pytest.approx(0.5e-3)
    assert part.numbers["sharpest_edge"].number == pytest.approx(2.35e-3, abs=1e-6)
    assert part.numbers["edge_deviation"].number <= 1e-6
    silent = {
        name for name, item in part.numbers.items() if not item.source.startswith(("assumed", "derived"))
    }
    assert silent == {
        "cable_radius", "last_angle", "anchor_distance", "bolt_count", "bolt_circle", "bolt_hole",
    }  # fmt: skip


def test_the_body_reaches_around_the_bolts(contour: Contour) -> None:
    part = MachinedTwoSidedCam(cable_radius=CABLE, bolts=BOLTS).part(contour)
    assert part.numbers["body_radius"].number == pytest.approx((13e-3 + 1.6e-3) / 2 + 1e-3)


# --- what cannot be made --------------------------------------------------------------------------

Making = Callable[[Contour, Contour], object]
REFUSED: dict[str, tuple[type[NlsError], str, Making]] = {
    "cable": (
        ValueRangeError, r"cable radius 3 mm: the cable is thicker than the sharpest radius.*2\.6 mm",
        lambda two, one: MachinedTwoSidedCam(cable_radius=mm(3)).part(two),
    ),
    "corner": (
        ValueRangeError, r"radius of 0\.01 mm at its sharpest: is a corner within its tolerance of 0\.02",
        lambda two, one: MachinedTwoSidedCam(cable_radius=mm(2.59), channel_clearance=0.0).part(two),
    ),
    "unit": (
        ValueRangeError, r"was 'mm' meant", lambda two, one: MachinedTwoSidedCam(cable_radius=0.25),
    ),
    "dimension": (
        UnitError, "cable_radius", lambda two, one: MachinedTwoSidedCam(cable_radius=quantity(1, "s")),
    ),
    "bolts outside": (
        ValueRangeError, r"bolt hole 1 of 2\.2 mm at 17 mm from the axis: .* outside the material",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, bolts=BoltCircle(count=4, circle=mm(34), hole=mm(2.2))
        ).part(two),
    ),
    "wall": (
        ValueRangeError, r"bolt hole 1 .*leaves .* mm to the edge, minimum_wall is 1 mm",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, bolts=BoltCircle(count=4, circle=mm(5), hole=mm(2.2))
        ).part(two),
    ),
    "holes": (
        ValueRangeError, r"bolt hole 1 and bolt hole 2: leave",
        lambda two, one: MachinedOneSidedCam(
            cable_radius=CABLE, bolts=BoltCircle(count=12, circle=mm(7), hole=mm(1.2))
        ).part(one),
    ),
    "two bolts": (
        ArrangementError, "do not hold two separate halves",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, bolts=BoltCircle(count=2, circle=mm(10), hole=mm(2))
        ).part(two),
    ),
    "bore": (
        ArrangementError, "hub bore of 4 mm: would cut the channel.*give a groove_depth",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, hub_bore=mm(4)).part(two),
    ),
    "keyway without a bore": (
        ArrangementError, "keyway: has no bore", lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, keyway=True
        ),
    ),
    "keyway of a small bore": (
        ValueRangeError, r"hub_bore 6 mm with a keyway: no key is made for it; bores are over 6 and up to 30",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, hub_bore=mm(6), keyway=True),
    ),
    "keyway that is no choice": (
        ValueRangeError, "keyway = '2 mm': is neither true nor false",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, hub_bore=mm(8), keyway="2 mm"),
    ),
    "keyway in a thin wall": (
        ValueRangeError, "hub bore of 9 mm with a keyway 1.4 mm deep at 0 mm from the axis: leaves",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, hub_bore=mm(9), keyway=True).part(one),
    ),
    "bore of a one-sided": (
        ValueRangeError, "hub bore of 11 mm at 0 mm from the axis: leaves",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, hub_bore=mm(11)).part(one),
    ),
    "not through the centre": (
        ArrangementError, "lever arm of 6 mm at angle zero.*MachinedOneSidedCam",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE).part(one),
    ),
    "channel": (
        ValueRangeError, "channel, 8 mm from the axis to its mouth: needs",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, channel_clearance=mm(9.9)).part(two),
    ),
    "tool": (
        ValueRangeError, r"tool_radius 1 mm: is larger than an inner corner of the edge, 0\.75 mm",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, tool_radius=mm(1), cable_end=FerruleSeat(diameter=mm(1.5))
        ).part(two),
    ),
    "mouth": (
        ValueRangeError, r"tool_radius 0\.5 mm: does not pass the mouth of the channel, 0\.5 mm wide",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, tool_radius=mm(0.5), groove_depth=mm(1.5)
        ).part(two),
    ),
    "ferrule": (
        ValueRangeError, "ferrule seat of 0.5 mm: is no wider than the channel",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, cable_end=FerruleSeat(diameter=mm(0.5))
        ).part(two),
    ),
    "groove": (
        ValueRangeError, "groove_depth 0.3 mm: is less than the cable is thick",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, groove_depth=mm(0.3)).part(two),
    ),
    "plate": (
        ValueRangeError, "leaves a base of 0.5 mm",
        lambda two, one: MachinedTwoSidedCam(
            cable_radius=CABLE, groove_depth=mm(1.5), thickness=mm(2.0)
        ).part(two),
    ),
    "run-out": (
        ValueRangeError, "over-travel of 60°: the run-out reaches the anchor",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, over_travel=math.radians(60)).part(
            replace(two, anchor_distance=1.01 * two.radii.max())
        ),
    ),
    "undercut": (
        ValueRangeError, "run-out: the lip ends at the direction 22.*°, beyond 180°",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, over_travel=math.radians(170)).part(two),
    ),
    "body": (
        ValueRangeError, "body_radius 20 mm: stands out over the edge",
        lambda two, one: MachinedTwoSidedCam(cable_radius=CABLE, body_radius=mm(20)).part(two),
    ),
    "crossing": (
        ArrangementError, "edge of the cam: crosses itself at x = -5",
        lambda two, one: MachinedOneSidedCam(
            cable_radius=CABLE, lead_in=mm(2), body_radius=0.0, corner_radius=mm(3)
        ).part(spiral()),
    ),
    "lead-in": (
        ArrangementError, "has no convex back.*shorter lead_in",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, lead_in=mm(20)).part(spiral()),
    ),
    "more than a turn": (
        ArrangementError, "more than once",
        lambda two, one: MachinedOneSidedCam(cable_radius=CABLE, over_travel=math.radians(80)).part(spiral()),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_made_is_named_with_the_next_step(
    what: str, contour: Contour, one_sided: Contour
) -> None:
    kind, message, making = REFUSED[what]
    with pytest.raises(kind, match=message) as caught:
        making(contour, one_sided)
    assert caught.value.next_step


def test_a_concave_contour_is_refused(contour: Contour) -> None:
    hollow = Contour(
        contour.directions, contour.lever_arms, contour.slopes,
        contour.radii_of_curvature - 4e-3, contour.anchor_distance,
    )  # fmt: skip
    with pytest.raises(ValueRangeError, match="is concave there"):
        MachinedTwoSidedCam(cable_radius=CABLE).part(hollow)


def test_what_is_refused_writes_nothing(tmp_path: Path, contour: Contour) -> None:
    machined = MachinedTwoSidedCam(cable_radius=CABLE)
    with pytest.raises(UnknownNameError, match=r"format 'stp'.*did you mean 'step'"):
        write_drawings(tmp_path / "new", contour, machined=machined, formats=["dxf", "stp"])
    with pytest.raises(ValueRangeError, match="declared by the machined cam already"):
        write_drawings(tmp_path / "new", contour, machined=machined, cable_radius=1e-4)
    with pytest.raises(ValueRangeError, match="thicker than the sharpest radius"):
        write_drawings(tmp_path / "new", contour, machined=MachinedTwoSidedCam(cable_radius=3e-3))
    assert not (tmp_path / "new").exists()
