"""Sums and sentences of a verdict and of a refit, from gaps written by hand."""

from __future__ import annotations

import math
from typing import Any, cast

import pytest

from nlsdesign.bench.discrepancy.reporting.refit import FittedNumber, Refit
from nlsdesign.bench.discrepancy.reporting.remainder import Formula, Remainder
from nlsdesign.bench.discrepancy.reporting.verdict import Course, NamedEffect, RecordGap, Verdict
from nlsdesign.components import Fixed
from nlsdesign.components.assembly.named_parts import assembly

BLANK = assembly("blank", load=Fixed())
GAPS = (
    RecordGap("motor", "a", "fit", 0.07, 0.06, 0.05, 900, "N*m"),
    RecordGap("motor", "b", "held_out", 0.09, 0.08, 0.05, 900, "N*m"),
    RecordGap("spring", "a", "fit", 50.0, 20.0, 10.0, 500, "N"),
    RecordGap("spring", "b", "held_out", 10.0, 3.0, 2.0, 100, "N"),
    RecordGap("spring", "c", "held_out", 6.0, 5.0, 2.0, 300, "N"),
)


def verdict(kind: str = "named", **changed: Any) -> Verdict:
    course = cast(Course, None)
    return Verdict(kind, (), (), changed.pop("gaps", GAPS), "spring", (), BLANK, BLANK, course, **changed)


# Per sample, not per record: (100·10² + 300·6²)/400 = 52, (100·3² + 300·5²)/400 = 21.
BEFORE, AFTER, FLOOR = math.sqrt(52.0), math.sqrt(21.0), 2.0


def test_errors_are_summed_over_the_samples_of_one_block_and_one_role() -> None:
    said = verdict()
    assert said.rms("before", "held_out") == pytest.approx(BEFORE)
    assert said.rms("after", "held_out") == pytest.approx(AFTER)
    assert said.rms("before", "fit") == pytest.approx(50.0)
    assert said.held_out_ratio == pytest.approx(AFTER / FLOOR)
    assert math.isnan(verdict(gaps=GAPS[:3]).rms("before", "held_out")), "no such record"


def test_what_is_closed_is_the_share_of_the_mean_square_beyond_the_floor() -> None:
    assert verdict().closed == pytest.approx(1.0 - (21.0 - 4.0) / (52.0 - 4.0))
    silent = RecordGap("spring", "b", "held_out", 1.0, 1.0, 2.0, 100, "N")
    assert verdict(gaps=(silent,)).closed == 0.0, "nothing was beyond the floor"
    below = RecordGap("spring", "b", "held_out", 4.0, 1.0, 2.0, 100, "N")
    assert verdict(gaps=(below,)).closed == 1.0, "no more than all"


def test_the_error_in_the_file_is_that_of_the_summed_up_block_in_its_own_unit() -> None:
    error = verdict().to_dict()["error"]
    assert (error["block"], error["unit"], error["noise_floor"]) == ("spring", "N", 2.0)
    assert error["held_out"] == {"before": 7.2111, "after": 4.58258}, "√52 and √21, to six digits"
    assert error["fit"] == {"before": 50.0, "after": 20.0}


def test_nothing_missing_is_said_with_what_the_records_leave_open() -> None:
    assert verdict("none").words().endswith("nothing is missing.")
    assert "They leave 2 of its numbers" in verdict("none", unidentified=("k", "c")).words()
    assert "They leave" not in verdict("unknown", unidentified=("k", "c")).words()


def test_shares_are_said_in_percent() -> None:
    effect = NamedEffect(
        "slack", "spring.cable", {"spring.cable.gap": (1e-3, "m", 2e-5)}, (), 0.82, "late", "source"
    )
    formula = Formula({"[q]": 2.0}, 0.64, "2·[q] (in N, signals in SI)")
    left = Remainder(
        "spring", "force.reading", "N", 4.5000001, 2.0, "a drift", (("time", 1.0 / 3.0),), formula
    )
    named = Verdict(
        "named", (effect,), (), GAPS, "spring", (), BLANK, BLANK, cast(Course, None), remainder=left
    )
    assert (
        "gap = 0.001000 ± 0.000020 m. What it leaves in records: late. It explains 82 % of" in named.words()
    )
    assert "do not tell it from" not in named.words()
    assert "2·[q] (in N, signals in SI) explains 64 % of it on records" in named.words()
    written = named.to_dict()["remainder"]
    assert (written["rms"], written["shape"]) == (4.5, [{"over": "time", "share": 0.333333}]), "six digits"
    without = Remainder("spring", "force.reading", "N", 4.5, 2.0, "a drift", (), None)
    assert without.words().endswith("and is 4.5 N rms, the noise floor 2 N.")


# --- refit ----------------------------------------------------------------------------------------


def number(name: str, strain: float, *, error: float = 0.1) -> FittedNumber:
    return FittedNumber(name, "N/m", 1.0, 1.0, error, strain)


def test_the_error_of_a_refit_is_per_block_and_role_over_all_samples() -> None:
    errors = {(e.block, e.role): e for e in Refit(BLANK, (), (), GAPS, ()).errors()}
    assert list(errors) == [
        ("motor", "fit"),
        ("motor", "held_out"),
        ("spring", "fit"),
        ("spring", "held_out"),
    ]
    spring = errors["spring", "held_out"]
    assert (spring.declared, spring.fitted) == (pytest.approx(BEFORE), pytest.approx(AFTER))
    assert (spring.noise_floor, spring.unit) == (pytest.approx(FLOOR), "N")
    assert errors["motor", "fit"].fitted == pytest.approx(0.06)


def test_a_number_at_either_end_of_its_range_is_named() -> None:
    numbers = (
        number("low", -3.0, error=math.nan),
        number("middle", 2.9),
        number("high", 3.0, error=math.nan),
    )
    said = Refit(BLANK, (), numbers, GAPS, ()).words()
    assert [text.partition(" stands")[0] for text in said] == ["low", "high"]
    assert "-3.0 standard deviations" in said[0]
