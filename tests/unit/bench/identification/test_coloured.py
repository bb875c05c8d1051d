"""The spectrum of broadband noise from stretches of a signal, against processes whose spectrum is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from nlsdesign.bench.identification.equation_error.noise import (
    NoisePart,
    Stretch,
    colour_of,
    independent_number,
    variance_behind,
)
from nlsdesign.bench.identification.filters import filter_weights

STEP = 0.002
WEIGHTS = filter_weights(0.004, 0, STEP)


DURATION = 12.0
FLICKER = [NoisePart(0.16, time) for time in (0.004, 0.0225, 0.126, 0.71, 4.0)]
"""About 1/f from 0.04 to 40 Hz."""


def remembering(count: int, time: float, variance: float, draw: np.random.Generator) -> NDArray[np.float64]:
    """A first-order process, begun long before."""
    memory = np.exp(-STEP / time)
    white = np.sqrt(variance * (1.0 - memory**2)) * draw.standard_normal(count + 10_000)
    result: NDArray[np.float64] = lfilter([1.0], [1.0, -memory], white)[10_000:]
    return result


@pytest.mark.parametrize("time", [0.005, 0.02, 0.1])
def test_the_variance_behind_a_filter_is_that_of_a_long_process(time: float) -> None:
    process = remembering(400_000, time, 2.0, np.random.default_rng(1))
    seen = np.var(np.convolve(process, WEIGHTS, mode="valid"))
    assert variance_behind([NoisePart(2.0, time)], WEIGHTS, STEP) == pytest.approx(seen, rel=0.05)
    assert variance_behind([], WEIGHTS, STEP) == 0.0


@pytest.mark.parametrize("lag", [0, 250])
@pytest.mark.parametrize("time", [0.005, 0.02, 0.1])
def test_level_and_colour_are_told_at_rest_and_from_differences_over_a_period(time: float, lag: int) -> None:
    ratios = []
    for seed in range(6):
        draw = np.random.default_rng(seed)
        rows = [remembering(1500 + lag, time, 0.4, draw) + 0.6 * draw.standard_normal(1500 + lag)
                for _ in range(4)]  # fmt: skip
        if lag:
            rows = [(row[lag:] - row[:-lag]) / np.sqrt(2.0) for row in rows]
        colour = colour_of([Stretch(row, STEP, lag) for row in rows])
        assert colour is not None
        assert colour.parts
        behind = colour.white * float(WEIGHTS @ WEIGHTS) + variance_behind(colour.parts, WEIGHTS, STEP)
        true = 0.36 * float(WEIGHTS @ WEIGHTS) + variance_behind([NoisePart(0.4, time)], WEIGHTS, STEP)
        ratios.append(behind / true)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.25)


def test_white_noise_stays_white_and_a_line_is_no_noise() -> None:
    draw = np.random.default_rng(3)
    at = STEP * np.arange(2000)
    for line in (0.0, 1.5):
        rows = [0.6 * draw.standard_normal(2000) + line * np.sin(2 * np.pi * 17.0 * at) for _ in range(4)]
        colour = colour_of([Stretch(row, STEP, 0) for row in rows])
        assert colour is not None
        assert colour.parts == ()
        assert colour.white == pytest.approx(0.36, rel=0.1)


def test_what_drifts_is_no_noise() -> None:
    draw = np.random.default_rng(4)
    at = STEP * np.arange(1000)
    rows = [0.6 * draw.standard_normal(1000) + 30.0 * np.exp(-at / 0.5) for _ in range(5)]
    colour = colour_of([Stretch(row, STEP, 0) for row in rows])
    assert colour is not None
    assert colour.white + sum(p.variance for p in colour.parts) == pytest.approx(0.36, rel=0.2)


def test_too_few_samples_tell_nothing() -> None:
    assert colour_of([]) is None
    assert colour_of([Stretch(np.random.default_rng(5).standard_normal(20), STEP, 0)]) is None


def estimated_over_true(parts: list[NoisePart], duration: float, lag: int, seed: int) -> float:
    """Variance behind the filter of noise seen in six stretches of 1.3 s, or four pairs of periods of 2 s."""
    draw = np.random.default_rng(seed)
    rows = []
    for _ in range(4 if lag else 6):
        count = (1000 if lag else 650) + lag
        row = sum((remembering(count, p.time, p.variance, draw) for p in parts), np.zeros(count))
        row = row + 0.6 * draw.standard_normal(count)
        rows.append(Stretch((row[lag:] - row[:-lag]) / np.sqrt(2.0) if lag else row, STEP, lag))
    colour = colour_of(rows, duration)
    assert colour is not None
    white = float(WEIGHTS @ WEIGHTS)
    return (colour.white * white + variance_behind(colour.parts, WEIGHTS, STEP)) / (
        0.36 * white + variance_behind(parts, WEIGHTS, STEP)
    )


@pytest.mark.long_cases("1000")
@pytest.mark.parametrize("lag", [0, 1000])
def test_noise_that_rises_to_the_lowest_frequency_seen_is_taken_to_rise_on(lag: int) -> None:
    to_the_end = np.median([estimated_over_true(FLICKER, DURATION, lag, seed) for seed in range(12)])
    cut = np.median([estimated_over_true(FLICKER, 0.0, lag, seed) for seed in range(12)])
    assert to_the_end == pytest.approx(1.0, abs=0.2)
    assert cut < 0.7


@pytest.mark.parametrize("time", [0.005, 0.02, 0.05])
def test_below_a_corner_that_is_plainly_seen_nothing_is_added(time: float) -> None:
    ratios = [estimated_over_true([NoisePart(0.8, time)], DURATION, 0, seed) for seed in range(8)]
    assert np.median(ratios) == pytest.approx(1.0, abs=0.25)


def test_a_process_whose_corner_lies_below_what_is_seen_is_continued() -> None:
    """A process of 0.1 s has its corner at 1.6 Hz; rests of 1.3 s show 1.9 Hz and more."""
    ratios = [estimated_over_true([NoisePart(0.8, 0.1)], DURATION, 0, seed) for seed in range(8)]
    assert np.median(ratios) == pytest.approx(1.0, abs=0.2)


def test_white_noise_stays_white_however_long_the_record() -> None:
    for seed in range(5):
        draw = np.random.default_rng(seed)
        rows = [Stretch(0.6 * draw.standard_normal(650), STEP, 0) for _ in range(6)]
        assert colour_of(rows, DURATION) == colour_of(rows, 0.0)


@pytest.mark.parametrize("time", [0.02, 0.3, 2.0])
def test_the_mean_square_of_slow_noise_scatters_as_so_many_independent_samples_would(time: float) -> None:
    count, spacing = 1500, 4 * STEP
    squares = []
    for seed in range(300):
        draw = np.random.default_rng(seed)
        slow = remembering(4 * count, time, 0.5, draw)[::4]
        squares.append(np.mean((slow + np.sqrt(0.5) * draw.standard_normal(count)) ** 2))
    own = independent_number([NoisePart(0.5, time)], count, spacing)
    assert own == pytest.approx(2.0 / np.var(squares), rel=0.3)
    assert independent_number([], count, spacing) == count
