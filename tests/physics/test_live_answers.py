"""The quick answers of the live design against whole designs, geometry, and the analyses of other rooms."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import CamDesign, DesignSettings, design_cam
from nlsdesign.design.optimisation.result import Miss
from nlsdesign.feedback.analysis import Observability, over_angle
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import NlsError, ValueRangeError
from nlsdesign.live.answers import LiveAnswer
from nlsdesign.live.background import BackgroundWork
from nlsdesign.live.edits import (
    add_point,
    change_limit,
    choose_deck,
    choose_material,
    drop_limit,
    edit,
    free_number,
    hold_number,
    move_point,
    set_number,
)
from nlsdesign.live.gallery import gallery_question, question_of
from nlsdesign.live.live_design import MOST_SNAPSHOTS, LiveDesign
from nlsdesign.live.question import LiveQuestion
from nlsdesign.live.saved import reopened
from nlsdesign.live.work import Work, full_answer, whole_design
from tests.renamed import in_words, renamed

SAME = 2e-4
"""Difference of two rms errors relative to the largest torque: a flat optimum is left at a tolerance of the
solver of 1e-9 in a cost in which 1e-3 of the largest torque counts as one."""


def whole(question: LiveQuestion, starts: int) -> CamDesign:
    settings = DesignSettings(
        starts=starts, defaults=(), look_for_size_ranges=False, look_for_remedies=False, draws=0
    )
    return design_cam(
        question.actuator, target=question.target, free=question.free, keep=question.keep, settings=settings
    )


def require_same(answer: LiveAnswer, question: LiveQuestion, *, starts: int = 4) -> None:
    """The quick answer is the whole design: torque error, sizes, limits that bind."""
    assert answer.state == "solved"
    assert answer.design is not None
    assert not answer.stale
    design, largest = whole(question, starts), question.target.largest
    assert answer.design.rms_error == pytest.approx(design.predicted_rms, abs=SAME * largest)
    for state, margin in zip(design.limits, answer.design.margins, strict=False):
        assert (state.limit, state.of) == (margin.limit, margin.of)
        assert margin.value == pytest.approx(state.value, rel=5e-3, abs=5e-3 * abs(state.bound))
        assert margin.margin >= -1e-6 * abs(margin.bound)


@pytest.fixture(scope="module")
def session() -> Iterator[LiveDesign]:
    live = LiveDesign(gallery_question("cam-actuator"))
    yield live
    live.work.close()


@pytest.fixture
def template(session: LiveDesign) -> Iterator[LiveDesign]:
    """The session as it began."""
    yield session
    session.work.close()
    while session.answer.controls.can_undo:
        session.undo()


def drag(live: LiveDesign, draw: np.random.Generator, size: float = 0.03) -> LiveAnswer:
    """One step of a mouse: a random point moves by a share of its torque and of its room."""
    points = live.question.points
    k = int(draw.integers(1, len(points)))
    room = points[k].angle - points[k - 1].angle
    angle = points[k].angle + 0.1 * room * draw.uniform(-1.0, 1.0)
    torque = points[k].torque * (1.0 + size * draw.standard_normal())
    return live.apply(edit(move_point, k, float(angle), float(max(torque, 0.0))))


def test_quick_answer_of_a_template_is_the_whole_design(template: LiveDesign) -> None:
    require_same(template.answer, template.question, starts=1)
    point = template.question.points[3]
    answer = template.apply(edit(move_point, 3, point.angle * 1.02, point.torque * 1.1))
    require_same(answer, template.question, starts=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    "deck",
    [
        "one_sided_cable_drive",
        "one-sided-finger",
        "austin2015_figure_consistent",
        "test_rig",
        "coil_cable_drive",
    ],
)
def test_quick_answers_of_other_decks_are_whole_designs(deck: str) -> None:
    live = LiveDesign(gallery_question(deck))
    require_same(live.answer, live.question)
    draw = np.random.default_rng(5)
    for _ in range(3):
        answer = drag(live, draw)
    require_same(answer, live.question)


@pytest.mark.slow
def test_a_machine_with_other_names_gives_the_same_answers() -> None:
    machine: Assembly = declare(load_deck("test_rig"))
    one, other = (
        LiveDesign(question_of(each, "x")) for each in (machine, renamed(machine, in_words).assembly)
    )
    for draw in (np.random.default_rng(1), None):
        if draw is not None:
            answers = [drag(each, np.random.default_rng(1)) for each in (one, other)]
            assert answers[0].design is not None
            assert answers[1].design is not None
            assert answers[0].design.rms_error == pytest.approx(answers[1].design.rms_error, rel=1e-6)


def path(deck: str, drags: int) -> None:
    """A path of drags ends at the design of a fresh session, or the whole design says that it did not."""
    live, draw = LiveDesign(gallery_question(deck)), np.random.default_rng(3)
    for _ in range(drags):
        answer = drag(live, draw)
    fresh = LiveDesign(live.question)
    assert answer.design is not None
    assert fresh.answer.design is not None
    largest = live.question.target.largest
    if abs(answer.design.rms_error - fresh.answer.design.rms_error) > SAME * largest:
        solved = live._history.now.solved
        full = whole_design(lambda _: None, live.question.actuator, live.question.target,
                            live.question.free, live.question.keep)  # fmt: skip
        assert "local optimum" in full_answer(full, live.question, answer, solved).message


@pytest.mark.slow
def test_a_path_of_drags_ends_where_a_fresh_session_begins() -> None:
    path("cam-actuator", 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "deck", ["cam-actuator", "one-sided-finger", "one_sided_cable_drive", "test_rig", "coil_cable_drive"]
)
def test_fifty_drags_end_where_a_fresh_session_begins(deck: str) -> None:
    path(deck, 50)


def test_undo_and_redo_give_the_same_numbers(template: LiveDesign) -> None:
    before = template.answer
    edits = [
        edit(move_point, 2, 0.42, 0.17),
        edit(change_limit, "MaximumStrain", 1.2),
        edit(set_number, "spring.rubber.area", 55e-6),
    ]
    answers = [template.apply(edit) for edit in edits]
    for expected in (*reversed(answers[:-1]), before):
        there = template.undo()
        assert there.revision > expected.revision
        assert there.design is not None
        assert expected.design is not None
        assert there.design.rms_error == expected.design.rms_error
        assert not there.stale
        np.testing.assert_array_equal(there.design.contour, expected.design.contour)
        assert there.controls.points == expected.controls.points
    assert there.controls.can_redo
    for _ in answers:
        there = template.redo()
    assert there.design is not None
    assert answers[-1].design is not None
    assert there.design.numbers == answers[-1].design.numbers
    assert not there.controls.can_redo
    # Steps of one drag are taken back together.
    for torque in (0.171, 0.172, 0.173):
        template.apply(edit(move_point, 2, 0.42, torque), drag="point 2")
    assert template.undo().controls.points == answers[-1].controls.points
    for _ in edits:
        template.undo()
    assert template.answer.controls.points == before.controls.points


def test_limits_that_contradict_each_other_are_named_and_the_last_design_stays(template: LiveDesign) -> None:
    good = template.answer.design
    template.apply(edit(change_limit, "MaximumCamRadius", 0.03))
    good = template.answer.design
    answer = template.apply(edit(change_limit, "MaximumCamRadius", 0.002))
    assert answer.state == "infeasible"
    assert answer.stale
    assert answer.design is not None
    assert good is not None
    assert answer.design.rms_error == good.rms_error
    assert set(answer.conflicts) == {"MaximumCamRadius", "MinimumRadiusOfCurvature"}
    assert "contradict each other" in answer.message
    # A disc as small as the cable bends, 2.25 mm, is the smallest cam there is.
    assert answer.message.count("contradict") == 1
    assert "largest cam radius (2 mm) and least radius of curvature (2.25 mm) contradict" in answer.message
    assert answer.message.endswith("least radius of curvature from 2.25 mm to about 2 mm")
    back = template.apply(edit(drop_limit, "MaximumCamRadius"))
    assert back.state == "solved"
    assert not back.stale
    assert back.design is not None
    assert back.design.rms_error == pytest.approx(good.rms_error, abs=SAME * template.question.target.largest)


@pytest.mark.slow
def test_another_rubber_and_a_held_contour(template: LiveDesign) -> None:
    softer = template.apply(edit(choose_material, "Dragon_Skin_30"))
    require_same(softer, template.question)
    template.undo()
    contour = template.answer.design.contour if template.answer.design else None
    held = template.apply(edit(hold_number, template.question.contour))
    assert held.state == "solved"
    assert "is shown and not kept" in held.message
    assert held.design is not None
    assert contour is not None
    assert held.design.rms_error < 1e-3 * template.question.target.largest
    np.testing.assert_allclose(held.design.contour[-1], contour[-1], atol=1e-4)
    tight = template.apply(edit(change_limit, "MinimumRadiusOfCurvature", 6e-3))
    question = template.question
    full = whole_design(
        lambda _: None, question.actuator, question.target, question.free, question.keep,
        question.held_contour,
    )  # fmt: skip
    checked = full_answer(full, question, tight, None)
    for answer in (tight, checked):
        assert answer.design is not None
        margin = {each.limit: each for each in answer.design.margins}["MinimumRadiusOfCurvature"]
        assert margin.value < margin.bound == 6e-3
        assert "BROKEN by the contour that is held: radius of curvature 2.25 mm" in answer.message
        assert "at least 6 mm is asked for" in answer.message
    here = template.at(0.3)
    assert template.shown is not None
    assert len(template.shown.mechanism(0.3).halves) >= 1
    assert (here.poles.state, here.observability.state) == ("done", "done")
    assert here.poles.revision == tight.revision
    template.undo()
    template.undo()


def test_a_contour_that_was_just_designed_has_the_same_numbers_free_and_held(template: LiveDesign) -> None:
    """The cam that is fitted to it ripples, down to a radius of -1.9 mm; what is cut is the contour."""
    free = template.answer.design
    held = template.apply(edit(hold_number, template.question.contour))
    texts, designed = template.saved(), template.question.machine.designed
    template.undo()
    again = reopened(texts)[0].held_contour
    assert designed is not None
    assert again is not None
    np.testing.assert_array_equal(again.radii_of_curvature, designed.radii_of_curvature)
    for begin in (texts.begin.replace("lever_arms = [0.0,", "lever_arms = ["), texts.begin + "slopes = []\n"):
        with pytest.raises(NlsError, match=r"live\.toml"):
            reopened(replace(texts, begin=begin))
    assert held.state == "solved"
    assert "BROKEN" not in held.message
    assert free is not None
    assert held.design is not None
    for before, after in zip(free.margins, held.design.margins, strict=True):
        assert (before.limit, before.active) == (after.limit, after.active)
        assert after.value == pytest.approx(before.value, rel=1e-6)
    for name in ("lever_arm", "radius", "radius_of_curvature", "torque"):
        there, here = free.column(name).values, held.design.column(name).values
        np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-6 * np.max(np.abs(there)))
    assert held.design.rms_error == pytest.approx(free.rms_error, rel=1e-3)
    np.testing.assert_allclose(held.design.contour[-1], free.contour[-1], rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("deck", ["one-sided-finger", "austin2015_figure_consistent"])
def test_a_held_contour_of_other_decks_is_judged_as_it_was_designed(deck: str) -> None:
    """The one whose lever arm jumps at angle zero, and the one that sits on its stress exactly."""
    live = LiveDesign(gallery_question(deck))
    free = live.answer.design
    held = live.apply(edit(hold_number, live.question.contour))
    assert held.state == "solved", held.message
    assert free is not None
    assert held.design is not None
    assert "BROKEN" not in held.message
    for before, after in zip(free.margins, held.design.margins, strict=True):
        assert after.value == pytest.approx(before.value, rel=1e-6)
    question = live.question
    full = whole_design(
        lambda _: None, question.actuator, question.target, question.free, question.keep,
        question.held_contour,
    )  # fmt: skip
    if full.design is not None:
        assert "BROKEN" not in full_answer(full, question, held, live._history.now.solved).message


def test_each_drag_is_one_step_back_also_two_of_the_same_point(template: LiveDesign) -> None:
    point = template.question.points[3]
    torques = [point.torque * factor for factor in (1.0, 1.01, 1.02, 1.03)]
    template.apply(edit(move_point, 3, point.angle, torques[1]), drag="point 3")
    template.apply(edit(move_point, 3, point.angle, torques[2]), drag="point 3", last=True)
    template.apply(edit(move_point, 3, point.angle, torques[3]), drag="point 3", last=True)
    template.undo()
    assert template.question.points[3].torque == torques[2]
    template.undo()
    assert template.question.points[3].torque == torques[0]


@pytest.mark.slow
def test_what_is_saved_is_designed_to_the_same_numbers(template: LiveDesign) -> None:
    template.apply(edit(free_number, "spring.rubber.area", 4e-5, 7e-5))
    answer = template.apply(edit(add_point, 0.5, 0.21))
    again = LiveDesign(*reopened(template.saved()))
    assert answer.design is not None
    assert again.answer.design is not None
    assert again.answer.controls.points == answer.controls.points
    for there, here in zip(again.answer.design.numbers, answer.design.numbers, strict=True):
        assert there.name == here.name
        assert there.value == pytest.approx(here.value, rel=1e-6)
    assert again.answer.design.rms_error == pytest.approx(answer.design.rms_error, rel=1e-4)


def test_mechanism_is_to_scale_and_analyses_are_those_of_the_other_rooms(template: LiveDesign) -> None:
    """The free cable passes the centre at the lever arm; the rubber grows by the extension."""
    design = template.answer.design
    assert design is not None
    assert template.shown is not None
    shapes = [template.shown.mechanism(angle) for angle in (0.0, 0.3, 0.9)]
    angles = design.columns[0].values
    for angle, shape in zip((0.3, 0.9), shapes[1:], strict=True):
        (x1, y1), (x2, y2) = shape.contacts[0], shape.guides[0]
        distance = abs(x1 * y2 - x2 * y1) / np.hypot(x2 - x1, y2 - y1)
        arm = np.interp(angle, angles, design.column("lever_arm").values)
        assert distance == pytest.approx(arm, rel=2e-3)
    grown = np.interp(0.9, angles, design.column("extension").values) - design.column("extension").values[0]
    length = [shape.rubbers[0][1, 0] - shape.rubbers[0][0, 0] for shape in shapes]
    assert length[2] - length[0] == pytest.approx(grown, rel=1e-9)
    answer = template.at(0.3)
    seen, poles = answer.observability.value, answer.poles.value
    chart = over_angle(template.shown.model, [Observability(measured=(seen.measured,))],
                       angles=np.array([*np.linspace(0.0, angles[-1], 21), 0.3]))  # fmt: skip
    assert seen.rank == chart["observability.rank"][-1] == seen.states
    assert seen.condition == pytest.approx(chart["observability.condition"][-1], rel=1e-9)
    assert all(np.all(group.real < 0.0) for group in poles)
    assert answer.loop.state == "asked for later"
    torque = float(np.interp(0.3, angles, design.column("torque").values))
    assert torque == pytest.approx(float(template.question.target.torque(0.3)), rel=1e-2)
    with pytest.raises(ValueRangeError):
        template.at(float("nan"))


@pytest.mark.slow
def test_a_whole_design_says_where_the_quick_one_differs(
    template: LiveDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A quick answer at a worse optimum is stated with its numbers; the whole design takes its place."""
    monkeypatch.setattr("nlsdesign.live.work.STARTS", 1)
    question, answer, solved = template.question, template.answer, template._history.now.solved
    assert solved is not None
    full = whole_design(lambda _: None, question.actuator, question.target, question.free, question.keep)
    same = full_answer(full, question, answer, solved)
    assert same.source == "full"
    assert same.message == ""
    assert same.design is not None
    assert same.design.checked
    unanswered = full_answer(replace(full, design=None, message="stopped"), question, answer, solved)
    assert "came to no answer: stopped; shown is the quick answer, unchecked" in unanswered.message
    miss = Miss(0.05, 0.01, 0.3, 1e-3, ("MaximumStrain",), None, ("free rubber.area (to 2 mm^2)", "another"))
    missed = full_answer(
        replace(full, design=replace(full.design, miss=miss)), question, answer, solved
    ).message  # fmt: skip
    assert missed.startswith("misses its target: 5 % rms of the largest torque, 1 % allowed; worst at 17.2°")
    assert missed.lower().count("misses") == 1
    assert "; what would help: free rubber.area (to 2 mm^2), or another" in missed
    worse = full_answer(full, question, answer, replace(solved, cost=2.0))
    assert "a worse local optimum (torque error, rubber and smoothness together): 0.0319" in worse.message
    template._history.settle(full)
    assert template.answer.source == "full"
    assert template.at(0.3).poles.revision == template.answer.revision


