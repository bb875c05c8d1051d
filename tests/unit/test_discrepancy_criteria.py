"""The decision rule on excesses made by hand: what is open, what helps, what is taken, when it is done."""

from __future__ import annotations

import math

import pytest

from nlsdesign.discrepancy.selection.criteria import (
    DECLARED,
    LEAST_EXCESS,
    NOISE_MARGIN,
    SIGNIFICANT,
    Excess,
    Rival,
    best_shares,
    choose,
    explained,
    helps,
    is_beyond_noise,
    is_beyond_prior,
    is_explained,
    is_superfluous,
    lacking,
    most_effects,
    total_excess,
)

ROWS = 1000


def excess(fit: float, held_out: float, *, is_open: bool = True, block: str = "spring") -> Excess:
    """A block with so much beyond the floor on 1000 fitted and 1000 held-out residuals."""
    chi2 = (ROWS + fit, ROWS + held_out)
    return Excess(block, "N", 0.1, 1.0, 1.0, chi2, (ROWS, ROWS), is_open)


def blocks(**each: Excess) -> dict[str, Excess]:
    return each


FIRST = blocks(spring=excess(1e5, 1e5), motor=excess(1e4, 1e4))


def with_left(spring: float, motor: float = 1e4) -> dict[str, Excess]:
    """What lacks no more than 0.4 of the floor on either role is closed."""
    pair = {
        "spring": excess(spring, spring, is_open=spring > LEAST_EXCESS * ROWS),
        "motor": excess(motor, motor, is_open=motor > LEAST_EXCESS * ROWS),
    }
    return blocks(**pair)


# --- what is open ---------------------------------------------------------------------------------


def test_a_mean_square_is_open_beyond_what_filters_and_noise_leave() -> None:
    many = 1e6
    assert not is_beyond_noise(1.0 + 0.99 * LEAST_EXCESS, many)
    assert is_beyond_noise(1.0 + 1.01 * LEAST_EXCESS, many)
    edge = 1.0 + SIGNIFICANT * math.sqrt(2.0 / 50.0)
    assert edge > 1.0 + LEAST_EXCESS
    assert not is_beyond_noise(0.99 * edge, 50.0)
    assert is_beyond_noise(1.01 * edge, 50.0)
    assert not is_beyond_noise(5.0, 0.0), "what is equivalent to no sample says nothing"


def test_numbers_are_beyond_their_prior_if_they_all_pass_the_edge_of_their_range() -> None:
    edge = 3.0  # (√3)²: the edge of a uniform range in its standard deviations
    assert not is_beyond_prior(4 * edge, 4)
    assert is_beyond_prior(4 * edge + 0.01, 4)


def test_an_excess_is_never_negative_and_counts_all_roles() -> None:
    quiet = excess(-100.0, 50.0)
    assert quiet.excess == (0.0, 50.0)
    assert quiet.mean_square == pytest.approx(1950 / 2000)
    assert total_excess(blocks(spring=quiet, motor=excess(10.0, 20.0))) == 80.0


# --- what an effect explains ----------------------------------------------------------------------


def test_the_explained_share_is_the_smaller_of_fitted_and_held_out_records() -> None:
    """What fits but does not predict explains nothing: this is what makes a verdict honest."""
    before, after = blocks(spring=excess(1e4, 1e4)), blocks(spring=excess(1e3, 7e3))
    assert explained(before, after) == {"spring": pytest.approx(0.3)}
    turned = blocks(spring=excess(7e3, 1e3))
    assert explained(before, turned) == {"spring": pytest.approx(0.3)}
    worse = blocks(spring=excess(0.0, 2e4))
    assert explained(before, worse) == {"spring": pytest.approx(-1.0)}


