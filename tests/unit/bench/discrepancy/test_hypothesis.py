"""A hypothesis and its excess, and the judgement on another rig, on tallies and numbers made by hand."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects.effect import Candidate, Unknown
from nlsdesign.bench.discrepancy.fitting import Tally
from nlsdesign.bench.discrepancy.screening.wrong_numbers import (
    numbers_explain,
    other_numbers,
    with_numbers_let_go,
)
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis, excesses
from nlsdesign.bench.discrepancy.selection.measures import DECLARED
from nlsdesign.bench.identification import Parameter
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.components import Assembly, Fixed, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.quantity import Quantity

SPREAD = 0.2
RANGE = math.log1p(SPREAD)


def rig() -> Assembly:
    def number(value: float, unit: str) -> Quantity:
        return replace(Quantity(value, unit, "by hand"), spread=SPREAD)

    spring = Spring(stiffness=number(2.0, "N*m/rad"))
    return assembly(
        "rig",
        wheel=Inertia(inertia=number(1e-3, "kg*m^2")),
        wall=Fixed(),
        spring=tie(spring, "wheel", "wall"),
    )


def fitted(error: float = 1e-3, **factors: float) -> Fit:
    """Numbers at a multiple of what is declared, each with a prior of its declared range."""
    names = {n.replace("_", ".", 1): f for n, f in factors.items()}
    numbers = rig().quantities()
    parameters = tuple(
        Parameter(n, numbers[n].unit, v, v, RANGE / math.sqrt(3.0), v / 9, v * 9, "log")
        for n in names
        for v in [numbers[n].number]
    )
    values = {n: f * numbers[n].number for n, f in names.items()}
    return Fit(parameters, values, error**2 * np.eye(len(names)), 1.0, {}, True)


class BenchByHand:
    """Two fitted records, one for selection, one held out."""

    def __init__(self) -> None:
        block = SimpleNamespace(unit="N*m")
        self.block_noise = {
            name: SimpleNamespace(typical=floor, known=math.inf, block=block)
            for name, floor in (("spring", 0.1), ("wheel", 0.5))
        }
        self.roles = {"a": "fit", "b": "fit", "c": "selection", "d": "held_out"}

    @property
    def records(self) -> BenchByHand:
        return self

    def of(self, *roles: str) -> list[SimpleNamespace]:
        return [SimpleNamespace(name=n) for n, role in self.roles.items() if role in roles]


BENCH = cast(Bench, BenchByHand())
RULE = Criteria()


def with_mean_squares(**records: float) -> Hypothesis:
    tallies = {("spring", name): Tally(100.0 * each, 100, 50.0) for name, each in records.items()}
    return Hypothesis(rig(), tallies=tallies)


# --- hypothesis -----------------------------------------------------------------------------------


@pytest.mark.parametrize("mean_square", [1.0, 4.0])
def test_numbers_beside_an_open_block_are_as_known_as_its_records_agree(mean_square: float) -> None:
    fit = replace(fitted(0.1, spring_stiffness=1.0), by_records=np.array([[0.04]]))
    hypothesis = replace(with_mean_squares(a=mean_square), fits={("spring",): fit})
    left = excesses(hypothesis, BENCH, RULE)
    (known,) = hypothesis.as_known_beside(left).fits.values()
    assert known.covariance[0, 0] == pytest.approx(0.04 if left["spring"].open else 0.01)
    assert left["spring"].open == (mean_square > 1.0)


def test_a_standard_error_holds_what_no_record_tells_from_the_number() -> None:
    fit = fitted(0.1, spring_stiffness=1.0)
    known = fit.standard_error("spring.stiffness")
    late = replace(fit, parameters=tuple(replace(p, confounded=2.0 * known) for p in fit.parameters))
    assert late.standard_error("spring.stiffness") == pytest.approx(math.sqrt(5.0) * known)


def test_a_hypothesis_lists_its_effects_and_their_numbers_in_the_order_of_adding() -> None:
    one = Candidate("one", "wheel", rig(), (Unknown("x", (1.0,), 0.1, 9.0),), "", "")
    two = Candidate("two", "wheel", rig(), (Unknown("y", (1.0,), 0.1, 9.0),), "", "")
    hypothesis = Hypothesis(rig(), (one, two))
    assert hypothesis.names == ("one", "two")
    assert hypothesis.newest is two
    assert [u.name for u in hypothesis.unknowns] == ["x", "y"]


def test_a_hypothesis_has_the_fitted_numbers_in_its_assembly_and_their_departure_as_prior() -> None:
    fit = fitted(spring_stiffness=1.2, wheel_inertia=1.0 / 1.2)
    hypothesis = Hypothesis(rig(), values=fit.values, fits={("spring", "wheel"): fit})
    assert hypothesis.fitted.quantities()["spring.stiffness"].number == pytest.approx(2.4)
    # Both at the edge of their range, which is √3 standard deviations away.
    assert hypothesis.prior == pytest.approx(2 * 3.0)


def test_an_unpredictable_record_counts_as_the_others_in_a_hypothesis() -> None:
    hypothesis = replace(with_mean_squares(a=1.0), unpredictable=frozenset({("spring", "b")}))
    tallies = {("spring", "a"): Tally(150.0, 100, 50.0), ("spring", "b"): Tally(9e3, 100, 50.0)}
    assert hypothesis.judged_by(tallies).tallies["spring", "b"].squares == pytest.approx(150.0)


# --- excess ---------------------------------------------------------------------------------------


def test_an_excess_sums_over_the_records_as_predicted_and_is_shown_in_the_unit_of_the_block() -> None:
    plain = with_mean_squares(a=4.0, b=2.0)
    tallies = {key: t._replace(segments=(t.squares, 0.5 * t.squares)) for key, t in plain.tallies.items()}
    found = excesses(replace(plain, tallies=tallies), BENCH, RULE)["spring"]
    assert (found.chi2, found.rows) == (900.0, 200)
    assert (found.fit, found.predicted) == (
        pytest.approx(0.1 * math.sqrt(3)),
        pytest.approx(0.1 * math.sqrt(4.5)),
    )
    assert found.pieces == {"a": (400.0, 200.0), "b": (200.0, 100.0)}
    assert found.unit == "N*m"
    assert found.open


def test_a_block_is_open_beyond_what_its_independent_residuals_allow() -> None:
    """With 100 independent residuals noise stays below 1 + 5·√(2/100) = 1.71."""
    assert excesses(with_mean_squares(a=1.8, b=1.8), BENCH, RULE)["spring"].open
    assert not excesses(with_mean_squares(a=1.6, b=1.6), BENCH, RULE)["spring"].open


def test_a_block_is_closed_on_a_record_by_the_independent_residuals_of_that_record_alone() -> None:
    """With 50 independent residuals noise stays below 1 + 5·√(2/50) = 2."""
    found = excesses(with_mean_squares(a=1.9, b=2.1), BENCH, RULE)["spring"]
    assert found.open
    assert found.closed_on == {"a"}


def test_the_declared_numbers_are_open_beyond_the_edge_of_their_ranges() -> None:
    for factor, is_open in ((1.15, False), (1.25, True)):
        fit = fitted(spring_stiffness=factor, wheel_inertia=factor)
        hypothesis = replace(with_mean_squares(a=1.0), fits={("spring",): fit})
        found = excesses(hypothesis, BENCH, RULE)[DECLARED]
        assert found.open is is_open
        assert found.fit == pytest.approx(math.sqrt(3.0) * math.log(factor) / RANGE)


def test_numbers_that_coloured_noise_moves_are_not_beyond_their_ranges_unless_a_block_is_open() -> None:
    """Known to two standard deviations of the prior, where white noise would let it be one half."""
    sigma = RANGE / math.sqrt(3.0)
    fit = fitted(2.0 * sigma, spring_stiffness=1.25, wheel_inertia=1.25)
    fit = replace(fit, white=(0.5 * sigma) ** 2 * np.eye(2))
    assert fit.expected_prior_squares() == pytest.approx(2 * (1.0 + 4.0 - 2.0 * 0.25))
    for mean_square, is_open in ((1.0, False), (9.0, True)):
        hypothesis = replace(with_mean_squares(a=mean_square), fits={("spring",): fit})
        assert excesses(hypothesis, BENCH, RULE)[DECLARED].open is is_open


def test_coloured_noise_moves_fitted_numbers_as_far_as_is_expected() -> None:
    """Against 4000 linear fits of numbers drawn from their priors, residuals counted as independent."""
    draw = np.random.default_rng(7)
    slope = draw.standard_normal((60, 2)).cumsum(axis=0) / 6.0
    sigma = RANGE / math.sqrt(3.0)
    for time in (0.0, 8.0):
        apart = np.abs(np.subtract.outer(np.arange(60), np.arange(60)))
        noise = np.exp(-apart / time) if time else np.eye(60)
        slopes, prior = slope / (3.0 * sigma), np.eye(2) / sigma**2
        white = np.linalg.inv(slopes.T @ slopes + prior)
        scatter = white @ (slopes.T @ noise @ slopes + prior) @ white
        gain, root = white @ slopes.T, np.linalg.cholesky(noise)
        moved = [gain @ (slopes @ (sigma * draw.standard_normal(2)) + root @ draw.standard_normal(60))
                 for _ in range(4000)]  # fmt: skip
        fit = replace(fitted(spring_stiffness=1.0, wheel_inertia=1.0), covariance=scatter, white=white)
        squares = float(np.mean(np.sum(np.square(moved), axis=1))) / sigma**2
        if time:
            assert squares > 2.0
            assert fit.expected_prior_squares() == pytest.approx(squares, rel=0.1)
        else:
            assert squares < fit.expected_prior_squares() == pytest.approx(2.0)


# --- another rig ----------------------------------------------------------------------------------


class Freed:
    """A comparison in which numbers let go leave a given mean square."""

    def __init__(self, fit: Fit, left: float) -> None:
        self.bench, self._fit, self._left = BENCH, fit, left

    def polished(self, hypothesis: Hypothesis, *, released: Collection[str] = ()) -> Hypothesis:
        assert released
        free = with_mean_squares(a=self._left, d=self._left)
        return replace(free, values=self._fit.values, fits={("spring",): self._fit})


STUCK = fitted(spring_stiffness=1.2**1.98, wheel_inertia=1.2**-1.98)
FAR = fitted(spring_stiffness=1.2**6, wheel_inertia=1.0)


def refitted(mean_square: float, fit: Fit = STUCK) -> Hypothesis:
    return replace(with_mean_squares(a=mean_square, d=mean_square), fits={("spring",): fit})


def asked(base: Hypothesis, better: Hypothesis, free: Fit = FAR, left: float = 1.0) -> tuple[bool, str]:
    found = other_numbers(cast(Comparison, Freed(free, left)), base, better, RULE)
    return found.decides, found.words


def test_records_are_of_another_rig_if_far_numbers_explain_all_that_no_effect_does() -> None:
    base = refitted(101.0)
    decides, words = asked(base, base)
    assert decides
    assert "explains 100 % of the excess" in words
    assert "spring.stiffness is 5.97 N·m/rad, 6 standard deviations away" in words


def test_numbers_at_their_ends_are_mentioned_where_they_do_not_decide() -> None:
    base = refitted(101.0)
    decides, words = asked(base, base, left=4.0)
    assert not decides, "numbers let go explain 97 % only"
    assert words.startswith("2 of 2 refitted numbers stand at the end of what their declared spread allows")
    near = fitted(spring_stiffness=1.2**3)
    assert not asked(base, base, free=near)[0], "three standard deviations away are none of another rig"
    unsure = fitted(0.5, spring_stiffness=1.2**6)
    assert not asked(base, base, free=unsure)[0], "six with an error of three are none either"


def test_nothing_is_said_where_numbers_are_inside_their_ranges_or_nothing_is_lacking() -> None:
    inside = refitted(101.0, fitted(spring_stiffness=1.2, wheel_inertia=1.2))
    assert asked(inside, inside) == (False, "")
    one = refitted(101.0, fitted(spring_stiffness=1.2**1.98, wheel_inertia=1.0))
    assert asked(one, one) == (False, ""), "one number alone is no other rig"
    assert asked(refitted(1.0), refitted(1.0)) == (False, "")


def test_an_effect_that_explains_nearly_all_is_the_simpler_explanation() -> None:
    base = refitted(101.0)
    assert asked(base, refitted(9.0))[0], "8 % left by the effect, nothing by the numbers"
    assert not asked(base, refitted(5.0))[0], "4 % left by the effect"


def test_numbers_must_explain_98_percent_and_twice_what_effects_do() -> None:
    def explain(share: float = 1.0, left: float = 0.0, after: float = 50.0, *, named: bool = True) -> bool:
        return numbers_explain(share, left=left, after=after, before=100.0, named=named)

    assert explain()
    assert not explain(share=0.97)
    assert not explain(left=26.0)
    assert explain(left=24.0)
    assert not explain(after=4.0)
    assert explain(after=4.0, named=False)


# --- a wrong number -------------------------------------------------------------------------------


def let_go(base: Hypothesis, free: Fit, left: float) -> Hypothesis | None:
    class Released(Freed):
        def polished(self, hypothesis: Hypothesis, *, released: Collection[str] = ()) -> Hypothesis:
            done = super().polished(hypothesis, released=released)
            return replace(done, assembly=hypothesis.assembly, released=frozenset(released))

    return with_numbers_let_go(cast(Comparison, Released(free, left)), base, RULE)


def test_numbers_at_their_ends_are_let_go_only_where_something_is_left() -> None:
    assert let_go(refitted(101.0), FAR, 1.0) is not None
    assert let_go(refitted(1.3), FAR, 0.5) is None, "no block is open, whatever other numbers gain"
    inside = refitted(101.0, fitted(spring_stiffness=1.1, wheel_inertia=1.1))
    assert let_go(inside, FAR, 1.0) is None, "no number stands at its end"
    assert let_go(refitted(101.0), FAR, 60.0) is None, "it explains less than half"
    near = fitted(spring_stiffness=1.2**1.9, wheel_inertia=1.0)
    assert let_go(refitted(101.0), near, 1.0) is None, "the number ends inside twice its range"
