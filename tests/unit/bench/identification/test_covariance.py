"""Covariances of fitted numbers against the scatter of many fits, where residuals remember."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from nlsdesign.bench.identification.covariance import Piece, covariance_by_records, robust_covariance
from nlsdesign.foundation.arrays import Array

COUNT, STEP = 600, 0.01
NOTHING = np.zeros((0, 2))


def slopes() -> Array:
    """A constant, and a slow wave."""
    time = STEP * np.arange(COUNT)
    return np.column_stack([np.ones(COUNT), np.sin(2.0 * np.pi * 0.5 * time)])


def fitted(seed: int, memory: float) -> tuple[Array, list[Piece]]:
    """Two numbers fitted to two records of one block whose residuals remember."""
    draw, x = np.random.default_rng(seed), slopes()
    noise = [lfilter([1.0], [1.0, -memory], draw.standard_normal(COUNT + 300))[300:] for _ in range(2)]
    whole, rest = np.vstack([x, x]), np.concatenate(noise)
    values = np.linalg.lstsq(whole, rest, rcond=None)[0]
    pieces = [
        Piece("motor", f"r{k}", STEP * np.arange(COUNT), n - x @ values, x) for k, n in enumerate(noise)
    ]
    return values, pieces


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_stated_errors_are_those_of_many_fits(memory: float) -> None:
    fits = [fitted(seed, memory) for seed in range(150)]
    true = np.std([values for values, _ in fits], axis=0)
    stated = np.mean([np.sqrt(np.diag(robust_covariance(p, NOTHING))) for _, p in fits[:30]], axis=0)
    np.testing.assert_allclose(stated, true, rtol=0.3)


def test_residuals_that_follow_the_slopes_count_beyond_what_their_size_says() -> None:
    """Each segment wants another number: their scatter is the error, not the size of what is left."""
    draw, x = np.random.default_rng(1), slopes()[:, 1:]
    wanted = np.repeat(draw.standard_normal(20), COUNT // 20)[:, None]
    whole = np.concatenate([(wanted * x).ravel(), (wanted[::-1] * x).ravel()])
    value = np.linalg.lstsq(np.vstack([x, x]), whole, rcond=None)[0]
    pieces = [
        Piece("motor", f"r{k}", STEP * np.arange(COUNT), part - (x @ value), x)
        for k, part in enumerate(np.split(whole, 2))
    ]
    left = np.concatenate([p.residual for p in pieces])
    as_if_independent = np.mean(left**2) / (2.0 * np.sum(x**2))
    scatter = np.std(wanted) ** 2 / 40.0
    found = robust_covariance(pieces, np.zeros((0, 1)))[0, 0]
    assert found > 3.0 * as_if_independent
    assert found > 0.4 * scatter


def wanting(records: int, seed: int) -> tuple[float, list[Piece]]:
    """One number fitted to records each of which wants another one throughout: a model lacks something."""
    draw, x = np.random.default_rng(seed), slopes()[:, 1:]
    runs = [(x * draw.standard_normal()).ravel() + 0.1 * draw.standard_normal(COUNT) for _ in range(records)]
    value = np.linalg.lstsq(np.vstack([x] * records), np.concatenate(runs), rcond=None)[0]
    time = STEP * np.arange(COUNT)
    return float(value[0]), [Piece("motor", f"r{k}", time, run - x @ value, x) for k, run in enumerate(runs)]


def test_what_a_model_lacks_throughout_a_record_scatters_from_record_to_record() -> None:
    none, fits = np.zeros((0, 1)), [wanting(6, seed) for seed in range(100)]
    true = float(np.std([value for value, _ in fits]))
    by_segments = [robust_covariance(pieces, none) for _, pieces in fits]
    by_records = [
        covariance_by_records(pieces, none, known)
        for (_, pieces), known in zip(fits, by_segments, strict=True)
    ]
    stated = [float(np.sqrt(np.mean(each))) for each in (by_segments, by_records)]
    assert stated[0] < 0.6 * true, "or the test would show nothing"
    assert stated[1] == pytest.approx(true, rel=0.25)


def test_what_comes_in_the_middle_of_each_record_is_no_better_known_than_the_change() -> None:
    """A load that is put on halfway: the fitted one lies between, and no record differs from another."""
    draw, none, x = np.random.default_rng(4), np.zeros((0, 1)), slopes()[:, 1:]
    late = np.where(np.arange(COUNT) < COUNT // 2, 1.0, 2.0)[:, None]
    runs = [(late * x).ravel() + 0.1 * draw.standard_normal(COUNT) for _ in range(4)]
    value = float(np.linalg.lstsq(np.vstack([x] * 4), np.concatenate(runs), rcond=None)[0][0])
    time = STEP * np.arange(COUNT)
    pieces = [Piece("motor", f"r{k}", time, run - value * x[:, 0], x) for k, run in enumerate(runs)]
    known = robust_covariance(pieces, none)
    error = float(np.sqrt(covariance_by_records(pieces, none, known)[0, 0]))
    assert value == pytest.approx(1.5, abs=0.02)
    assert 2.0 * float(np.sqrt(known[0, 0])) < 0.3, "or the test would show nothing"
    assert error == pytest.approx(0.5 / np.sqrt(8.0), rel=0.15), "eight halves, each 0.5 away"


def test_two_records_tell_nothing_of_a_scatter() -> None:
    pieces = wanting(2, 0)[1]
    known = robust_covariance(pieces, np.zeros((0, 1)))
    assert covariance_by_records(pieces, np.zeros((0, 1)), known) is known


def test_a_number_of_which_one_segment_alone_tells_is_not_known_exactly() -> None:
    x = slopes()
    x[:, 1] = 0.0
    x[100:110, 1] = 1.0
    draw = np.random.default_rng(2)
    rest = draw.standard_normal(COUNT)
    values = np.linalg.lstsq(x, rest, rcond=None)[0]
    pieces = [Piece("motor", "r0", STEP * np.arange(COUNT), rest - x @ values, x)]
    error = np.sqrt(robust_covariance(pieces, NOTHING)[1, 1])
    assert error > 0.8 / np.sqrt(10.0)


def test_what_nothing_tells_keeps_its_prior() -> None:
    x = slopes()
    x[:, 1] = 0.0
    prior = np.array([[0.0, 1.0 / 0.3]])
    pieces = [
        Piece("motor", "r0", STEP * np.arange(COUNT), np.random.default_rng(3).standard_normal(COUNT), x)
    ]
    assert robust_covariance(pieces, prior)[1, 1] == pytest.approx(0.09, rel=1e-6)
