"""The C of the monitor: the bits of its twin, its self-test, its cost, and the files that it leaves."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.components import smoothed
from nlsdesign.export import CORTEX_M4F, export_watch, measure_on_target, read_watch_record
from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.watch_code import LENGTH, MISFIT, ONE_MOTION, WatchTwin, drawn_rows
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.export.compilation.target_run import missing_emulator
from nlsdesign.foundation.errors import ExportError
from nlsdesign.regeneration import read_watch, watch_plan
from tests.compiling import compile_program
from tests.watched import joint_deck
from tests.watching import as_step, quick, readings

DECK = "austin2015_figure_consistent"


def plan_of(deck, sample_time):
    return watch_plan(nls.flatten(smoothed(nls.declare(nls.load_deck(deck)))), sample_time)


@pytest.fixture(scope="module")
def published():
    return plan_of(DECK, 1e-3)


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    file = tmp_path_factory.mktemp("deck") / "joint.toml"
    file.write_text(joint_deck(), encoding="utf-8")
    return plan_of(file, 2e-3)


@pytest.mark.long_cases("published-float")
@pytest.mark.parametrize("real", list(Real))
@pytest.mark.parametrize("machine", ["published", pytest.param("joint", marks=pytest.mark.slow)])
def test_the_c_has_the_bits_of_its_twin(machine, real, request, tmp_path):
    plan = quick(request.getfixturevalue(machine))
    source = export_watch(plan, tmp_path, real=real)
    whole, residuals, twin = (
        CompiledStep(as_step(source)),
        CompiledStep(source.residuals),
        WatchTwin(plan, real),
    )
    ends = np.cumsum([len(block.changes) + 3 for block in plan.blocks])[:-1]
    words, expected = [], []
    for row in readings(plan, 1100).tolist():
        words.append(whole(row)[1])
        given, status = residuals(row)
        expected.append(twin.take([part.tolist() for part in np.split(given, ends)], status == 0))
    assert words == expected
    assert {2} < {word & 3 for word in words}  # judged, after too little had been seen
    memory, record = bytes(whole._state), twin.record.tobytes()
    at = memory.index(record[:8])
    assert memory[at : at + len(record)] == record
    assert twin.record["judged"] >= 9
    assert (twin.record["bins"]["count"] > 0).sum() >= 2


@pytest.mark.long_cases("float")
@pytest.mark.parametrize("real", [Real.FLOAT, pytest.param(Real.DOUBLE, marks=pytest.mark.slow)])
def test_the_self_test_passes_and_notices_a_wrong_sum(published, real, tmp_path):
    source = export_watch(published, tmp_path, real=real)

    def returned(name):
        files = [source.selftest, source.source, source.residuals.source]
        return subprocess.run(
            [compile_program(files, tmp_path / name)], check=False, capture_output=True
        ).returncode

    assert returned("right") == 0
    text = source.source.read_text(encoding="utf-8")
    assert "+= mean[i] * mean[j]" in text
    source.source.write_text(text.replace("+= mean[i] * mean[j]", "+= mean[i] * mean[i]"), encoding="utf-8")
    assert returned("wrong") in {1, 2}


@pytest.mark.skipif(bool(missing_emulator()), reason=missing_emulator() or "there")
@pytest.mark.parametrize("machine", ["published", pytest.param("joint", marks=pytest.mark.slow)])
def test_a_step_costs_at_most_a_thousand_instructions_and_eight_kilobytes(machine, request, tmp_path):
    plan = quick(request.getfixturevalue(machine))
    rows = readings(plan, 240)[:119] if machine == "published" else readings(plan, 240)
    cost = measure_on_target(as_step(export_watch(plan, tmp_path, real="float")), CORTEX_M4F, inputs=rows)
    assert cost.run.same
    assert cost.run.instructions.max() <= 1000
    assert cost.flash <= 8192
    assert cost.memory <= 8192


def test_what_one_motion_shows_is_no_change(published):
    """The same rows, of one speed and load or of each in turn."""
    plan = replace(quick(published), some=2.0)
    (block,) = plan.blocks
    for varied, expected in ((False, 2 | ONE_MOTION), (True, 1 | 1 << plan.first_bit(0))):
        twin = WatchTwin(plan)
        word = 0
        for row in drawn_rows(plan, 600):
            speed_and_load = row[0][-2:] if varied else [2.0 * block.least_speed, block.usual_load]
            word = twin.take([[*row[0][:-2], *speed_and_load]])
        assert word & ~4 == expected


def test_rows_that_follow_the_first_change_of_each_block_say_so(joint):
    plan = quick(joint)
    twin = WatchTwin(plan)
    words = [twin.take(row) for row in drawn_rows(plan, 400)]
    first = [1 << plan.first_bit(i) for i in range(2)]
    assert words[-1] & ~4 == 1 | first[0] | first[1]
    assert words[0] & 3 == 2


def test_more_left_than_any_change_explains_is_a_word_of_its_own(published):
    """Efforts that go with nothing: no change is sure, and no bit of a change would be set."""
    plan = quick(published)
    (block,) = plan.blocks
    for share, expected in ((0.5, 0), (2.0, 1 | MISFIT)):
        twin, draw = WatchTwin(plan), np.random.default_rng(5)
        word = 0
        for _ in range(60):
            drawn = draw.normal(size=len(block.changes))
            left = share * block.usual_load * draw.normal()
            for _ in range(LENGTH):
                word = twin.take([[*(1e-3 * drawn), left, 1.0, 1.0]])
        assert word & ~4 == expected


def test_a_mean_counts_where_those_on_both_sides_go_the_same_way(published):
    plan = quick(published)
    row = [1.0] * (len(plan.blocks[0].changes) + 1)
    ways = (1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 0.0, -1.0)
    twin = WatchTwin(plan)
    # The first mean is that of a single sample and is not used.
    for way in (1.0, *np.repeat(ways, LENGTH)):
        twin.take([[*row, way, 1.0]])
    assert twin.record["bins"]["count"].sum() == pytest.approx(
        3.0, rel=1e-2
    )  # the second, the fifth and the sixth


def test_what_no_motion_tells_apart_is_not_asked_of_the_load(joint):
    motor, load = joint.blocks
    assert "spring.stiffness" in motor.changes
    assert "motor.delay" in motor.changes
    assert "spring.stiffness" not in load.changes  # all its efforts are known up to a common factor
    assert load.least_speed == 0.0 < motor.least_speed


def test_the_word_names_the_changes_in_the_order_of_its_bits(joint, tmp_path):
    header = export_watch(joint, tmp_path).header.read_text(encoding="utf-8")
    bits = re.findall(r"bit (\d+): (\S+) has changed by some (\S+ \S+),", header)
    names = [name for block in joint.blocks for name in block.changes]
    assert [(int(bit), name) for bit, name, _ in bits] == list(enumerate(names, start=8))
    assert ("0.002 s") in {size for _, _, size in bits}


def evidence(plan, changes, word=0):
    """Sums of 2,000 means of a machine whose numbers have changed, in changes to be noticed, by name."""
    (block,), record, draw = plan.blocks, WatchTwin(plan).record, np.random.default_rng(3)
    told = draw.normal(size=(2000, len(block.changes)))
    left = told @ [changes.get(name, 0.0) for name in block.changes] + draw.normal(size=2000)
    rows = np.zeros((2000, plan.most + 1))
    rows[:, : len(block.changes)], rows[:, -1] = told, left
    record["word"], record["bins"][0][0]["count"] = word, 2000.0
    record["bins"][0][0]["products"] = (rows.T @ rows)[np.tril_indices(plan.most + 1)]
    return record


def test_what_no_number_does_is_no_name(published):
    (friction,) = [n for n in published.blocks[0].changes if n.endswith(".friction")]
    verdict = read_watch(evidence(published, {friction: 2.0}), published)
    assert [c.name for c in verdict.named] == [friction]
    assert verdict.named[0].size == pytest.approx(0.2, rel=0.1)
    for wrong in ({"motor.inertia": 300.0}, {"motor.inertia": -25.0, friction: 40.0}):
        verdict = read_watch(evidence(published, wrong), published)
        assert (verdict.verdict, verdict.named) == ("implausible", ())
        assert "check sign, unit and scale" in "".join(verdict.words())


def test_evidence_of_before_is_said_to_be(published):
    fresh, old = (read_watch(evidence(published, {}, word), published) for word in (0, 2))
    assert (fresh.verdict, fresh.is_of_before) == ("none", False)
    assert (old.verdict, old.is_of_before) == ("none", True)
    assert "of the time before" in "".join(old.words())
    assert "of the time before" not in "".join(fresh.words())


def test_evidence_of_one_motion_names_nothing(published):
    (friction,) = [n for n in published.blocks[0].changes if n.endswith(".friction")]
    verdict = read_watch(evidence(published, {friction: 2.0}, 2 | ONE_MOTION), published)
    assert (verdict.verdict, verdict.named) == ("one_motion", ())
    assert "call commission" in "".join(verdict.words())


def test_what_is_not_watched_is_known(published):
    assert published.unseen == ()
    assert plan_of("test_rig", 1e-3).unseen == ("spring.stiffness",)


@pytest.fixture
def kept(published, tmp_path):
    """A record of the published machine as a file, sealed as the C seals it."""
    import zlib

    twin = WatchTwin(published, Real.FLOAT)
    record = twin.record
    record["checksum"] = zlib.crc32(record.tobytes()[: record.dtype.fields["checksum"][1]])
    file = tmp_path / "watch.bin"
    file.write_bytes(record.tobytes())
    return file


def test_a_record_is_read_and_says_that_little_was_seen(published, kept):
    verdict = read_watch(read_watch_record(kept, published), published)
    assert verdict.verdict == "too_little"
    assert verdict.words() == [
        "Too little motion was seen, 0 means: let the machine be used for some minutes."
    ]


def changed(place, value):
    def change(content):
        return content[:place] + value + content[place + len(value) :]

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: b"", "is no record of a monitor"),
        (changed(0, b"NLSX"), "is no record of a monitor"),
        (changed(4, b"\x09"), "has version 9 of the format"),
        (changed(16, b"\x01\x02\x03\x04"), "is of another deck than austin2015_figure_consistent"),
        (changed(24, b"\x01\x02\x03\x04"), "is of another monitor of this deck"),
        (lambda content: content[:-4], "it was cut"),
        (changed(100, b"\x01"), "is damaged: the checksum does not fit"),
    ],
)
def test_a_record_that_cannot_be_read_is_one_sentence(published, kept, change, message):
    kept.write_bytes(change(kept.read_bytes()))
    with pytest.raises(ExportError, match=f"{re.escape(message)}.* -> ") as caught:
        read_watch_record(kept, published)
    assert "\n" not in str(caught.value)


def test_a_record_of_another_sample_time_or_deck_is_refused(published, joint, kept):
    with pytest.raises(ExportError, match="another deck than elastic_joint"):
        read_watch_record(kept, joint)
    with pytest.raises(ExportError, match="another monitor of this deck"):
        read_watch_record(kept, replace(published, between=20.0))
    with pytest.raises(ExportError, match="cannot be read"):
        read_watch_record(kept.parent / "none.bin", published)
