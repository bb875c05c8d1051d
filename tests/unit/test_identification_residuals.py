"""Noise, effective sample size, whiteness, filters and metrics against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from nlsdesign.identification.statistics.filters import (
    derivative,
    kernel,
    noise_gain,
    rate_noise_gain,
    smoothing,
)
from nlsdesign.identification.statistics.metrics import agreement
from nlsdesign.identification.statistics.residuals import (
    autocorrelation,
    binned,
    effective_size,
    noise_of,
    quantum_of,
    shapes,
    spectrum,
    whiteness,
)

DRAW = np.random.default_rng(7)
WHITE = DRAW.standard_normal(6000)


def test_noise_is_found_under_a_signal_a_thousand_times_larger() -> None:
    time = np.arange(6000) * 0.002
    signal = 600.0 * np.abs(np.sin(2 * np.pi * 2.0 * time)) + 0.6 * WHITE
    assert noise_of(signal) == pytest.approx(0.6, rel=0.05)


def test_quantum_is_the_smallest_step() -> None:
    assert quantum_of(np.round(10.0 * np.sin(np.arange(500) * 0.01) / 0.25) * 0.25) == pytest.approx(0.25)
    assert quantum_of(np.full(10, 3.0)) == 0.0


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_effective_size_is_that_of_a_first_order_process(memory: float) -> None:
    # ρₖ = aᵏ, so n/(1 + 2Σa²ᵏ) = n·(1 − a²)/(1 + a²)
    n = 60_000
    process = lfilter([1.0], [1.0, -memory], np.random.default_rng(3).standard_normal(n))
    expected = n * (1.0 - memory**2) / (1.0 + memory**2)
    assert effective_size(process) == pytest.approx(expected, rel=0.1)


def test_whiteness_tells_white_from_coloured() -> None:
    white, coloured = whiteness(WHITE), whiteness(lfilter([1.0], [1.0, -0.3], WHITE))
    assert white.ratio < 2.0
    assert coloured.ratio > 10.0
    assert autocorrelation(WHITE, 3)[0] == pytest.approx(1.0)


def test_bins_hold_the_mean_and_its_error() -> None:
    over = DRAW.uniform(0.0, 1.0, 6000)
    found = binned(2.0 * over + WHITE, over, 10)
    np.testing.assert_allclose(found.mean, 2.0 * found.centre, atol=4.0 * found.error.max())
    np.testing.assert_allclose(found.error, 1.0 / np.sqrt(600), rtol=0.15)


def test_spectrum_peaks_at_the_frequency_of_a_sine() -> None:
    time = np.arange(4000) * 0.002
    found = spectrum(np.sin(2 * np.pi * 40.0 * time), 0.002)
    width = found.centre[1] - found.centre[0]
    assert found.centre[np.argmax(found.mean)] == pytest.approx(40.0, abs=width)


def test_shapes_separate_forward_and_backward() -> None:
    time = np.arange(6000) * 0.002
    angle, speed = np.sin(time), np.cos(time)
    found = shapes(0.3 * np.sign(speed), {"angle": angle}, speed, 0.002)
    np.testing.assert_allclose(found["over angle, forward"].mean, 0.3, atol=1e-12)
    np.testing.assert_allclose(found["over angle, backward"].mean, -0.3, atol=1e-12)
    assert {"over frequency", "over time", "over speed"} <= set(found)


def test_filter_has_no_phase_and_unit_gain() -> None:
    n, width = 400, 4.0
    matrix = smoothing(n, width, 1)
    time = np.arange(n)
    omega = 0.1
    kept = matrix @ time
    wave = matrix @ np.sin(omega * time)
    expected = np.exp(-0.5 * (omega * width) ** 2) * np.sin(omega * kept)
    np.testing.assert_allclose(wave, expected, atol=1e-6)
    np.testing.assert_allclose(matrix @ np.ones(n), 1.0, atol=1e-12)


def test_second_derivative_behind_the_filter_makes_no_ripple_of_its_own() -> None:
    # The trap that DESIGN names: a truncated second-derivative kernel answers a parabola with a ripple.
    time = np.arange(600) * 0.002
    matrix = smoothing(600, 4.0, 5)
    for power, exact in ((1, 0.0), (2, 2.0)):
        np.testing.assert_allclose(matrix @ derivative(time**power, 0.002, order=2), exact, atol=2e-6)


def test_rate_is_that_of_a_line_and_of_a_slow_sine() -> None:
    time = np.arange(2000) * 0.002
    np.testing.assert_allclose(derivative(3.0 * time, 0.002, order=1)[50:-50], 3.0, rtol=1e-5)
    slow = derivative(np.sin(2.0 * time), 0.002, order=1)[50:-50]
    np.testing.assert_allclose(slow, 2.0 * np.cos(2.0 * time[50:-50]), atol=1e-3)


@pytest.mark.parametrize("order", [0, 2])
def test_noise_gain_is_what_white_noise_shows(order: int) -> None:
    noise = np.random.default_rng(5).standard_normal(200_000)
    found = smoothing(len(noise), 4.0, 1) @ derivative(noise, 1.0, order=order)
    assert np.std(found) == pytest.approx(noise_gain(4.0, order), rel=0.02)


def test_rate_noise_gain_is_what_white_noise_shows() -> None:
    noise = np.random.default_rng(6).standard_normal(200_000)
    assert np.std(derivative(noise, 1.0, order=1)) == pytest.approx(rate_noise_gain(), rel=0.05)
    assert kernel(4.0).sum() == pytest.approx(1.0)


def test_metrics_are_those_of_the_paper() -> None:
    measured = np.array([10.0, -20.0, 0.5, 40.0])
    predicted = np.array([11.0, -18.0, 3.0, 40.0])
    found = agreement(measured, predicted, noise=1.0)
    assert found.rmse == pytest.approx(np.sqrt((1 + 4 + 6.25) / 4))
    # 0.5 is below a tenth of the largest and does not count: (10 % + 10 % + 0)/3
    assert found.relative == pytest.approx(20.0 / 3.0)
    assert found.noise_ratio == pytest.approx(found.rmse)
    assert found.of_spread == pytest.approx(100.0 * found.rmse / np.std(measured))
