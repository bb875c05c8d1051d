"""The contour against geometry done another way: tangents to polygons, lengths of cable, circles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline

from nlsdesign.components import OneSidedCam
from nlsdesign.design import (
    Contour,
    contour_from_lever_arm,
    contour_of_cam,
)
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.design.statics.declared_cam import cam_from_profile
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from tests.cam_cases import CONCAVE, actuator

ANCHORS = [22e-3, 40e-3, 1e6]


def wavy(anchor: float, *, refine: int = 40) -> Contour:
    """A convex contour with radii of curvature between 1 and 12 mm."""
    nodes = np.linspace(0.0, 1.3, 9)
    radii = 1e-3 * np.array([4.0, 1.0, 9.0, 12.0, 2.0, 6.0, 6.0, 3.0, 8.0])
    return contour_from_curvature(nodes, radii, first_slope=7e-3, anchor_distance=anchor, refine=refine)


@pytest.mark.parametrize("anchor", ANCHORS[:2])
@pytest.mark.parametrize("turned", [0.15, 0.45, 0.8])
def test_lever_arm_is_that_of_a_cable_laid_around_the_turned_polygon(anchor: float, turned: float) -> None:
    contour = wavy(anchor)
    angle = turned * contour.angles[-1]
    lower, _ = contour.outlines(angle)
    end = np.array([anchor, 0.0])
    # Seen from the anchor the cable is the line that leaves the whole half of the cam on one side.
    right = lower[len(contour.angles) : -1]
    bearings = np.unwrap(np.arctan2(right[:, 1], right[:, 0] - anchor) % (2 * np.pi))
    touched = right[np.argmin(bearings)]
    along = (touched - end) / np.linalg.norm(touched - end)
    arm = abs(end[0] * along[1] - end[1] * along[0])
    assert arm == pytest.approx(np.interp(angle, contour.angles, contour.lever_arms), rel=1e-5)
    contact, drawn_end = contour.cable(angle)
    # The polygon's corner is the contact point up to one edge: 12 mm times the step of 1.3/320 rad.
    assert np.linalg.norm(contact - touched) < 12e-3 * 1.3 / 320 * 1.1
    assert drawn_end == pytest.approx(end)


@pytest.mark.parametrize("anchor", ANCHORS)
def test_what_the_cam_takes_up_of_the_cable_is_the_integral_of_the_lever_arm(anchor: float) -> None:
    contour = wavy(anchor)
    # Cable from the point where it leaves the channel: along the contour, then straight to the anchor.
    length = contour.arc_lengths + contour.free_lengths
    work = make_interp_spline(contour.angles, contour.lever_arms, k=3).antiderivative()
    taken = work(contour.angles) - work(0.0)
    assert length - length[0] == pytest.approx(taken, abs=1e-9 if anchor < 1.0 else 1e-8)


def test_a_parallel_cable_is_the_limit_of_a_far_anchor() -> None:
    near, far, parallel = wavy(1e3), wavy(1e5), wavy(np.inf)
    for quantity in ("angles", "taken_lengths", "points", "arc_lengths"):
        once, twice, limit = (getattr(contour, quantity) for contour in (near, far, parallel))
        assert np.all(np.isfinite(limit))
        # What is missing falls with the distance.
        assert np.abs(twice - limit).max() <= 0.011 * np.abs(once - limit).max() + 1e-12, quantity
        assert np.abs(twice - limit).max() < 1e-6, quantity
    for angle in (0.0, 0.7, -0.7):
        contact, beyond = parallel.cable(angle)
        assert contact == pytest.approx(far.cable(angle)[0], abs=1e-6)
        assert beyond[1] == contact[1], "the cable is not parallel to the x axis"
        assert beyond[0] > 5 * parallel.radii.max()


@pytest.mark.parametrize("anchor", [*ANCHORS, np.inf])
def test_the_length_taken_up_is_the_integral_of_the_lever_arm_one_sided_too(anchor: float) -> None:
    angles = np.linspace(0.0, 1.2, 400)
    contour = contour_from_lever_arm(angles, 6e-3 + 5e-3 * angles**2, anchor_distance=anchor)
    wanted = 6e-3 * contour.angles + 5e-3 * contour.angles**3 / 3
    assert contour.taken_lengths == pytest.approx(wanted, abs=2e-8)


@pytest.mark.parametrize("anchor", ANCHORS)
def test_radius_of_curvature_is_that_of_circles_through_three_points(anchor: float) -> None:
    contour = wavy(anchor, refine=160)
    a, b, c = contour.points[:-2], contour.points[1:-1], contour.points[2:]
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (a, c))]
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    circles = sides[0] * sides[1] * sides[2] / (2 * np.abs(ux * vy - uy * vx))
    # Within an interval; at the nodes the radius has a corner.
    inner = np.ones(len(b), dtype=bool)
    inner[159::160] = False
    assert circles[inner] == pytest.approx(contour.radii_of_curvature[1:-1][inner], rel=2e-3)


@pytest.mark.parametrize("anchor", ANCHORS)
def test_constant_radius_of_curvature_is_an_arc(anchor: float) -> None:
    contour = contour_from_curvature([0.0, 0.6, 1.2], [5e-3] * 3, first_slope=8e-3, anchor_distance=anchor)
    # From (8 mm, 0), leaving along x, with the body below.
    assert np.hypot(contour.points[:, 0] - 8e-3, contour.points[:, 1] + 5e-3) == pytest.approx(
        5e-3, rel=1e-12
    )


@pytest.mark.parametrize("anchor", ANCHORS)
def test_contour_and_lever_arm_are_each_other_s_inverse(anchor: float) -> None:
    nodes = np.linspace(0.0, 1.3, 9)
    radii = 5e-3 + 2e-3 * np.sin(2.0 * nodes)
    contour = contour_from_curvature(nodes, radii, first_slope=7e-3, anchor_distance=anchor, refine=1)
    fine = contour_from_curvature(nodes, radii, first_slope=7e-3, anchor_distance=anchor, refine=50)
    angles = np.linspace(0.0, fine.angles[-1], 301)
    arms = make_interp_spline(fine.angles, fine.lever_arms, k=5)(angles)
    back = contour_from_lever_arm(angles, arms, anchor_distance=anchor)
    assert back.points == pytest.approx(
        np.column_stack([np.interp(back.directions, fine.directions, p) for p in fine.points.T]), abs=2e-7
    )
    wanted = np.interp(back.directions, contour.directions, contour.radii_of_curvature)
    assert back.radii_of_curvature[10:-10] == pytest.approx(wanted[10:-10], rel=0.02)


def test_outlines_are_closed_and_each_other_s_half_turn() -> None:
    lower, upper = wavy(22e-3).outlines(0.3, cable_radius=0.5e-3)
    assert np.array_equal(lower[0], lower[-1])
    assert upper == pytest.approx(-lower)


def test_surface_lies_deeper_by_the_radius_of_the_cable() -> None:
    contour = wavy(22e-3)
    gap = np.linalg.norm(contour.surface(0.8e-3) - contour.points, axis=1)
    assert gap == pytest.approx(0.8e-3)
    with pytest.raises(ValueRangeError, match="sharpest radius under the cable, 1 mm"):
        contour.surface(1.1e-3)


def test_both_directions_of_turning_mirror_the_cable() -> None:
    contour = wavy(22e-3)
    assert contour.cable(-0.4) == pytest.approx(contour.cable(0.4) * [1.0, -1.0])
    with pytest.raises(ValueRangeError, match="the contour ends at"):
        contour.cable(2.0)


def test_declared_cam_and_contour_are_each_other_s_inverse() -> None:
    cam = actuator(CONCAVE)["spring.cam"]
    contour = contour_of_cam(cam)
    fit = cam_from_profile(contour.angles, contour.lever_arms, like=cam, count=12)
    # What is left comes from 10 to 20 mrad, where the change of sides still takes w²/2θ² off 10 mm.
    assert fit.error < 1e-5
    old, new = (np.array(item.lever_arm.values)[3:] for item in (cam, fit.cam))
    assert new == pytest.approx(old, abs=2e-6)
    assert fit.cam.anchor_distance == cam.anchor_distance


def test_a_cam_whose_lever_arm_jumps_has_the_contour_that_it_was_fitted_to() -> None:
    """Within its onset no angle decides the control values; they go on as the contour does behind it."""
    cam = OneSidedCam(lever_arm=(8e-3,) * 6, last_angle=np.radians(60.0),
                      onset=np.radians(2.0))  # fmt: skip
    wanted = contour_from_curvature(
        np.linspace(0.0, np.radians(60.0), 41), np.full(41, 6e-3), first_slope=3e-3,
        first_lever_arm=13e-3, anchor_distance=np.inf,
    )  # fmt: skip
    fit = cam_from_profile(wanted.angles, wanted.lever_arms, like=cam, count=64)
    made = contour_of_cam(fit.cam)
    assert fit.cam.lever_arm.values[0] == pytest.approx(13e-3, rel=0.02)
    np.testing.assert_allclose(made.lever_arms[0], 13e-3, rtol=1e-4)
    np.testing.assert_allclose(made.radii_of_curvature, 6e-3, rtol=0.02)


def test_what_is_no_contour_is_refused() -> None:
    angles = np.linspace(0.0, 1.0, 50)
    with pytest.raises(ValueRangeError, match="must exceed the largest lever arm, 30 mm"):
        contour_from_lever_arm(angles, 0.03 * angles, anchor_distance=0.02)
    with pytest.raises(ValueRangeError, match="turn back"):
        contour_from_lever_arm(angles, 0.019 * (1.0 - angles), anchor_distance=0.0195)
    with pytest.raises(ArrangementError, match="has no contour"):
        contour_of_cam(actuator(CONCAVE)["spring.rubber"])
    with pytest.raises(ValueRangeError, match="ascend from zero"):
        cam_from_profile(angles + 0.1, angles, like=actuator(CONCAVE)["spring.cam"])


def test_extension_of_the_declared_cam_is_the_integral_of_its_contour_s_lever_arm() -> None:
    contour = wavy(22e-3)
    fit = cam_from_profile(contour.angles, contour.lever_arms, like=actuator(CONCAVE)["spring.cam"], count=60)
    arms = contour_of_cam(fit.cam, points=2001)
    area = cumulative_trapezoid(arms.lever_arms, arms.angles)[-1]
    taken = contour.arc_lengths[-1] + contour.free_lengths[-1] - contour.free_lengths[0]
    # The lever arm changes sides over 1 mrad, worth 1 mrad of a lever arm of 13 mm at the very most.
    assert area == pytest.approx(taken, abs=1.3e-5)
