"""Curves that no cable can make, designed as cams that roll on one another, and their part.

Independent roads: profiles of the authors' own program, the torque of the finished numbers by splines of
scipy, and the edge as it is read from the DXF, rolled on itself by equal arcs and opposite tangents.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.components import Assembly, LinearElastic, RollingPair
from nlsdesign.design import (
    CamDesign,
    DesignSettings,
    MachinedPair,
    MaximumCamRadius,
    MaximumPressureAngle,
    MaximumStrain,
    TabulatedTorque,
    design_cam,
    write_design,
)
from nlsdesign.design.statics.contour import PairContour
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.live.gallery import question_of
from nlsdesign.presentation.figures.cam_motion import numbers_at
from nlsdesign.presentation.report import write_design_report
from tests.cam_cases import CONTOUR, PRETENSION, actuator
from tests.dxf_reading import header_of, polylines_of
from tests.rolled import along_edge, rolled_on, way_of
from tests.undrawn import without_drawing

QUICK = DesignSettings(starts=4, draws=0, look_for_size_ranges=False, look_for_remedies=False)
RATE, LENGTH, TRAVEL = 1186.0, 14.4e-3, 15.87e-3
"""Of one coil 5/1/1; Wu and Mintchev 2024, README.md."""
HILLS = TabulatedTorque(
    angles=tuple(np.radians([0.0, 0.2, 30.0, 60.0, 89.8])), torques=(0.0, 0.035, 0.07, 0.0, 0.035)
)
"""Wu and Mintchev 2024, Step1_SpringSelector.m, Example on repository, with its jump at angle zero."""
FALL = TabulatedTorque(angles=tuple(np.radians([0.0, 0.2, 90.0])), torques=(0.0, 0.125, 0.0))
"""Same file of 2025, Example 4: a jump to the largest torque, then a fall to zero."""


def wave(turns: float, last: float = 80.0) -> TabulatedTorque:
    """2·sin(turns·π·θ/θ_end) N·m: it changes its sign where turns > 1."""
    angles = np.linspace(0.0, math.radians(last), 41)
    torques = 2.0 * np.sin(np.pi * turns * angles / angles[-1])
    return TabulatedTorque(angles=tuple(angles), torques=tuple(torques))


def rubber_pair() -> Assembly:
    cam = RollingPair(lever_arm=(0.0, *[0.005] * 7), last_angle=1.0, elements=2.0, base_distance=0.08)
    machine = actuator(LinearElastic(modulus=quantity(1.0, "MPa")), pretension=6e-3)
    return machine.with_part("spring.cam", cam)


@pytest.fixture(scope="module")
def hills() -> CamDesign:
    machine = nls.declare(nls.load_deck("rolling_pair_drive"))
    return design_cam(machine, target=HILLS, free=PRETENSION, settings=QUICK)


@pytest.fixture(scope="module")
def signs() -> CamDesign:
    keep = [MaximumStrain(2.0)]
    return design_cam(rubber_pair(), target=wave(1.3), free=PRETENSION, keep=keep, settings=QUICK)


def published_profile(target: TabulatedTorque, way_at_end: float) -> np.ndarray:
    """Step2_ERCdesigner.m: half the length of two coils of which the energy is that of the curve, turned."""
    angles = np.linspace(math.radians(0.2), target.last_angle, 2000)
    work = target.energy(angles) / 2.0
    ways = np.sqrt(way_at_end**2 - 2.0 * (work[-1] - work) / RATE)
    halves, arms = (LENGTH + ways) / 2.0, target.torque(angles) / (2.0 * RATE * ways)
    directions = angles / 2.0
    normals = np.column_stack([np.sin(directions), np.cos(directions)])
    along = normals[:, ::-1] * [1.0, -1.0]
    return halves[:, None] * normals + arms[:, None] * along


@pytest.mark.slow
def test_the_published_joint_comes_out_with_its_own_coil(hills: CamDesign) -> None:
    """The jump at zero is a facet; the cam is that of the authors' program with the coil as far stretched."""
    cam, contour = hills.actuator["spring.cam"], hills.contour
    assert isinstance(cam, RollingPair)
    assert isinstance(contour, PairContour)
    assert hills.met
    assert hills.rms < 0.005 * HILLS.largest
    assert contour.lever_arms[0] > 5e-4
    stretched = float(hills.curves.extensions.max())
    assert LENGTH + float(hills.curves.extensions[0]) == pytest.approx(contour.centre_radii[0], rel=1e-6)
    theirs = published_profile(HILLS, stretched)
    away = [float(np.min(np.hypot(*(theirs - point).T))) for point in contour.points[5::7]]
    assert max(away) < 5e-5


