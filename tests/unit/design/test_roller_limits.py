"""What a cam with a roller is asked for, what it is refused, and the words in which it is said."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import Assembly, LinearElastic, RollerCam, SlidingGuide
from nlsdesign.design import (
    AtMost,
    DesignSettings,
    LeastMass,
    MachinedRollerCam,
    MachinedTwoSidedCam,
    MaximumCamRadius,
    MaximumPressureAngle,
    MaximumStrain,
    MinimumHollowRadius,
    MinimumRadiusOfCurvature,
    TabulatedTorque,
    ToleranceQuantile,
    contour_of_cam,
    design_cam,
    job_of,
    write_drawings,
)
from nlsdesign.design.statics.contour import RollerContour, roller_contour
from nlsdesign.foundation.errors import ArrangementError, InfeasibleError, NlsError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.live.gallery import question_of
from tests.cam_cases import CONTOUR, KEEP, PRETENSION, TARGET, actuator

QUICK = DesignSettings(starts=2, draws=0, look_for_size_ranges=False, look_for_remedies=False)
STRAIN = MaximumStrain(2.0)
CAM = RollerCam(
    lever_arm=(0.0, *[0.005] * 7), last_angle=1.0, elements=2.0, base_radius=0.03, roller_radius=0.005
)
SOFT = LinearElastic(modulus=quantity(1.0, "MPa"))


def machine(cam: RollerCam = CAM) -> Assembly:
    return actuator(SOFT, pretension=6e-3).with_part("spring.cam", cam)


def hill(last: float = 80.0, turns: float = 1.0) -> TabulatedTorque:
    """Rise and fall, with one turn to nothing."""
    angles = np.linspace(0.0, math.radians(last), 41)
    torques = np.maximum(2.0 * np.sin(np.pi * turns * angles / angles[-1]), 0.0)
    return TabulatedTorque(angles=tuple(angles), torques=tuple(torques))


def edge(base: float, roller: float) -> RollerContour:
    """Twice up and down by 1 mm within a radian."""
    at = np.linspace(0.0, 1.0, 401)
    rate = 4.0 * np.pi
    way = (
        5e-4 * (1.0 - np.cos(rate * at)),
        5e-4 * rate * np.sin(rate * at),
        5e-4 * rate**2 * np.cos(rate * at),
    )
    return roller_contour(at, way, base_radius=base, roller_radius=roller)


@pytest.mark.parametrize("limit", [MaximumPressureAngle(0.5), MinimumHollowRadius(6e-3)], ids=repr)
def test_limits_of_a_roller_are_refused_for_a_cable(limit: MaximumPressureAngle) -> None:
    with pytest.raises(ArrangementError, match=r"is of a cam with a roller.*RollerCam"):
        design_cam(actuator(SOFT), target=TARGET, free=CONTOUR, keep=[limit], settings=QUICK)


def test_a_hollow_narrower_than_the_roller_is_refused() -> None:
    with pytest.raises(ValueRangeError, match=r"must exceed that of the roller, 5 mm.*ask for 6\.25 mm"):
        design_cam(machine(), target=hill(), free=CONTOUR, keep=[MinimumHollowRadius(5e-3)], settings=QUICK)


def test_an_undercut_is_named_with_its_place_and_the_roller_that_mends_it(tmp_path: Path) -> None:
    contour = edge(12e-3, 5e-3)
    with pytest.raises(ValueRangeError, match="is undercut") as caught:
        MachinedRollerCam(roller_radius=5e-3).part(contour)
    (first, last), (at,) = (
        re.findall(r"from ([0-9.]+)° to ([0-9.]+)°", str(caught.value))[0],
        re.findall(r"mm at ([0-9.]+)°", str(caught.value)),
    )
    # The crests lie where the cosine is least, at a quarter and three quarters of a radian.
    assert float(first) < math.degrees(0.25) < float(last)
    assert min(abs(float(at) - math.degrees(each)) for each in (0.25, 0.75)) < 0.2
    (most,) = re.findall(r"roller of at most ([0-9.]+) mm", str(caught.value))
    smaller = 0.99e-3 * float(most)
    part = MachinedRollerCam(roller_radius=smaller, edge_tolerance=1e-6).part(edge(12e-3, smaller))
    assert part.number("sharpest_edge") > 0.0
    with pytest.raises(ValueRangeError, match="is undercut"):
        MachinedRollerCam(roller_radius=5e-3).part(edge(12e-3, 1.01e-3 * float(most)))


def test_a_cam_with_a_roller_is_not_drawn_for_a_cable_nor_the_other_way_round() -> None:
    with pytest.raises(ArrangementError, match="is no edge for a roller"):
        MachinedRollerCam(roller_radius=5e-3).part(contour_of_cam(actuator(SOFT)["spring.cam"]))
    with pytest.raises(NlsError):
        MachinedTwoSidedCam(cable_radius=5e-4).part(edge(20e-3, 2e-3))


def test_without_a_part_the_edge_is_drawn_alone(tmp_path: Path) -> None:
    _, svg, dxf = write_drawings(tmp_path, edge(20e-3, 2e-3))
    assert "edge under the roller" in dxf.read_text(encoding="utf-8")
    assert svg.read_text(encoding="utf-8").count("<path") == 5, "one outline, three lines, the axis"


def test_goals_over_the_spreads_are_refused_and_a_design_has_its_tolerance() -> None:
    asked = {"target": hill(), "free": CONTOUR, "keep": [STRAIN]}
    with pytest.raises(ArrangementError, match="has a roller, which goals over the spreads do not know"):
        design_cam(machine(), **asked, goals=[ToleranceQuantile()], settings=QUICK)
    design = design_cam(machine(), **asked, settings=replace(QUICK, draws=20))
    assert design.tolerance is not None
    alone = {each.cause.name: each.alone for each in design.tolerance.causes}
    # A slope of the edge makes the torque, its place does not.
    assert alone["spring.cam.contour.wave"] > 2.0 * alone["spring.cam.contour.offset"] > 0.0
    assert alone["spring.cam.roller_radius"] < 0.2 * alone["spring.cam.contour.wave"]


def test_the_live_page_refuses_a_roller_with_the_next_step() -> None:
    with pytest.raises(ArrangementError, match="which the live page does not design yet -> design it with"):
        question_of(machine(), "rolling")


@pytest.mark.slow
def test_what_the_guide_bears_is_said_with_its_friction() -> None:
    def remark(cam: RollerCam) -> str:
        design = design_cam(machine(cam), target=hill(), free=CONTOUR, keep=[STRAIN], settings=QUICK)
        (said,) = (each for each in design.remarks if "guide of the follower" in each)
        forces = 2.0 * np.interp(design.contour.angles, design.curves.angles, design.curves.forces)
        contour = design.contour
        assert isinstance(contour, RollerContour)
        slopes = np.abs(contour.lever_arms) / contour.centre_radii
        (newtons,) = re.findall(r"up to ([0-9.]+) N sideways", said)
        assert float(newtons) == pytest.approx(float(np.max(forces * slopes)), rel=0.01)
        steep = float(slopes.max())
        for friction, share in re.findall(r"at ([0-9.]+) up to ([0-9.]+) %", said):
            exact = 100.0 * (1.0 / (1.0 - float(friction) * steep) - 1.0)
            assert float(share) == pytest.approx(exact, rel=0.06)
        return said

    assert "not declared (SlidingGuide), at 0.05" in remark(CAM)
    rubbing = replace(CAM, guide=SlidingGuide(guide_friction=0.11, guide_creep_speed=1e-3))
    assert "as declared, at 0.11 up to" in remark(rubbing)


def test_a_contour_that_is_held_is_judged_by_the_same_limits() -> None:
    """Only the pretension is free; base radius and edge stay, and the pressure angle is that of the deck."""
    row = (-0.002, 0.0, 0.002, 0.0035, 0.004, 0.004, 0.0035, 0.003)
    made, target = replace(CAM, lever_arm=row), hill(54.0)
    held = design_cam(machine(made), target=target, free=["spring.pretension"], keep=[STRAIN], settings=QUICK)
    assert held.values.keys() == {"spring.pretension"}
    (state,) = (each for each in held.limits if each.limit == "MaximumPressureAngle")
    contour = contour_of_cam(made, last_angle=math.radians(54.0))
    assert isinstance(contour, RollerContour)
    assert state.value == pytest.approx(float(np.max(contour.pressure_angles)), rel=1e-3)


def test_a_corner_of_a_declared_edge_is_named_with_what_would_have_to_give() -> None:
    """The lever arm of this cam begins with a jump: a notch in which the roller touches two places."""
    words = r"\(MinimumHollowRadius\): cannot be kept.*the hollow edge >= 6\.25 mm would have to give by"
    with pytest.raises(InfeasibleError, match=words):
        design_cam(machine(), target=hill(54.0), free=["spring.pretension"], keep=[STRAIN], settings=QUICK)


def test_a_limit_on_a_radius_is_held_as_a_curvature_and_read_as_a_radius() -> None:
    keep = [STRAIN, MinimumRadiusOfCurvature(8e-3), MaximumPressureAngle(1.0)]
    design = design_cam(machine(), target=hill(), free=CONTOUR, keep=keep, settings=QUICK)
    (state,) = (each for each in design.limits if each.limit == "MinimumRadiusOfCurvature")
    assert (state.upper, state.bound, state.active) == (False, pytest.approx(8e-3), True)
    assert "radius of the convex edge 8 mm >= 8 mm (MinimumRadiusOfCurvature)  ACTIVE" in str(state)
    rho = design.contour.radii_of_curvature
    assert rho[rho > 0.0].min() == pytest.approx(8e-3, rel=2e-3)


def test_the_mass_is_that_of_the_area_below_the_edge() -> None:
    mass = LeastMass(rubber_density=1000.0, plate_thickness=1e-3, plate_density=2e3)
    keep = [STRAIN, AtMost(mass, 1.0)]
    design = design_cam(machine(), target=hill(), free=CONTOUR, keep=keep, settings=QUICK)
    x, y = np.vstack([design.contour.points, [[0.0, 0.0]]]).T
    both_sides = abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
    (state,) = (each for each in design.limits if each.limit == "AtMost")
    assert state.value == pytest.approx(1000.0 * design.rubber_volume + 2.0 * both_sides, rel=1e-3)


@pytest.mark.slow
def test_a_cable_that_lifts_off_is_told_where_and_that_a_roller_does_not() -> None:
    """The error that is promised of the roller is what its design leaves."""
    settings, target = replace(QUICK, look_for_remedies=True, starts=1), hill(turns=0.6)
    missed = design_cam(
        actuator(SOFT, pretension=6e-3), target=target, free=CONTOUR, keep=[STRAIN], settings=settings
    )
    assert missed.miss is not None
    hollow, cure = (
        next(each for each in missed.miss.advice if words in each)
        for words in ("would have to be hollow from", "take a cam with a roller follower (RollerCam)")
    )
    assert "a taut cable lifts off there; the roller of a follower" in hollow
    assert missed.miss.remedies is not None
    (other,) = (each for each in missed.miss.remedies.others if "roller" in each.words)
    assert str(other) in cure
    then = design_cam(other.machine, target=target, free=CONTOUR, keep=[STRAIN], settings=QUICK)
    assert then.met
    assert then.predicted_rms == pytest.approx(other.error, abs=1e-4 * target.largest)


@pytest.mark.slow
def test_a_jump_is_named_as_such() -> None:
    angles = tuple(np.radians([0.0, 0.01, 40.0, 80.0]))
    step = TabulatedTorque(angles=angles, torques=(0.0, 1.5, 2.0, 2.0))
    missed = design_cam(machine(), target=step, free=CONTOUR, keep=[STRAIN], settings=QUICK)
    assert missed.miss is not None
    assert missed.miss.binding == ("radius of the hollow edge (MinimumHollowRadius)",)
    assert any("spread its jumps over 2° or more" in each for each in missed.miss.advice)


def test_a_design_file_names_limits_and_sizes_of_a_roller(tmp_path: Path) -> None:
    text = """
free = ["spring.cam.contour"]
[target]
PowerTorque = {coefficient = 1.0, exponent = 1.0, angle = "60 deg"}
[limits]
MaximumPressureAngle = {angle = "25 deg"}
MinimumHollowRadius = {radius = "7 mm"}
MaximumCamRadius = {radius = "40 mm"}
[drawing]
hub_bore = "6 mm"
"""
    job = job_of(text, tmp_path / "design.toml")
    assert MaximumPressureAngle(math.radians(25.0)) in job.keep
    assert MinimumHollowRadius(7e-3) in job.keep
    assert MaximumCamRadius(40e-3) in job.keep
    assert isinstance(job.drawing, dict)


def test_a_cable_still_gets_its_own_limits(tmp_path: Path) -> None:
    design = design_cam(
        actuator(SOFT, pretension=6e-3), target=TARGET, free=PRETENSION, keep=KEEP, settings=QUICK
    )
    assert not {"MaximumPressureAngle", "MinimumHollowRadius"} & {each.limit for each in design.limits}
