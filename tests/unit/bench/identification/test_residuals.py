"""Noise, effective sample size, filters and metrics against closed forms."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.signal import lfilter

from nlsdesign.bench.identification.filters import (
    derivative,
    difference,
    every,
    filter_weights,
    kernel,
    smoothing,
    without_rounding,
)
from nlsdesign.bench.identification.residuals import (
    agreement,
    autocorrelation,
    binned,
    effective_size,
    noise_of,
    quantum_of,
    shapes,
    spectrum,
)

DRAW = np.random.default_rng(7)
WHITE = DRAW.standard_normal(6000)


def test_noise_is_found_under_a_signal_a_thousand_times_larger() -> None:
    time = np.arange(6000) * 0.002
    signal = 600.0 * np.abs(np.sin(2 * np.pi * 2.0 * time)) + 0.6 * WHITE
    assert noise_of(signal) == pytest.approx(0.6, rel=0.05)


def test_noise_is_found_under_a_motion_of_ten_samples_a_period() -> None:
    signal = np.sin(2 * np.pi * 0.1 * np.arange(6000)) + 1e-4 * WHITE
    assert noise_of(signal) == pytest.approx(1e-4, rel=0.1)


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


def test_autocorrelation_begins_at_one_and_falls_with_the_memory() -> None:
    assert autocorrelation(WHITE, 3)[0] == pytest.approx(1.0)
    coloured = autocorrelation(lfilter([1.0], [1.0, -0.3], WHITE), 3)
    np.testing.assert_allclose(coloured, [1.0, 0.3, 0.09, 0.027], atol=0.05)


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
    found = shapes(0.3 * np.sign(speed), {"angle": angle}, speed=speed, time=time, step=0.002)
    np.testing.assert_allclose(found["over angle, forward"].mean, 0.3, atol=1e-12)
    np.testing.assert_allclose(found["over angle, backward"].mean, -0.3, atol=1e-12)
    assert {"over frequency", "over time", "over speed"} <= set(found)


def test_the_shape_over_time_is_that_of_the_records_not_of_their_order() -> None:
    """Two records of 2 s are no record of 4 s: what both show at their end stands at 2 s."""
    once = np.arange(1000) * 0.002
    time = np.concatenate([once, once])
    found = shapes(time, {}, speed=None, time=time, step=0.002)["over time"]
    assert found.centre.max() < 2.0
    np.testing.assert_allclose(found.mean, found.centre, atol=0.05)


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
    matrix = smoothing(600, 4.0, 5, margin=4)
    for power, exact in ((1, 0.0), (2, 2.0)):
        np.testing.assert_allclose(matrix @ derivative(time**power, 0.002, order=2), exact, atol=2e-6)


def test_rate_is_that_of_a_line_and_of_a_slow_sine() -> None:
    time = np.arange(2000) * 0.002
    for span in (0.0, 0.062):
        np.testing.assert_allclose(derivative(3.0 * time, 0.002, order=1, span=span)[50:-50], 3.0, rtol=1e-5)
        slow = derivative(np.sin(2.0 * time), 0.002, order=1, span=span)[50:-50]
        np.testing.assert_allclose(slow, 2.0 * np.cos(2.0 * time[50:-50]), atol=1e-3)


@pytest.mark.parametrize("rate", [100.0, 500.0, 5000.0])
def test_a_rate_over_a_span_of_time_is_the_same_at_every_sampling_rate(rate: float) -> None:
    time, turn = np.arange(0.0, 4.0, 1.0 / rate), 8.0
    seen = derivative(np.sin(turn * time), 1.0 / rate, order=1, span=2.5 / turn)
    inside = np.abs(time - 2.0) < 1.0
    lost = 1.0 - np.std(seen[inside]) / np.std(turn * np.cos(turn * time[inside]))
    assert lost == pytest.approx(0.0056, abs=0.0015)


def test_derivatives_between_neighbours_hold_at_ten_samples_a_period() -> None:
    time = np.arange(200) * 0.1
    turn = 2.0 * np.pi
    for order, exact in ((1, turn * np.cos(turn * time)), (2, -(turn**2) * np.sin(turn * time))):
        seen = derivative(np.sin(turn * time), 0.1, order=order, span=0.2)
        np.testing.assert_allclose(seen[10:-10], exact[10:-10], atol=2e-4 * turn**order)


def test_rounding_is_removed_over_a_share_of_the_span_and_cubics_pass() -> None:
    time = np.arange(-200, 200) * 0.002
    for span in (0.01, 0.062, 0.2):
        np.testing.assert_allclose(without_rounding(time**3, 0.002, span), time**3, atol=1e-12)
    rounded = np.round(time / 0.01) * 0.01
    left = [np.std(without_rounding(rounded, 0.002, span) - time) for span in (0.01, 0.062, 0.2)]
    assert left[0] == pytest.approx(np.std(rounded - time))
    assert left[2] < 0.5 * left[1] < 0.5 * left[0]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_weights_of_a_filter_tell_what_white_noise_shows_behind_it(order: int) -> None:
    noise, step = np.random.default_rng(5).standard_normal(200_000), 0.002
    found = smoothing(len(noise), 4.0, 1) @ derivative(noise, step, order=order, span=0.062)
    weights = filter_weights(0.008, order, step, 0.062)
    assert np.std(found) == pytest.approx(np.linalg.norm(weights), rel=0.05)
    assert kernel(4.0).sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("width", "stride"), [(4.0, 5), (1.0, 1), (7.3, 9), (0.1, 2), (3.0, 40)])
def test_a_filter_of_rows_is_the_convolution_at_their_places(width: float, stride: int) -> None:
    draw = np.random.default_rng(2)
    signal, columns = draw.standard_normal(1500), draw.standard_normal((1500, 3))
    matrix, kept = smoothing(1500, width, stride, margin=7), np.array([0, 2, 3, 11])
    whole = np.convolve(signal, kernel(width), mode="same")
    np.testing.assert_allclose(matrix @ signal, whole[matrix.places], atol=1e-12)
    np.testing.assert_allclose(matrix[kept] @ signal, whole[matrix.places[kept]], atol=1e-12)
    assert matrix.places[0] >= 7
    assert matrix.shape == (len(matrix.places), 1500)
    assert (matrix[np.zeros(0, dtype=int)] @ columns).shape == (0, 3)
    for k in range(3):
        np.testing.assert_allclose((matrix @ columns)[:, k], matrix @ columns[:, k], atol=1e-12)
    np.testing.assert_array_equal(every(1500, stride) @ signal, signal[::stride])


def test_the_filter_of_a_record_of_a_million_samples_takes_little_memory() -> None:
    signal = np.zeros(1_000_000)
    tracemalloc.start()
    rows = smoothing(len(signal), 30.0, 37) @ derivative(signal, 1e-4, order=2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(rows) == pytest.approx(1_000_000 / 37, rel=0.01)
    assert peak < 4 * signal.nbytes


def test_weights_of_derivative_and_filter_are_those_of_one_after_the_other() -> None:
    signal = np.random.default_rng(4).standard_normal(900)
    both = np.convolve(signal, filter_weights(0.008, 2, 0.002), mode="same")
    matrix = smoothing(900, 4.0, 5, margin=4)
    np.testing.assert_allclose(matrix @ derivative(signal, 0.002, order=2), both[matrix.places], atol=1e-6)
    assert np.sum(difference(2)) == pytest.approx(0.0, abs=1e-12)


def test_metrics_are_those_of_the_paper() -> None:
    measured = np.array([10.0, -20.0, 0.5, 40.0])
    predicted = np.array([11.0, -18.0, 3.0, 40.0])
    found = agreement(measured, predicted, noise=1.0)
    assert found.rmse == pytest.approx(np.sqrt((1 + 4 + 6.25) / 4))
    # 0.5 is below a tenth of the largest and does not count: (10 % + 10 % + 0)/3
    assert found.relative == pytest.approx(20.0 / 3.0)
    assert found.noise_ratio == pytest.approx(found.rmse)
    assert found.of_spread == pytest.approx(100.0 * found.rmse / np.std(measured))
