"""What time takes from the torque: set and slow relaxation against a neo-Hookean strip written out here."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.components import Assembly, LinearElastic, ViscousMaterial, series, specimen
from nlsdesign.components.materials.specimen import TensionSet
from nlsdesign.design import tolerance_analysis
from nlsdesign.design.tolerance.causes import LastingCause, draw_deviations
from nlsdesign.design.tolerance.lasting import MEASURED_AFTER, lasting_causes
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.cam_cases import NeoHooke
from tests.physics.test_tolerance import ANCHOR, LAST, NOMINAL, TARGET, actuator, pulled_arc

ANGLES = np.linspace(1e-9, LAST, 31)
STIFF, SLOW = 0.2e6, 600.0
"""Modulus in Pa of a branch, and its relaxation time in s."""


def with_rubber(*, share: float | None = None, time: float | None = None) -> Assembly:
    laws = {"stiff": NeoHooke(modulus=quantity(0.85, "MPa", spread=0.15))}
    if time is not None:
        laws["slow"] = series(
            spring=LinearElastic(modulus=STIFF), dashpot=ViscousMaterial(viscosity=STIFF * time)
        )
    sizes = {"area": quantity(1.0, "cm^2"), "rest_length": quantity(12.5, "mm")}
    rubber = specimen(**sizes, **laws)
    if share is not None:
        stated = quantity(share, "1", source="data sheet, ISO 2285")
        rubber = replace(rubber, lasting=TensionSet(tension_set=stated))
    return actuator().with_part("spring.element", rubber)


def cause_of(machine: Assembly) -> tuple[tuple[LastingCause, ...], tuple[str, ...]]:
    return lasting_causes(flatten(machine), None, ANGLES)


def whole(cause: LastingCause) -> np.ndarray:
    """Return the loss once all of it has come about."""
    return math.sqrt(12.0) * np.array(cause.loss)


def test_set_is_a_pretension_that_is_lost() -> None:
    (cause,), (on_set, on_creep) = cause_of(with_rubber(share=0.1))
    touched = pulled_arc(ANGLES, ANCHOR, 0.0)
    after = replace(NOMINAL, pretension=(1.0 - 0.1) * NOMINAL.pretension)
    expected = NOMINAL.torque(*touched) - after.torque(*touched)
    assert np.max(expected) > 0.01 * TARGET.largest
    assert whole(cause) == pytest.approx(expected, abs=2e-3 * np.max(expected))
    assert cause.name == "spring.element.set"
    assert cause.source == "declared: 10 % of the strain at rest stays, data sheet, ISO 2285"
    assert "stretched by 32 % at angle zero" in on_set
    assert "no law of 'spring.element' relaxes" in on_creep


def test_creep_is_what_still_pulls_when_the_new_spring_is_measured() -> None:
    (cause,), (on_set, on_creep) = cause_of(with_rubber(time=SLOW))
    extensions, arms = pulled_arc(ANGLES, ANCHOR, 0.0)
    strain = (NOMINAL.pretension + extensions) / NOMINAL.rest_length
    branch_force = NOMINAL.area * STIFF * strain * math.exp(-MEASURED_AFTER / SLOW)
    expected = NOMINAL.elements * arms * branch_force
    assert whole(cause) == pytest.approx(expected, abs=2e-3 * np.max(expected))
    assert "states no tension_set (ISO 2285)" in on_set
    assert "is not over 60 s after" in on_creep


def test_what_is_over_at_once_takes_nothing() -> None:
    causes, (_, on_creep) = cause_of(with_rubber(time=0.1))
    assert causes == ()
    assert "is over 60 s after it was stretched" in on_creep


def test_the_loss_is_on_one_side_and_each_part_of_it_as_likely() -> None:
    (cause,), _ = cause_of(with_rubber(share=0.1))
    shares = draw_deviations([cause], 4000, seed=1)[:, 0] / math.sqrt(12.0)
    assert 0.0 <= np.min(shares) < 0.01
    assert 0.99 < np.max(shares) <= 1.0
    assert np.std(shares) == pytest.approx(1.0 / math.sqrt(12.0), rel=0.02)


@pytest.mark.slow
def test_it_is_one_more_cause_and_a_trim_takes_it_back() -> None:
    plain, set_too = (
        tolerance_analysis(with_rubber(share=share), target=TARGET, draws=400, seed=2)
        for share in (None, 0.1)
    )
    names = [each.cause.name for each in plain.causes]
    assert {each.cause.name for each in set_too.causes} == {*names, "spring.element.set"}
    effect = next(each for each in set_too.causes if each.cause.name == "spring.element.set")
    assert effect.measured == pytest.approx(plain.quantiles[-1].value, rel=1e-6), "without it, as before"
    assert np.median(set_too.band[1] - plain.band[1]) < 0.0
    # The pretension that is set anew is the one that was lost.
    assert effect.share_after_trim < 0.1 * effect.share
    assert [text for what, text in set_too.rows() if what == "over time"] == list(set_too.over_time)
    assert "spring.element.set" in str(set_too)
