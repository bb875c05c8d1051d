"""Errors are read by people: no power of ten where a prefix, or none, says the same."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from nlsdesign.design import ExponentialTorque, design_cam
from nlsdesign.design.optimisation.defaults import DesignSettings
from nlsdesign.design.tolerance.tolerance_result import QuantileEstimate
from nlsdesign.feedback.observer.spread.spread_errors import SpreadErrors
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.written_numbers import prefixed, shared_prefix, without_power
from nlsdesign.presentation.figures import torque_against_target
from tests.sweeping import actuator

POWER = re.compile(r"\d[eE][+-]?\d|·10[⁰¹²³⁴⁵⁶⁷⁸⁹]")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3.99, "3.99 N·m"),
        (-3.99, "-3.99 N·m"),
        (0.999, "999 mN·m"),
        (0.9996, "1 N·m"),
        (1234.0, "1.23 kN·m"),
        (0.0, "0 mN·m"),
        (math.inf, "inf mN·m"),
    ],
)
def test_a_number_has_the_prefix_that_fits(value: float, text: str) -> None:
    assert prefixed(value) == text


def test_numbers_of_a_table_share_the_prefix_of_the_largest() -> None:
    assert shared_prefix([0.1, math.inf, math.nan], "N") == (1000.0, "mN")
    assert shared_prefix([0.1, 12.0], "N") == (1.0, "N")
    assert shared_prefix([], "N*m") == (1000.0, "mN·m")
    assert without_power(1e3 * 3.99) == "3990"


def test_a_quantile_of_newton_metres_is_read_in_them() -> None:
    shown = str(QuantileEstimate(share=0.95, value=3.99, lower=3.5, upper=4.25))
    assert shown == "95 % below 3.99 N·m rms (3.5 to 4.25 with 95 % confidence)"


@pytest.mark.slow
def test_a_design_that_misses_by_newton_metres_says_so_without_a_power_of_ten() -> None:
    """The springs of the deck store far less than 40 N·m over 53° take."""
    target = ExponentialTorque(maximum=quantity(40.0, "N*m"), angle=quantity(53.0, "deg"), shape=1.0)
    quick = DesignSettings(starts=1, draws=20, look_for_size_ranges=False, look_for_remedies=False)
    made = design_cam(actuator(), target=target, settings=quick)
    assert made.rms > 1.0
    rows = dict(made.rows())
    assert rows["torque error, exact numbers"].startswith(f"{made.rms:.3g} N·m rms (")
    assert made.tolerance is not None
    words = "\n".join(
        (rows["torque error, exact numbers"], rows["torque error over the spread"], str(made.tolerance))
    )
    assert not POWER.search(words), words
    assert made.tolerance.shown_in == "N·m"
    drawn = torque_against_target(target, {"design": (made.check.angles, made.check.torques)})
    assert drawn.axes[1].get_ylabel() == "error in N·m"


def test_errors_over_the_spread_are_shown_in_one_unit() -> None:
    errors = SpreadErrors(
        observers=("cascade",),
        frequencies=(1.0,),
        torque=50.0,
        exact=np.array([[0.01]]),
        drawn=np.full((1, 4, 1), 2.5),
        causes={"spring.stiffness": np.array([[2.0]])},
        bound=np.array([]),
        unit="N*m",
        lost=0,
    )
    assert errors.shown_in == "N·m"
    (row,) = errors.rows()
    assert row[2:] == ["2.50", "2.50", "2.50", "not computed", "0.0100"], "exact numbers come last"
