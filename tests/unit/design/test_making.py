"""What a drawing says of how the part is made, and of what carries its torque."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from nlsdesign.design import (
    BoltCircle,
    ClampScrew,
    Contour,
    MachinedCam,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
    contour_from_lever_arm,
)
from nlsdesign.design.drawing.making import Mounting, carrying_note, process_of
from nlsdesign.design.jobs.written_design import part_remarks
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.quantity import quantity

CABLE = quantity(0.45, "mm", source="example")
GROOVED = MachinedTwoSidedCam(cable_radius=CABLE, groove_depth=4e-3, hub_bore=6e-3)


@pytest.fixture
def contour() -> Contour:
    nodes = np.linspace(0.0, 1.35, 8)
    radii = 1e-3 * np.array([2.6, 4.0, 9.0, 12.6, 12.0, 8.0, 6.0, 5.0])
    return contour_from_curvature(nodes, radii, first_slope=8e-3, anchor_distance=30e-3)


def remarks(machined: MachinedCam, contour: Contour, torque: float, tension: float = 0.0) -> list[str]:
    return list(Mounting(machined, contour, machined.part(contour), torque, tension).remarks())[1:]


def wound(**sizes: object) -> tuple[MachinedOneSidedCam, Contour]:
    angles = np.linspace(0.0, 1.2, 100)
    contour = contour_from_lever_arm(angles, 14e-3 + 3e-3 * angles**2, anchor_distance=math.inf)
    radius = quantity(0.25, "mm")
    return MachinedOneSidedCam(cable_radius=radius, **sizes), contour  # type: ignore[arg-type]


def test_a_narrow_deep_channel_names_its_process(contour: Contour) -> None:
    """0.9 mm wide and 4 mm deep is 4.4 times as deep as wide; 3 mm are 3.3 times."""
    words = process_of(GROOVED.part(contour))
    assert words.startswith("channel 0.9 mm wide and 4 mm deep, 4.4 times: die-sinking erosion")
    shallow = replace(GROOVED, groove_depth=quantity(3.0, "mm"), thickness=None)
    assert process_of(shallow.part(contour)).endswith(
        "3.3 times: milling, fine for ± 0.02 mm (ISO 2768-1 f: ± 0.05)"
    )
    coarse = replace(shallow, edge_tolerance=quantity(0.05, "mm"))
    assert process_of(coarse.part(contour)).endswith("3.3 times: milling")
    through = MachinedTwoSidedCam(cable_radius=CABLE).part(contour)
    assert process_of(through).startswith("edges cut through, ± 0.02 mm: wire erosion")


def test_a_bore_alone_carries_no_torque_and_the_bolts_that_are_named_do(contour: Contour) -> None:
    """5 N·m on the rim of a bore of 6 mm are 1667 N."""
    (said,) = remarks(GROOVED, contour, 5.0)
    assert "5 N·m" in said
    assert "1.67e+03 N" in said
    count, circle, hole = re.findall(r'count = (\d+), circle = "([0-9.]+) mm", hole = "([0-9.]+) mm"', said)[
        0
    ]
    bolts = BoltCircle(count=int(count), circle=float(circle) * 1e-3, hole=float(hole) * 1e-3)
    assert remarks(replace(GROOVED, bolts=bolts), contour, 5.0) == []


def test_bolts_that_are_too_weak_are_said(contour: Contour) -> None:
    """M1.6 of class 8.8 bear 0.6·800 MPa·1.27 mm²/1.25 = 488 N; twice 25 N·m at 17 mm are 4·735 N."""
    weak = replace(GROOVED, bolts=BoltCircle(count=4, circle=34e-3, hole=1.7e-3))
    (said,) = remarks(weak, contour, 25.0)
    assert "with 735 N each" in said
    assert "M1.6 carries 488 N" in said
    assert remarks(weak, contour, 14.0) == []


@pytest.mark.slow
def test_where_no_bolts_fit_that_is_said() -> None:
    angles = np.linspace(0.0, 1.2, 100)
    contour = contour_from_lever_arm(angles, 6e-3 + 3e-3 * angles**2, anchor_distance=math.inf)
    machined = MachinedOneSidedCam(cable_radius=quantity(0.25, "mm"), hub_bore=4e-3)
    (said,) = remarks(machined, contour, 0.5)
    assert "no bolts that carry it fit" in said


def test_a_clamp_that_lets_the_cable_slip_is_said_with_the_screw_that_holds() -> None:
    """M2 of class 8.8: 2 faces, 0.1, 500 MPa of 2.07 mm² over 1.6 are 129 N; M3 holds 314 N."""
    bolts = BoltCircle(count=4, circle=16e-3, hole=3.2e-3)
    machined, contour = wound(bolts=bolts, cable_end=ClampScrew(diameter=1.6e-3))
    assert remarks(machined, contour, 0.5, 64.0) == []
    (said,) = remarks(machined, contour, 0.5, 150.0)
    assert "hold 2 times 150 N: M2 holds 129 N" in said
    (core,) = re.findall(r'ClampScrew = {diameter = "([0-9.]+) mm"}', said)
    assert float(core) == 2.5, "the thinnest that does"
    thicker = replace(machined, cable_end=ClampScrew(diameter=float(core) * 1e-3))
    assert remarks(thicker, contour, 0.5, 150.0) == []
    (said,) = remarks(machined, contour, 0.5, 2e3)
    assert said.endswith("no thicker screw that holds it fits: take a FerruleSeat")
    (said,) = remarks(replace(machined, cable_end=ClampScrew(diameter=0.9e-3)), contour, 0.5, 60.0)
    assert "no thread from M1.6 on" in said


def test_the_tension_of_the_design_is_what_the_clamp_has_to_hold() -> None:
    machined, contour = wound(
        bolts=BoltCircle(count=4, circle=16e-3, hole=3.2e-3), cable_end=ClampScrew(diameter=1.6e-3)
    )
    design: Any = SimpleNamespace(
        contour=contour,
        check=SimpleNamespace(torques=np.array([0.0, 0.5])),
        curves=SimpleNamespace(forces=np.array([20.0, 150.0, 90.0])),
    )
    assert "hold 2 times 150 N" in " ".join(part_remarks(design, machined, machined.part(contour)))


def test_both_sides_of_a_cable_hold_each_other(contour: Contour) -> None:
    clamped = replace(
        GROOVED, cable_end=ClampScrew(diameter=1.6e-3), bolts=BoltCircle(count=4, circle=34e-3, hole=1.7e-3)
    )
    assert remarks(clamped, contour, 1.0, 1e4) == []


def test_where_no_bolts_fit_the_key_of_the_bore_is_named_with_the_strength_it_asks_for() -> None:
    """2·2·5 N·m on 9 mm are 2222 N, on 1.2 mm by 4 mm 463 MPa, which is 0.9 of 514 MPa."""
    machined, contour = wound(hub_bore=9e-3, thickness=4e-3, minimum_wall=5e-3)
    (said,) = remarks(machined, contour, 5.0)
    assert "no bolts that carry it fit: keyway = true does: a key of 3 x 3 mm (DIN 6885-1) over 4 mm" in said
    assert "at least 514 MPa" in said
    (said,) = remarks(machined, contour, 10.0)
    assert said.endswith("leave room for a key or a clamp, or take a larger body_radius"), "no steel bears it"
    wide = replace(machined, hub_bore=quantity(16.0, "mm"))
    (said,) = remarks(wide, contour, 5.0)
    assert "a key of" not in said, "no wall is left beside it"


def test_a_keyway_carries_the_torque_or_says_what_it_lacks() -> None:
    """The shaft of 9 mm is 7.2 mm beside its keyway: 16·10 N·m/(π·7.2³) are 136 MPa, √3 times 236 MPa."""
    machined, contour = wound(hub_bore=9e-3, keyway=True, thickness=4e-3)
    (said,) = remarks(machined, contour, 5.0)
    assert said.startswith("The key carries 2 times 5 N·m: a key of 3 x 3 mm (DIN 6885-1) over 4 mm")
    assert "at least 514 MPa of the plate (DIN 6892 C) and 236 MPa of a solid shaft" in said
    assert said == carrying_note(machined.part(contour), 5.0)
    assert carrying_note(machined.part(contour), 0.0) == "A key of 3 x 3 mm (DIN 6885-1) carries the torque."
    (said,) = remarks(machined, contour, 10.0)
    assert said.startswith("The key DOES NOT CARRY 2 times 10 N·m")
    assert "bolts = {" in said, "what would"
    tight = replace(machined, minimum_wall=quantity(4.5, "mm"))
    (said,) = remarks(tight, contour, 10.0)
    assert said.endswith("no bolts that carry it fit: take a larger bore or a thicker plate")


def test_the_sheet_says_what_carries_the_torque(contour: Contour) -> None:
    part = replace(GROOVED, bolts=BoltCircle(count=4, circle=34e-3, hole=1.7e-3)).part(contour)
    assert carrying_note(part, 14.0).startswith(
        "4 bolts carry 2 times 14 N·m: 412 N each, M1.6 carries 488 N"
    )
    assert carrying_note(part, 25.0).startswith("4 bolts DO NOT CARRY 2 times 25 N·m: 735 N each")
    assert carrying_note(part, 0.0) == "4 bolts carry the torque."
    assert carrying_note(GROOVED.part(contour), 5.0).startswith(
        "Nothing drawn here carries the torque of 5 N·m"
    )