def test_only_open_blocks_count_and_only_roles_that_lacked_something() -> None:
    before = blocks(spring=excess(1e4, 0.5 * LEAST_EXCESS * ROWS), motor=excess(1e4, 1e4, is_open=False))
    after = blocks(spring=excess(1e3, 1e4), motor=excess(0.0, 0.0))
    assert explained(before, after) == {"spring": pytest.approx(0.9)}


def test_what_is_shown_of_an_effect_are_both_shares_of_the_block_that_gains_most() -> None:
    before = blocks(spring=excess(1e4, 1e4), motor=excess(1e4, 1e4))
    after = blocks(spring=excess(1e3, 2e3), motor=excess(9e3, 9e3))
    assert best_shares(before, after) == (pytest.approx(0.9), pytest.approx(0.8))
    closed = blocks(spring=excess(1e4, 1e4, is_open=False))
    assert best_shares(closed, closed) == (0.0, 0.0)


def test_an_effect_helps_if_it_explains_half_on_both_roles() -> None:
    assert helps(FIRST, FIRST, with_left(0.49e5))
    assert not helps(FIRST, FIRST, with_left(0.51e5))
    fitted_only = blocks(spring=excess(0.0, 0.6e5), motor=FIRST["motor"])
    assert not helps(FIRST, FIRST, fitted_only)


def test_an_effect_that_spoils_the_whole_does_not_help() -> None:
    assert helps(FIRST, FIRST, with_left(0.2e5, motor=0.5e5))
    assert not helps(FIRST, FIRST, with_left(0.2e5, motor=1.0e5)), "as much lost elsewhere as won here"


def test_a_further_effect_must_explain_a_part_of_what_was_lacking_at_first() -> None:
    """All of a remainder of 4 % is not enough, however clean; of 6 % it is."""
    assert not helps(FIRST, with_left(0.04e5, motor=0.0), with_left(0.0, motor=0.0))
    assert helps(FIRST, with_left(0.06e5, motor=0.0), with_left(0.0, motor=0.0))


# --- when the search is done ----------------------------------------------------------------------


def test_a_block_counts_as_named_when_closed_or_explained_by_three_quarters() -> None:
    def last(left: float, *, is_open: bool = True) -> dict[str, Excess]:
        return blocks(spring=excess(left, left, is_open=is_open))

    first = blocks(spring=excess(1e4, 1e4))
    assert is_explained(first, last(2.4e3))
    assert not is_explained(first, last(2.6e3))
    assert is_explained(first, last(9e3, is_open=False))


def test_declared_numbers_decide_only_where_no_block_is_open() -> None:
    strained = Excess(DECLARED, "1", 1.0, 3.0, 1.0, (90.0, 0.0), (10, 0), True)
    alone = {DECLARED: strained}
    assert not is_explained(alone, alone)
    beside = {"spring": excess(1e4, 1e4), DECLARED: strained}
    assert is_explained(beside, {"spring": excess(1e3, 1e3), DECLARED: strained})


def test_the_largest_lack_comes_first_and_what_is_nearly_closed_is_left() -> None:
    now = blocks(spring=excess(0.1e5, 0.1e5), motor=excess(0.9e4, 0.9e4))
    assert lacking(FIRST, FIRST, has_free_flight=False) == ["spring", "motor"]
    assert lacking(FIRST, now, has_free_flight=False) == ["spring", "motor"]
    assert lacking(FIRST, now, has_free_flight=True) == ["motor"], "a tenth is closed in free flight"
    assert lacking(FIRST, with_left(0.04e5), has_free_flight=False) == ["motor"], "forms are never exact"
    closed = blocks(spring=excess(0.2e5, 0.2e5, is_open=False), motor=FIRST["motor"])
    assert lacking(FIRST, closed, has_free_flight=False) == ["motor"]


