"""The written-out Newton iteration against ``scipy.optimize.brentq`` and against closed forms.

It runs inside flattened models and generated C with a fixed number of steps, so it has to be right at the
first try: kinks, slopes a million apart, flat pieces, and its derivative.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from nlsdesign.foundation.symbolic import depends, positive_part, smooth_sign, solve_monotone, symbol


def law(knots: np.ndarray, slopes: np.ndarray, z: ca.SX | float) -> ca.SX | float:
    """Continuous piecewise line through zero at zero: slope i between knots i − 1 and i."""
    maximum = ca.fmax if isinstance(z, ca.SX) else max
    rises = np.diff(slopes)
    bends = [rise * (maximum(z - at, 0.0) - max(-at, 0.0)) for rise, at in zip(rises, knots, strict=True)]
    return slopes[0] * z + sum(bends)


def solved(g: object, whole: float, guess: float | None = None) -> float:
    unknown, e = symbol("z"), symbol("e")
    start = e / 2 if guess is None else ca.SX(guess)
    root = solve_monotone(lambda z: g(z, e), unknown, start)  # type: ignore[operator]
    return float(ca.Function("root", [e], [root])(whole))


bends = st.tuples(
    st.integers(0, 10**6),  # seed
    st.integers(1, 6),  # knots of the one law
    st.integers(1, 6),  # knots of the other
    st.floats(0.0, 6.0),  # decades between the slopes
    st.floats(-2.0, 2.0),  # common extension
)


def laws(seed: int, counts: tuple[int, int], decades: float) -> list[tuple[np.ndarray, np.ndarray]]:
    draw = np.random.default_rng(seed)
    return [(np.sort(draw.uniform(-1, 1, n)), 10.0 ** draw.uniform(0.0, decades, n + 1)) for n in counts]


@given(bends)
def test_two_bent_springs_in_series(case: tuple[int, int, int, float, float]) -> None:
    """Slopes up to a million apart, also shallow–steep–shallow, where plain Newton goes to and fro."""
    seed, first, second, decades, whole = case
    one, other = laws(seed, (first, second), decades)
    found = solved(lambda z, e: law(*one, z) - law(*other, e - z), whole)
    expected = brentq(lambda z: law(*one, z) - law(*other, whole - z), -50.0, 50.0, xtol=1e-15, rtol=1e-14)
    efforts = float(law(*one, found)), float(law(*other, whole - found))
    assert abs(efforts[0] - efforts[1]) <= 1e-9 * (1.0 + abs(efforts[0]) + abs(efforts[1]))
    assert found == pytest.approx(expected, abs=1e-9)


def test_flat_steep_flat_does_not_go_to_and_fro() -> None:
    """From either flat piece Newton points at the other; only a bracket that shrinks gets in between."""

    def s_shape(z: ca.SX, e: ca.SX) -> ca.SX:
        return 1e3 * (ca.fmax(z, -1e-3) - ca.fmax(z - 1e-3, 0)) + 1e-3 * z - e

    for whole in (0.3, -0.3, 0.9, 1e-5):
        found = solved(s_shape, whole, guess=5.0)
        assert found == pytest.approx(whole / (1e3 + 1e-3), rel=1e-9)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-6.0, 0.0))
def test_cubic_springs_in_series(first: float, second: float, whole: float, line: float) -> None:
    a, b, c = 10.0**first, 10.0**second, 10.0**line
    found = solved(lambda z, e: a * z**3 + c * z - b * (e - z) ** 3, whole)
    efforts = a * found**3 + c * found, b * (whole - found) ** 3
    assert abs(efforts[0] - efforts[1]) <= 1e-9 * (1.0 + abs(efforts[0]) + abs(efforts[1]))


@given(st.floats(-1.0, 2.0), st.floats(-4.0, 0.0), st.floats(-3.0, 1.0), st.floats(-2.0, 2.0))
def test_dry_friction_in_series_with_a_dashpot(
    level: float, width: float, damping: float, rate: float
) -> None:
    torque, creep, c = 10.0**level, 10.0**width, 10.0**damping
    found = solved(lambda z, e: torque * smooth_sign(z, creep) - c * (e - z), rate, guess=0.0)
    one, other = torque * np.tanh(found / creep), c * (rate - found)
    assert abs(one - other) <= 1e-9 * (1.0 + abs(one) + abs(other))


@pytest.mark.parametrize("whole", [-0.7, -1e-9, 0.0, 1e-9, 0.02, 0.4, 1.7])
def test_the_derivative_is_that_of_the_implicit_function(whole: float) -> None:
    """dz/de = f₂'/(f₁' + f₂'), also at rest, where the guess is the root already."""
    unknown, e = symbol("z"), symbol("e")

    def one(z: ca.SX) -> ca.SX:
        return 3.0 * z + 5.0 * positive_part(z - 0.1, 0.05)

    def other(z: ca.SX) -> ca.SX:
        return 20.0 * z + 700.0 * z**3

    root = solve_monotone(lambda z: one(z) - other(e - z), unknown, e / 2)
    found = ca.Function("root", [e], [root, ca.jacobian(root, e), ca.jacobian(ca.jacobian(root, e), e)])
    z, slope, _ = (float(v) for v in found(whole))
    x = symbol("x")
    slopes = [
        float(ca.Function("s", [x], [ca.jacobian(f(x), x)])(v)) for f, v in ((one, z), (other, whole - z))
    ]
    assert slope == pytest.approx(slopes[1] / (slopes[0] + slopes[1]), rel=1e-10)
    step = 1e-5
    central = (float(found(whole + step)[1]) - float(found(whole - step)[1])) / (2 * step)
    assert float(found(whole)[2]) == pytest.approx(central, rel=1e-4, abs=1e-5)


def test_the_derivative_is_right_where_the_guess_is_the_root() -> None:
    """At rest nothing is left to iterate; the half that the guess says must not be taken for the share."""
    unknown, e = symbol("z"), symbol("e")
    root = solve_monotone(
        lambda z: 3.0 * z + 5.0 * z**3 - 20.0 * (e - z) - 700.0 * (e - z) ** 3, unknown, e / 2
    )
    slope = ca.Function("slope", [e], [ca.jacobian(root, e)])
    assert float(slope(0.0)) == pytest.approx(20.0 / 23.0, rel=1e-12)


@pytest.mark.parametrize("whole", [-1.0, -1e-3, 0.0])
def test_two_slack_cables_share_without_a_nan(whole: float) -> None:
    """Both flat: any share will do; value and derivative stay finite."""
    unknown, e = symbol("z"), symbol("e")
    root = solve_monotone(lambda z: 3.0 * ca.fmax(z, 0) - 5.0 * ca.fmax(e - z, 0), unknown, e / 2)
    found = ca.Function("root", [e], [root, ca.jacobian(root, e)])
    z, slope = (float(v) for v in found(whole))
    assert 3.0 * max(z, 0.0) == 5.0 * max(whole - z, 0.0) == 0.0
    assert np.isfinite(slope)


def test_linear_equations_are_solved_symbolically() -> None:
    unknown, a, b = symbol("z"), symbol("a"), symbol("b")
    root = solve_monotone(lambda z: a * z - b * (1 - z), unknown, ca.SX(0.5))
    assert not depends(root, unknown)
    assert ca.Function("f", [a, b], [root]).n_instructions() < 12
    assert float(ca.Function("f", [a, b], [root])(2.0, 6.0)) == pytest.approx(0.75, rel=1e-15)
