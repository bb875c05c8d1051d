"""What a designer may do on the live page: each edit makes another question or is refused with its reason."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nlsdesign.foundation.errors import NlsError, UnknownNameError, ValueRangeError
from nlsdesign.live.answers import LimitMargin, to_json
from nlsdesign.live.edits import (
    EDITS,
    LiveEdit,
    add_point,
    change_limit,
    choose_deck,
    choose_material,
    drop_limit,
    edit,
    edit_from,
    free_number,
    hold_number,
    move_point,
    remove_point,
    scale_target,
    set_number,
)
from nlsdesign.live.gallery import gallery_cards, gallery_question, question_of_deck
from nlsdesign.live.question import MOST_POINTS, LiveQuestion
from nlsdesign.live.saved import SavedDesign, reopened, saved
from nlsdesign.live.session_news import choices
from nlsdesign.live.tasks import drop_task, follow_tasks, set_motor, set_task
from nlsdesign.live.views import not_kept, unkept


@pytest.fixture(scope="module")
def question() -> LiveQuestion:
    return gallery_question("cam-actuator")


def test_gallery_lists_every_deck_and_says_why_some_have_no_cam() -> None:
    cards = {card.name: card for card in gallery_cards()}
    assert cards["cam-actuator"].reason == ""
    assert cards["cam-actuator"].kind == "template"
    assert "no cam spring" in cards["austin2015_soft_spring"].reason
    assert all(card.line for card in cards.values())
    with pytest.raises(NlsError, match="no cam spring"):
        gallery_question("austin2015_soft_spring")
    with pytest.raises(UnknownNameError, match="cam-actuator"):
        edit(choose_deck, "cam-actuatr").applied(gallery_question("cam-actuator"))


def test_points_move_between_their_neighbours_only(question: LiveQuestion) -> None:
    moved = edit(move_point, 2, 0.4, 0.2).applied(question)
    assert moved.points[2] == (0.4, 0.2)
    assert moved.target.torque(0.4) == pytest.approx(0.2)
    assert question.points[2] != (0.4, 0.2)
    for step in (
        edit(move_point, 2, 0.1, 0.2),
        edit(move_point, 2, 0.7, 0.2),
        edit(move_point, 0, 0.0, 0.1),
        edit(move_point, -1, 0.3, 0.1),
        edit(move_point, 9, 0.3, 0.1),
        edit(move_point, 2, math.nan, 0.2),
        edit(move_point, 2, 0.4, math.inf),
        edit(move_point, 2, 0.4, -0.1),
        edit(move_point, 5, 9.0, 0.1),
        edit(add_point, question.points[2].angle, 0.1),
        edit(remove_point, 0),
    ):
        with pytest.raises(ValueRangeError):
            step.applied(question)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (edit(move_point, 2, 0.4, -5.0), ["torque of point 3 = -5 N·m", "[0, 1e+05] N·m"]),
        (edit(move_point, 2, -math.radians(5.0), 0.2), ["angle of point 3 = -5 °", "[0, 359.8] °"]),
        (edit(move_point, 2, 0.7, 0.2), ["points 3 and 4 of the target", "0.057°"]),
        (edit(move_point, 0, 0.0, 0.1), ["point 1 of the target", "2 to 6"]),
        (edit(change_limit, "MaximumStrain", -0.05), ["largest strain of the rubber = -5 %"]),
        (edit(change_limit, "MaximumStress", -2e6), ["largest nominal stress of the rubber = -2 MPa"]),
        (edit(change_limit, "MinimumRadiusOfCurvature", -3e-3), ["least radius of curvature = -3 mm"]),
        (edit(set_number, "spring.rubber.area", -5e-6), ["spring.rubber.area = -5 mm²", "[0.01, 1e+04] mm²"]),
    ],
)
def test_a_refusal_counts_points_and_names_units_as_the_page_does(
    question: LiveQuestion, step: LiveEdit, words: list[str]
) -> None:
    with pytest.raises(ValueRangeError) as refused:
        step.applied(question)
    assert all(each in str(refused.value) for each in words), str(refused.value)
    assert "SI" not in str(refused.value)


def test_a_whole_curve_is_scaled_to_its_last_point_and_keeps_its_form(question: LiveQuestion) -> None:
    """A curve of 60° is not brought to 40° point by point: each stays between its neighbours."""
    scaled = edit(scale_target, math.radians(40.0), 0.8).applied(question)
    assert scaled.points[-1] == (math.radians(40.0), 0.8)
    last = question.points[-1]
    for before, after in zip(question.points, scaled.points, strict=True):
        assert after.angle / math.radians(40.0) == pytest.approx(before.angle / last.angle, rel=1e-12)
        assert after.torque / 0.8 == pytest.approx(before.torque / last.torque, rel=1e-12)
    for angle, torque in ((0.0, 0.8), (1e-3, 0.8), (7.0, 0.8), (0.7, 0.0), (0.7, math.nan), (0.7, 1e9)):
        with pytest.raises(ValueRangeError):
            edit(scale_target, angle, torque).applied(question)
    flat = question.with_points((*question.points[:-1], last._replace(torque=0.0)))
    with pytest.raises(ValueRangeError, match="ends without torque"):
        edit(scale_target, 0.7, 0.8).applied(flat)


def test_a_refused_limit_gives_no_advice_for_python(question: LiveQuestion) -> None:
    with pytest.raises(ValueRangeError, match=r"must lie in \[0, 0\.5\] m -> give a number in that range"):
        edit(change_limit, "MinimumRadiusOfCurvature", 1.0).applied(question)


def test_a_limit_that_a_held_contour_breaks_is_named_with_both_numbers(question: LiveQuestion) -> None:
    held = edit(change_limit, "MinimumRadiusOfCurvature", 6e-3).applied(
        edit(hold_number, question.contour).applied(question)
    )
    shape = LimitMargin(
        "MinimumRadiusOfCurvature", "radius of curvature", -1.9e-3, 6e-3, -7.9e-3, "m", "mm", False, False
    )
    force = LimitMargin("MaximumCableTension", "cable tension", 200.0, 180.0, -20.0, "N", "N", True, False)
    assert unkept(held, (force, shape)) == (shape,)
    words = "; ".join(not_kept(held, (force, shape)))
    assert "is shown and not kept" in words
    assert "BROKEN by the cam as it is fitted: radius of curvature -1.9 mm, at least 6 mm" in words
    assert "least radius of curvature (6 mm) is shown and not kept" in words
    assert "MinimumRadius" not in words
    kept = replace(shape, value=7e-3, margin=1e-3)
    assert "BROKEN" not in "; ".join(not_kept(held, (kept,)))
    assert not_kept(question, (shape,)) == []


def test_rubbers_without_an_elastic_law_are_offered_with_the_reason(question: LiveQuestion) -> None:
    offered = {each["name"]: each["reason"] for each in choices()["materials"]}
    assert offered["PMC-770"] == offered["Dragon_Skin_30"] == ""
    assert offered["EPDM"] == "has no elastic law: only loss tangent known"
    for name, reason in offered.items():
        if reason:
            with pytest.raises(NlsError, match=reason):
                edit(choose_material, name).applied(question)


def test_two_points_are_a_straight_line_and_fifty_are_the_most(question: LiveQuestion) -> None:
    line = question
    while len(line.points) > 2:
        line = edit(remove_point, 1).applied(line)
    end = line.points[1]
    angles = np.linspace(0.0, end.angle, 9)
    np.testing.assert_allclose(line.target.torque(angles), end.torque * angles / end.angle, rtol=1e-12)
    with pytest.raises(ValueRangeError, match="2 to 50"):
        edit(remove_point, 1).applied(line)
    for k in range(MOST_POINTS - 2):
        line = edit(add_point, end.angle * (k + 1) / 49.0, end.torque * (k + 1) / 49.0).applied(line)
    assert len(line.points) == MOST_POINTS
    with pytest.raises(ValueRangeError, match="51 points"):
        edit(add_point, end.angle * 0.005, 0.0).applied(line)


def test_limits_of_the_deck_are_changed_and_come_back(question: LiveQuestion) -> None:
    given = question.limit_values["MinimumRadiusOfCurvature"]
    assert given.by_default
    assert given.value == pytest.approx(2.25e-3)
    changed = edit(change_limit, "MinimumRadiusOfCurvature", 3e-3).applied(question)
    assert not changed.limit_values["MinimumRadiusOfCurvature"].by_default
    assert edit(drop_limit, "MinimumRadiusOfCurvature").applied(changed).limit_values == question.limit_values
    with pytest.raises(ValueRangeError, match="not set here"):
        edit(drop_limit, "MinimumRadiusOfCurvature").applied(question)
    with pytest.raises(UnknownNameError, match="MaximumStrain"):
        edit(change_limit, "MaximumStran", 1.0).applied(question)
    for value in (math.nan, math.inf, -1.0, 7.0):
        with pytest.raises(ValueRangeError):
            edit(change_limit, "MinimumRadiusOfCurvature", value).applied(question)


def test_a_number_that_is_given_is_held_and_one_that_is_freed_has_a_range(question: LiveQuestion) -> None:
    area = "spring.rubber.area"
    given = edit(set_number, area, 50e-6).applied(question)
    assert given.actuator.quantities()[area].number == 50e-6
    free = edit(free_number, area, 40e-6, 60e-6).applied(given)
    assert area in free.free
    assert free.numbers[area].minimum == 40e-6
    assert area not in edit(set_number, area, 45e-6).applied(free).free
    for step in (
        edit(set_number, area, -1.0),
        edit(set_number, area, math.inf),
        edit(free_number, area, 60e-6, 40e-6),
    ):
        with pytest.raises(ValueRangeError):
            step.applied(question)
    with pytest.raises(UnknownNameError, match=r"spring\.rubber\.area"):
        edit(set_number, "spring.rubber.aera", 1.0).applied(question)
    held = edit(hold_number, "spring.pretension").applied(question)
    with pytest.raises(ValueRangeError, match="nothing that may change"):
        edit(hold_number, held.contour).applied(held)
    with pytest.raises(ValueRangeError, match="anchor shapes the contour"):
        edit(hold_number, question.contour).applied(
            edit(free_number, "spring.cam.anchor_distance").applied(question)
        )


def test_another_rubber_keeps_the_sizes(question: LiveQuestion) -> None:
    softer = edit(choose_material, "Dragon_Skin_30").applied(
        edit(set_number, "spring.rubber.area", 50e-6).applied(question)
    )
    assert softer.numbers["spring.rubber.area"].value == 50e-6
    sources = [
        q.source for n, q in softer.actuator.quantities().items() if n.startswith("spring.rubber.stiff")
    ]
    assert any("Dragon_Skin_30" in each for each in sources)
    with pytest.raises(UnknownNameError):
        edit(choose_material, "Dragon_Skin_31").applied(question)


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"edit": "LiveEdit"},
        {"edit": ["MovePoint"]},
        {"edit": "MovePoint", "index": 1, "angle": 0.1},
        {"edit": "MovePoint", "index": 1.5, "angle": 0.1, "torque": 0.1},
        {"edit": "MovePoint", "index": True, "angle": 0.1, "torque": 0.1},
        {"edit": "MovePoint", "index": 1, "angle": "0.1", "torque": 0.1},
        {"edit": "MovePoint", "index": 1, "angle": math.nan, "torque": 0.1},
        {"edit": "MovePoint", "index": 1, "angle": 0.1, "torque": 0.1, "color": "red"},
        {"edit": "MovePoint", "index": 10**400, "angle": 0.1, "torque": 0.1},
        {"edit": "MovePoint", "index": 1, "angle": 10**400, "torque": 0.1},
        {"edit": "ChooseDeck", "name": "x" * 10_000},
        {"edit": "FreeNumber", "name": None},
    ],
)
def test_messages_that_are_no_edit_are_refused(message: dict[str, Any]) -> None:
    with pytest.raises(NlsError) as refused:
        edit_from(message)
    assert len(str(refused.value)) < 600


def test_every_edit_is_read_from_its_message() -> None:
    for step in (
        edit(move_point, 1, 0.1, 0.2),
        edit(add_point, 0.1, 0.2),
        edit(remove_point, 1),
        edit(scale_target, 0.7, 0.8),
        edit(change_limit, "MaximumStrain", 1.0),
        edit(drop_limit, "MaximumStrain"),
        edit(set_number, "a.b", 1.0),
        edit(free_number, "a.b"),
        edit(free_number, "a.b", 0.0, 1.0),
        edit(hold_number, "a.b"),
        edit(choose_material, "PMC-770"),
        edit(choose_deck, "test_rig"),
        edit(set_task, 0, "ankle", 75.0, 0.01, 1.0),
        edit(drop_task, 0),
        edit(set_motor, "resistance", 0.3),
        edit(follow_tasks),
    ):
        names = {change: name for name, change in EDITS.items()}
        message = {"edit": names[step.change], **step.fields}
        assert edit_from(json.loads(json.dumps(message))) == step


def test_decks_are_bounded_and_read_as_text(question: LiveQuestion) -> None:
    with pytest.raises(ValueRangeError, match="larger than"):
        question_of_deck("#" * 500_000, "big.toml")
    with pytest.raises(NlsError, match=r"mine\.toml"):
        question_of_deck("[deck\n", "mine.toml")
    text = saved(question, {}).deck
    assert question_of_deck(text, "mine.toml").numbers == question.numbers


def test_a_saved_question_reads_back_to_the_last_digit(question: LiveQuestion) -> None:
    asked = question
    for step in (
        edit(move_point, 2, 0.41, 0.1701),
        edit(set_number, "spring.rubber.rest_length", 0.0411),
        edit(free_number, "spring.rubber.area", 4e-5, 7e-5),
        edit(change_limit, "MaximumCamRadius", 0.0301),
        edit(set_task, 0, "ankle", 71.3, 0.1 + 0.2),
        edit(set_task, 1, "knee", 80.0, 0.01, 0.25),
        edit(set_motor, "resistance", 0.31),
    ):
        asked = step.applied(asked)
    again, values = reopened(saved(asked, {"spring.pretension": 0.1 + 0.2}))
    assert values == {"spring.pretension": 0.1 + 0.2}
    assert again.points == asked.points
    assert again.limit_values == asked.limit_values
    assert again.free == asked.free
    assert again.ranges == asked.ranges
    assert again.title == asked.title
    assert (again.tasks, again.motor) == (asked.tasks, asked.motor)
    assert {n: s.value for n, s in again.numbers.items()} == {n: s.value for n, s in asked.numbers.items()}
    texts = saved(asked, {})
    for changed in (
        SavedDesign(texts.deck, texts.job + 'MaximumTorqueError = {rms = "1 mN*m"}\n'),
        SavedDesign(texts.deck, texts.job.replace("spring.rubber.area", "spring.rubber.aera")),
        SavedDesign(texts.deck, texts.job, "title = "),
        SavedDesign(texts.deck, texts.job, 'tasks = [["ankle", 75.0, "much", 1.0]]'),
        SavedDesign(texts.deck, texts.job, 'tasks = [["ankle", 75.0]]'),
        SavedDesign(texts.deck, texts.job, 'tasks = [["elbow", 75.0, 0.1, 1.0]]'),
        SavedDesign(texts.deck, texts.job, "[motor]\ncolour = 1.0"),
        SavedDesign(texts.deck, texts.job, "[motor]\nresistance = -1.0"),
        SavedDesign(texts.deck, "#" * 500_000),
    ):
        with pytest.raises(NlsError):
            reopened(changed)


def test_json_holds_no_number_that_is_none() -> None:
    content = to_json(
        {"a": np.array([1.0, math.inf]), "b": (math.nan, np.float64(2.0), np.bool_(True)), "c": 3}
    )
    assert content == {"a": [1.0, None], "b": [None, 2.0, True], "c": 3}
    json.dumps(content, allow_nan=False)
