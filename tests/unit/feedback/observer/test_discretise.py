"""Exact discretisation against closed forms and against a numerical solution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.feedback.observer.scheduling.step import held, linear

TIME = 1e-3
FAST = -0.58e6 / 411.0  # the printed relaxation, 1/s


def test_the_printed_relaxation_keeps_a_quarter_per_sample() -> None:
    transition, _ = held(np.array([[FAST]]), np.zeros((1, 1)), TIME)
    assert transition[0, 0] == pytest.approx(np.exp(FAST * TIME), rel=1e-12)
    assert transition[0, 0] == pytest.approx(0.24, abs=0.005)
    euler = 1.0 + FAST * TIME
    assert euler == pytest.approx(-0.41, abs=0.005)


def test_one_state_has_its_closed_form() -> None:
    rate, decay = -2.0, np.exp(-2.0 * 0.5)
    transition, gain = held(np.array([[rate]]), np.array([[3.0]]), 0.5)
    assert gain[0, 0] == pytest.approx(3.0 * (1.0 - decay) / 2.0)
    same, begin, end = linear(np.array([[rate]]), 0.5)
    assert same[0, 0] == transition[0, 0] == pytest.approx(decay)
    # ∫e^(−2(T−s))·s/T ds and ∫e^(−2(T−s))·(1 − s/T) ds with T = 0.5
    assert end[0, 0] == pytest.approx(0.5 - (1.0 - decay) / 2.0)
    assert begin[0, 0] == pytest.approx((1.0 - decay) - 0.5)


def test_a_moving_drive_is_integrated_exactly() -> None:
    draw = np.random.default_rng(3)
    a, start, first, last = draw.normal(size=(3, 3)) * 200.0, *draw.normal(size=(3, 3))
    transition, begin, end = linear(a, TIME)
    found = solve_ivp(
        lambda t, x: a @ x + first + (last - first) * t / TIME, (0.0, TIME), start, rtol=1e-11, atol=1e-13
    ).y[:, -1]
    assert transition @ start + begin @ first + end @ last == pytest.approx(found, rel=1e-9)


def test_many_matrices_at_once_equal_one_after_the_other() -> None:
    draw = np.random.default_rng(4)
    a, b = 100.0 * draw.normal(size=(5, 2, 2)), draw.normal(size=(5, 2, 1))
    for many, one in (
        (held(a, b, TIME), lambda i: held(a[i], b[i], TIME)),
        (linear(a, TIME), lambda i: linear(a[i], TIME)),
    ):
        for i in range(5):
            assert all(np.allclose(m[i], o, rtol=1e-12, atol=0.0) for m, o in zip(many, one(i), strict=True))
