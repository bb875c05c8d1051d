"""A sweep file and its command: what is asked, what is refused with its place, exit status, JSON."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from nlsdesign.foundation.errors import DeckError, NlsError, UnknownNameError
from nlsdesign.sweeps import (
    AngleQuestion,
    DesignQuestion,
    DiagnosisQuestion,
    LoopQuestion,
    read_sweep,
)
from nlsdesign.sweeps.sweep_file import read_sweep_file
from tests.command_line import Run, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
AXES = """
[[axes]]
GridAxis = {name = "motor.inertia", lower = "1e-6 kg*m^2", upper = "2 mg*m^2", count = 3}

[[axes]]
Listed = {values = {"ask.last" = ["30 deg", "40 deg"]}}
"""
ANGLE = (
    'decks = "austin2015_figure_consistent"\n' + AXES + '[ask.AngleQuestion]\nfirst = "10 deg"\ncount = 3\n'
)


def written(folder: Path, text: str) -> Path:
    path = folder / "sweep.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_is_read_as_it_would_be_written_in_python(tmp_path: Path) -> None:
    task = read_sweep_file(written(tmp_path, ANGLE))
    assert isinstance(task.question, AngleQuestion)
    assert task.question.first == pytest.approx(0.17453292519943295)
    assert len(task.plan) == 6
    assert [c.unit for c in task.plan.columns] == ["kg*m^2", "rad"]
    assert task.plan.point(5) == pytest.approx((2e-6, 0.6981317007977318))
    # The same answers as a direct call.
    changed = AngleQuestion(first=task.question.first, last=task.plan.point(5)[1], count=3)
    base = next(iter(task.assemblies.values())).with_values({"motor.inertia": 2e-6})
    assert task.work(task.plan.point(5)) == pytest.approx(tuple(changed.ask(base).values()), nan_ok=True)


def test_a_design_is_asked_with_the_tables_of_a_design_file(tmp_path: Path) -> None:
    text = """