@pytest.mark.slow
def test_a_whole_design_that_misses_names_what_would_help_and_it_does() -> None:
    question = gallery_question("one_sided_cable_drive")
    missed = whole_design(lambda _: None, question.actuator, question.target, question.free, question.keep)
    assert missed.design is not None
    assert missed.design.miss is not None
    (advice,) = missed.design.miss.advice
    length = "spring.cable.rope.rubber.rest_length"
    assert advice.startswith(f"free {length} (to ")
    helped = edit(free_number, length).applied(question, None)
    met = whole_design(lambda _: None, helped.actuator, helped.target, helped.free, helped.keep)
    assert met.design is not None
    assert met.design.met


@pytest.mark.slow
def test_the_whole_design_replaces_the_quick_answer_and_can_be_cancelled(template: LiveDesign) -> None:
    state = template.start(Work.SETTLE)
    assert state.state == "computing"
    state = template.work.wait(Work.SETTLE, 120.0) or state
    assert state.state == "done", state.message
    template.poll()
    answer = template.answer
    assert answer.source == "full"
    assert answer.design is not None
    assert answer.design.checked
    assert not answer.stale
    next_one = drag(template, np.random.default_rng(0))
    assert next_one.source == "quick"
    assert next_one.state == "solved"
    template.poll()
    assert template.answer.source == "quick", "an answer to another question replaced this one"
    template.undo()


