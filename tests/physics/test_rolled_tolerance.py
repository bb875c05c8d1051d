"""Edges that are cut wrong, rolled over by a circle or on themselves, against what the tolerance says.

Nothing of the package's tolerance is used for the edge: each point is moved along its normal, and the centre
of what rolls, its lever arm by differences and the torque of a spring follow from there.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from nlsdesign.components import Driven, RollerCam, RollingPair, Spring, through, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import PowerTorque, SpreadRules, contour_of_cam
from nlsdesign.design.statics.contour import RollingContour
from nlsdesign.design.tolerance.causes import Cause, WaveCause, spring_causes
from nlsdesign.design.tolerance.made_spring import made_spring
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.quantity import Quantity, quantity
from nlsdesign.model import FlatModel, flatten
from tests.rolled import rolled_on, rolled_over, through_points

ROW = (0.0, 0.0, 0.004, 0.007, 0.005, 0.0, -0.004, -0.005, -0.002)
END, STIFF, STRETCHED, ROLLER = 1.3, 3e3, 6e-3, 4e-3
NUMBERS = {"lever_arm": ROW, "last_angle": END, "changeover": 1e-6}
CAMS = {
    "roller": RollerCam(**NUMBERS, base_radius=0.022, roller_radius=ROLLER),
    "pair": RollingPair(**NUMBERS, base_distance=0.16),
}
TARGET = PowerTorque(coefficient=0.1, exponent=1.0, angle=END)
ANGLES = np.linspace(0.1, 1.2, 12)
CUT = SpreadRules(given={"s.cam.contour": quantity(0.02, "mm")})


def drive(cam: RollerCam | RollingPair) -> FlatModel:
    spring = tie(through(cam, pretension=STRETCHED, k=Spring(stiffness=STIFF)), "shaft")
    return flatten(assembly("a", shaft=Driven(), s=spring))


def moved(cam: RollerCam | RollingPair, cause: WaveCause | None) -> Array:
    """Torque at the angles on an edge that lies off by the cause along its normals."""
    contour = contour_of_cam(cam, points=4001)
    assert isinstance(contour, RollingContour)
    points = contour.points
    if cause is not None:
        error = cause.deviation * np.cos(cause.order * math.pi * contour.angles / END)
        points = points + error[:, None] * contour.normals
    edge = np.vstack([points[:0:-1] * [-1.0, 1.0], points])
    if isinstance(cam, RollerCam):
        steps = np.array([-6e-3, 6e-3])
        heights = [[rolled_over(edge, ROLLER, a + step)[0] for a in ANGLES] for step in (*steps, 0.0)]
        arms = (np.array(heights[1]) - heights[0]) / np.ptp(steps)
        way = np.array(heights[2]) - rolled_over(edge, ROLLER, 0.0)[0]
    else:
        profile = through_points(edge)
        rolled = rolled_on(profile, profile, np.linspace(0.0, 0.05, 300))
        law = make_interp_spline(-rolled.angles, rolled.distances, k=5)
        way, arms = law(ANGLES) - law(0.0), law(ANGLES, 1)
    return STIFF * (STRETCHED + way) * arms


def said(model: FlatModel, causes: tuple[Cause, ...], number: int) -> tuple[Array, Array]:
    """Change of the torque at the angles, of one made spring and to first order."""
    made = made_spring(model, None, target=TARGET, causes=causes, angles=401)
    one = np.eye(len(causes))[number : number + 1]
    rows = made.torques(one)[0] - made.nominal, made.sensitivities[number]
    whole, first = (make_interp_spline(made.angles, row)(ANGLES) for row in rows)
    return whole, first


@pytest.mark.parametrize("kind", CAMS)
def test_what_rolls_on_a_wrong_edge_turns_as_the_tolerance_says(kind: str) -> None:
    cam, model = CAMS[kind], drive(CAMS[kind])
    causes = tuple(each for each in spring_causes(model, None, CUT) if isinstance(each, WaveCause))
    waves = [each for each in causes if ".contour." in each.name]
    assert [each.order for each in waves] == [0, 1, 2]
    for number, cause in enumerate(waves):
        by_edge = moved(cam, cause) - moved(cam, None)
        largest = max(float(np.abs(by_edge).max()), 1e-4)
        for row in said(model, causes, number):
            assert row == pytest.approx(by_edge, abs=0.03 * largest), cause.name
    # A tool of another radius moves both cams of a pair apart and no torque.
    assert (np.abs(said(model, causes, 0)[0]).max() < 1e-9) == (kind == "pair")


def test_a_roller_deviates_as_it_is_declared_or_as_a_bearing() -> None:
    def deviation(radius: Quantity | float) -> dict[str, float]:
        cam = RollerCam(**NUMBERS, base_radius=0.022, roller_radius=radius)
        return {each.name: each.deviation for each in spring_causes(drive(cam), None, SpreadRules())}

    assert deviation(ROLLER)["s.cam.roller_radius"] == pytest.approx(2e-6 / math.sqrt(3.0))
    wide = quantity(4.0, "mm", source="turned by hand", spread=0.01)
    assert deviation(wide)["s.cam.roller_radius"] == pytest.approx(4e-3 * math.log(1.01))
    pair = [each.name for each in spring_causes(drive(CAMS["pair"]), None, SpreadRules())]
    assert not any("radius" in name or "base" in name for name in pair)
