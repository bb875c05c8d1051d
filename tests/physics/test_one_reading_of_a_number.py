"""One declared number means the same to fit, observer, tolerance analysis, sweep and calibration."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import kstest, norm, uniform

from nlsdesign import declare, flatten, quantity
from nlsdesign.bench.calibration.estimate import prior_of
from nlsdesign.bench.identification.parameters import declared_parameter, free_parameter
from nlsdesign.design import SpreadRules
from nlsdesign.design.tolerance.causes import draw_deviations, spring_causes
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.foundation.spread import NormalSpread, RelativeSpread, Spread, UniformSpread
from nlsdesign.model import FlatModel
from nlsdesign.regeneration.regenerated_observer import DRAWS, _draws
from nlsdesign.simulation.prior import declared_prior
from nlsdesign.sweeps import AngleQuestion, RandomDraws
from nlsdesign.sweeps.axis_values import Subject

AREA = "spring.rubber.area"
DECK = load_deck("austin2015_figure_consistent")
VALUE = declare(DECK).quantities()[AREA].number


def machine(spread: Spread | float) -> Any:
    """The published actuator with one number whose spread is stated."""
    actuator = declare(DECK)
    exact = {name: q.with_spread(0.0) for name, q in actuator.quantities().items()}
    return actuator.with_values(
        {**exact, AREA: Quantity(VALUE, "m^2", "by hand", spread=cast(Spread, spread))}
    )


def logarithms(spread: float) -> Any:
    """Cumulative distribution of a number over its declared value, by hand."""
    return lambda ratio: norm.cdf(np.log(ratio) / math.log(1.0 + spread))


CASES = {
    "a share": (RelativeSpread(0.3), logarithms(0.3)),
    "with a unit": (NormalSpread(0.1 * VALUE), lambda ratio: norm.cdf((ratio - 1.0) / 0.1)),
    "a range": (UniformSpread(0.2 * VALUE), lambda ratio: uniform.cdf(ratio, 0.8, 0.4)),
}


@pytest.mark.parametrize("case", CASES)
def test_everything_that_draws_draws_from_the_same_distribution(case: str) -> None:
    spread, expected = CASES[case]
    actuator = machine(spread)
    model = flatten(actuator)
    drawn = {"observer, loop": declared_prior(model).draws(2000, seed=3)[AREA]}
    drawn["calibration"] = prior_of(actuator, None).draws(2000, seed=4)[AREA]
    axes = RandomDraws(count=2000, seed=5).bound(Subject({"one": actuator}, AngleQuestion()))
    drawn["sweep"] = np.array([axes.row(k)[0] for k in range(2000)])
    (cause,) = [c for c in spring_causes(model, None, SpreadRules()) if c.name == AREA]
    standard = draw_deviations([cause], 2000, seed=6)[:, 0]
    drawn["tolerance"] = VALUE + cause.deviation * standard
    drawn["regeneration"] = np.array([values[AREA] for values in _draws(model, ())])
    for who, numbers in drawn.items():
        assert kstest(numbers / VALUE, expected).pvalue > 1e-3, (who, len(numbers))
    assert len(drawn["regeneration"]) == DRAWS


@pytest.mark.parametrize("share", [0.05, 0.3, 1.5])
def test_a_fit_weighs_a_number_as_the_observer_does(share: float) -> None:
    model = flatten(machine(share))
    parameter = declared_parameter(model.variable(AREA))
    assert parameter.sigma == pytest.approx(math.log(1.0 + share), rel=1e-12)
    assert declared_prior(model).deviations[0] == pytest.approx(parameter.sigma, rel=1e-12)
    assert parameter.inward(parameter.upper) - parameter.inward(VALUE) == pytest.approx(3.0 * parameter.sigma)


def test_a_number_of_either_sign_is_known_in_its_unit() -> None:
    variable = variable_of(0.0, NormalSpread(30.0))
    parameter = declared_parameter(variable)
    ends = (parameter.inward(parameter.lower), parameter.inward(parameter.upper))
    assert (parameter.sigma, ends) == (1.0, (-3.0, 3.0))
    assert parameter.outward(-1.0) == -30.0


def test_a_fit_of_a_range_stays_in_it_and_prefers_nothing_inside() -> None:
    parameter = declared_parameter(variable_of(2.0, UniformSpread(1.0)))
    assert (parameter.lower, parameter.upper, parameter.sigma) == (1.0, 3.0, math.inf)


@pytest.mark.parametrize(("minimum", "scale"), [(0.0, "log"), (-math.inf, "linear")])
def test_the_range_of_the_law_decides_whether_a_free_number_may_change_its_sign(
    minimum: float, scale: str
) -> None:
    assert free_parameter(variable_of(6.0, RelativeSpread(5.0), minimum)).scale == scale


def variable_of(value: float, spread: Spread, minimum: float = -math.inf) -> Any:
    """A parameter of no model in particular."""
    return SimpleNamespace(
        name="ripple.sine", unit="N*m", start=value, spread=spread, minimum=minimum, maximum=math.inf
    )


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("value = 2.0, spread = 0.1", (2.0, RelativeSpread(0.1))),
        ('value = 0.0, spread = "30 mN*m"', (0.0, NormalSpread(0.03))),
        ("range = [1.0, 3.0]", (2.0, UniformSpread(1.0))),
        ("value = 2.0", (2.0, RelativeSpread(0.0))),
    ],
)
def test_each_form_is_read_from_a_deck_and_written_back(
    written: str, expected: tuple[float, Spread], tmp_path: Path
) -> None:
    from nlsdesign.components.assembly.part_text import number_of
    from nlsdesign.foundation.deck import read_deck

    line = f'{{{written}, unit = "N*m", source = "by hand"}}'
    deck = read_deck(f"[load]\ntorque = {line}\n", tmp_path / "own.toml")
    given = deck.quantity("load.torque")
    assert (given.number, given.spread) == expected
    again = read_deck(f"[load]\ntorque = {number_of(given)}\n", tmp_path / "again.toml").quantity(
        "load.torque"
    )
    assert (again.number, again.spread) == expected


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ('value = 0.0, spread = "30 mm"', r"spread = \"30 mm\": is not of the dimension of 'N\*m'"),
        ("range = [3.0, 1.0]", r"range: is a range from a smaller to a larger number -> write range = \[1.0"),
        ("range = [1.0, 3.0], spread = 0.1", "has both range and spread -> leave out spread"),
        ("value = 1.0, spread = 15", r"a factor of 16 .* write spread = 0.15 if 15 %"),
        ('value = 1.0, spread = "-2 N*m"', "above zero and finite"),
    ],
)
def test_spreads_that_mean_nothing_are_refused(written: str, message: str, tmp_path: Path) -> None:
    from nlsdesign.foundation.deck import read_deck
    from nlsdesign.foundation.errors import NlsError

    deck = read_deck(f'[load]\ntorque = {{{written}, unit = "N*m", source = "x"}}\n', tmp_path / "own.toml")
    with pytest.raises(NlsError, match=message):
        deck.quantity("load.torque")


def test_a_relative_spread_of_zero_leaves_it_exact(tmp_path: Path) -> None:
    model: FlatModel = flatten(machine(0.3))
    still = model.with_values({AREA: quantity(1.0, "mm^2", source="x", spread=0.0)})
    assert declared_prior(still).names == ()
