"""Linear algebra of many small systems against SciPy's, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_discrete_are, solve_discrete_lyapunov

from nlsdesign.feedback.analysis.kalman import best_covariances, deviation_of, steady_state_kalman
from nlsdesign.feedback.analysis.sweep import (
    covariance_without_measurement,
    exponential_and_gramian,
    riccati,
    transposed,
)

COUNT = 6


def stable(seed: int, size: int) -> np.ndarray:
    """Random systems of which the fastest has a decay of some hundreds."""
    draw = np.random.default_rng(seed)
    a = draw.normal(size=(COUNT, size, size)) * 10.0 ** draw.uniform(0.0, 2.0, size=(COUNT, 1, 1))
    shift = np.max(np.linalg.eigvals(a).real, axis=-1) + 0.5
    return a - shift[:, None, None] * np.eye(size)


def weights(seed: int, size: int) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(COUNT, size, size))
    return root @ transposed(root)


@pytest.mark.parametrize("horizon", [1e-3, 0.2])
def test_exponential_and_gramian(horizon: float) -> None:
    a, w = stable(1, 4), weights(2, 4)
    whole, gramian = exponential_and_gramian(a, w, horizon)
    for i in range(COUNT):
        assert whole[i] == pytest.approx(expm(a[i] * horizon), rel=1e-10, abs=1e-13)

        def product(t: float, i: int = i) -> np.ndarray:
            return expm(a[i].T * t) @ w[i] @ expm(a[i] * t)

        expected = quad_vec(product, 0.0, horizon, epsrel=1e-11)[0]
        assert gramian[i] == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.max(expected))


def test_riccati_is_that_of_scipy_also_where_the_system_is_unstable_but_seen() -> None:
    draw = np.random.default_rng(3)
    phi = np.array([expm(1e-2 * each) for each in stable(4, 4)])
    phi[: COUNT // 2] *= 1.2
    c, q = draw.normal(size=(COUNT, 2, 4)), weights(5, 4) * 1e-3
    found, steady = riccati(phi, transposed(c) @ c, q)
    assert np.all(steady)
    for i in range(COUNT):
        expected = solve_discrete_are(phi[i].T, c[i].T, q[i], np.eye(2))
        assert found[i] == pytest.approx(expected, rel=1e-8, abs=1e-10 * np.max(expected))


@pytest.mark.parametrize("own", [1.0, 1.1])
def test_without_a_steady_state_there_is_no_number(own: float) -> None:
    """The second state does not decay and is not seen; the first system is as it should be."""
    phi = np.array([np.diag([0.9, 0.5]), np.diag([0.9, own])])
    seen = np.array([np.diag([1.0, 0.0])] * 2)
    found, steady = riccati(phi, seen, np.array([np.eye(2)] * 2))
    assert list(steady) == [True, False]
    assert np.all(np.isfinite(found[0]))
    assert np.all(np.isnan(found[1]))
    quiet = riccati(phi, seen, np.array([np.diag([1.0, 0.0])] * 2))[1]
    assert list(quiet) == [True, False], "an error of the start stays, though nothing disturbs it"
    a = np.array([np.diag([-1.0, -1.0]), np.diag([-1.0, own - 1.0])])
    covariance, steady = best_covariances(a, np.eye(2), (np.array([[[1.0, 0.0]]] * 2), np.ones(1)), 0.1)
    assert list(steady) == [True, False]
    assert list(np.isinf(deviation_of(np.ones((2, 2)), covariance))) == [False, True]


def test_covariance_without_measurement() -> None:
    phi = np.array([expm(1e-2 * each) for each in stable(6, 3)])
    q = weights(7, 3)
    found = covariance_without_measurement(phi, q)
    for i in range(COUNT):
        expected = solve_discrete_lyapunov(phi[i], q[i])
        assert found[i] == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.max(expected))
    grows = covariance_without_measurement(np.array([[[1.0]], [[0.5]]]), np.array([[[1.0]]] * 2))
    assert grows.ravel() == pytest.approx([np.inf, 4.0 / 3.0])


def test_the_best_covariance_is_that_of_one_filter() -> None:
    from nlsdesign.feedback.analysis.kalman import discrete_noise

    a, density = stable(8, 3), np.diag([0.0, 4.0, 1e-4])
    c, spread = np.random.default_rng(9).normal(size=(COUNT, 1, 3)), np.array([3e-3])
    found, steady = best_covariances(a, density, (c, spread), 1e-3)
    assert np.all(steady)
    for i in range(COUNT):
        phi, noise = discrete_noise(a[i], density, 1e-3)
        expected = steady_state_kalman(phi, c[i], noise, spread)[1]
        assert found[i] == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.max(expected))
