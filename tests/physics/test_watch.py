"""Monitors in use on machines that share no model code with the package: quiet, awake, and right about
what changed."""

from __future__ import annotations

import math

import pytest

import nlsdesign as nls
from nlsdesign.components import smoothed
from nlsdesign.export import export_watch, read_watch_record
from nlsdesign.regeneration import read_watch, watch_plan
from tests.watched import build_watched, joint_deck, use

CHANGE, MINUTE = 300.0, 61.0
AT_ONCE = {"friction": "dry_friction.friction", "stiffness": "spring.stiffness", "delay": "motor.delay"}
SIZES = {"friction": 1.1, "stiffness": 0.95, "delay": 2e-3}


@pytest.fixture(scope="module", params=["published", "joint"])
def watched(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    deck, sample_time = "austin2015_figure_consistent", 1e-3
    if request.param == "joint":
        deck, sample_time = folder / "joint.toml", 2e-3
        deck.write_text(joint_deck(), encoding="utf-8")
    plan = watch_plan(nls.flatten(smoothed(nls.declare(nls.load_deck(deck)))), sample_time)
    return plan, build_watched(request.param, export_watch(plan, folder / "c", real="float")), folder


@pytest.mark.long_cases("joint-20")
@pytest.mark.parametrize("minutes", [20, pytest.param(30, marks=pytest.mark.slow)])
def test_time_without_a_change_is_quiet_and_reads_as_none(watched, minutes):
    plan, program, folder = watched
    seen = use(program, 31, 60.0 * minutes, record=folder / "kept.bin")
    assert math.isinf(seen.first)
    assert seen.judged == 6 * minutes - 1
    assert seen.usable > 0.99
    assert read_watch(read_watch_record(folder / "kept.bin", plan), plan).verdict == "none"


@pytest.mark.parametrize("what", list(SIZES))
def test_a_change_is_noticed_within_a_minute_and_named_after_five(watched, what):
    plan, program, folder = watched
    seen = use(
        program, 33, CHANGE + 300.0, change_at=CHANGE, after={what: SIZES[what]}, record=folder / "kept.bin"
    )
    assert CHANGE < seen.first <= CHANGE + MINUTE
    (named,) = read_watch(read_watch_record(folder / "kept.bin", plan), plan).named
    assert AT_ONCE[what] in (named.name, *named.aliases)


@pytest.mark.long_cases("joint")
def test_a_machine_that_is_not_quite_its_deck_is_held_against_itself(watched):
    _, program, _ = watched
    built = {"friction": 1.25, "stiffness": 1.03, "inertia": 0.97}
    assert use(program, 35, 600.0, built=built).first < 200.0
    assert math.isinf(use(program, 35, 1200.0, built=built, commission_at=300.0).first)
    seen = use(
        program, 35, 1200.0, built=built, commission_at=300.0, change_at=900.0, after={"friction": 1.4}
    )
    assert 900.0 < seen.first <= 900.0 + MINUTE


def test_one_motion_again_and_again_is_too_little_until_the_machine_is_held_against_itself(watched):
    """A sine of 3 A at 1.5 Hz, held and not, named damping and delay of the published machine as it is."""
    _, program, _ = watched
    for not_held in (0, 1):
        seen = use(program, 1, 300.0, current=(2, 3.0, 1.5, not_held))
        assert (seen.alarms, seen.usable) == (0, 0.0)
    held = use(program, 1, 300.0, current=(2, 3.0, 1.5, 0), commission_at=100.0)
    assert held.alarms == 0
    assert held.usable > 0.5
