"""Where fits begin and which records they follow, with the least squares replaced by a notebook."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import fitting as strategies
from nlsdesign.bench.discrepancy.effects import backlash
from nlsdesign.bench.discrepancy.effects.effect import Candidate, Unknown
from nlsdesign.bench.discrepancy.fitting import (
    BUDGET,
    Continuation,
    FitProblem,
    Key,
    Limits,
    RobustOverFreeFlight,
    Smooth,
    Start,
    Strategy,
    Tally,
    best_fit,
    fit_of_nothing,
    method_for,
    refusal,
)
from nlsdesign.bench.discrepancy.selection.comparison import FreeBlock, GroupFit, HypothesisFit
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.identification import Parameter
from nlsdesign.bench.identification.equation_error.block import Drive
from nlsdesign.bench.identification.equation_error.evidence import Bench, Evidence
from nlsdesign.bench.identification.least_squares import Fit, Promise
from nlsdesign.components import Fixed
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ConvergenceError
from nlsdesign.model import Variable

BLANK = assembly("blank", load=Fixed())


def start(value: float, name: str = "spring.gap") -> Start:
    return (Parameter(name, "rad", value, value, np.inf, 0.0, 10.0, "linear"),)


ENDED = Fit(start(0.1), {"spring.gap": 0.1}, np.eye(1), 1.0, {}, True)


@dataclass
class Notebook:
    """Stands for the least squares: ends where it began, at a cost that is a table of starts."""

    costs: Mapping[float, float] = field(default_factory=dict)
    near: Mapping[float, float] = field(default_factory=dict)
    steps: Mapping[float, float] = field(default_factory=dict)
    held: list[Collection[str]] = field(default_factory=list)
    fits: list[dict[str, Any]] = field(default_factory=list)

    def fit(self, evidence: Sequence[Evidence], parameters: Start, **settings: Any) -> Fit:
        begin = parameters[0].start
        names = [e.record.name for e in evidence]
        self.fits.append({"start": begin, "records": names, **settings})
        cost = self.costs.get(begin, 1.0)
        if cost == np.inf:
            raise ConvergenceError("block 'spring'", "its response is not finite", next_step="give up")
        values = {p.name: p.start for p in parameters}
        known = tuple(replace(p, sigma=p.sigma or 1.0) for p in parameters)
        return Fit(known, values, np.eye(len(parameters)), cost, {}, True)

    def promised_costs(
        self, evidence: Sequence[Evidence], parameters: Start, held: Collection[str]
    ) -> Promise:
        self.held.append(held)
        begin = parameters[0].start
        far = self.costs.get(begin, 1.0)
        return Promise(self.near.get(begin, far), far)

    def step(self, evidence: Sequence[Evidence], parameters: Start) -> tuple[float, Start]:
        """Lead to a hundredth of where a fit would begin, with the cost that a table promises there."""
        begin = parameters[0].start
        if begin not in self.steps:
            raise ConvergenceError("block 'spring'", "its response is not finite", next_step="give up")
        return self.steps[begin], tuple(replace(p, start=0.01 * p.start) for p in parameters)


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> Notebook:
    written = Notebook()
    monkeypatch.setattr(strategies, "fit", written.fit)
    monkeypatch.setattr(strategies, "promised_costs", written.promised_costs)
    monkeypatch.setattr(strategies, "gauss_newton_step", written.step)
    return written


def evidence(name: str, role: str, rate: float, *, stiff: bool = False, size: int = 100) -> Evidence:
    trace = {"q": np.sin(rate * 0.001 * np.arange(1000))}
    block = SimpleNamespace(name="spring", drives={"q": Drive("q", 1)})
    driven = SimpleNamespace(block=block, stiff=stiff, instructions=size)
    return cast(
        Evidence,
        SimpleNamespace(driven=driven, record=SimpleNamespace(name=name, role=role, trace=trace, step=0.001)),
    )


def problem(*, stiff: bool = False, size: int = 100, **changes: Any) -> FitProblem:
    """Four fitted records of which "d" is the quickest, one held out; 100 rows each."""
    rates = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 40.0}
    seen = [evidence(n, "fit", rate, stiff=stiff, size=size) for n, rate in rates.items()]
    whole = FitProblem(
        cast(Bench, None),
        BLANK,
        ("spring",),
        (start(0.1), start(0.5)),
        (*seen, evidence("e", "held_out", 1.5, stiff=stiff, size=size)),
        ("spring.gap",),
        {("spring", n): Tally(2100.0, 100, 50.0) for n in "abcde"},
        frozenset(),
        1,
        False,
        True,
    )
    return replace(whole, **changes)


# --- limits and refusals --------------------------------------------------------------------------


def test_a_first_look_ends_earlier_than_a_fit_to_all_samples() -> None:
    assert problem().limits == Limits(20, 1e-3, 0.0)
    # Half of the squares of the four fitted records; the held-out one is not looked at.
    assert problem().cost_before == 0.5 * 4 * 2100.0
    assert problem(coarse=False).limits == Limits(40, 2e-5, 0.0)
    assert problem(coarse=False, effects=0).limits == Limits(40, 0.0, 0.0)
    assert problem(size=BUDGET.long_step + 1).limits.evaluations == 6
    assert problem(size=BUDGET.long_step + 1, effects=0).limits.evaluations == 20


def test_only_a_further_effect_can_be_too_expensive() -> None:
    long, many = BUDGET.expensive_step + 1, tuple(start(0.1 * k) for k in range(BUDGET.most_starts + 1))
    assert refusal(problem(size=long)) == ""
    assert "100001 operations per step" in refusal(problem(size=long, effects=2))
    assert refusal(problem(effects=2, starts=many)) == ""
    assert "9 starts" in refusal(problem(effects=2, starts=many, beside_free_flight=True))
    assert refusal(problem(effects=2, starts=many[1:], beside_free_flight=True)) == ""


# --- smooth ---------------------------------------------------------------------------------------


def test_the_best_start_is_fitted_first_and_what_promises_less_not_at_all(notebook: Notebook) -> None:
    notebook.costs = {0.1: 5.0, 0.5: 2.0}
    assert isinstance(method_for(problem()), Smooth)
    ended = method_for(problem()).fit(problem(), Strategy())
    assert ended.values == {"spring.gap": 0.5}
    assert [f["start"] for f in notebook.fits] == [0.5]
    assert notebook.fits[0]["records"] == ["a", "b", "c", "d"]
    assert notebook.fits[0]["known"] is None


def test_starts_are_ranked_by_what_they_reach_without_leaving_their_place(notebook: Notebook) -> None:
    """Slopes in a number with several minima promise the third start most, and lead nowhere from it."""
    notebook.costs, notebook.near = {0.1: 5.0, 0.5: 6.0, 0.9: 1.0}, {0.1: 8.0, 0.5: 7.0, 0.9: 9.0}
    best_fit([], [start(value) for value in (0.1, 0.5, 0.9)], Limits(5, 0.0))
    assert [f["start"] for f in notebook.fits] == [0.5, 0.1, 0.9]
    assert notebook.held == [{"spring.gap"}] * 3
    both = [(*start(value), *start(0.2, "spring.width")) for value in (0.1, 0.5)]
    best_fit([], both, Limits(5, 0.0))
    assert notebook.held[-1] == {"spring.gap"}, "a number with one start is not held"


def test_a_start_without_a_response_says_nothing_of_the_others(notebook: Notebook) -> None:
    notebook.costs = {0.1: np.inf, 0.5: 2.0}
    assert best_fit([], [start(0.1), start(0.5)], Limits(5, 0.0)).values == {"spring.gap": 0.5}
    with pytest.raises(ConvergenceError, match="not finite"):
        best_fit([], [start(0.1)], Limits(5, 0.0))


def test_a_fit_does_not_follow_what_is_unpredictable_unless_nothing_else_is_left(notebook: Notebook) -> None:
    set_aside = problem(unpredictable=frozenset({("spring", "d")}))
    Smooth().fit(set_aside, Strategy())
    assert notebook.fits[0]["records"] == ["a", "b", "c"]
    everything = problem(unpredictable=frozenset(("spring", n) for n in "abcd"))
    Smooth().fit(everything, Strategy())
    assert notebook.fits[-1]["records"] == ["a", "b", "c", "d"]
    after = {("spring", n): Tally(1e9, 100, 50.0) for n in "abcde"}
    assert Smooth().set_aside(set_aside, ENDED, after) == {("spring", "d")}


# --- free flight ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Begun(Strategy):
    """Begins at given values."""

    at: tuple[float, ...]

    def beginnings(self, problem: FitProblem, slow: Sequence[Evidence]) -> list[Start]:
        assert [e.record.name for e in slow] == ["a", "b", "c"]
        return [start(value) for value in self.at]


def test_free_flight_is_fitted_to_the_slower_records_first_and_robustly(notebook: Notebook) -> None:
    flying = problem(stiff=True)
    method = method_for(flying)
    assert isinstance(method, RobustOverFreeFlight)
    method.fit(flying, Strategy())
    slow, last = notebook.fits[0], notebook.fits[-1]
    assert (slow["records"], slow["evaluations"], slow["known"]) == (["a", "b", "c"], 6, {})
    assert slow["least"] == pytest.approx(0.1 * last["least"])
    assert (last["records"], last["evaluations"]) == (["a", "b", "c", "d"], 3)
    assert last["known"] == {("spring", n): 2100.0 for n in "abcde"}


def test_a_further_effect_and_a_polish_have_fewer_evaluations(notebook: Notebook) -> None:
    RobustOverFreeFlight().fit(problem(stiff=True, effects=2), Strategy())
    assert [f["evaluations"] for f in notebook.fits] == [2, 1]
    notebook.fits.clear()
    RobustOverFreeFlight().fit(problem(stiff=True, coarse=False), Strategy())
    assert [(f["evaluations"], f["records"]) for f in notebook.fits] == [(2, ["a", "b", "c", "d"])]


@pytest.mark.parametrize(("cost", "evaluations"), [(2249.0, 6), (2251.0, 0)])
def test_what_a_continuation_begins_is_fitted_if_it_explains_enough(
    notebook: Notebook, cost: float, evaluations: int
) -> None:
    """Half of 3·2100 is 3150, half of the noise 150: 30 % of what lies between are 900."""
    notebook.costs = {0.2: cost, 0.3: 3000.0}
    RobustOverFreeFlight().fit(problem(stiff=True), Begun((0.3, 0.2)))
    looks, fits = notebook.fits[:2], notebook.fits[2:]
    assert [f["evaluations"] for f in looks] == [0, 0]
    assert [(f["start"], f["evaluations"]) for f in fits] == [(0.2, evaluations), (0.2, evaluations // 2)]


def test_a_held_number_stands_at_a_multiple_within_its_bounds_and_the_others_where_they_ended() -> None:
    gap, size = (*start(0.1), *start(0.3, "spring.size"))
    fitted = Fit((gap, size), {"spring.gap": 2.0, "spring.size": 0.7}, np.eye(2), 1.0, {}, True)
    held, free = strategies._held(fitted, "spring.gap", 1.2)
    assert held.start == pytest.approx(2.4)
    assert held.lower == pytest.approx(2.4, rel=0.01)
    assert held.upper == pytest.approx(2.4, rel=0.01)
    assert held.lower < held.start < held.upper
    assert free == replace(size, start=0.7)
    top, _ = strategies._held(fitted, "spring.gap", 7.0)
    assert top.start == 10.0, "the upper bound"
    bounded = Fit((replace(gap, lower=1.5), size), fitted.values, np.eye(2), 1.0, {}, True)
    assert strategies._held(bounded, "spring.gap", 0.5)[0].start == 1.5, "the lower bound"


def test_a_new_effect_may_leave_a_quick_record_unpredicted_whose_neighbours_diverge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def diverging(evidence: Evidence, best: Fit) -> bool:
        asked.append(evidence.record.name)
        return True

    monkeypatch.setattr(strategies, "diverges", diverging)
    flying = problem(stiff=True)
    after: dict[Key, Tally] = {("spring", n): Tally(110.0, 100, 50.0) for n in "abce"}
    after["spring", "d"] = Tally(9e3, 100, 50.0)
    method = RobustOverFreeFlight()
    assert method.set_aside(flying, ENDED, after) == {("spring", "d")}
    assert asked == ["d"]
    assert method.set_aside(replace(flying, new=()), ENDED, after) == frozenset()
    assert method.set_aside(replace(flying, coarse=False), ENDED, after) == frozenset()
    earlier = replace(flying, new=(), unpredictable=frozenset({("spring", "a"), ("motor", "a")}))
    assert method.set_aside(earlier, ENDED, after) == {("spring", "a")}
    monkeypatch.setattr(strategies, "diverges", lambda evidence, best: False)
    assert method.set_aside(flying, ENDED, after) == frozenset(), "failing alone proves nothing"


def test_backlash_alone_brings_a_continuation_and_it_keeps_what_means_the_same() -> None:
    (candidate,) = backlash(declare(load_deck("test_rig")))
    strategy = candidate.strategy
    assert isinstance(strategy, Continuation)
    assert (strategy.takes_long, Strategy().takes_long, strategy.hold) == (True, False, 1.2)
    same = strategy._same_numbers(candidate.assembly)
    assert "spring.gap" in same
    assert "motor.inertia" not in same, "a tenth of it is behind the gap in the whole effect"


@pytest.mark.parametrize(("left", "enough"), [(749.0, True), (751.0, False)])
def test_a_simpler_form_must_explain_enough_of_one_block_at_least(left: float, enough: bool) -> None:
    """Half of 2100 is 1050, half of the noise 50: 30 % of what lies between are 300."""
    before = {("spring", "a"): Tally(2100.0, 100, 50.0), ("motor", "a"): Tally(9e5, 100, 50.0)}
    two = replace(problem(), blocks=("motor", "spring"), before=before)
    assert strategies.explains_enough(two, {("spring", "a"): left, ("motor", "a"): 4.4e5}) == enough


def test_a_block_that_lacks_nothing_does_not_ask_for_the_whole_effect() -> None:
    noise = replace(problem(), before={("spring", "a"): Tally(90.0, 100, 50.0)})
    assert not strategies.explains_enough(noise, {("spring", "a"): 10.0})


# --- one group of a hypothesis --------------------------------------------------------------------


# Four records with 2,100 squares in 100 rows: half a sum of 4,200, of which 4,000 lie over the noise.
@pytest.mark.parametrize(
    ("promised", "nothing"),
    [
        ({0.1: 4199.0, 0.5: 4181.0}, True),
        ({0.1: 4179.0, 0.5: 4199.0}, False),  # one start promises more than half a hundredth of that
        ({0.1: 4199.0, 0.5: 4221.0}, False),  # or begins where slopes say little of the place without it
        ({0.1: 4199.0}, False),  # or has no response
    ],
)
def test_what_no_start_promises_to_explain_is_not_fitted(
    notebook: Notebook, promised: Mapping[float, float], nothing: bool
) -> None:
    notebook.steps = promised
    ended = fit_of_nothing(problem())
    assert (ended is not None) == nothing
    assert [(each["start"], each["evaluations"]) for each in notebook.fits] == [(0.005, 0)] * nothing


def test_what_declared_numbers_have_cost_before_counts_in_the_score_test(notebook: Notebook) -> None:
    notebook.steps = {0.1: 4199.0, 0.5: 4199.0}
    declared = Parameter("motor.inertia", "1", 3.0, 0.0, 0.3, -9.0, 9.0, "linear")
    moved = tuple((*each, declared) for each in problem().starts)
    assert fit_of_nothing(problem(starts=moved)) is None
    notebook.steps = {0.1: 4249.0, 0.5: 4249.0}
    assert fit_of_nothing(problem(starts=moved)) is not None


def test_many_starts_and_blocks_that_were_not_judged_before_are_fitted(notebook: Notebook) -> None:
    notebook.steps = dict.fromkeys((0.1, 0.2, 0.3, 0.4, 0.5), 4200.0)
    starts = tuple(start(begin) for begin in notebook.steps)
    assert fit_of_nothing(problem(starts=starts[:4])) is not None
    assert fit_of_nothing(problem(starts=starts)) is None
    assert fit_of_nothing(problem(before={})) is None


def test_a_first_look_leaves_what_was_left_where_an_effect_promises_nothing(notebook: Notebook) -> None:
    before = Tally(900.0, 2, 2.0, (450.0, 450.0))
    notebook.steps = {2.0: 450.0}
    hypothesis = Hypothesis(BLANK, (candidate(GAP, SIZE),), tallies={("spring", "a"): before}, coarse=True)
    fits = HypothesisFit(cast(Bench, BenchOfOne()), {})
    result = fits.fitted(hypothesis, group(), (GAP, SIZE))
    assert isinstance(result, GroupFit)
    assert result.tallies == {("spring", "a"): before}
    polished = fits.fitted(replace(hypothesis, coarse=False), group(), (GAP, SIZE))
    assert isinstance(polished, GroupFit)
    assert polished.tallies["spring", "a"].squares == 25.0


class BenchOfOne:
    """Gives the evidence of one record, and remembers at which values blocks were made."""

    def __init__(self, size: int = 100) -> None:
        self.size, self.values = size, list[Mapping[str, float]]()
        self.records = SimpleNamespace(records=("a",))

    def driven(self, block: Any, free: Sequence[str], values: Mapping[str, float]) -> str:
        self.values.append(values)
        return str(block.name)

    def evidence(self, driven: str, records: Any, values: Any, *, coarse: bool) -> list[Evidence]:
        one = evidence("a", "fit", 1.0, size=self.size)
        one.driven.free, floor = (), SimpleNamespace(sigma=np.ones(2), independent=np.inf)
        residual = lambda values: (np.array([3.0, 4.0]), np.zeros((2, 0)))  # noqa: E731
        return [
            cast(
                Evidence,
                SimpleNamespace(driven=one.driven, record=one.record, floor=floor, residual=residual),
            )
        ]


def group() -> list[FreeBlock]:
    known = Variable("spring.stiffness", "N*m/rad", "stiffness", start=2.0, spread=0.2)
    new = [Variable(f"part.{n}", "rad", "new", start=1.0) for n in ("gap", "size")]
    block = SimpleNamespace(name="spring", model=SimpleNamespace(parameters=(known, *new)))
    return [FreeBlock(cast(Any, block), ("spring.stiffness", "part.gap", "part.size"))]


def candidate(*unknowns: Unknown) -> Candidate:
    return Candidate("slack", "spring", BLANK, unknowns, "sign", "source")


GAP = Unknown("part.gap", (0.1, 0.3), 0.01, 1.0, of="q")
SIZE = Unknown("part.size", (0.0, 1.0), -5.0, 5.0)


def test_every_combination_of_starts_is_tried_in_the_size_of_what_was_measured(notebook: Notebook) -> None:
    hypothesis = Hypothesis(
        BLANK, (candidate(GAP, SIZE),), {"spring.stiffness": 2.2}, tallies={("spring", "a"): Tally(9, 2, 2)}
    )
    bench = BenchOfOne()
    fits = HypothesisFit(cast(Bench, bench), {"q": 2.0})
    task = fits._problem(hypothesis, group(), (GAP, SIZE))
    assert [[p.start for p in each] for each in task.starts] == [
        [2.2, 0.2, 0.0], [2.2, 0.2, 1.0], [2.2, 0.6, 0.0], [2.2, 0.6, 1.0],
    ]  # fmt: skip
    stiffness, gap, size = task.starts[0]
    assert np.isfinite(stiffness.sigma), "a declared number has its spread as a prior"
    assert (gap.lower, gap.upper, gap.scale, gap.sigma) == (0.02, 2.0, "log", np.inf)
    assert (size.lower, size.upper, size.scale, size.size) == (-5.0, 5.0, "linear", 1.0)
    assert bench.values == [{"spring.stiffness": 2.2, "part.gap": 0.2, "part.size": 0.0}]
    assert task.new == ("part.gap", "part.size")


def test_a_delay_is_known_but_for_a_shift_that_the_records_may_have() -> None:
    """Held currents act half a sample late: a delay was half a sample wrong, with an error of a hundredth."""
    fits = HypothesisFit(cast(Bench, BenchOfOne()), {"q": 2.0, "shift": 0.06})
    late = replace(GAP, beyond="shift")
    task = fits._problem(Hypothesis(BLANK, (candidate(late, SIZE),)), group(), (late, SIZE))
    _, gap, size = task.starts[0]
    assert gap.confounded == pytest.approx(0.06 / math.sqrt(3.0))
    assert size.confounded == 0.0


def test_a_group_comes_back_with_what_it_leaves_over(notebook: Notebook) -> None:
    hypothesis = Hypothesis(BLANK, (candidate(GAP),), tallies={("spring", "a"): Tally(9, 2, 2)})
    result = HypothesisFit(cast(Bench, BenchOfOne()), {}).fitted(hypothesis, group(), (GAP,))
    assert isinstance(result, GroupFit)
    assert result.tallies["spring", "a"][:2] == (25.0, 2)
    assert not result.has_free_flight
    assert result.unpredictable == frozenset()


def test_an_expensive_further_effect_and_one_without_a_response_come_back_as_errors(
    notebook: Notebook,
) -> None:
    bench = cast(Bench, BenchOfOne(BUDGET.expensive_step + 1))
    twice = Hypothesis(BLANK, (candidate(GAP), candidate(SIZE)))
    refused = HypothesisFit(bench, {}).fitted(twice, group(), (SIZE,))
    assert isinstance(refused, ConvergenceError)
    assert "too expensive" in refused.rule
    assert notebook.fits == [], "it was not even begun"
    notebook.costs = {2.0: np.inf}
    failed = HypothesisFit(bench, {}).fitted(Hypothesis(BLANK, (candidate(GAP),)), group(), (GAP,))
    assert isinstance(failed, ConvergenceError)
    assert "not finite" in failed.rule
