"""Curves that a convex cam cannot make, designed with a roller follower, and the part that is drawn.

Independent roads: the torque of the finished numbers by splines of scipy and ∫T dθ = ½k·e², a circle that is
rolled over the edge as it is read from the DXF, without the library that wrote it.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.components import Assembly, LinearElastic, RollerCam
from nlsdesign.design import (
    CamDesign,
    DesignSettings,
    MachinedRollerCam,
    MaximumPressureAngle,
    MaximumStrain,
    TabulatedTorque,
    design_cam,
    write_design,
)
from nlsdesign.design.statics.contour import RollerContour
from nlsdesign.foundation.quantity import quantity
from tests.cam_cases import CONTOUR, PRETENSION, actuator
from tests.dxf_reading import entities_of, header_of, polylines_of
from tests.rolled import laid_on, way_of

QUICK = DesignSettings(starts=2, draws=0, look_for_size_ranges=False)
HILLS = TabulatedTorque(
    angles=tuple(np.radians([0.0, 5.0, 30.0, 60.0, 89.8])), torques=(0.0, 0.035, 0.07, 0.0, 0.035)
)
"""Wu and Mintchev 2024, Step1_SpringSelector.m: a hill and a valley. Their curve jumps from zero at angle
zero, and to an end stop at 90°; here the jump has 5°, and the end stop is left out."""


def wave(turns: float, last: float = 80.0) -> TabulatedTorque:
    """2·sin(turns·π·θ/θ_end) N·m: it changes its sign where turns > 1."""
    angles = np.linspace(0.0, math.radians(last), 41)
    return TabulatedTorque(
        angles=tuple(angles), torques=tuple(2.0 * np.sin(np.pi * turns * angles / angles[-1]))
    )


def with_roller() -> Assembly:
    cam = RollerCam(
        lever_arm=(0.0, *[0.005] * 7), last_angle=1.0, elements=2.0, base_radius=0.03, roller_radius=0.005
    )
    machine = actuator(LinearElastic(modulus=quantity(1.0, "MPa")), pretension=6e-3)
    return machine.with_part("spring.cam", cam)


@pytest.fixture(scope="module")
def hills() -> CamDesign:
    machine = nls.declare(nls.load_deck("roller_cam_drive"))
    return design_cam(machine, target=HILLS, free=PRETENSION, settings=QUICK)


@pytest.fixture(scope="module")
def signs() -> CamDesign:
    return design_cam(
        with_roller(), target=wave(1.3), free=PRETENSION, keep=[MaximumStrain(2.0)], settings=QUICK
    )


def by_hand(cam: RollerCam, angles: np.ndarray, stiffness: float, pretension: float) -> np.ndarray:
    """N·k·(e₀ + ∫h)·h of the declared numbers, outside the change of sides."""
    law = way_of(cam)
    taken = np.array([law.integrate(0.0, angle) for angle in angles])
    return cam.elements.number * stiffness * (pretension + taken) * law(angles)


def test_the_published_hills_are_met_exactly(hills: CamDesign) -> None:
    """With the spring of the authors; the torque is evaluated from the declared numbers by hand."""
    cam, angles = hills.actuator["spring.cam"], np.linspace(0.05, HILLS.last_angle, 400)
    assert isinstance(cam, RollerCam)
    pretension = hills.values["spring.pretension"].number
    torques = by_hand(cam, angles - cam.changeover.number, 1186.0, pretension)
    errors = torques - HILLS.torque(angles)
    assert np.sqrt(np.mean(errors**2)) < 0.005 * 0.07
    assert hills.met
    assert hills.rms < 0.005 * HILLS.largest
    assert "TabulatedTorque, up to 89.8 deg, at most 0.07 N·m" in str(hills), "the hill is at 30 deg"
    # By energy: what 2 coils take up is the area below the curve.
    stretched = hills.curves.extensions
    stored = 1186.0 * (stretched[-1] ** 2 - stretched[0] ** 2)
    assert stored == pytest.approx(float(HILLS.energy(HILLS.last_angle)), rel=2e-3)


def test_a_torque_that_changes_its_sign_is_met(signs: CamDesign) -> None:
    assert signs.met
    assert signs.rms < 0.005 * signs.target.largest
    assert signs.contour.lever_arms.min() < -2e-3
    assert signs.check.torques[-1] < -1.5


def test_the_limits_that_follow_from_the_roller_hold(signs: CamDesign, hills: CamDesign) -> None:
    for design in (signs, hills):
        contour = design.contour
        assert isinstance(contour, RollerContour)
        assert np.degrees(np.abs(contour.pressure_angles)).max() < 30.01
        rho, roller = contour.radii_of_curvature, contour.roller_radius
        assert rho[rho > 0.0].min() > 0.999 * roller
        assert -rho[rho < 0.0].max() > 1.249 * roller
        kinds = {state.limit for state in design.limits}
        assert kinds >= {"MaximumPressureAngle", "MinimumRadiusOfCurvature", "MinimumHollowRadius"}


def test_the_optimiser_sees_the_edge_that_is_drawn(signs: CamDesign) -> None:
    """Radii of curvature and distances from the axis at the nodes, there in symbols, here in numbers."""
    seen, contour = signs.curves, signs.contour
    at = np.searchsorted(contour.angles, seen.angles - 1e-9)
    assert contour.angles[at] == pytest.approx(seen.angles, abs=1e-9)
    assert 1.0 / seen.radii_of_curvature == pytest.approx(1.0 / contour.radii_of_curvature[at], rel=1e-6)
    assert seen.radii == pytest.approx(contour.radii[at], rel=1e-9)


@pytest.mark.slow
def test_a_smaller_pressure_angle_takes_a_larger_cam() -> None:
    def radius(degrees: float) -> float:
        keep = [MaximumStrain(2.0), MaximumPressureAngle(math.radians(degrees))]
        design = design_cam(with_roller(), target=wave(1.3), free=CONTOUR, keep=keep, settings=QUICK)
        assert design.met
        (state,) = (each for each in design.limits if each.limit == "MaximumPressureAngle")
        assert math.degrees(state.value) <= degrees * 1.0001
        return design.values["spring.cam.base_radius"].number

    steep, flat = radius(30.0), radius(12.0)
    assert flat > 1.5 * steep


def drawn(design: CamDesign, folder: Path) -> str:
    written = write_design(design, folder)
    assert not any("no machined part" in remark for remark in written.remarks)
    return (folder / "cam.dxf").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.long_cases("signs")
@pytest.mark.parametrize("which", ["hills", "signs"])
def test_a_circle_rolled_over_the_drawn_edge_gives_way_and_torque(
    which: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    design: CamDesign = request.getfixturevalue(which)
    contour = design.contour
    assert isinstance(contour, RollerContour)
    text = drawn(design, tmp_path)
    assert header_of(text)["$INSUNITS"].strip() == "4", "drawing units are not millimetres"
    (edge,) = polylines_of(text, "EDGE")
    end = float(contour.angles[-1])
    angles = np.linspace(-end, end, 121)
    heights, arms = np.array([laid_on(edge, 1e3 * contour.roller_radius, angle) for angle in angles]).T
    claimed = 1e3 * np.interp(np.abs(angles), contour.angles, contour.centre_radii)
    assert heights == pytest.approx(claimed, abs=1e-3 * float(np.ptp(claimed)))
    # The torque of that way and of the direction in which the edge pushes the roller.
    stiffness = 1186.0 if which == "hills" else 1e6 * 1e-4 / 12.5e-3
    extension = design.values["spring.pretension"].number + 1e-3 * (heights - heights[60])
    torques = 2.0 * stiffness * extension * 1e-3 * arms
    arms = np.sign(angles) * np.interp(np.abs(angles), contour.angles, contour.lever_arms)
    ways = 1e-3 * (claimed - claimed[60])
    promised = 2.0 * stiffness * (design.values["spring.pretension"].number + ways) * arms
    assert torques == pytest.approx(promised, abs=1e-3 * design.target.largest)
    wanted = np.sign(angles) * design.target.torque(np.abs(angles))
    assert np.sqrt(np.mean((torques - wanted) ** 2)) < 0.005 * design.target.largest


@pytest.mark.slow
def test_the_drawing_holds_the_way_the_roller_and_the_line_of_the_follower(
    signs: CamDesign, tmp_path: Path
) -> None:
    text, contour = drawn(signs, tmp_path), signs.contour
    assert isinstance(contour, RollerContour)
    way, *lines = polylines_of(text, "PITCH")
    assert np.hypot(*way[:, :2].T).max() == pytest.approx(1e3 * contour.centre_radii.max(), abs=1e-3)
    circles = [each for each in entities_of(text) if each.kind == "CIRCLE" and each.layer == "ROLLER"]
    assert [float(each.numbers(40)[0]) for each in circles] == pytest.approx([5.0] * 3)
    first = np.array([circles[0].numbers(10)[0], circles[0].numbers(20)[0]])
    assert first == pytest.approx([0.0, 1e3 * contour.centre_radii[0]], abs=1e-5)
    assert len(lines) == 3
    assert all(line[0, :2] == pytest.approx([0.0, 0.0]) for line in lines)


@pytest.mark.slow
def test_the_part_and_its_page_say_roller(signs: CamDesign, tmp_path: Path) -> None:
    text = drawn(signs, tmp_path)
    assert "for a roller of radius 5 mm" in text
    csv = (tmp_path / "cam_centre_line.csv").read_text(encoding="utf-8")
    assert "centre of a roller of radius 5 mm" in csv
    machined = MachinedRollerCam(roller_radius=quantity(5.0, "mm"), hub_bore=quantity(4.0, "mm"))
    part = machined.part(signs.contour)
    assert part.counterpart == "roller"
    assert [hole.name for hole in part.holes] == ["hub bore"]
    assert part.number("narrowest_hollow") > 6.2e-3