def test_its_page_speaks_of_no_cable_and_of_no_torque_where_it_jumps(
    hills: CamDesign, tmp_path: Path
) -> None:
    with without_drawing():
        page = write_design_report(tmp_path / "report.html", hills, deck="rolling_pair_drive").read_text(
            "utf8"
        )
    assert "element force" in page
    assert not any(each in page for each in ("cable force", "cable without", "rubber is drawn"))
    assert "TabulatedTorque, up to 89.8 deg, at most 0.07 N·m. The design meets its target" in page
    assert numbers_at(hills, 0.0).endswith("torque begins here")
    assert numbers_at(hills, float(hills.check.angles[-1])).endswith(" 35 mN·m")


@pytest.mark.slow
def test_a_curve_that_falls_to_zero_is_met_with_its_jump() -> None:
    coil = {"spring.coil.free_length": 19.47e-3, "spring.coil.largest_extension": 20e-3}
    machine = nls.declare(nls.load_deck("rolling_pair_drive")).with_values(coil)
    design = design_cam(machine, target=FALL, free=PRETENSION, settings=QUICK)
    assert design.met
    # The jump itself has the angle over which the lever arm changes sides.
    behind = design.check.angles > math.radians(1.0)
    assert np.abs(design.check.errors[behind]).max() < 0.005 * FALL.largest
    arms = design.contour.lever_arms
    assert arms[0] > 0.9 * arms.max() > 0.0
    assert arms[-1] == pytest.approx(0.0, abs=0.01 * arms.max())


def test_a_torque_that_changes_its_sign_is_met_by_a_convex_profile(signs: CamDesign) -> None:
    cam = signs.actuator["spring.cam"]
    assert isinstance(cam, RollingPair)
    assert signs.met
    assert signs.contour.lever_arms.min() < -2e-3
    assert signs.contour.radii_of_curvature.min() > 0.999e-3
    law, angles = way_of(cam), np.linspace(0.05, signs.target.last_angle, 200)
    taken = np.array([law.integrate(0.0, angle - cam.changeover.number) for angle in angles])
    force = 1e6 * 1e-4 / 12.5e-3 * (signs.values["spring.pretension"].number + taken)
    torques = 2.0 * force * law(angles - cam.changeover.number)
    assert np.sqrt(np.mean((torques - signs.target.torque(angles)) ** 2)) < 0.005 * 2.0


def test_a_pair_that_nothing_keeps_small_says_how_large_it_is(hills: CamDesign, signs: CamDesign) -> None:
    assert not any("size of this pair" in remark for remark in hills.remarks), "1.06 times its coil"
    (said,) = (remark for remark in signs.remarks if "size of this pair" in remark)
    distance = signs.values["spring.cam.base_distance"].number
    assert f"its pivots are {1e3 * distance:.3g} mm apart" in said
    limit = float(said.partition('radius = "')[2].partition(" mm")[0])
    assert 1e3 * signs.contour.radii.max() > limit
    assert "MaximumCamRadius" in said


def test_the_optimiser_sees_the_edge_that_is_drawn(signs: CamDesign) -> None:
    seen, contour = signs.curves, signs.contour
    at = np.searchsorted(contour.angles, seen.angles - 1e-9)
    assert seen.radii_of_curvature == pytest.approx(contour.radii_of_curvature[at], abs=1e-9)
    assert seen.radii[1:] == pytest.approx(contour.radii[at][1:], rel=1e-9)
    assert seen.extensions - seen.extensions[0] == pytest.approx(contour.taken_lengths[at], abs=1e-9)


def drawn(design: CamDesign, folder: Path) -> str:
    written = write_design(design, folder)
    assert not any("no machined part" in remark for remark in written.remarks)
    return (folder / "cam.dxf").read_text(encoding="utf-8")


