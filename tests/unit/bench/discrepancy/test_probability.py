"""The probability that a name is right: what it rises with, and that it is never certain."""

from __future__ import annotations

import math

import pytest

from nlsdesign.bench.discrepancy.selection.criteria import CALIBRATION, Calibration


def test_the_probability_is_the_logistic_curve_of_ratio_and_completeness() -> None:
    curve = Calibration(offset=0.5, distance=2.0, complete=1.0)
    assert curve.probability(0.3, complete=False) == pytest.approx(1.0 / (1.0 + math.exp(-1.1)))
    assert curve.probability(0.3, complete=True) == pytest.approx(1.0 / (1.0 + math.exp(-2.1)))


def test_it_rises_with_what_other_names_leave_and_falls_below_one_half_where_they_leave_less() -> None:
    stated = [CALIBRATION.probability(d, complete=False) for d in (-3.0, -1.0, 0.0, 1.0, 3.0)]
    assert stated == sorted(stated)
    assert stated[0] < 0.5 < stated[2]


def test_no_name_is_certain() -> None:
    assert CALIBRATION.probability(50.0, complete=True) == 0.99
