"""Rounding of corners in a function of SX."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import StrainStiffening
from nlsdesign.design import elastic_law
from nlsdesign.design.statics.equilibrium import rounded
from nlsdesign.model import flatten
from tests.cam_cases import actuator

X, P = ca.SX.sym("x"), ca.SX.sym("p", 2)
CORNERED = ca.Function(
    "f", [X, P], [ca.fmax(X - P[0], 0) + ca.fmin(2 * X, P[1]) + ca.fabs(X), ca.vertcat(ca.exp(X), X / P[1])]
)
SAMPLES = [np.linspace(-1.0, 1.0, 21).reshape(1, -1), np.tile([[0.3], [0.5]], 21)]


def test_width_zero_changes_nothing() -> None:
    same = rounded(CORNERED, SAMPLES, 0.0)
    for x in (-0.7, 0.0, 0.3, 0.31, 0.9):
        for new, old in zip(same(x, [0.3, 0.5]), CORNERED(x, [0.3, 0.5]), strict=True):
            assert np.array(new) == pytest.approx(np.array(old), abs=1e-15)


def test_corners_become_smooth_and_nothing_else_moves() -> None:
    smooth = rounded(CORNERED, SAMPLES, 0.01)
    x = ca.SX.sym("x")
    slope = ca.Function("slope", [x], [ca.jacobian(smooth.call([x, ca.SX([0.3, 0.5])])[0], x)])
    # Left and right of each corner the slope is nearly the same now, and lies between those far away.
    for corner, low, high in ((0.3, 3.0, 2.0), (0.0, 1.0, 3.0)):
        assert float(slope(corner + 1e-6)) == pytest.approx(float(slope(corner - 1e-6)), abs=1e-3)
        assert min(low, high) - 1.1 < float(slope(corner)) < max(low, high) + 1.1
    # Far from the corners, in widths, it is the old function up to width²/distance.
    assert float(smooth(-0.9, [0.3, 0.5])[0]) == pytest.approx(float(CORNERED(-0.9, [0.3, 0.5])[0]), abs=1e-3)
    assert np.array(smooth(0.4, [0.3, 0.5])[1]).ravel() == pytest.approx([np.exp(0.4), 0.8], rel=1e-15)


def test_a_law_without_corners_is_left_alone() -> None:
    plain = ca.Function("plain", [X, P], [X * P[0]])
    assert rounded(plain, SAMPLES, 0.1) is plain


def test_a_law_with_knots_gets_a_continuous_stiffness() -> None:
    law = elastic_law(flatten(actuator(StrainStiffening(modulus=(1e6, 2e6), knots=(0.0, 0.4)))), "spring")
    knot, smooth = 0.4 * 12.5e-3, law.without_knots(12.5e-3, 0.003)
    jump = float(law.stiffness(knot + 1e-8) - law.stiffness(knot - 1e-8))
    assert jump == pytest.approx(2e6 * 1e-4 / 12.5e-3)
    assert float(smooth.stiffness(knot + 1e-8) - smooth.stiffness(knot - 1e-8)) < 1e-3 * jump
    # At the corner max(v, 0) is too large by half the width: 0.3 % of the largest distance, a strain of 0.6.
    excess = 0.5 * 0.003 * (1.0 - 0.4) * 2e6 * 1e-4
    assert float(smooth.force(knot) - law.force(knot)) == pytest.approx(excess, rel=0.05)
