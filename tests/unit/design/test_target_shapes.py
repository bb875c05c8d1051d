"""Polynomial, stiffness, weighted points and band: what they are, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from nlsdesign.design import ExponentialTorque, PolynomialTorque, PowerTorque, Target, TorqueBand
from nlsdesign.design.curves.target import TabulatedStiffness, TabulatedTorque
from nlsdesign.foundation.errors import UnitError, ValueRangeError
from nlsdesign.foundation.quantity import quantity

STIFFNESS = TabulatedStiffness(angles=(0.0, 0.2, 0.5, 0.9), stiffnesses=(1.0, 4.0, 0.0, 6.0))
CURVES: dict[str, Target] = {
    "polynomial": PolynomialTorque(coefficients=(2.0, -1.5, 3.0), angle=0.9),
    "stiffness": STIFFNESS,
    "sampled": TabulatedStiffness.sampled(lambda angle: 2.0 + 5.0 * angle**2, angle=0.9),
    "slopes": TabulatedTorque(angles=(0.0, 0.4, 0.9), torques=(0.0, 1.0, 4.0), slopes=(2.0, 3.0, 8.0)),
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_energy_is_the_integral_of_torque(curve: Target) -> None:
    at, weights = np.polynomial.legendre.leggauss(12)
    for angle in (0.07, 0.31, 0.9):
        kinks = [each for each in getattr(curve, "angles", ()) if 0.0 < each < angle]
        # A rule of Gauss between kinks is exact for the polynomials that stand there.
        ends = np.array([0.0, *kinks, angle])
        middles, halves = (ends[1:] + ends[:-1]) / 2, (ends[1:] - ends[:-1]) / 2
        places = middles[:, None] + halves[:, None] * at
        torques = np.reshape(curve.torque(places.ravel()), places.shape)
        expected = float(np.sum(halves[:, None] * weights * torques))
        assert float(curve.energy(angle)) == pytest.approx(expected, rel=1e-9)


def test_polynomial_by_hand() -> None:
    curve = CURVES["polynomial"]
    assert float(curve.torque(0.5)) == pytest.approx(2.0 * 0.5 - 1.5 * 0.25 + 3.0 * 0.125)
    assert curve.initial_stiffness == pytest.approx(2.0, rel=1e-6)


def test_the_slope_of_a_stiffness_curve_is_the_stiffness() -> None:
    angle = ca.SX.sym("angle")
    slope = ca.Function("slope", [angle], [ca.gradient(STIFFNESS.torque_law(angle), angle)])
    for at, expected in ((0.1, 2.5), (0.35, 2.0), (0.7, 3.0)):
        assert float(slope(at)) == pytest.approx(expected, rel=1e-9)
    function = CURVES["sampled"]
    assert float(function.torque(0.9)) == pytest.approx(2.0 * 0.9 + 5.0 * 0.9**3 / 3.0, rel=1e-4)


def test_known_slopes_are_met() -> None:
    curve, angle = CURVES["slopes"], ca.SX.sym("angle")
    slope = ca.Function("slope", [angle], [ca.gradient(curve.torque_law(angle), angle)])
    for at, expected in ((0.0, 2.0), (0.4, 3.0), (0.9, 8.0)):
        assert float(slope(at)) == pytest.approx(expected, rel=1e-9)


def test_a_curve_that_falls_is_told() -> None:
    assert not any(curve.falls for curve in CURVES.values() if curve is not CURVES["slopes"])
    assert PolynomialTorque(coefficients=(2.0, -1.2), angle=1.0).falls
    assert TabulatedTorque(angles=(0.0, 0.3, 0.6), torques=(0.0, 2.0, 1.0)).falls
    assert not ExponentialTorque(maximum=5.0, angle=0.9, shape=-3.0).falls


def test_weights() -> None:
    points = {"angles": (0.0, 0.4, 0.9), "torques": (0.0, 1.0, 4.0)}
    curve = TabulatedTorque(**points, weights=(1.0, 3.0, 0.0))
    assert curve.weight([0.0, 0.2, 0.4, 0.65]) == pytest.approx([1.0, 2.0, 3.0, 1.5])
    assert TabulatedTorque(**points).weight([0.0, 0.3]) == pytest.approx([1.0, 1.0])
    assert STIFFNESS.weight(np.zeros((2, 3))) == pytest.approx(np.ones((2, 3)))
    assert curve.torque(0.7) == TabulatedTorque(**points).torque(0.7)


def test_a_band_between_two_curves() -> None:
    low = PowerTorque(coefficient=2.0, exponent=1.0, angle=1.0)
    high = PowerTorque(coefficient=3.0, exponent=1.0, angle=0.8)
    band = TorqueBand.between(low, high)
    assert band.last_angle == 0.8
    angle = ca.SX.sym("angle")
    edges = ca.Function("edges", [angle], [band.lower_law(angle), band.upper_law(angle)])
    assert [float(each) for each in edges(0.5)] == pytest.approx([1.0, 1.5])
    assert band.contains([0.5, 0.5, 0.5], [0.99, 1.2, 1.51]).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: PolynomialTorque(coefficients=(), angle=1.0), ValueRangeError, "zero everywhere"),
        (lambda: PolynomialTorque(coefficients=(1.0, -2.0), angle=1.0), ValueRangeError, "torque is -1"),
        (lambda: PolynomialTorque(coefficients=(-1.0, 5.0), angle=1.0), ValueRangeError, "nowhere negative"),
        (
            lambda: PolynomialTorque(coefficients=(1.0, -4.5, 5.0), angle=1.0),
            ValueRangeError,
            r"at 0\.45 rad",
        ),
        (lambda: PolynomialTorque(coefficients=(float("nan"),), angle=1.0), ValueRangeError, r"\[1\] = nan"),
        (
            lambda: PolynomialTorque(coefficients=(1.0,), angle=quantity(1.0, "m")),
            UnitError,
            "unit like 'rad'",
        ),
        (
            lambda: TabulatedStiffness(angles=(0.0, 0.5, 1.0), stiffnesses=(1.0, -1.0, 2.0)),
            ValueRangeError,
            "row 2",
        ),
        (
            lambda: TabulatedStiffness(angles=(0.0, 0.5, 1.0), stiffnesses=(0.0,) * 3),
            ValueRangeError,
            "positive",
        ),
        (
            lambda: TabulatedTorque(
                angles=(0.0, 0.5, 1.0), torques=(0.0, 1.0, 2.0), weights=(1.0, -1.0, 1.0)
            ),
            ValueRangeError,
            "nowhere negative",
        ),
        (
            lambda: TabulatedTorque(angles=(0.0, 0.5, 1.0), torques=(0.0, 1.0, 2.0), weights=(1.0, 1.0)),
            ValueRangeError,
            "2 weights",
        ),
        (
            lambda: TorqueBand(angles=(0.0, 0.5, 1.0), lower=(0.0, 1.0, 2.0), upper=(0.0, 1.0, 3.0)),
            ValueRangeError,
            "row 2",
        ),
        (
            lambda: TorqueBand(angles=(0.0, 0.5, 1.0), lower=(0.1, 1.0, 2.0), upper=(0.2, 1.5, 3.0)),
            ValueRangeError,
            "must hold zero",
        ),
    ],
)
def test_what_is_refused(make: Callable[[], object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()


def test_a_torque_may_fall_below_zero_where_work_was_taken_up_before() -> None:
    curve = TabulatedTorque(angles=(0.0, 0.5, 1.0, 1.4), torques=(0.0, 2.0, 0.0, -1.5))
    assert curve.largest == pytest.approx(2.0, rel=1e-3)
    assert float(curve.torque(1.4)) == pytest.approx(-1.5)
    deep = TabulatedTorque(angles=(0.0, 0.5, 1.0, 1.2), torques=(0.0, 2.0, 0.0, -3.0))
    assert deep.largest == pytest.approx(3.0), "the largest magnitude"


@pytest.mark.parametrize(
    ("torques", "row"),
    [((0.0, -1.0, 2.0, 3.0), 2), ((0.0, 1.0, -1.0, -3.0), 4), ((0.0, -1e-6, -2.0, 1.0), 2)],
)
def test_a_torque_that_gives_more_work_than_it_took_is_refused(torques: tuple[float, ...], row: int) -> None:
    with pytest.raises(ValueRangeError, match=rf"row {row}: gives more work than the spring has taken up"):
        TabulatedTorque(angles=(0.0, 0.5, 1.0, 1.5), torques=torques)
