"""Rubber that a machine at rest keeps stretched: the limit that holds by default, and how it is set aside."""

from __future__ import annotations

import pytest

from nlsdesign.components import declare
from nlsdesign.design import (
    CamDesign,
    DesignSettings,
    Limit,
    MaximumLastingStrain,
    MaximumStrain,
    MaximumStress,
    design_cam,
    safe_limits,
)
from nlsdesign.foundation.deck import load_deck
from nlsdesign.live.gallery import gallery_question
from nlsdesign.model import flatten

QUICK = DesignSettings(starts=1, draws=0, look_for_size_ranges=False)
FREE = ["spring.cam.contour", "spring.pretension"]
"""With both free the template of the live page stretched 40 mm of rubber by 46 mm for good, 114 %."""


def designed(*keep: Limit) -> CamDesign:
    question = gallery_question("cam-actuator")
    return design_cam(question.actuator, target=question.target, free=FREE, keep=keep, settings=QUICK)


def at_rest(design: CamDesign) -> float:
    values = flatten(design.actuator).values
    return values["spring.pretension"] / values["spring.rubber.rest_length"]


def test_a_design_keeps_no_rubber_stretched_to_more_than_twice_its_length() -> None:
    design = designed()
    assert design.met
    assert at_rest(design) <= 1.0 + 1e-6
    (state,) = [each for each in design.limits if each.limit == MaximumLastingStrain.__name__]
    assert state.value == pytest.approx(at_rest(design), rel=1e-6)
    assert state.bound == 1.0


@pytest.mark.slow
def test_a_limit_of_the_same_kind_takes_its_place_and_a_looser_one_is_remarked() -> None:
    assert at_rest(designed(MaximumLastingStrain(0.6))) <= 0.6 + 1e-6
    loose = designed(MaximumLastingStrain(1.5))
    assert at_rest(loose) > 1.05
    (remark,) = [each for each in loose.remarks if "beyond what the declared" in each]
    assert "strain at rest of spring.rubber" in remark


def test_it_holds_where_something_is_known_of_the_rubber() -> None:
    kinds = [type(limit) for limit in safe_limits(flatten(declare(load_deck("austin2015_as_printed"))))]
    assert kinds.count(MaximumLastingStrain) == 1
    assert {MaximumStrain, MaximumStress} <= set(kinds)
    assert MaximumLastingStrain not in map(type, safe_limits(flatten(declare(load_deck("test_rig")))))