def test_work_that_is_cancelled_or_fails_leaves_no_process() -> None:
    work = BackgroundWork("sleep", 1, _sleeping, (60.0,))
    time.sleep(0.2)
    assert work.state().state == "computing"
    assert work.cancel().state == "cancelled"
    assert not work._process.is_alive()
    failed = BackgroundWork("fail", 1, _sleeping, ("no number",)).wait(60.0)
    assert failed.state == "failed"
    assert "TypeError" in failed.message
    gone = BackgroundWork("die", 1, _dying, ())
    assert gone.wait(60.0).state == "failed"
    assert "without an answer" in gone.state().message


def _sleeping(stage: object, seconds: float) -> None:
    time.sleep(seconds)


def _dying(stage: object) -> None:
    import os

    os._exit(3)


@pytest.mark.slow
def test_another_deck_begins_anew(template: LiveDesign) -> None:
    answer = template.apply(edit(choose_deck, "one-sided-finger"))
    assert answer.state == "solved"
    assert answer.controls.title == "one-sided-finger"
    assert template.shown is not None
    assert len(template.shown.mechanism(0.2).cables) == 1
    fresh = LiveDesign(gallery_question("one-sided-finger")).answer
    assert answer.design is not None
    assert fresh.design is not None
    assert answer.design.rms_error == fresh.design.rms_error, "it began beside the design of another machine"
    assert template.undo().controls.title == "cam-actuator"


