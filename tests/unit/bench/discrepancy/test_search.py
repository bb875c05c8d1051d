"""The order of the search on a comparison made by hand: a table says what each set of effects leaves."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar, cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects.effect import Candidate, EffectFunction, Unknown
from nlsdesign.bench.discrepancy.fitting import Continuation, Strategy, Tally
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.selection.measures import EffectNumber, Standing
from nlsdesign.bench.discrepancy.selection.search import Outcome, Stop, never, search
from nlsdesign.bench.discrepancy.selection.trials import Skipped
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.bench.identification.parameters import Parameter
from nlsdesign.components import Assembly, Fixed
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ConvergenceError

BLANK = assembly("blank", load=Fixed())
ROWS = 1000
LONG = Continuation(through=BLANK)


def effect(
    name: str,
    numbers: int = 1,
    *,
    strategy: Strategy | None = None,
    simpler: tuple[str, ...] = (),
) -> EffectFunction:
    unknowns = tuple(Unknown(f"{name}.{k}", (1.0,), 0.1, 10.0) for k in range(numbers))

    def of(assembly: Assembly) -> Sequence[Candidate]:
        way = strategy or Strategy()
        return [Candidate(name, "motor", assembly, unknowns, "sign", "source", way, simpler=simpler)]

    return of


SEGMENTS = 5


def noise_by_hand(unit: str) -> SimpleNamespace:
    return SimpleNamespace(typical=1.0, known=math.inf, block=SimpleNamespace(unit=unit))


class Bench:
    block_noise: ClassVar = {name: noise_by_hand(unit) for name, unit in (("motor", "N*m"), ("spring", "N"))}


class Table:
    """A comparison that looks up the excess of the motor, and perhaps of the spring, for the effects added.

    A set of effects that is not in the table does not converge.
    """

    def __init__(self, table: dict[Collection[str], tuple[float, ...]], **flags: bool) -> None:
        self.table = {frozenset(names): left for names, left in table.items()}
        self.bench, self.flags, self.asked = Bench(), flags, list[tuple[str, ...]]()
        self.records: Table | None = None

    def hypothesis(self, added: tuple[Candidate, ...]) -> Hypothesis:
        left = self.table.get(frozenset(c.effect for c in added))
        if left is None:
            raise ConvergenceError("fit", "has no response", next_step="give up")
        tallies = {
            (block, record): Tally(ROWS + each, ROWS, ROWS, ((ROWS + each) / SEGMENTS,) * SEGMENTS)
            for block, each in zip(("motor", "spring"), left, strict=False)
            for record in ("one", "other")
        }
        return Hypothesis(BLANK, added, tallies=tallies, **cast(Any, self.flags))

    def coarsely(self, hypothesis: Hypothesis) -> Hypothesis:
        return self.hypothesis(hypothesis.added)

    def on_all_samples(self, hypothesis: Hypothesis) -> Hypothesis:
        return hypothesis

    def without_whole_records(self, hypothesis: Hypothesis) -> Hypothesis:
        return (
            self.hypothesis(hypothesis.added)
            if self.records is None
            else self.records.hypothesis(hypothesis.added)
        )

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        return replace(hypothesis, values={"polished": 1.0})

    def with_effect(
        self, hypothesis: Hypothesis, candidate: Candidate, wanted: Collection[str] = ()
    ) -> Hypothesis | None:
        self.asked.append((*hypothesis.names, candidate.effect))
        return self.hypothesis((*hypothesis.added, candidate))


@pytest.fixture(autouse=True)
def one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work done here, so that the table sees what it is asked."""
    monkeypatch.setattr(
        "nlsdesign.bench.discrepancy.selection.trials.parallel_map",
        lambda work, count: map(work, range(count)),
    )


def outcome(table: Table, *effects: EffectFunction, stop: Stop = never) -> Outcome:
    base = table.hypothesis(())
    return search(cast(Comparison, table), base, effects, Criteria(), lambda text: None, stop=stop)


