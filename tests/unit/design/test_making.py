"""What a drawing says of how the part is made, and of what carries its torque."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.design import (
    BoltCircle,
    Contour,
    MachinedCam,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
    contour_from_lever_arm,
)
from nlsdesign.design.drawing.making import Mounting, process_of
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.quantity import quantity

CABLE = quantity(0.45, "mm", source="example")
GROOVED = MachinedTwoSidedCam(cable_radius=CABLE, groove_depth=4e-3, hub_bore=6e-3)


@pytest.fixture
def contour() -> Contour:
    nodes = np.linspace(0.0, 1.35, 8)
    radii = 1e-3 * np.array([2.6, 4.0, 9.0, 12.6, 12.0, 8.0, 6.0, 5.0])
    return contour_from_curvature(nodes, radii, first_slope=8e-3, anchor_distance=30e-3)


def remarks(machined: MachinedCam, contour: Contour, torque: float) -> list[str]:
    return list(Mounting(machined, contour, machined.part(contour), torque).remarks())[1:]


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
