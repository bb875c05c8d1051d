"""What the live page calls limits, and what it says of rubber that is stretched too far."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.design.optimisation.defaults import StrainEnd
from nlsdesign.design.optimisation.limits import limit_kinds
from nlsdesign.live.answers import LimitMargin, LiveColumn
from nlsdesign.live.edits import edit, free_number, hold_number
from nlsdesign.live.gallery import gallery_question
from nlsdesign.live.question import LiveQuestion
from nlsdesign.live.views import holding, in_words, not_kept, smallest, stretched_beyond


@pytest.fixture(scope="module")
def question() -> LiveQuestion:
    return gallery_question("cam-actuator")


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        (
            "limits of stress of spring.rubber (MaximumStress), radius of curvature "
            "(MinimumRadiusOfCurvature), first slope (PullingCable): contradict each other",
            "limits of stress of spring.rubber (1.723 MPa), radius of curvature (2.25 mm), first slope: "
            "contradict each other",
        ),
        (
            "stress of spring.rubber <= 1.723 MPa would have to give by 0.5 MPa (to 2.2 MPa) (MaximumStress)",
            "stress of spring.rubber ≤ 1.723 MPa would have to give by 0.5 MPa (to 2.2 MPa)",
        ),
        (
            "beyond what is declared: radius of curvature 1 mm >= 2 mm (MinimumRadiusOfCurvature)",
            "beyond what is declared: radius of curvature 1 mm ≥ 2 mm",
        ),
        ("MaximumStrain: strain = -1", "largest strain of the rubber (166.7 %): strain = -1"),
        ("no MaximumCamRadius is asked for", "no largest cam radius is asked for"),
        ("no strength is asked for (PullingCable, NumberRange): any", "no strength is asked for: any"),
        ("spring.rubber.area <= 60 mm² (NumberRange)", "spring.rubber.area ≤ 60 mm²"),
        ("ask for a longer one (limit RestLengthRange)", "ask for a longer one"),
    ],
)
def test_a_limit_is_called_what_it_limits(question: LiveQuestion, sentence: str, words: str) -> None:
    assert in_words(sentence, question.limit_values) == words


def margin(limit: str, of: str, bound: float, *, active: bool = True) -> LimitMargin:
    kind = limit_kinds()[limit]
    return LimitMargin(limit, of, bound, bound, 0.0, kind.unit, kind.unit, kind.upper, active)


def test_what_holds_a_design_has_its_number_and_a_held_contour_is_named_in_place_of_its_limits(
    question: LiveQuestion,
) -> None:
    rows = (
        margin("MaximumStrain", "strain of spring.rubber", 5.0 / 3.0),
        margin("MinimumRadiusOfCurvature", "radius of curvature", 2.25e-3),
        margin("MaximumCableTension", "cable tension", 180.0, active=False),
    )
    bounds = ["strain of spring.rubber ≤ 166.7 %", "radius of curvature ≥ 0.00225 m"]
    rows = (rows[0], replace(rows[1], shown_unit="mm"), rows[2])
    bounds[1] = "radius of curvature ≥ 2.25 mm"
    assert holding(question, rows) == bounds
    held = edit(hold_number, question.contour).applied(question)
    assert holding(held, rows) == [bounds[0], "the contour, which is held"]


def test_a_range_of_a_free_number_is_a_limit_like_another(question: LiveQuestion) -> None:
    """It is in the margins of a whole design, and has no slider."""
    asked = edit(free_number, "spring.rubber.area", 40e-6, 60e-6).applied(question)
    row = LimitMargin(
        "NumberRange", "spring.rubber.area", 6e-5, 6e-5, 0.0, "m^2", "mm^2", upper=True, active=True
    )
    assert not_kept(asked, (row,)) == []
    assert holding(asked, (row,)) == ["spring.rubber.area ≤ 60 mm²"]


def test_rubber_beyond_what_is_stated_is_found_with_its_place_and_what_to_change() -> None:
    angles = LiveColumn("angle", "rad", "", np.radians([0.0, 10.0, 20.0, 30.0]))
    ends = {"spring.rubber": StrainEnd(2.0, "its law is stated to hold up to 200 %")}

    def strained(*values: float) -> tuple[str, ...]:
        return stretched_beyond(ends, [angles, LiveColumn("spring.rubber.strain", "1", "", np.array(values))])

    assert strained(0.0, 1.0, 1.5, 2.0) == ()
    (finding,) = strained(0.0, 1.0, 2.1, 40.0)
    assert finding.startswith(
        "spring.rubber is stretched to 4000 % between 20° and 30°, but its law is stated"
    )
    assert "limit the largest strain, give it more rest length or less pretension" in finding
    assert (smallest(ends), smallest({})) == (2.0, math.inf)


def test_the_end_of_rubber_is_what_its_law_states_what_it_breaks_at_or_what_soft_rubbers_do(
    question: LiveQuestion,
) -> None:
    assert question.machine.strain_ends == {
        "spring.rubber": StrainEnd(5.0, "it is declared to break at 500 %")
    }
    rig = gallery_question("test_rig")
    (end,) = rig.machine.strain_ends.values()
    assert end.strain == 5.0
    assert end.reason.startswith("nothing is stated of its rubber")
    # Its own cam stretches it to 104 %; without a limit a design went to 4001 %.
    assert dict(rig.limits) == {"MaximumStrain": 2.1}
    assert dict(question.limits) == {}