def names(found: Outcome) -> list[str]:
    return [step.effect for step in found.steps]


def test_where_nothing_is_open_nothing_is_tried() -> None:
    table = Table({(): (0.0,)})
    found = outcome(table, effect("a"))
    assert (names(found), found.complete, table.asked) == ([], True, [])


def test_the_one_effect_that_explains_is_named_and_fitted_to_all_samples() -> None:
    found = outcome(Table({(): (1e5,), ("a",): (9e4,), ("b",): (10.0,)}), effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert found.complete
    assert found.last.values == {"polished": 1.0}
    assert [(e.candidate.effect, round(e.share, 2)) for e in found.tried] == [("b", 1.0), ("a", 0.1)]
    assert [bool(e.objections) for e in found.tried] == [False, True]
    assert found.steps[0].share == pytest.approx(1.0, abs=1e-3)


def test_a_search_is_given_up_beside_what_asks_for_another_reading_of_the_records() -> None:
    table = Table({(): (1e5,), ("a",): (3e3,), ("b",): (9e4,), ("a", "b"): (10.0,)})
    effects = effect("a"), effect("b")
    whole = outcome(table, *effects)
    assert (names(whole), whole.stopped) == (["a", "b"], False)
    table.asked.clear()
    given_up = outcome(table, *effects, stop=lambda hypothesis: hypothesis.names == ("a",))
    assert (names(given_up), given_up.stopped) == (["a"], True)
    assert ("a", "b") not in table.asked, "nothing is tried beside it, and nothing looked at again"


def test_a_second_effect_is_sought_while_a_block_is_open() -> None:
    table = {(): (1e5,), ("a",): (3e4,), ("b",): (9e4,), ("a", "b"): (10.0,)}
    found = outcome(Table(table), effect("a"), effect("b"))
    assert names(found) == ["a", "b"]
    assert found.complete


def test_an_effect_that_a_later_one_makes_superfluous_is_dropped() -> None:
    """Without b more is left, so it stays; but not where c, fitted anew from the start, explains all."""
    table = Table({(): (1e5,), ("b",): (3e4,), ("c",): (4e4,), ("b", "c"): (100.0,)})
    assert names(outcome(table, effect("b"), effect("c"))) == ["b", "c"]
    better = Table({(): (1e5,), ("b",): (3e4,), ("c",): (4e4,), ("b", "c"): (100.0,)})

    def improving(*arguments: Any) -> Hypothesis | None:
        done = Table.with_effect(better, *arguments)
        if len(better.asked) > 3:
            better.table[frozenset("c")] = (150.0,)
        return done

    better.with_effect = improving  # type: ignore[method-assign]
    assert names(outcome(better, effect("b"), effect("c"))) == ["c"]


def test_what_an_effect_gains_is_said_beside_all_others_that_are_named() -> None:
    """Added first, b gained 70,000; beside c it gains 39,900, and that is what would be lost without it."""
    table = Table({(): (1e5,), ("b",): (3e4,), ("c",): (4e4,), ("b", "c"): (100.0,)})
    first, second = outcome(table, effect("b"), effect("c")).steps
    assert (first.effect, second.effect) == ("b", "c")
    assert first.gain.value == pytest.approx(2 * (4e4 - 100.0))
    assert first.gains == {"one": pytest.approx(4e4 - 100.0), "other": pytest.approx(4e4 - 100.0)}
    assert second.gain.value == pytest.approx(2 * (3e4 - 100.0))


def test_two_effects_that_help_only_together_are_found_as_a_pair() -> None:
    table = {(): (1e5,), ("a",): (8e4,), ("b",): (9e4,), ("a", "b"): (10.0,)}
    found = outcome(Table(table), effect("a"), effect("b"))
    assert names(found) == ["a", "b"]


def test_nothing_is_named_where_neither_one_nor_two_explain_half() -> None:
    table = {(): (1e5,), ("a",): (8e4,), ("b",): (9e4,), ("a", "b"): (6e4,)}
    found = outcome(Table(table), effect("a"), effect("b"))
    assert names(found) == []
    assert not found.complete


def test_what_explains_most_of_a_block_is_named_and_what_is_left_is_said() -> None:
    found = outcome(Table({(): (1e5,), ("a",): (2e4,)}), effect("a"))
    assert names(found) == ["a"]
    assert not found.complete


def test_what_leaves_most_of_its_block_unexplained_is_named_only_if_it_stands_out() -> None:
    alone = {(): (1e5,), ("a",): (4e4,), ("c",): (4.4e4,)}
    found = outcome(Table(alone), effect("a"), effect("c"))
    assert names(found) == [], "another name leaves 1.1 times as much"
    assert not found.complete
    said = next(each.objections[0] for each in found.tried if each.candidate.effect == "a")
    assert "explains 60 % of the excess, less than 75 %" in said
    found = outcome(Table({**alone, ("c",): (7e4,)}), effect("a"), effect("c"))
    assert names(found) == ["a"], "the next best name leaves three quarters more"
    assert not found.complete
    beside = {
        (): (1e5, 9e4), ("a",): (4e4, 9e4), ("b",): (1e5, 10.0), ("c",): (4.4e4, 9e4),
        ("a", "b"): (4e4, 10.0), ("b", "c"): (4.4e4, 10.0),
    }  # fmt: skip
    found = outcome(Table(beside), effect("a"), effect("b"), effect("c"))
    assert names(found) == ["b"], "the other block is explained and has its name"
    assert not found.complete


def test_no_more_than_three_effects_are_named() -> None:
    letters = "abcde"
    table = Table({tuple(letters[:k]): (1e6 * 0.45**k,) for k in range(len(letters) + 1)})
    assert names(outcome(table, *[effect(name) for name in letters])) == ["a", "b", "c"]


def test_no_more_than_two_effects_are_named_in_free_flight() -> None:
    """The second leaves 40 % of its block, which is open and would be searched for more."""
    table = {(): (1e6, 9e5), ("a",): (10.0, 9e5), ("a", "b"): (10.0, 2e5), ("a", "b", "c"): (10.0, 10.0)}
    effects = [effect(name) for name in "abc"]
    assert names(outcome(Table(table), *effects)) == ["a", "b", "c"]
    assert names(outcome(Table(table, has_free_flight=True), *effects)) == ["a", "b"]


def test_what_takes_long_is_tried_only_where_nothing_else_closes_the_block() -> None:
    table = Table({(): (1e5,), ("a",): (10.0,), ("slow",): (10.0,)})
    found = outcome(table, effect("a"), effect("slow", strategy=LONG))
    assert (table.asked, names(found)) == ([("a",)], ["a"])
    reason = "takes long, and a explains the block down to its noise"
    assert found.skipped == (Skipped("slow", "motor", (), reason),)
    table = Table({(): (1e5,), ("a",): (4e4,), ("slow",): (10.0,)})
    assert names(outcome(table, effect("a"), effect("slow", strategy=LONG))) == ["slow"]


def test_what_could_not_be_compared_is_in_the_outcome_with_its_reason() -> None:
    found = outcome(Table({(): (1e5,), ("a",): (2e4,)}), effect("a"), effect("broken"))
    assert names(found) == ["a"]
    assert found.skipped == (
        Skipped("broken", "motor", (), "has no response"),
        Skipped("broken", "motor", ("a",), "has no response"),
    )
    assert str(found.skipped[1]) == "broken at motor beside a: has no response"


def test_the_block_that_lacks_most_is_worked_on_first() -> None:
    table = {(): (1e5, 1e6), ("a",): (10.0, 1e6), ("b",): (1e5, 10.0), ("a", "b"): (10.0, 10.0)}
    found = outcome(Table(table), effect("a"), effect("b"))
    assert names(found) == ["b", "a"]
    assert found.complete


def test_what_only_all_samples_show_is_judged_on_all_samples() -> None:
    """Of every tenth sample nothing stands out; all of them ask for the effect that leaves nothing."""
    all_samples = Table({(): (1e5,), ("a",): (9e4,), ("b",): (10.0,)})

    class Coarse(Table):
        def on_all_samples(self, hypothesis: Hypothesis) -> Hypothesis:
            return all_samples.hypothesis(hypothesis.added)

    found = outcome(Coarse({(): (100.0,), ("a",): (50.0,), ("b",): (60.0,)}), effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert found.steps[0].share == pytest.approx(1.0, abs=1e-3)


def test_what_does_not_predict_whole_records_is_not_named_and_the_next_best_is() -> None:
    left = {(): (1e5,), ("a",): (10.0,), ("b",): (2e4,), ("a", "b"): (10.0,)}
    table = Table(left)
    table.records = Table({**left, ("a",): (2e5,), ("a", "b"): (2e5,)})
    found = outcome(table, effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert found.tried[0].candidate.effect == "a"
    assert found.tried[0].objections == ("it does not predict records that are left out as a whole",)


def test_a_richer_form_takes_its_place_once_the_other_effects_are_named() -> None:
    """Alone the richer form leaves hardly less than the simpler one; beside b it leaves nothing."""
    left = {
        (): (1e5, 1e6), ("plain",): (2e4, 1e6), ("rich",): (1.9e4, 1e6), ("b",): (1e5, 10.0),
        ("b", "plain"): (2e4, 10.0), ("b", "rich"): (10.0, 10.0),
    }  # fmt: skip
    effects = effect("plain"), effect("rich", 3, simpler=("plain",)), effect("b")
    found = outcome(Table(left), *effects)
    assert names(found) == ["b", "rich"]
    assert found.complete
    left["b", "rich"] = (1.5e4, 10.0)
    assert names(outcome(Table(left), *effects)) == ["b", "plain"], "not half of what is left"


def test_what_shows_beside_a_richer_form_alone_is_found_there() -> None:
    """Friction with a bend, and a delay: either form leaves much; the delay shows beside the bend only."""
    left = {
        (): (1e5,), ("plain",): (1.4e4,), ("rich",): (8e3,), ("late",): (9.5e4,),
        ("plain", "late"): (1.1e4,), ("rich", "late"): (10.0,),
    }  # fmt: skip
    effects = effect("plain"), effect("rich", 3, simpler=("plain",)), effect("late")
    found = outcome(Table(left), *effects)
    assert names(found) == ["rich", "late"]
    assert found.complete
    left["rich", "late"] = (7e3,)
    table = Table(left)
    assert names(outcome(table, *effects)) == ["plain"], "nothing comes of the richer form"
    assert ("rich", "late") in table.asked
    left["rich", "late"], left["rich",] = (10.0,), (1.4e4 - 10.0,)
    table = Table(left)
    assert names(outcome(table, *effects)) == ["plain"], "the richer form gains no more than noise"
    assert ("rich", "late") not in table.asked


def forms(name: str, **numbers: int) -> EffectFunction:
    """One effect in several forms, by the name that the table knows each by, with so many numbers."""

    def of(assembly: Assembly) -> Sequence[Candidate]:
        return [
            Candidate(
                name, "motor", assembly,
                tuple(Unknown(f"{form}.{form}_{k}", (1.0,), 0.1, 10.0) for k in range(count)), form, "source",
            )
            for form, count in numbers.items()
        ]  # fmt: skip

    return of


class TableOfForms(Table):
    """A table that knows forms of one effect apart, by their signatures."""

    def hypothesis(self, added: tuple[Candidate, ...]) -> Hypothesis:
        known = super().hypothesis(tuple(replace(c, effect=c.signature) for c in added))
        return replace(known, added=added)


def test_a_richer_form_of_a_named_effect_comes_before_one_more_name() -> None:
    """Beside b two branches leave nothing, and one branch with c beside it leaves as little."""
    left = {
        (): (1e5, 9e4), ("one",): (2e4, 9e4), ("two",): (1.9e4, 9e4), ("sign",): (1e5, 10.0),
        ("sign", "one"): (2e4, 10.0), ("sign", "two"): (10.0, 10.0),
    }  # fmt: skip
    effects = forms("branch", one=2, two=4), effect("b")
    found = outcome(TableOfForms(left), *effects)
    assert [(c.effect, len(c.unknowns)) for c in found.last.added] == [("branch", 4), ("b", 1)]
    left["sign", "two"] = (1.5e4, 10.0)
    found = outcome(TableOfForms(left), *effects)
    assert [len(c.unknowns) for c in found.last.added] == [2, 1], "not half of what is left"


def test_a_richer_form_whose_numbers_do_not_stand_does_not_take_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left = {
        (): (1e5, 9e4), ("one",): (2e4, 9e4), ("two",): (1.9e4, 9e4), ("sign",): (1e5, 10.0),
        ("sign", "one"): (2e4, 10.0), ("sign", "two"): (10.0, 10.0),
    }  # fmt: skip
    weak = Standing((EffectNumber("two.two_0", 0.1, True, 0.1, False),), np.array([[0.01]]))

    def standing(unknowns: Sequence[Unknown], fits: Any) -> Standing:
        return weak if len(unknowns) == 4 else Standing()

    monkeypatch.setattr("nlsdesign.bench.discrepancy.selection.search.standing_of", standing)
    found = outcome(TableOfForms(left), forms("branch", one=2, two=4), effect("b"))
    assert [len(c.unknowns) for c in found.last.added] == [2, 1]


def test_steps_made_anew_keep_the_form_of_an_effect() -> None:
    """Two forms have as many numbers; without a, which c makes superfluous, b keeps the form it had."""
    left = {
        (): (1e5,), ("a",): (3e4,), ("first",): (9e4,), ("second",): (8e4,), ("c",): (9.5e4,),
        ("a", "first"): (2.9e4,), ("a", "second"): (1e4,), ("a", "c"): (2.9e4,),
        ("a", "second", "c"): (1e3,), ("a", "first", "c"): (9e3,), ("second", "c"): (1e3,),
        ("first", "c"): (9e3,),
    }  # fmt: skip
    named_a, named_c = forms("a", a=1), forms("c", c=1)
    found = outcome(TableOfForms(left), named_a, forms("b", first=2, second=2), named_c)
    assert [c.signature for c in found.last.added] == ["second", "c"]


def test_an_effect_whose_numbers_fail_on_all_samples_is_dropped_and_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On thinned records nothing speaks against a; on all samples its number is one error from none."""
    left = {(): (1e5, 1e5), ("a",): (10.0, 1e5), ("b",): (1e5, 10.0), ("a", "b"): (10.0, 10.0)}
    table = Table(left)
    weak = Standing((EffectNumber("a.0", 0.1, True, 0.1, False),), np.array([[0.01]]))

    def standing(unknowns: Sequence[Unknown], fits: Any) -> Standing:
        return weak if unknowns[0].name == "a.0" else Standing()

    monkeypatch.setattr("nlsdesign.bench.discrepancy.selection.search.standing_of", standing)
    found = outcome(table, effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert [s.reason for s in found.skipped] == [
        "on all samples its numbers are 1.0 standard errors from no effect"
    ]


def test_an_effect_belongs_to_the_block_of_which_it_explains_most() -> None:
    """The spring stays unexplained, so its effect is dropped; what explains the motor is not."""
    left = {
        (): (1e5, 1e6), ("a",): (1e5, 4e5), ("both",): (10.0, 9e5), ("c",): (1e5, 4.4e5),
        ("a", "both"): (10.0, 4e5), ("both", "c"): (10.0, 4.4e5),
    }  # fmt: skip
    found = outcome(Table(left), effect("a"), effect("both"), effect("c"))
    assert names(found) == ["both"]
    assert found.steps[0].block == "motor"


def test_two_effects_are_found_beside_a_named_one_where_much_is_left() -> None:
    left = {
        (): (1e5,), ("a",): (3e4,), ("b",): (9e4,), ("c",): (9e4,), ("a", "b"): (2e4,), ("a", "c"): (2.5e4,),
        ("b", "c"): (8e4,), ("a", "b", "c"): (10.0,),
    }  # fmt: skip
    found = outcome(Table(left), effect("a"), effect("b"), effect("c"))
    assert sorted(names(found)) == ["a", "b", "c"]
    little = {each: (tuple(0.1 * x for x in value) if "a" in each else value) for each, value in left.items()}
    assert names(outcome(Table(little), effect("a"), effect("b"), effect("c"))) == ["a"]


def test_an_effect_whose_numbers_fail_on_all_samples_makes_room_for_one_that_is_about_as_good() -> None:
    """The best stands at its bound there; what leaves far more only imitates it. The reason is kept."""
    parameter = Parameter("a.0", "N", 0.1, 0.1, math.inf, 0.1, 10.0, "log")
    at_bound = Fit((parameter,), {"a.0": 0.1}, np.full((1, 1), 1e-4), 1.0, {}, converged=True)

    class Failing(Table):
        def polished(self, hypothesis: Hypothesis) -> Hypothesis:
            done = super().polished(hypothesis)
            return replace(done, fits={("motor",): at_bound}) if "a" in hypothesis.names else done

    left = {(): (1e5,), ("a",): (1e3,), ("b",): (1.9e3,)}
    found = outcome(Failing(left), effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert names(outcome(Failing({**left, ("b",): (2.1e3,)}), effect("a"), effect("b"))) == []
    assert "a at motor: on all samples a.0 is at a bound of the search" in map(str, found.skipped)


def test_the_delay_that_a_search_begins_beside_is_no_name_and_not_asked_for_its_numbers() -> None:
    parameter = Parameter("late.0", "s", 0.1, 0.1, math.inf, 0.1, 10.0, "log")
    at_bound = Fit((parameter,), {"late.0": 0.1}, np.full((1, 1), 1e-4), 1.0, {}, converged=True)

    class Beside(Table):
        def polished(self, hypothesis: Hypothesis) -> Hypothesis:
            return replace(super().polished(hypothesis), fits={("motor",): at_bound})

    table = Beside({("late",): (1e5,), ("late", "b"): (10.0,)})
    base = table.hypothesis(tuple(effect("late")(BLANK)))
    found = search(cast(Comparison, table), base, [effect("b")], Criteria(), lambda text: None)
    assert names(found) == ["b"]
    assert found.last.names == ("late", "b")


def test_a_simpler_form_takes_its_place_once_the_other_effects_are_named() -> None:
    """Alone the richer form stands for a part of b as well; beside b the simpler one leaves as little."""
    left = {
        (): (1e5,), ("plain",): (3e4,), ("rich",): (1e4,), ("b",): (9e4,), ("b", "plain"): (11.0,),
        ("b", "rich"): (10.0,),
    }  # fmt: skip
    effects = effect("plain"), effect("rich", 3, simpler=("plain",)), effect("b")
    assert names(outcome(Table(left), *effects)) == ["plain", "b"]
    left["b", "plain"] = (9e3,)
    assert names(outcome(Table(left), *effects)) == ["rich", "b"], "much more is left"


def test_an_effect_that_has_no_response_on_all_samples_leaves_the_search_to_others() -> None:
    class Ending(Table):
        def polished(self, hypothesis: Hypothesis) -> Hypothesis:
            if "a" in hypothesis.names:
                raise ConvergenceError("fit", "has no response", next_step="give up")
            return super().polished(hypothesis)

    found = outcome(Ending({(): (1e5,), ("a",): (1e3,), ("b",): (1.9e3,)}), effect("a"), effect("b"))
    assert names(found) == ["b"]
    assert "a at motor: on all samples has no response" in map(str, found.skipped)
