"""The part of a closed-form cam that cannot be made, against curves whose contour is known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import OneSidedCam
from nlsdesign.design import contour_of_cam, design_cam
from nlsdesign.design.statics.energy import CamProfile
from tests.cam_cases import ALONE, CONCAVE, CONTOUR, CONVEX, KEEP, RUBBER, TARGET, actuator
from tests.closed_form import energy_profile, unmakeable_parts

ANGLES = np.linspace(0.0, 1.2, 601)


def profile(lever_arms: np.ndarray) -> CamProfile:
    nothing = np.zeros_like(ANGLES)
    return CamProfile(ANGLES, nothing, lever_arms, nothing, nothing, 1.0, 0.0)


def one_sided() -> OneSidedCam:
    return OneSidedCam(lever_arm=(0.01,) * 6, last_angle=1.2)


def test_with_a_parallel_cable_the_radius_of_curvature_is_h_plus_its_second_derivative() -> None:
    """h = a + b·sin(2θ): ρ = a − 3b·sin(2θ), hollow where sin(2θ) > a/(3b)."""
    a, b = 10e-3, 4e-3
    (part,) = unmakeable_parts(profile(a + b * np.sin(2 * ANGLES)), one_sided())
    edge = np.arcsin(a / (3 * b)) / 2
    assert part.first == pytest.approx(edge, abs=3e-3)
    assert part.last == pytest.approx(np.pi / 2 - edge, abs=3e-3)
    assert "hollow" in part.reason
    assert f"{1e3 * (a - 3 * b):.3g} mm" in part.reason


def test_too_sharp_is_told_apart_from_hollow() -> None:
    """h = a + b·sin(2θ) with a > 3b is convex, down to a − 3b at 45°."""
    a, b = 10e-3, 3e-3
    assert unmakeable_parts(profile(a + b * np.sin(2 * ANGLES)), one_sided()) == ()
    (part,) = unmakeable_parts(profile(a + b * np.sin(2 * ANGLES)), one_sided(), minimum_radius=2e-3)
    edge = np.arcsin((a - 2e-3) / (3 * b)) / 2
    assert part.first == pytest.approx(edge, abs=3e-3)
    assert "sharper than 2 mm" in part.reason


def test_a_cable_through_the_centre_allows_no_jump_at_angle_zero() -> None:
    machine = actuator(CONCAVE)
    closed = energy_profile(machine, target=TARGET)
    parts = unmakeable_parts(closed, machine["spring.cam"])
    assert parts[0].first == parts[0].last == 0.0
    assert f"jumps to {1e3 * closed.lever_arms[0]:.3g} mm" in parts[0].reason
    with_pretension = actuator(CONVEX, pretension=8e-3)
    assert unmakeable_parts(energy_profile(with_pretension, target=TARGET), machine["spring.cam"]) == ()


def test_a_lever_arm_beyond_the_anchor_is_named() -> None:
    parts = unmakeable_parts(profile(0.03 * ANGLES), actuator(CONCAVE)["spring.cam"])
    (part,) = (each for each in parts if "reaches the anchor" in each.reason)
    assert part.first == pytest.approx(25.0 / 30.0, abs=3e-3)


def test_what_was_designed_can_be_made() -> None:
    """The optimiser keeps ρ ≥ 1 mm; the lever arm alone must show that."""
    design = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=KEEP, settings=ALONE)
    contour = contour_of_cam(design.actuator["spring.cam"], points=601)
    nothing = np.zeros_like(contour.angles)
    made = CamProfile(contour.angles, nothing, contour.lever_arms, nothing, nothing, 2.0, 0.0)
    assert unmakeable_parts(made, design.actuator["spring.cam"], minimum_radius=0.9e-3) == ()
    assert CONTOUR == ["spring.cam.contour"]