@pytest.mark.long_cases("hills")
@pytest.mark.parametrize("which", ["hills", "signs"])
def test_the_drawn_edge_rolls_on_itself_and_gives_distance_and_torque(
    which: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    design: CamDesign = request.getfixturevalue(which)
    contour = design.contour
    assert isinstance(contour, PairContour)
    text = drawn(design, tmp_path)
    assert header_of(text)["$INSUNITS"].strip() == "4", "drawing units are not millimetres"
    (edge,), (partner,) = polylines_of(text, "EDGE"), polylines_of(text, "PARTNER")
    curve, last = along_edge(edge), 1e3 * contour.points[-1] @ [1.0, 1.0j]
    arcs = np.linspace(0.0, 2.0 * abs(last), 20001)
    arcs = np.linspace(0.0, arcs[np.argmin(np.abs(curve(arcs)[0] - last))], 60)
    rolled = rolled_on(curve, curve, arcs)
    end = float(contour.angles[-1])
    claimed = 1e3 * np.interp(-rolled.angles, contour.angles, contour.centre_radii)
    travel = 1e3 * float(np.ptp(contour.centre_radii))
    assert -rolled.angles[-1] == pytest.approx(end, rel=1e-3)
    assert rolled.distances == pytest.approx(claimed, abs=1e-3 * travel)
    stiffness = RATE if which == "hills" else 1e6 * 1e-4 / 12.5e-3
    stretched = design.values["spring.pretension"].number + 1e-3 * (rolled.distances - rolled.distances[0])
    torques = -2.0 * stiffness * stretched * 1e-3 * rolled.arms
    # While the cams lie on their facets the torque is whatever turns them off.
    wanted, beyond = design.target.torque(-rolled.angles), -rolled.angles > math.radians(0.3)
    assert np.sqrt(np.mean((torques - wanted)[beyond] ** 2)) < 1e-3 * design.target.largest
    arms = 1e3 * np.interp(-rolled.angles, contour.angles, contour.lever_arms)
    promised = 2.0 * stiffness * stretched * 1e-3 * arms
    assert torques[beyond] == pytest.approx(promised[beyond], abs=1e-3 * design.target.largest)
    # By virtual work: what the element has stored since the first node is the area below the curve.
    first = int(np.argmax(-rolled.angles > math.radians(3.0)))
    stored, work = stiffness * stretched**2, design.target.energy(-rolled.angles)
    assert (stored - stored[first])[first:] == pytest.approx(
        (work - work[first])[first:], abs=1e-3 * float(work.max())
    )
    assert np.all(np.abs(torques[~beyond]) < torques[beyond][0] + 1e-6)
    # The other cam is the same edge turned by half a turn about the middle between the pivots.
    assert partner[:, :2] == pytest.approx([0.0, rolled.distances[0]] - edge[:, :2], abs=2e-5)


def test_what_does_not_fit_a_pair_is_named(signs: CamDesign) -> None:
    part = MachinedPair(hub_bore=quantity(3.0, "mm")).part(signs.contour)
    assert part.counterpart == "equal cam"
    assert [hole.name for hole in part.holes] == ["hub bore"]
    with pytest.raises(ArrangementError, match="does not roll on its mirror image"):
        MachinedPair().part(signs.contour.edge)  # type: ignore[attr-defined]
    with pytest.raises(ArrangementError, match="another cam that rolls on it, which the live page does not"):
        question_of(rubber_pair(), "rolling")
    with pytest.raises(ArrangementError, match="is of a cam with a roller, which this is not"):
        design_cam(
            rubber_pair(), target=wave(1.3), free=CONTOUR, keep=[MaximumPressureAngle(0.5)], settings=QUICK
        )


@pytest.mark.slow
def test_a_pair_that_is_too_small_for_its_curve_says_what_binds() -> None:
    keep = [MaximumStrain(2.0), MaximumCamRadius(12e-3)]
    missed = design_cam(rubber_pair(), target=wave(1.3), free=CONTOUR, keep=keep, settings=QUICK)
    assert missed.miss is not None
    assert missed.active_limits[:2] == ("MaximumCamRadius", "MinimumRadiusOfCurvature")