@pytest.mark.slow
def test_rubber_without_limits_is_a_finding_or_says_what_cannot_be_solved() -> None:
    live = LiveDesign(gallery_question("test_rig"))
    assert live.answer.design is not None
    assert live.answer.design.met
    assert live.answer.design.column("spring.cable.rubber.strain").values.max() < 2.2
    answer = live.apply(edit(drop_limit, "MaximumStrain"))
    assert answer.design is not None
    (finding,) = answer.design.beyond
    assert answer.message.startswith("spring.cable.rubber is stretched to 4001 % between 0° and 56°")
    assert answer.message.startswith(finding)
    full = whole_design(
        lambda _: None, live.question.actuator, live.question.target, live.question.free, live.question.keep
    )
    assert full_answer(full, live.question, answer, None).message.startswith(finding)


def test_designs_are_kept_by_name_up_to_the_most(template: LiveDesign) -> None:
    template.snapshots.clear()
    for k in range(MOST_SNAPSHOTS):
        assert template.keep(str(k)).answer is template.answer
    with pytest.raises(ValueRangeError, match="8 designs kept"):
        template.keep("one more")
    for name in ("", " ", "x" * 61, "two\nlines"):
        with pytest.raises(ValueRangeError, match="1 to 60 printable characters"):
            template.keep(name)
    template.keep("0")
    assert list(template.snapshots) == [str(k) for k in range(MOST_SNAPSHOTS)]
    template.snapshots.clear()


@pytest.mark.slow
def test_programs_are_not_kept_with_the_steps_that_can_be_undone(
    template: LiveDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program takes tens of megabytes: a step whose program is gone gives the same design and goes on."""
    monkeypatch.setattr("nlsdesign.design.parametric.parametric_solver._MOST_PROGRAMS", 1)
    before = template.answer.design
    point = template.question.points[2]
    template.apply(edit(add_point, 0.5, 0.21))
    assert template._history.past[-1].solved is None
    back = template.undo()
    assert back.design is not None
    assert before is not None
    assert back.design.rms_error == before.rms_error
    moved = template.apply(edit(move_point, 2, point.angle, point.torque * 1.01))
    require_same(moved, template.question, starts=1)
