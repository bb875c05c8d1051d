"""The spectrum of broadband noise from stretches of a signal, against processes whose spectrum is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from nlsdesign.identification.statistics.coloured import NoisePart, Stretch, colour_of, variance_behind
from nlsdesign.identification.statistics.filters import filter_weights

STEP = 0.002
WEIGHTS = filter_weights(0.004, 0, STEP)


def remembering(count: int, time: float, variance: float, draw: np.random.Generator) -> NDArray[np.float64]:
    """A first-order process, begun long before."""
    memory = np.exp(-STEP / time)
    white = np.sqrt(variance * (1.0 - memory**2)) * draw.standard_normal(count + 2000)
    result: NDArray[np.float64] = lfilter([1.0], [1.0, -memory], white)[2000:]
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
