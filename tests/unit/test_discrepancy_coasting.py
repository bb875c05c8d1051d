"""A record that a coasting body makes unpredictable counts as the others do, and only the quickest may."""

from nlsdesign.discrepancy.selection.unpredictable import astray, like_the_others

ROWS = {("spring", r): 100 for r in ("slow", "middle", "quick")} | {("motor", "quick"): 50}
BEFORE = {("spring", r): 500.0 for r in ("slow", "middle", "quick")} | {("motor", "quick"): 900.0}


def after(**changes: float) -> dict[tuple[str, str], float]:
    found = {("spring", "slow"): 110.0, ("spring", "middle"): 130.0, ("spring", "quick"): 120.0}
    return found | {("motor", "quick"): 60.0} | {("spring", k): v for k, v in changes.items()}


def test_nothing_is_astray_where_all_records_are_predicted() -> None:
    assert astray(BEFORE, after(), ROWS, {"quick"}) == frozenset()


def test_a_quick_record_predicted_worse_than_before_is_astray() -> None:
    found = astray(BEFORE, after(quick=5000.0), ROWS, {"quick"})
    assert found == {("spring", "quick")}


def test_a_quick_record_left_far_behind_the_others_is_astray() -> None:
    assert astray(BEFORE, after(quick=270.0), ROWS, {"quick"}) == {("spring", "quick")}
    assert astray(BEFORE, after(quick=250.0), ROWS, {"quick"}) == frozenset()


def test_a_slow_record_is_never_astray() -> None:
    assert astray(BEFORE, after(slow=5000.0), ROWS, {"quick"}) == frozenset()


def test_a_record_astray_counts_as_the_others_of_its_block_and_never_for_more() -> None:
    squares = after(quick=5000.0)
    told = like_the_others(squares, ROWS, {("spring", "quick")})
    assert told["spring", "quick"] == (110.0 + 130.0) / 200 * 100
    assert {k: v for k, v in told.items() if k != ("spring", "quick")} == {
        k: v for k, v in squares.items() if k != ("spring", "quick")
    }
    assert like_the_others(after(quick=50.0), ROWS, {("spring", "quick")})["spring", "quick"] == 50.0
