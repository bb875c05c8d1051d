"""Cams and pulleys: the lever arm is the derivative of the extension, that the integral of the spline.

Independent roads: ``scipy.interpolate.BSpline`` with the same control values, quadrature of it, finite
differences, CasADi's derivative, and an analytic lever arm that the control values must reproduce.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import BSpline

from nlsdesign.components import Driven, Pulley, Spring, TwoSidedCam, control_values, through, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.foundation.symbolic import uniform_spline, uniform_spline_integral
from nlsdesign.model import FlatModel, flatten

STIFFNESS = 1000.0
LAST = 1.1


def behind(cam: TwoSidedCam | Pulley, *, pretension: float = 0.0) -> FlatModel:
    spring = through(cam, spring=Spring(stiffness=STIFFNESS), pretension=pretension)
    return flatten(assembly("a", shaft=Driven(), spring=tie(spring, "shaft")), outputs=["spring.torque"])


def extension(model: FlatModel, angle: float) -> float:
    return model.evaluate([], [angle, 0.0])["spring.spring.extension"]


def lever_arm(model: FlatModel, angle: float) -> float:
    return model.evaluate([], [angle, 0.0])["spring.cam.lever_arm_now"]


def random_cam(seed: int, *, count: int = 14, changeover: float = 1e-3) -> TwoSidedCam:
    values = 0.01 + 0.004 * np.random.default_rng(seed).uniform(-1, 1, count)
    return TwoSidedCam(lever_arm=tuple(values), last_angle=LAST, changeover=changeover)


# --- the spline under the cam ---------------------------------------------------------------------


@settings(max_examples=settings.default.max_examples)
@given(st.integers(5, 45), st.integers(0, 10**6), st.floats(0.0, 1.0))
def test_spline_and_its_integral_against_scipy(count: int, seed: int, share: float) -> None:
    lower, step = -0.3, 0.07
    values = np.random.default_rng(seed).normal(size=count)
    reference = BSpline(lower + step * np.arange(-3, count + 1), values, 3)
    coefficients, at = ca.SX.sym("c", count), ca.SX.sym("at")
    row = ca.vertsplit(coefficients)
    both = ca.vertcat(uniform_spline(row, lower, step, at), uniform_spline_integral(row, lower, step, at))
    found = ca.Function("both", [coefficients, at], [both, ca.jacobian(both, at)])
    point = lower + step * (count - 3) * share
    values_found, slopes_found = (np.array(m).ravel() for m in found(values, point))
    assert values_found[0] == pytest.approx(float(reference(point)), abs=1e-13)
    assert values_found[1] == pytest.approx(float(reference.integrate(lower, point)), abs=1e-14)
    assert slopes_found[1] == pytest.approx(float(reference(point)), abs=1e-12)
    assert slopes_found[0] == pytest.approx(float(reference.derivative()(point)), rel=1e-10, abs=1e-10)


def test_spline_at_every_knot_from_both_sides() -> None:
    """Where the choice of the span changes, value, slope and curvature do not jump."""
    values = np.random.default_rng(3).normal(size=12)
    at = ca.SX.sym("at")
    spline = uniform_spline([ca.SX(v) for v in values], 0.0, 1.0, at)
    slope = ca.jacobian(spline, at)
    all_three = ca.Function("f", [at], [ca.vertcat(spline, slope, ca.jacobian(slope, at))])
    for knot in range(1, 9):
        left, right = np.array(all_three(knot - 1e-9)).ravel(), np.array(all_three(knot)).ravel()
        assert left == pytest.approx(right, abs=1e-7)


def test_spline_costs_far_less_than_one_term_per_control_value() -> None:
    """Instructions: 40 control values are read once; the rest grows like the root of their number."""
    coefficients, at = ca.SX.sym("c", 40), ca.SX.sym("at")
    function = ca.Function(
        "f", [coefficients, at], [uniform_spline(ca.vertsplit(coefficients), 0.0, 1.0, at)]
    )
    assert function.n_instructions() < 300


# --- the two-sided cam ----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_lever_arm_is_the_derivative_of_the_extension(seed: int) -> None:
    """By central differences of the extension, and by CasADi through the whole flat model."""
    model = behind(random_cam(seed, changeover=0.02))
    s = model.symbols()
    names = [v.name for v in model.signals]
    stretch = s.signal[names.index("spring.spring.extension")]
    slope = ca.Function("slope", [s.input, s.parameter], [ca.jacobian(stretch, s.input[0])])
    step = 1e-6
    for angle in np.concatenate([np.linspace(-1.4, 1.4, 41), [1e-4, -3e-3, LAST - 1e-4, LAST + 0.05]]):
        arm = lever_arm(model, angle)
        central = (extension(model, angle + step) - extension(model, angle - step)) / (2 * step)
        assert arm == pytest.approx(central, abs=1e-9)
        assert arm == pytest.approx(float(slope([angle, 0.0], model.start(model.parameters))), abs=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_extension_is_even_and_the_lever_arm_odd(seed: int) -> None:
    model = behind(random_cam(seed))
    for angle in np.linspace(0.0, 1.5, 31):
        assert extension(model, -angle) == extension(model, angle)
        assert lever_arm(model, -angle) == -lever_arm(model, angle)
    assert extension(model, 0.0) == 0.0
    assert lever_arm(model, 0.0) == 0.0


def test_far_from_the_changeover_the_cam_is_its_spline() -> None:
    """h(θ) = H(√(θ² + w²) − w)·θ/√(θ² + w²) with H from scipy; δ by quadrature of h."""
    cam = random_cam(7, changeover=0.01)
    reference = BSpline(cam.step * np.arange(-3, 15), np.array(cam.lever_arm.values), 3)

    def arm(angle: float) -> float:
        root = np.hypot(angle, 0.01)
        return float(reference(root - 0.01)) * angle / root

    model = behind(cam)
    for angle in (0.002, 0.05, 0.3, 0.77, 1.05):
        assert lever_arm(model, angle) == pytest.approx(arm(angle), rel=1e-12)
        assert extension(model, angle) == pytest.approx(
            quad(arm, 0.0, angle, epsabs=1e-15, epsrel=1e-12, limit=500)[0], rel=1e-9
        )


def test_beyond_the_contour_the_lever_arm_stays() -> None:
    model = behind(random_cam(2))
    at_end = lever_arm(model, LAST + 2e-3)
    for beyond in (0.1, 0.5, 2.0):
        assert lever_arm(model, LAST + beyond) == pytest.approx(at_end, rel=1e-5)
        expected = extension(model, LAST + 2e-3) + at_end * (beyond - 2e-3)
        assert extension(model, LAST + beyond) == pytest.approx(expected, rel=1e-6)


def test_the_end_of_the_contour_is_that_of_its_last_span() -> None:
    cam = TwoSidedCam(lever_arm=(0.01, 0.011, 0.012, 0.013, 0.014, 0.015), last_angle=0.9)
    assert cam.step == pytest.approx(0.3)
    assert lever_arm(behind(cam), 5.0) == pytest.approx((0.013 + 4 * 0.014 + 0.015) / 6, rel=1e-6)


@pytest.mark.parametrize("count", [0, 1, 4])
def test_a_contour_has_at_least_five_control_values(count: int) -> None:
    with pytest.raises(ValueRangeError):
        TwoSidedCam(lever_arm=(0.01,) * count, last_angle=1.0)


# --- control values -------------------------------------------------------------------------------


def test_control_values_reproduce_an_analytic_lever_arm() -> None:
    """Error of a cubic spline: 4th order in the distance of the knots, here 40 against 20 control values."""

    def arm(angle: np.ndarray) -> np.ndarray:
        return 0.012 + 0.004 * np.sin(2.3 * angle) + 0.002 * angle**2

    angles = np.linspace(0.0, LAST, 201)
    errors = []
    for count in (20, 40):
        values = control_values(angles, arm(angles), count)
        spline = BSpline(LAST / (count - 3) * np.arange(-3, count + 1), np.array(values), 3)
        fine = np.linspace(0.0, LAST, 997)
        errors.append(float(np.max(np.abs(spline(fine) - arm(fine)))))
    assert errors[1] < 2e-9
    assert errors[0] / errors[1] > 10.0


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4))
def test_control_values_of_a_cubic_are_exact(powers: list[float]) -> None:
    angles = np.linspace(0.0, 1.0, 9)
    wanted = np.polynomial.Polynomial(powers)
    values = control_values(angles, wanted(angles), 8)
    spline = BSpline(np.arange(-3, 9) / 5, np.array(values), 3)
    fine = np.linspace(0.0, 1.0, 57)
    assert spline(fine) == pytest.approx(wanted(fine), abs=1e-12)


@pytest.mark.parametrize("angles", [[0.1, 0.2, 0.3, 0.4], [0.0, 0.2, 0.2, 0.4], [0.0, 0.3, 0.2, 0.4]])
def test_tables_that_do_not_ascend_from_zero(angles: list[float]) -> None:
    with pytest.raises(ValueRangeError, match="ascend"):
        control_values(np.array(angles), np.full(4, 0.01))


# --- what stands behind ---------------------------------------------------------------------------


def test_pulley_with_pretension_and_two_elements() -> None:
    """T = N·r·k·(e₀ + r·θ), by hand."""
    model = behind(Pulley(radius=0.02, elements=2.0), pretension=3e-3)
    for angle in (-0.5, 0.0, 0.7):
        at = model.evaluate([], [angle, 0.0])
        assert at["spring.torque"] == pytest.approx(2 * 0.02 * STIFFNESS * (3e-3 + 0.02 * angle), rel=1e-14)
        assert at["spring.spring.extension"] == pytest.approx(3e-3 + 0.02 * angle, rel=1e-14)


def test_finite_slope_at_zero_needs_pretension() -> None:
    """DESIGN, section 5: τ'(0) = N·F₀·h'(0); without pretension the stiffness at zero is zero."""
    row = (-1e-3, 0.0, 1e-3, 2e-3, 3e-3, 4e-3)
    cam = TwoSidedCam(lever_arm=row, last_angle=0.9, elements=2.0, changeover=1e-6)
    step = 1e-2
    slopes = []
    for pretension in (0.0, 2e-3):
        model = behind(cam, pretension=pretension)
        torque = [model.evaluate([], [a, 0.0])["spring.torque"] for a in (step, -step)]
        slopes.append((torque[0] - torque[1]) / (2 * step))
    # h'(0) = 1 mm per 0.3 rad, F₀ = k·e₀; δ grows like θ²/2·h'(0), a relative 1e-4 at this step.
    assert slopes[1] - slopes[0] == pytest.approx(2 * STIFFNESS * 2e-3 * 1e-3 / 0.3, rel=0.02)
    assert abs(slopes[0]) < 1e-3 * slopes[1]


@pytest.mark.parametrize("name", ["austin2015_as_printed", "austin2015_figure_consistent"])
def test_cams_of_the_decks_obey_virtual_work(name: str) -> None:
    """Static work: ∫T dθ = N·∫F dδ, quadrature on both sides."""
    assembly_ = declare(load_deck(name)).with_part("motor", Driven()).without_part("motor_encoder")
    model = flatten(assembly_, outputs=["spring.torque"])
    angles = np.linspace(0.0, np.radians(53), 20001)
    zeros = np.zeros_like(angles)
    rows = [np.zeros((len(model.states), len(angles))), np.vstack([angles, zeros])]
    parameters = np.repeat(model.start(model.parameters)[:, None], len(angles), axis=1)
    signals = np.array(model.equations.map(len(angles))(zeros[None], *rows, parameters, np.zeros((0, 1)))[2])
    at = {v.name: signals[i] for i, v in enumerate(model.signals)}
    turned = np.trapezoid(at["spring.torque"], angles)
    stretched = 2 * np.trapezoid(at["spring.rubber.force"], at["spring.rubber.extension"])
    assert turned == pytest.approx(stretched, rel=1e-6)
    assert turned > 0.5
