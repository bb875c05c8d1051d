"""No work is lost: what somebody has changed or brought is not replaced unless it is asked for."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from nlsdesign.cli import overwriting
from nlsdesign.foundation.errors import ExportError
from nlsdesign.foundation.text_files import (
    LIST_NAME,
    discard,
    file_state,
    keeping,
    listed_files,
    refuse_to_lose,
    write_table,
    write_text,
)
from tests.command_line import Run, run, two_machines
from tests.undrawn import undrawn

__all__ = ["run", "two_machines", "undrawn"]  # the fixtures
pytestmark = pytest.mark.usefixtures("two_machines", "undrawn")
DECK = "austin2015_soft_spring"
CALL = ("simulate", "--deck", DECK, "--stop", "20 ms", "--signals", "motor.angle", "--out", "o/run.csv")


def test_what_was_written_is_known_until_it_is_changed(tmp_path: Path) -> None:
    file = tmp_path / "a" / "model.toml"
    assert file_state(file) == "new"
    with keeping(tmp_path):
        write_text(file, "one")
        write_table(tmp_path / "t.csv", [["x"], ["1"]])
    assert [file_state(f) for f in (file, tmp_path / "t.csv")] == ["as written"] * 2
    assert listed_files(tmp_path) == [file, tmp_path / "t.csv"]
    file.write_text("two", encoding="utf-8")
    assert file_state(file) == "changed"
    (tmp_path / "a" / "own.txt").write_text("mine", encoding="utf-8")
    assert file_state(tmp_path / "a" / "own.txt") == "foreign"
    with pytest.raises(
        ExportError, match=r"model\.toml: was changed since nlsdesign wrote it, and 1 more: own"
    ):
        refuse_to_lose([file, tmp_path / "t.csv", tmp_path / "a" / "own.txt"])
    refuse_to_lose([tmp_path / "t.csv", tmp_path / "none.txt"])


def test_a_library_call_keeps_no_list_and_replaces_as_it_always_did(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "one")
    write_text(tmp_path / "a.txt", "two")
    assert [each.name for each in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "two"


def test_a_collision_that_shows_at_the_end_is_written_beside(tmp_path: Path) -> None:
    for name in ("a.txt", "a.new.txt"):
        (tmp_path / name).write_text("own", encoding="utf-8")
    with keeping(tmp_path) as kept:
        write_text(tmp_path / "a.txt", "result")
    assert kept.beside == {tmp_path / "a.txt": tmp_path / "a.new2.txt"}
    contents = {name: (tmp_path / name).read_text(encoding="utf-8") for name in os.listdir(tmp_path)}
    assert contents["a.txt"] == contents["a.new.txt"] == "own"
    assert contents["a.new2.txt"] == "result"
    with keeping(tmp_path) as kept:  # the one beside is as written, so it is replaced
        write_text(tmp_path / "a.txt", "second")
    assert (tmp_path / "a.new2.txt").read_text(encoding="utf-8") == "second"
    with keeping(tmp_path, force=True) as kept:
        write_text(tmp_path / "a.txt", "third")
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "third"
    assert kept.beside == {}


def test_the_same_content_and_places_outside_are_no_collision(tmp_path: Path) -> None:
    inside, outside = tmp_path / "o" / "a.txt", tmp_path / "b.txt"
    inside.parent.mkdir()
    for file in (inside, outside):
        file.write_text("same", encoding="utf-8")
    with keeping(tmp_path / "o") as kept:
        write_text(inside, "same")
        write_text(outside, "other")
    assert kept.beside == {}
    assert file_state(inside) == "as written"
    assert outside.read_text(encoding="utf-8") == "other"
    assert not (tmp_path / LIST_NAME).exists()


def test_left_overs_are_removed_but_not_what_somebody_has_changed(tmp_path: Path) -> None:
    with keeping(tmp_path):
        for name in ("a.txt", "b.txt"):
            write_text(tmp_path / name, "one")
    (tmp_path / "b.txt").write_text("edited", encoding="utf-8")
    with keeping(tmp_path):
        for name in ("a.txt", "b.txt", "none.txt"):
            discard(tmp_path / name)
    assert not (tmp_path / "a.txt").exists()
    assert (tmp_path / "b.txt").read_text(encoding="utf-8") == "edited"
    assert set(json.loads((tmp_path / LIST_NAME).read_text(encoding="utf-8"))["files"]) == {"b.txt"}
    with keeping(tmp_path, force=True):
        discard(tmp_path / "b.txt")
    assert not (tmp_path / "b.txt").exists()


@pytest.mark.parametrize(
    "damage",
    ["", "[]", "{", '{"format": "other", "files": {}}', '{"format": "nlsdesign written files 1", "files": 3}',
     '{"format": "nlsdesign written files 1", "files": {"a.txt": 3, "../a.txt": "0"}}', "[" * 100_000],
)  # fmt: skip
def test_a_damaged_list_loses_nothing(damage: str, tmp_path: Path) -> None:
    with keeping(tmp_path):
        write_text(tmp_path / "a.txt", "one")
    (tmp_path / LIST_NAME).write_text(damage, encoding="utf-8")
    assert file_state(tmp_path / "a.txt") == "foreign"
    with keeping(tmp_path):
        write_text(tmp_path / "b.txt", "two")
    assert file_state(tmp_path / "b.txt") == "as written"


def test_a_command_repeats_itself_without_a_question_and_refuses_to_lose_an_edit(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(*CALL)[0] == 0
    first = {file.name: file.read_bytes() for file in (tmp_path / "o").iterdir()}
    assert set(first) == {"run.csv", "run.svg", "run.html", LIST_NAME}
    assert run(*CALL)[0] == 0
    page = tmp_path / "o" / "run.html"
    page.write_text("my notes", encoding="utf-8")
    status, out, _ = run(*CALL, "--dry-run", "--json")
    assert status == 1
    states = json.loads(out)
    assert states["files"] == {"o/run.csv": "as written", "o/run.svg": "as written", "o/run.html": "changed"}
    assert states["refused"] == ["o/run.html"]
    with monkeypatch.context() as patch:
        patch.setattr("nlsdesign.simulation.simulate", None)  # nothing is worked out before the refusal
        status, out, err = run(*CALL)
    assert (status, out) == (2, "")
    assert "run.html: was changed since nlsdesign wrote it -> nothing was done; name another --out" in err
    assert page.read_text(encoding="utf-8") == "my notes"
    assert run(*CALL, "--force")[0] == 0
    assert page.read_bytes() == first["run.html"]
    assert run(*CALL, "--dry-run")[0] == 0


def test_a_dry_run_writes_nothing(run: Run, tmp_path: Path) -> None:
    curve = ("--maximum", "1 N*m", "--angle", "30 deg")
    calls = (CALL, ("design", "--deck", DECK, *curve), ("export", "c", "--deck", DECK, "--what", "both"),
             ("export", "fmu", "--deck", DECK), ("diagnose", "--deck", DECK, "--records", "r", "--export"),
             ("study", "run", "hello"), ("observer", "--deck", DECK),
             ("fit", "--deck", DECK, "--records", "r"))  # fmt: skip
    listed = {}
    for words in calls:
        status, out, err = run(*words, "--dry-run")
        assert (status, err) == (0, ""), words
        listed[words[0], words[1]] = out
    assert list(tmp_path.iterdir()) == []
    assert "would write: out/design/model.toml, which is new" in listed["design", "--deck"]
    assert "would write: out/c/torque_loop_selftest.c, which is new" in listed["export", "c"]
    assert "would write: out/fmu/observer_and_controller.fmu" in listed["export", "fmu"]
    assert "would write: out/diagnosis/c/torque_loop.c" in listed["diagnose", "--deck"]
    assert "not known before the work" in listed["study", "run"]


def test_a_dry_run_of_a_design_lists_what_it_is_asked_for(run: Run, tmp_path: Path) -> None:
    curve = ("--maximum", "1 N*m", "--angle", "30 deg", "--out", "o")
    task = ("--target", "TaskTarget = {joint = 'ankle', body_mass = '75 kg', scale = 0.05}", "--out", "o")

    def listed(*words: str) -> set[str]:
        status, out, err = run("design", "--deck", DECK, *words, "--dry-run", "--json")
        assert (status, err) == (0, "")
        return {Path(name).name for name in json.loads(out)["files"]}

    whole = listed(*curve)
    assert "tolerance.svg" in whole
    assert listed(*curve, "--draws", "0") == whole - {"tolerance.svg"}
    assert listed(*task) == whole | {"task_curve.svg", "task_motor.svg", "task_springs.svg"}
    with keeping(tmp_path / "o"):
        write_text(tmp_path / "o" / "tolerance.svg", "of an earlier design, which the next one removes")
    assert listed(*curve, "--draws", "0") == whole


@pytest.mark.parametrize("name", ["", "."])
def test_a_file_without_a_name_is_refused(run: Run, name: str) -> None:
    status, _, err = run("cosimulate", "--fmu", "a=b.fmu", "--stop", "1 s", "--out", name, "--dry-run")
    assert status == 2
    assert "--out" in err


def test_what_a_command_lists_beforehand_is_what_it_writes(run: Run, tmp_path: Path) -> None:
    calls = (
        ("export", "controller", "--deck", DECK, "--out", "a"),
        ("export", "c", "--deck", DECK, "--what", "controller", "--examples", "--out", "b"),
        ("analyse", "--deck", DECK, "--count", "2", "--out", "c"),
    )
    for words in calls:
        listed = json.loads(run(*words, "--dry-run", "--json")[1])["files"]
        status, _, err = run(*words)
        assert status == 0, err
        written = {str(each.relative_to(tmp_path)) for each in listed_files(tmp_path / words[-1])}
        assert set(listed) == written


def test_a_file_of_somebody_that_turns_up_during_the_work_is_kept(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def too_late(_: object, **__: object) -> None:
        (tmp_path / "o").mkdir()
        (tmp_path / "o" / "run.svg").write_text("own", encoding="utf-8")

    monkeypatch.setattr(overwriting, "refuse_to_lose", too_late)
    status, _, err = run(*CALL)
    assert status == 0
    assert "run.svg was not written by nlsdesign and was kept; the new one is o/run.new.svg" in err
    assert (tmp_path / "o" / "run.svg").read_text(encoding="utf-8") == "own"
    assert "<svg" in (tmp_path / "o" / "run.new.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["report.html", "report.svg", "run", "model.toml"])
def test_a_table_is_named_as_one(run: Run, name: str) -> None:
    status, _, err = run("simulate", "--deck", DECK, "--stop", "20 ms", "--out", f"o/{name}")
    assert status == 2
    assert "must end in .csv" in err
    assert f"name it {Path(name).stem}.csv" in err
    assert not Path("o").exists()


def test_page_and_picture_of_a_simulation_replace_no_file_of_another_command(run: Run) -> None:
    with keeping(Path("o"), command="design"):
        write_text(Path("o/run.html"), "the page of a design")
    status, _, err = run(*CALL)
    assert status == 2
    assert "run.html: was written by another command" in err
    assert Path("o/run.html").read_text(encoding="utf-8") == "the page of a design"
    status, out, _ = run(*CALL, "--dry-run")
    assert status == 1
    assert "refuse to replace: " in out
    assert not Path("o/run.csv").exists()
    assert run(*CALL, "--force")[0] == 0
    assert run(*CALL)[0] == 0
    assert "the page of a design" not in Path("o/run.html").read_text(encoding="utf-8")
