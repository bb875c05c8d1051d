"""A cam with a roller follower, by other roads than its law.

Independent roads: splines of scipy, the balance of forces on follower and cam at the point of contact of a
circle that is laid on the edge, and powers by Simpson's rule.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.optimize import minimize_scalar

from nlsdesign.components import Driven, RollerCam, SlidingGuide, Spring, through, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import contour_of_cam
from nlsdesign.design.statics.contour import RollerContour
from nlsdesign.foundation.errors import NlsError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.rolled import balance, rolled_over, way_of

ROW = (0.0, 0.0, 0.004, 0.007, 0.005, 0.0, -0.004, -0.005, -0.002)
END, BASE, ROLLER, STIFF, PRESSED, FRICTION = 1.3, 0.022, 0.004, 3e3, 6e-3, 0.2
NUMBERS = {"lever_arm": ROW, "last_angle": END, "base_radius": BASE, "roller_radius": ROLLER}
SMOOTH = RollerCam(**NUMBERS, changeover=1e-6)
RUBBING = RollerCam(
    **NUMBERS, changeover=1e-6, guide=SlidingGuide(guide_friction=FRICTION, guide_creep_speed=1e-5)
)


def drive(cam: RollerCam) -> FlatModel:
    spring = tie(through(cam, pretension=PRESSED, k=Spring(stiffness=STIFF)), "shaft")
    return flatten(assembly("a", shaft=Driven(), s=spring))


def test_extension_and_lever_arm_are_those_of_a_spline_on_both_sides() -> None:
    law, model = way_of(SMOOTH), drive(SMOOTH)
    assert law(np.linspace(0.0, END, 200)).min() < -3e-3, "the lever arm changes its sign"
    for angle in (0.1, 0.45, 0.9, 1.25, 1.3):
        for side in (1.0, -1.0):
            found = model.evaluate([], [side * angle, 0.0])
            assert found["s.k.extension"] - PRESSED == pytest.approx(law.integrate(0.0, angle), abs=1e-7)
            assert found["s.cam.lever_arm_now"] == pytest.approx(side * float(law(angle)), abs=1e-7)


@pytest.mark.parametrize("friction", [0.0, FRICTION, -FRICTION], ids=["at rest", "lifted", "let down"])
@pytest.mark.parametrize("angle", [0.2, 0.5, 1.0, 1.25, -0.5, -1.0])
def test_the_torque_balances_the_follower_at_its_point_of_contact(angle: float, friction: float) -> None:
    """Nothing is asked of the law but where the roller's centre is; the normal is that of its way."""
    law = way_of(SMOOTH)

    def centre(at: float) -> np.ndarray:
        """In the resting frame, of the cam as it is turned now: the follower's line is y at ``angle``."""
        rho = BASE + law.integrate(0.0, abs(at))
        return rho * np.array([math.sin(at - angle), math.cos(at - angle)])

    step = 1e-6
    tangent = (centre(angle + step) - centre(angle - step)) / (2.0 * step)
    normal = np.array([-tangent[1], tangent[0]]) / np.hypot(*tangent)
    pressed = STIFF * (PRESSED + law.integrate(0.0, abs(angle)))
    by_hand = balance(centre(angle), normal, ROLLER, pressed, friction)
    arm = math.copysign(1.0, angle) * float(law(abs(angle)))
    # Turned so that the follower is lifted, or let down.
    speed = 0.0 if friction == 0.0 else 10.0 * math.copysign(1.0, friction) * math.copysign(1.0, arm)
    found = drive(RUBBING).evaluate([], [angle, speed])
    # What resists the angle is positive, what turns anticlockwise positive in the picture: the cam is turned
    # anticlockwise, so that the two are opposite.
    assert found["s.torque"] == pytest.approx(-by_hand.torque, rel=2e-3)
    assert abs(by_hand.side) == pytest.approx(by_hand.contact * abs(normal[0]), rel=1e-9)