def test_declared_numbers_are_searched_for_only_where_no_block_lacks() -> None:
    strained = Excess(DECLARED, "1", 1.0, 3.0, 1.0, (9e9, 0.0), (10, 0), True)
    assert lacking({**FIRST, DECLARED: strained}, {**FIRST, DECLARED: strained}, has_free_flight=False) == [
        "spring",
        "motor",
    ]
    quiet = blocks(spring=excess(0.0, 0.0, is_open=False)) | {DECLARED: strained}
    assert lacking(quiet, quiet, has_free_flight=False) == [DECLARED]


def test_fewer_effects_are_looked_for_in_free_flight() -> None:
    assert most_effects(has_free_flight=False) == 3
    assert most_effects(has_free_flight=True) == 2


def test_an_effect_is_superfluous_if_without_it_hardly_more_is_left() -> None:
    margin = 0.02 * total_excess(FIRST) + NOISE_MARGIN
    with_it = with_left(1e3, motor=0.0)
    assert is_superfluous(FIRST, with_left(1e3 + 0.49 * margin, motor=0.0), with_it)
    assert not is_superfluous(FIRST, with_left(1e3 + 0.51 * margin, motor=0.0), with_it)


# --- which effect is taken ------------------------------------------------------------------------


def rival(effect: str, numbers: int, spring: float, motor: float = 1e4) -> Rival[str]:
    return Rival(effect, effect, numbers, with_left(spring, motor))


def taken(*rivals: Rival[str]) -> tuple[str, ...] | None:
    choice = choose(FIRST, FIRST, rivals, "spring")
    return None if choice is None else (choice.taken.effect, *(r.effect for r in choice.equals))


def test_nothing_is_taken_where_nothing_helps() -> None:
    assert taken(rival("weak", 1, 0.6e5)) is None
    assert taken() is None


def test_what_leaves_least_is_taken() -> None:
    assert taken(rival("good", 1, 1e4), rival("better", 1, 0.5e4)) == ("better",)


def test_a_simpler_effect_is_taken_that_is_nearly_as_good_and_no_worse_one() -> None:
    """Nearly: 2 % of 2e5 more in the block, 4e3, half of it on each role."""
    assert taken(rival("rich", 3, 1e3), rival("simple", 1, 1e3 + 1.9e3)) == ("simple",)
    assert taken(rival("rich", 3, 1e3), rival("simple", 1, 1e3 + 2.2e3)) == ("rich",)


def test_an_effect_that_spoils_another_block_pays_for_it() -> None:
    assert taken(rival("spoiling", 1, 0.5e4, motor=2e4), rival("clean", 1, 1e4)) == ("clean",)


def test_among_what_cannot_be_told_apart_the_first_of_the_catalogue_is_taken() -> None:
    one, other = rival("one", 1, 1000.0), rival("other", 1, 1000.0 - 200.0)
    assert taken(one, other) == ("one", "other")
    assert taken(other, one) == ("other", "one")
    apart = rival("one", 1, 1000.0 + 500.0)
    assert taken(apart, other) == ("other",), "beyond 0.3 % of 2e5"


def test_an_alias_has_no_more_numbers_and_is_as_good_on_the_whole() -> None:
    simple = rival("simple", 1, 1000.0)
    assert taken(rival("rich", 2, 1000.0), simple) == ("simple",)
    # Where both come near, one leaves more in a block that neither spoils: less was won there.
    worse = Rival("worse", "worse", 1, with_left(1000.0, motor=9.9e3))
    better = Rival("better", "better", 1, with_left(1000.0, motor=9.0e3))
    assert taken(worse, better) == ("better",)
    assert taken(rival("worse", 1, 1000.0, motor=9.2e3), better) == ("worse", "better")


def test_an_effect_at_two_places_is_one_alias() -> None:
    places = [Rival(f"ripple at {k}", "ripple", 1, with_left(1000.0)) for k in range(2)]
    choice = choose(FIRST, FIRST, [*places, rival("other", 1, 1000.0)], "spring")
    assert choice is not None
    assert choice.taken.hypothesis == "ripple at 0"
    assert [r.effect for r in choice.equals] == ["other"]
