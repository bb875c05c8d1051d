"""The tolerance analysis: which numbers deviate and by how much, what is refused, what is printed."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from nlsdesign.components import Pulley, Through
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import (
    PowerTorque,
    SpreadRules,
    ToleranceResult,
    Trim,
    tolerance_analysis,
)
from nlsdesign.design.tolerance.causes import AnchorCause, Cause, NumberCause, spring_causes
from nlsdesign.design.tolerance.tolerance_result import quantile
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, TARGET, actuator

CURVE = PowerTorque(coefficient=4.35, exponent=2.09, angle=0.87)
"""Fig. 8 of Austin et al. 2015, see the deck."""


def published(**given: float) -> dict[str, Cause]:
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    rules = SpreadRules(given={name.replace("__", "."): value for name, value in given.items()})
    return {cause.name: cause for cause in spring_causes(model, None, rules)}


@pytest.fixture(scope="module")
def result() -> ToleranceResult:
    return tolerance_analysis(declare(load_deck("austin2015_figure_consistent")), target=CURVE, draws=400)


def test_declared_spreads_are_standard_deviations() -> None:
    causes = published()
    assert causes["spring.rubber.area"].deviation == pytest.approx(np.log(1.05) * 1e-4)
    assert causes["spring.rubber.rest_length"].deviation == pytest.approx(np.log(1.04) * 12.5e-3)
    anchor = causes["spring.cam.anchor_distance"]
    assert isinstance(anchor, AnchorCause)
    assert (anchor.deviation, anchor.source) == (pytest.approx(np.log(1.2) * 25e-3), "declared: ± 20 %")
    # Rows move together, relative to their own size.
    moduli = causes["spring.rubber.moduli"]
    assert isinstance(moduli, NumberCause)
    assert dict(moduli.numbers)["spring.rubber.stiff.modulus[2]"] == pytest.approx(np.log(1.1) * 1.479e6)
    assert dict(moduli.numbers)["spring.rubber.relaxing.spring.modulus"] == pytest.approx(
        np.log(1.1) * 1.479e6
    )
    assert str(moduli) == "spring.rubber.moduli ± 9.53 % (declared: ± 10 %)"
    assert "spring.cam.last_angle" not in causes  # no spread is declared


def test_what_no_deck_declares_is_assumed_with_a_reason() -> None:
    assumed = {name: cause for name, cause in published().items() if cause.assumed}
    edge = [f"spring.cam.contour.{part}" for part in ("offset", "half_wave", "wave")]
    assert set(assumed) == {"spring.pretension", *edge}
    assert all(len(cause.source) > 30 for cause in assumed.values())
    # Offset and two waves share the mean square of the edge equally; a wave has half the square of its size.
    shares = np.array([1.0, 0.5, 0.5]) * [assumed[name].deviation ** 2 for name in edge]
    assert shares == pytest.approx(np.full(3, (5e-5 / np.sqrt(3)) ** 2 / 3))


def test_the_declared_cable_deviates_as_it_is_declared() -> None:
    cable = published()["spring.cam.cable_radius"]
    assert cable.deviation == pytest.approx(0.5 * 0.9e-3 * np.log(1.05))
    assert cable.source == "declared: ± 5 %"
    rules = SpreadRules()
    (other,) = (
        cause
        for cause in spring_causes(flatten(actuator(CONCAVE)), None, rules)
        if cause.name == "spring.cam.cable_radius"
    )
    assert other.assumed


def test_given_spreads_replace_declared_and_assumed_ones() -> None:
    causes = published(
        spring__pretension=quantity(0.3, "mm"), spring__cam__contour=0.0, spring__rubber__moduli=0.02,
        spring__cam__elements=0.5, spring__cam__anchor_distance=0.0,
    )  # fmt: skip
    assert (causes["spring.pretension"].deviation, causes["spring.pretension"].source) == (0.0003, "given")
    assert causes["spring.cam.elements"].deviation == pytest.approx(0.25)  # of two
    assert causes["spring.rubber.moduli"].deviation == pytest.approx(np.log(1.02))
    gone = ("spring.cam.contour.offset", "spring.cam.contour.wave", "spring.cam.anchor_distance")
    assert not set(gone) & set(causes)


@pytest.mark.slow
def test_moduli_may_deviate_separately() -> None:
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    names = [cause.name for cause in spring_causes(model, None, SpreadRules(separate_moduli=True))]
    assert "spring.rubber.stiff.modulus[6]" in names
    assert "spring.rubber.moduli" not in names
    together = tolerance_analysis(model, target=CURVE, draws=200, trims=[])
    apart = tolerance_analysis(
        model, target=CURVE, draws=200, trims=[], rules=SpreadRules(separate_moduli=True)
    )
    assert apart.quantiles[-1].value < together.quantiles[-1].value


def test_a_far_anchor_does_not_deviate() -> None:
    model = flatten(actuator(CONCAVE, anchor=1e6))
    assert "spring.cam.anchor_distance" not in [c.name for c in spring_causes(model, None, SpreadRules())]


def test_a_result_says_what_was_found(result: ToleranceResult) -> None:
    text = str(result)
    for words in ("tighten first", "spring.rubber.moduli", "assumed: edge within", "seed 0", "400 draws"):
        assert words in text
    assert result.without_effect == ("spring.rubber.relaxing.dashpot.viscosity",)
    assert result.trim_first == "spring.pretension"
    assert result.tighten_first == result.measure_first == "spring.rubber.moduli"
    assert [each.share for each in result.causes] == sorted((e.share for e in result.causes), reverse=True)
    assert result.held > 0
    assert "held at the end of its range" in text
    assert np.all(np.diff(result.band, axis=0) >= 0.0)
    low, high = result.trims[0].needed
    assert 0.0 <= low < high < 2e-3
    with pytest.raises(FrozenInstanceError):
        result.seed = 1  # type: ignore[misc]
    assert str(pickle.loads(pickle.dumps(result))) == text


@pytest.mark.slow
def test_the_same_seed_gives_the_same_springs(result: ToleranceResult) -> None:
    machine = declare(load_deck("austin2015_figure_consistent"))
    again = tolerance_analysis(machine, target=CURVE, draws=400)
    assert np.array_equal(again.errors, result.errors)
    assert np.array_equal(again.trims[0].settings, result.trims[0].settings)
    other = tolerance_analysis(machine, target=CURVE, draws=400, seed=1)
    assert not np.any(other.errors == result.errors)


@pytest.mark.slow
def test_one_cause_less_leaves_the_draws_of_the_others(result: ToleranceResult) -> None:
    """Then two designs can be compared spring by spring."""
    rules = SpreadRules(given={"spring.cam.cable_radius": 0.0})
    machine = declare(load_deck("austin2015_figure_consistent"))
    less = tolerance_analysis(machine, target=CURVE, draws=400, rules=rules)
    assert np.corrcoef(less.errors, result.errors)[0, 1] > 0.99


def test_a_trim_of_the_anchor_moves_the_anchor() -> None:
    machine = actuator(CONCAVE, pretension=2e-3)
    trims = [Trim("spring.cam.anchor_distance", 22e-3, quantity(30.0, "mm")), Trim("spring.pretension")]
    both = tolerance_analysis(machine, target=TARGET, draws=40, trims=trims)
    anchor = next(each for each in both.trims if each.name == "spring.cam.anchor_distance")
    assert anchor.settings.min() >= 22e-3 - 1e-12
    assert anchor.settings.max() <= 30e-3 + 1e-12
    assert np.all(anchor.errors <= both.errors + 1e-9)
    assert [each.quantiles[-1].value for each in both.trims] == sorted(
        each.quantiles[-1].value for each in both.trims
    )


def test_a_quantile_has_a_confidence_interval_that_covers() -> None:
    """For 400 samples of an exponential distribution; of 300 intervals of 95 %, 285 are expected to cover."""
    draw, covered = np.random.default_rng(5), 0
    for _ in range(300):
        each = quantile(draw.exponential(size=400), 0.9)
        covered += each.lower <= np.log(10.0) <= each.upper
    assert 0.92 <= covered / 300 <= 0.985
    assert quantile(draw.exponential(size=20), 0.95).upper == np.inf


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"draws": 5}, ValueRangeError, "draws = 5: must be a whole number from 20"),
        ({"draws": 100.5}, ValueRangeError, "draws = 100.5"),
        ({"seed": -1}, ValueRangeError, "seed = -1"),
        ({"name": "sprin"}, UnknownNameError, "did you mean 'spring'"),
        (
            {"rules": SpreadRules(given={"spring.rubber.areas": 0.1})},
            UnknownNameError,
            "did you mean 'spring.rubber.area'",
        ),
        (
            {"rules": SpreadRules(given={"spring.pretension": quantity(1.0, "N")})},
            UnitError,
            "spread of spring.pretension",
        ),
        ({"rules": SpreadRules(given={"spring.cam.contour": -1e-5})}, ValueRangeError, "spring.cam.contour"),
        ({"rules": SpreadRules(given={"spring.pretension": float("nan")})}, ValueRangeError, "nan"),
        ({"trims": [Trim("spring.pretensoin")]}, UnknownNameError, "did you mean 'spring.pretension'"),
        ({"trims": [Trim("spring.pretension", 2e-3, 1e-3)]}, ValueRangeError, "has no room"),
        (
            {"trims": [Trim("spring.rubber.relaxing.dashpot.viscosity")]},
            ArrangementError,
            "does not change the torque at rest",
        ),
    ],
)
def test_what_cannot_be_asked_is_named(given: dict[str, object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        tolerance_analysis(actuator(CONCAVE), target=TARGET, **given)  # type: ignore[arg-type]


def test_a_pulley_deviates_in_its_radius() -> None:
    machine = actuator(CONCAVE, pretension=2e-3)
    spring = machine.element("spring")
    assert isinstance(spring, Through)
    wheel = Pulley(radius=quantity(10.0, "mm", spread=0.01))
    model = flatten(machine.with_part("spring", Through(cam=wheel, behind=spring.behind)))
    result = tolerance_analysis(model, target=TARGET, draws=20, trims=[])
    radius = next(each for each in result.causes if each.cause.name == "spring.cam.radius")
    # A factor of 1.01 on 10 mm against an edge within ± 0.05 mm.
    offset = next(each for each in result.causes if each.cause.name == "spring.cam.contour.offset")
    assert radius.share / offset.share == pytest.approx((np.log(1.01) * 1e-2 / (5e-5 / 3)) ** 2, rel=1e-3)