def test_the_work_put_in_is_stored_or_rubbed_away() -> None:
    """∫T·ω dt = ½k·(e² − e₀²) + ∫µ·|side force|·|dx/dt| dt, the side force from the balance of forces."""
    model, law = drive(RUBBING), way_of(RUBBING)
    turning = {
        "shaft.angle": lambda t: 0.65 * (1.0 - math.cos(2.0 * t)),
        "shaft.speed": lambda t: 1.3 * math.sin(2.0 * t),
    }
    run = simulate(model, np.linspace(0.0, 2.4, 12001), inputs=turning)
    angle, speed, torque = run["shaft.angle"], run["shaft.speed"], run["s.torque"]
    extension = run["s.k.extension"]
    put_in = cumulative_simpson(torque * speed, x=run.time, initial=0.0)
    arm, rho = law(angle), BASE + extension - PRESSED
    moved = np.tanh(arm * speed / 1e-5)
    slope, pressed = arm / rho, STIFF * extension
    # N·cos α = F + µ·|N·sin α|·sgn: the side force N·sin α = F·tan α/(1 − µ·|tan α|·sgn).
    side = pressed * np.abs(slope) / (1.0 - FRICTION * np.abs(slope) * moved)
    rubbed = cumulative_simpson(
        FRICTION * side * np.abs(arm * speed) * np.abs(moved), x=run.time, initial=0.0
    )
    stored = STIFF / 2.0 * (extension**2 - extension[0] ** 2)
    assert put_in == pytest.approx(stored + rubbed, abs=1e-4 * put_in.max())
    assert rubbed[-1] > 0.02 * put_in.max()


def test_only_a_guide_that_rubs_needs_the_rate() -> None:
    spring = Spring(stiffness=STIFF)
    assert through(RUBBING, k=spring).needs_rate
    assert not through(SMOOTH, k=spring).needs_rate


def test_without_a_guide_that_rubs_nothing_is_lost() -> None:
    model = drive(SMOOTH)
    lifted, let_down = (model.evaluate([], [0.7, speed])["s.torque"] for speed in (5.0, -5.0))
    assert lifted == let_down


def test_a_circle_laid_on_the_edge_has_its_centre_where_the_law_says() -> None:
    contour = contour_of_cam(SMOOTH, points=4001)
    assert isinstance(contour, RollerContour)
    law = way_of(SMOOTH)
    points = np.vstack([contour.points[::-1] * [-1.0, 1.0], contour.points])
    for angle in (-1.2, -0.4, 0.0, 0.3, 0.8, 1.1):
        expected = BASE + law.integrate(0.0, abs(angle))
        assert rolled_over(points, ROLLER, angle)[0] == pytest.approx(expected, abs=2e-7)


def test_radii_of_curvature_are_those_of_a_circle_through_three_points_of_the_edge() -> None:
    contour = contour_of_cam(SMOOTH, points=2001)
    a, b, c = contour.points[:-2], contour.points[1:-1], contour.points[2:]
    sides = [np.hypot(*(p - q).T) for p, q in ((a, b), (b, c), (c, a))]
    first, second = b - a, c - b
    # Clockwise turns are convex; the circle through three points has the radius product/(2·cross).
    cross = -(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    curvature = 2.0 * cross / np.prod(sides, axis=0)
    inner = slice(40, -40)
    assert (1.0 / contour.radii_of_curvature[1:-1])[inner] == pytest.approx(curvature[inner], abs=0.3)
    assert curvature.min() < -5.0 < 50.0 < curvature.max(), "hollow and convex"


def test_the_steepest_place_has_the_pressure_angle_between_normal_and_line() -> None:
    contour = contour_of_cam(SMOOTH, points=4001)
    assert isinstance(contour, RollerContour)
    law = way_of(SMOOTH)
    steepest = minimize_scalar(
        lambda at: -float(law(at)) / (BASE + law.integrate(0.0, at)), bounds=(0.0, 0.8), method="bounded"
    )
    assert float(np.max(contour.pressure_angles)) == pytest.approx(math.atan(-steepest.fun), rel=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"base_radius": 0.004}, "must exceed the radius of the roller"),
        ({"lever_arm": (0.0, 0.001, 0.002)}, "a contour needs at least 5"),
        ({"last_angle": 3.2}, "angle at the end of the contour must lie in"),
    ],
)
def test_what_is_no_cam_with_a_roller_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(NlsError, match=words):
        RollerCam(**{**NUMBERS, **change})  # type: ignore[arg-type]
