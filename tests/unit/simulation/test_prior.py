"""What a deck states of its numbers, drawn and narrowed; against laws of the normal distribution by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Prior, declared_prior
from tests.renamed import in_words, renamed

AREA, INERTIA = "spring.rubber.area", "motor.inertia"
CONSTANT, FRICTION = "motor.torque_constant", "dry_friction.sliding_effort"


@pytest.fixture(scope="module")
def model() -> FlatModel:
    return flatten(declare(load_deck("austin2015_figure_consistent")))


def two(correlation: float = 0.0) -> Prior:
    a, b = math.log(1.1), math.log(1.2)
    covariance = np.array([[a * a, correlation * a * b], [correlation * a * b, b * b]])
    return Prior(("a", "b"), np.array([2.0, -3.0]), covariance)


def test_a_spread_is_a_factor_of_one_standard_deviation(model: FlatModel) -> None:
    prior = declared_prior(model)
    declared = {v.name: v.spread.share(v.start) for v in model.parameters if v.spread and v.start != 0.0}
    assert prior.spreads() == pytest.approx(declared)
    drawn = prior.draws(20_000, seed=1)
    for name in (AREA, CONSTANT, FRICTION):
        inside, value = np.sort(drawn[name]), model.values[name]
        quantiles = inside[[3173, 10_000, 16_827]]  # 15.87, 50 and 84.13 %
        factor = 1.0 + declared[name]
        # The standard error of a quantile at one sigma from 20,000 draws is 1.2 % of a sigma; four of them.
        scatter = 0.05 * math.log(factor)
        assert np.log(quantiles / value) == pytest.approx(
            [-math.log(factor), 0.0, math.log(factor)], abs=scatter
        )


def test_no_draw_changes_a_sign(model: FlatModel) -> None:
    prior = declared_prior(model)
    drawn = prior.draws(5_000, seed=2)
    assert set(drawn) == set(prior.names)
    for name, value in zip(prior.names, prior.values, strict=True):
        assert np.all(drawn[name] * value > 0.0), name
    assert np.any(np.abs(prior.values) != prior.values), "the contour of this deck begins below zero"


def test_a_shape_is_drawn_with_one_factor_and_moduli_are_not(model: FlatModel) -> None:
    prior = declared_prior(model)
    drawn = prior.draws(7, seed=3)
    shape = [n for n in prior.names if n.startswith("spring.cam.lever_arm[")]
    assert len(shape) == 40
    factors = np.array([drawn[n] / model.values[n] for n in shape])
    assert np.ptp(factors, axis=0) == pytest.approx(np.zeros(7), abs=1e-9)
    assert np.ptp(factors[0]) > 0.0
    stiff = [n for n in prior.names if n.startswith("spring.rubber.stiff.modulus[")]
    assert len(stiff) == 6
    assert prior.correlation(stiff[0], stiff[1]) == 0.0
    assert prior.correlation(shape[0], shape[-1]) == pytest.approx(1.0)


def test_draws_follow_the_seed_and_not_the_names(model: FlatModel) -> None:
    machine = renamed(declare(load_deck("austin2015_figure_consistent")), in_words)
    drawn = declared_prior(model).draws(5, seed=4)
    other = declared_prior(flatten(machine.assembly)).draws(5, seed=4)
    for name, values in drawn.items():
        assert other[machine.name(name)].tolist() == values.tolist()
    assert declared_prior(model).draws(5, seed=5)[AREA].tolist() != drawn[AREA].tolist()


def test_draws_have_the_covariance() -> None:
    prior = two(-0.8)
    drawn = prior.draws(40_000, seed=6)
    x = np.log([drawn["a"] / 2.0, drawn["b"] / -3.0])
    assert np.corrcoef(x)[0, 1] == pytest.approx(-0.8, abs=0.01)
    assert np.std(x, axis=1) == pytest.approx([math.log(1.1), math.log(1.2)], rel=0.02)


def test_draws_stay_in_the_range_of_the_law() -> None:
    wide = np.array([[math.log(2.0) ** 2]])
    prior = Prior(("efficiency",), np.array([0.8]), wide, np.array([0.0]), np.array([1.0]))
    drawn = prior.draws(2_000, seed=7)["efficiency"]
    assert drawn.max() == 1.0
    assert drawn.min() > 0.0


def test_a_product_that_is_measured_narrows_the_product_alone() -> None:
    # ln(a·b) known to 0.001 by one measurement; by hand, var(a) falls to σa²·σb²/(σa² + σb²).
    known = two().after(np.array([[1.0, 1.0], [1.0, 1.0]]) / 0.001**2)
    a2, b2 = math.log(1.1) ** 2, math.log(1.2) ** 2
    left = a2 * b2 / (a2 + b2)
    assert known.deviations == pytest.approx([math.sqrt(left)] * 2, rel=1e-4)
    assert known.correlation("a", "b") == pytest.approx(-1.0, abs=1e-4)
    product, quotient = known.deviation_of(np.array([[1.0, 1.0], [1.0, -1.0]]))
    assert product == pytest.approx(0.001, rel=1e-4)
    assert quotient == pytest.approx(2.0 * math.sqrt(left), rel=1e-4)
    assert known.values.tolist() == [2.0, -3.0]


def test_measurements_of_each_number_add_their_information() -> None:
    known = two().after(np.diag([100.0, 400.0]))
    a2, b2 = math.log(1.1) ** 2, math.log(1.2) ** 2
    assert known.deviations**2 == pytest.approx([1.0 / (1.0 / a2 + 100.0), 1.0 / (1.0 / b2 + 400.0)])


def test_what_shares_a_factor_shares_what_is_learned(model: FlatModel) -> None:
    prior = declared_prior(model)
    first, last = prior.place("spring.cam.lever_arm[1]"), prior.place("spring.cam.lever_arm[40]")
    information = np.zeros((len(prior.names), len(prior.names)))
    information[first, first] = 1.0 / 0.001**2
    known = prior.after(information)
    expected = 1.0 / math.sqrt(1.0 / math.log(1.02) ** 2 + 1.0 / 0.001**2)
    assert known.deviations[[first, last]] == pytest.approx([expected] * 2)
    untouched = prior.place(AREA)
    assert known.deviations[untouched] == pytest.approx(prior.deviations[untouched])


def test_some_of_the_numbers_keep_their_covariance() -> None:
    prior = two(0.5)
    assert prior.only(["b", "a"]).correlation("a", "b") == pytest.approx(0.5)
    assert prior.only(["b"]).values.tolist() == [-3.0]
    with pytest.raises(UnknownNameError, match="'c'"):
        prior.only(["c"])


def test_a_model_without_spreads_has_nothing_to_draw(model: FlatModel) -> None:
    exact = declared_prior(model).only([])
    assert exact.draws(3, seed=0) == {}
    assert exact.after(np.zeros((0, 0))).names == ()


@pytest.mark.parametrize(
    ("values", "covariance"),
    [
        ([0.0], [[1.0]]),
        ([math.nan], [[1.0]]),
        ([1.0], [[-1.0]]),
        ([1.0, 2.0], [[1.0]]),
        ([1.0, 2.0], [[1.0, 2.0], [2.0, 1.0]]),
        ([1.0, 2.0], [[1.0, 0.5], [0.1, 1.0]]),
    ],
)
def test_what_is_no_prior_is_refused(values: list[float], covariance: list[list[float]]) -> None:
    names = ("a", "b")[: len(values)]
    with pytest.raises(ValueRangeError):
        Prior(names, np.array(values), np.array(covariance))