decks = ["austin2015_figure_consistent", "austin2015_soft_spring"]
[[axes]]
Listed = {values = {deck = ["austin2015_soft_spring", "austin2015_figure_consistent"]}}
[[axes]]
[axes.LatinHypercube]
count = 4
ranges."ask.target.maximum" = ["2 N*m", "3 N*m"]
ranges."ask.keep.MaximumCamRadius.radius" = ["20 mm", "30 mm"]
[ask.DesignQuestion]
free = ["spring.cam.contour", "spring.pretension"]
target.ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
limits.MaximumCamRadius = {radius = "30 mm"}
search.seed = 7
"""
    task = read_sweep_file(written(tmp_path, text))
    asked = task.question
    assert isinstance(asked, DesignQuestion)
    assert (asked.settings.seed, asked.settings.draws, len(asked.keep)) == (7, 0, 1)
    assert [c.unit for c in task.plan.columns] == ["", "N*m", "m"]
    assert len(task.plan) == 8
    assert "designed.spring.pretension" in [c.name for c in task.columns]
    first = task.plan.point(0)
    assert first[0] == "austin2015_soft_spring"
    assert 2.0 <= first[1] <= 3.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "names no deck"),
        (ANGLE.replace("decks", "deck"), "deck"),
        (ANGLE.replace("austin2015_figure_consistent", "austin2015_figure"), "austin2015_figure_consistent"),
        (ANGLE.replace("[[axes]]", "[[axis]]"), "sweep.toml:3:1: axis.*did you mean 'axes'"),
        (ANGLE.replace("GridAxis", "GridAxes"), r"sweep.toml:3:1: axes\[1\].*did you mean 'GridAxis'"),
        (ANGLE.replace("count = 3}", "cuont = 3}"), "field 'cuont'.*did you mean 'count'"),
        (ANGLE.replace(", count = 3}", "}"), "GridAxis lacks count"),
        (ANGLE.replace("motor.inertia", "motor.inertja"), "did you mean 'motor.inertia'"),
        (ANGLE.replace("ask.last", "ask.lats"), "did you mean 'ask.last'"),
        (ANGLE.replace("AngleQuestion", "AngelQuestion"), "did you mean 'AngleQuestion'"),
        (ANGLE.replace('"10 deg"', "true"), "first.*is not of the kind"),
        (ANGLE.replace("count = 3\n", "cnt = 3\n"), "did you mean 'count'"),
        ('decks = "austin2015_as_printed"\n[ask.AngleQuestion]\n', "no axes are given"),
        ('decks = "austin2015_as_printed"\n' + AXES, "must hold one question"),
        (ANGLE.replace('"40 deg"', '"30 deg"'), "twice: rows 1 and 2"),
        (ANGLE.replace("2 mg*m^2", "2 mm"), "'mm' is no unit of it"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(NlsError, match=words):
        read_sweep_file(written(tmp_path, text))


def test_records_lie_beside_the_file_and_count_by_their_content(tmp_path: Path) -> None:
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "a.csv").write_text("time,x\n0,1\n", encoding="utf-8")
    text = 'decks = "austin2015_as_printed"\n[[axes]]\nListed = {values = {"motor.inertia" = [1e-6]}}\n'
    path = written(tmp_path, text + '[ask.DiagnosisQuestion]\nrecords = "bench"\neffects = ["cable_slack"]\n')
    task = read_sweep_file(path)
    assert isinstance(task.question, DiagnosisQuestion)
    assert Path(task.question.records) == (tmp_path / "bench").resolve()
    before = task.question.describe()
    (tmp_path / "bench" / "a.csv").write_text("time,x\n0,2\n", encoding="utf-8")
    assert task.question.describe() != before
    assert "probability.cable_slack" in [c.name for c in task.columns]


def test_gains_of_a_loop_are_its_own_table(tmp_path: Path) -> None:
    text = (
        'decks = "austin2015_as_printed"\n[[axes]]\nListed = {values = {"ask.gains.proportional" = [1, 2]}}\n'
    )
    task = read_sweep_file(written(tmp_path, text + "[ask.LoopQuestion]\ngains = {proportional = 3.0}\n"))
    assert isinstance(task.question, LoopQuestion)
    assert task.question.gains is not None
    assert task.question.gains.proportional == 3.0


def test_the_command_computes_lists_and_goes_on(tmp_path: Path, run: Run) -> None:
    file, out = str(written(tmp_path, ANGLE)), tmp_path / "out"
    status, text, _ = run("sweep", file, "--out", str(out), "--dry-run", "--json")
    assert status == 0
    assert json.loads(text)["points"] == 6
    assert not out.exists()
    status, text, _ = run("sweep", file, "--out", str(out), "--workers", "2", "--json")
    content = json.loads(text)
    assert (status, content["points"], content["failed"]) == (0, 6, 0)
    table = read_sweep(out)
    assert table.done.all()
    assert table.values["least.observability.rank"].min() >= 1.0
    assert "6 of them stand" in run("sweep", file, "--out", str(out), "--dry-run")[1]
    (tmp_path / "sweep.toml").write_text(ANGLE.replace("count = 3\n", "count = 4\n"), encoding="utf-8")
    status, _, err = run("sweep", file, "--out", str(out))
    assert status == 2
    assert "holds another sweep: its question (AngleQuestion) is another one" in err


def test_points_that_fail_are_a_finding(tmp_path: Path, run: Run) -> None:
    text = ANGLE.replace('lower = "1e-6 kg*m^2"', 'lower = "-2 mg*m^2"')
    status, out, _ = run(
        "sweep", str(written(tmp_path, text)), "--out", str(tmp_path / "o"), "--workers", "1"
    )
    assert status == 1
    assert "6 points, 4 failed" in out
    assert "inertia = -2e-06 kg·m²: moment of inertia" in out
    status, _, err = run("sweep", str(tmp_path / "sweep.toml"), "--workers", "1", "--mpi")
    assert status == 2
    assert "--workers and --mpi: name two places for the work" in err


def test_a_sweep_ends_with_what_to_look_at(tmp_path: Path, run: Run) -> None:
    """Each command that is named as the next one does what is written beside it."""
    text = ANGLE.replace('lower = "1e-6 kg*m^2"', 'lower = "-2 mg*m^2"')
    words = ("sweep", str(written(tmp_path, text)), "--out", "my sweep", "--workers", "1")
    status, out, _ = run(*words)
    assert status == 1
    commands = [line.partition("#")[0].split(": ", 1)[1] for line in out.splitlines() if "next: " in line]
    assert [shlex.split(each)[1:] for each in commands] == [
        ["report", "my sweep"], ["report", "my sweep", "--deck-of", "0"],
    ]  # fmt: skip
    assert "first" in out
    status, out, _ = run(*shlex.split(commands[0])[1:])
    assert status == 0
    assert "4 of them failed" in out
    # The deck behind a point that failed says why it did.
    status, _, err = run(*shlex.split(commands[1])[1:])
    assert status == 2
    assert "inertia = -2e-06" in err


def test_a_page_is_written_at_the_end_and_no_changed_one_is_replaced(tmp_path: Path, run: Run) -> None:
    pytest.importorskip("SALib")
    one_axis = ANGLE.replace(AXES[: AXES.index("[[axes]]\nListed")], "")
    words = ("sweep", str(written(tmp_path, one_axis)), "--workers", "1", "--report", "pages")
    status, out, _ = run(*words)
    assert status == 0
    page = tmp_path / "pages" / "sweep.html"
    assert "nlsdesign report out/sweep --deck-of POINT" in page.read_text(encoding="utf-8")
    assert f"written: {Path('pages') / 'sweep.html'}" in out
    assert "next:" not in out
    content = json.loads(run(*words, "--json")[1])
    assert (content["page"], content["next"]) == ("pages/sweep.html", [])
    page.write_text("of somebody", encoding="utf-8")
    status, _, err = run(*words, "--again")
    assert status == 2
    assert "was changed" in err
    assert page.read_text(encoding="utf-8") == "of somebody"


def test_a_file_that_is_not_there(run: Run) -> None:
    status, _, err = run("sweep", "none.toml")
    assert status == 2
    assert "none.toml" in err
    assert issubclass(UnknownNameError, NlsError)
    assert issubclass(DeckError, NlsError)
