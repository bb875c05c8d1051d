"""Target curves: torque, its integral, symbols and numbers, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from nlsdesign.design import ExponentialTorque, PowerTorque, TabulatedTorque, Target
from nlsdesign.foundation.errors import UnitError, ValueRangeError
from nlsdesign.foundation.quantity import degrees, quantity

TABLE = TabulatedTorque(angles=(0.0, 0.1, 0.3, 0.5, 0.9), torques=(0.0, 0.3, 0.4, 2.0, 5.0))
CURVES = {
    "stiffening": ExponentialTorque(maximum=5.0, angle=0.925, shape=1.0),
    "softening": ExponentialTorque(maximum=2.0, angle=1.3, shape=-2.5),
    "steep": ExponentialTorque(maximum=5.0, angle=0.925, shape=3.62),
    "power": PowerTorque(coefficient=4.35, exponent=2.09, angle=0.9),
    "linear": PowerTorque(coefficient=3.4, exponent=1.0, angle=0.9),
    "table": TABLE,
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_energy_is_the_integral_of_torque(curve: Target) -> None:
    for angle in (0.05, 0.3, 0.77):
        expected, _ = quad(curve.torque, 0.0, angle, points=[0.1, 0.3, 0.5], epsabs=1e-13)
        assert float(curve.energy(angle)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_symbols_and_numbers_agree(curve: Target) -> None:
    angle = ca.SX.sym("angle")
    function = ca.Function("both", [angle], [curve.torque(angle), curve.energy(angle)])
    grid = np.linspace(0.0, curve.last_angle, 7).reshape(1, 7)
    assert curve.torque(grid).shape == (1, 7)
    for i, at in enumerate(grid[0]):
        torque, energy = function(at)
        assert float(torque) == pytest.approx(curve.torque(grid)[0, i], rel=1e-14, abs=1e-15)
        assert float(energy) == pytest.approx(curve.energy(grid)[0, i], rel=1e-14, abs=1e-15)


def test_exponential_curve_by_hand() -> None:
    curve = CURVES["stiffening"]
    assert float(curve.torque(0.0)) == 0.0
    assert float(curve.torque(0.5)) == pytest.approx(5.0 * (np.exp(0.5) - 1) / (np.exp(0.925) - 1))
    assert curve.initial_stiffness == pytest.approx(5.0 / (np.exp(0.925) - 1), rel=1e-6)
    assert curve.largest == pytest.approx(5.0)


def test_table_meets_its_points_without_new_bumps() -> None:
    assert TABLE.torque(TABLE.angles) == pytest.approx(TABLE.torques, abs=1e-14)
    assert np.all(np.diff(TABLE.torque(np.linspace(0.0, 0.9, 1001))) >= 0.0)
    assert TABLE.last_angle == 0.9


def test_tolerance_band() -> None:
    curve = ExponentialTorque(maximum=5.0, angle=0.9, shape=1.0, tolerance=quantity(50.0, "mN*m"))
    lower, upper = curve.band([0.0, 0.9])
    assert lower == pytest.approx([-0.05, 4.95])
    assert upper == pytest.approx([0.05, 5.05])
    with pytest.raises(ValueRangeError, match=r"tolerance = -0\.1"):
        ExponentialTorque(maximum=5.0, angle=0.9, shape=1.0, tolerance=-0.1)


def test_quantities_are_taken_in_their_units() -> None:
    curve = ExponentialTorque(maximum=quantity(5000.0, "mN*m"), angle=quantity(53.0, "deg"), shape=1.0)
    assert curve == ExponentialTorque(maximum=5.0, angle=degrees(53.0), shape=1.0)


def exponential(maximum: object = 5.0, angle: object = 0.9, shape: object = 1.0) -> Target:
    return ExponentialTorque(maximum=maximum, angle=angle, shape=shape)  # type: ignore[arg-type]


def table(angles: tuple[float, ...], torques: tuple[float, ...]) -> Target:
    return TabulatedTorque(angles=angles, torques=torques)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: exponential(angle=53.0), ValueRangeError, "were degrees meant"),
        (lambda: exponential(angle=quantity(5.0, "mm")), UnitError, "unit like 'rad'"),
        (lambda: exponential(shape=0.0), ValueRangeError, "use PowerTorque"),
        (lambda: exponential(maximum=float("nan")), ValueRangeError, "maximum = nan"),
        (lambda: PowerTorque(coefficient=1.0, exponent=0.5, angle=0.9), ValueRangeError, "exponent = 0.5"),
        (lambda: table((0.0, 1.0), (0.0, 1.0)), ValueRangeError, "at least three points"),
        (lambda: table((0.0, 0.5, 0.4), (0.0, 1.0, 2.0)), ValueRangeError, "row 3"),
        (lambda: table((0.1, 0.5, 0.9), (0.0, 1.0, 2.0)), ValueRangeError, "row 1"),
        (lambda: table((0.0, 0.5, 0.9), (1.0, 1.0, 2.0)), ValueRangeError, "start at zero"),
        (lambda: table((0.0, 0.5, 0.9), (0.0, 1.0)), ValueRangeError, "3 angles and 2"),
    ],
)
def test_what_is_no_target_is_refused(make: Callable[[], Target], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()
