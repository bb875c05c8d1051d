"""Losses: how much a sample, and how much a whole record, may count."""

import numpy as np
import pytest

from nlsdesign.bench.identification.least_squares import Huber, bounded_total, huber_rows

X = np.array([0.3, -0.8])


def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Three residuals that bend, and their slopes."""
    residual = np.array([1.0 + x[0] ** 2, 3.0 * x[1] - x[0], np.exp(x[1])])
    slope = np.array([[2.0 * x[0], 0.0], [-1.0, 3.0], [0.0, np.exp(x[1])]])
    return residual, slope


def test_a_record_within_its_bound_counts_as_it_is() -> None:
    residual, slope = rows(X)
    same, same_slope = bounded_total(residual, slope, float(residual @ residual))
    assert np.array_equal(same, residual)
    assert np.array_equal(same_slope, slope)


@pytest.mark.parametrize("share", [0.9, 0.5, 1e-3])
def test_the_sum_of_squares_is_the_stated_one(share: float) -> None:
    residual, slope = rows(X)
    total = float(residual @ residual)
    bound = share * total
    scaled = bounded_total(residual, slope, bound)[0]
    assert scaled @ scaled == pytest.approx(bound * (2.0 - bound / total), rel=1e-12)
    assert scaled @ scaled < 2.0 * bound


@pytest.mark.parametrize("share", [0.9, 0.5, 1e-3])
def test_the_slope_is_that_of_the_scaled_residuals(share: float) -> None:
    bound = share * float(rows(X)[0] @ rows(X)[0])
    slope, step = bounded_total(*rows(X), bound)[1], 1e-6
    for k in range(2):
        aside = step * np.eye(2)[k]
        ends = [bounded_total(*rows(X + sign * aside), bound)[0] for sign in (1.0, -1.0)]
        assert slope[:, k] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("limit", [0.5, 1.05, 10.0])
def test_scaled_residuals_have_the_loss_of_huber_and_its_slope(limit: float) -> None:
    residual, slope = rows(X)
    scaled, scaled_slope = huber_rows(residual, slope, limit)
    assert 0.5 * scaled @ scaled == pytest.approx(Huber(limit).value(residual), rel=1e-12)
    assert np.array_equal(np.sign(scaled), np.sign(residual))
    step = 1e-6
    for k in range(2):
        aside = step * np.eye(2)[k]
        ends = [huber_rows(*rows(X + sign * aside), limit)[0] for sign in (1.0, -1.0)]
        assert scaled_slope[:, k] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6, abs=1e-9)
