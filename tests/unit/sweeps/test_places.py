"""Messages about a sweep file: at the line of what they speak of, by the name that stands in the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.foundation.errors import NlsError
from nlsdesign.sweeps.sweep_file import read_sweep_file
from tests.command_line import Run, run

__all__ = ["run"]
AXES = """decks = "austin2015_figure_consistent"

[[axes]]
Listed = {values = {"motor.inertia" = ["1 mg*m^2"]}}
[[axes]]
[axes.GridAxis]
name = "spring.rubber.area"
lower = "0.2 cm^2"
upper = "0.4 cm^2"
count = 2

"""
DESIGN = AXES + (
    '[ask.DesignQuestion]\nfree = ["spring.cam.contour", "spring.pretension"]\n'
    'target.ExponentialTorque = {maximum = "2 N*m", angle = "53 deg", shape = 1.0}\n'
    'limits.MaximumCamRadius = {radius = "30 mm"}\n'
)


def written(folder: Path, text: str) -> str:
    path = folder / "sweep.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ask.Design", "ask.Desing", "sweep.toml:12:1: ask.DesingQuestion 'DesingQuestion'"),
        ("GridAxis]", "GridAxes]", "sweep.toml:5:1: axes[2] 'GridAxes'"),
        ("count = 2\n", "cuont = 2\n", "sweep.toml:10:1: axes[2].GridAxis.cuont: field 'cuont'"),
        ("target.Exp", "tarket.Exp", "sweep.toml:14:1: ask.DesignQuestion.tarket 'tarket'"),
        ("target.Expo", "target.Epxo", "sweep.toml:14:1: ask.DesignQuestion.target.Epxo"),
        ("limits.MaximumCam", "limits.MaximumKam", "sweep.toml:15:1: ask.DesignQuestion.limits.MaximumKam"),
        ('"53 deg"', '"53 mm"', "sweep.toml:14:1: ask.DesignQuestion.target.ExponentialTorque"),
        ("free = [", "free = 1 #", "sweep.toml:13:1: ask.DesignQuestion.free"),
    ],
)
def test_what_is_wrong_is_named_at_its_line(old: str, new: str, words: str, tmp_path: Path) -> None:
    assert DESIGN.count(old) == 1
    with pytest.raises(NlsError) as error:
        read_sweep_file(written(tmp_path, DESIGN.replace(old, new)))
    assert str(error.value).startswith(words)


def test_a_target_that_lacks_is_asked_for_where_it_belongs(tmp_path: Path) -> None:
    with pytest.raises(NlsError) as error:
        read_sweep_file(written(tmp_path, DESIGN.replace("target.", "#")))
    assert str(error.value).startswith("sweep.toml:12:1: ask.DesignQuestion.target: has no target")
    assert "write [ask.DesignQuestion.target] and below it" in str(error.value)
    text = DESIGN.replace("target.Exp", "target = 1 #")
    with pytest.raises(NlsError, match=r"write \[ask\.DesignQuestion\.target\]"):
        read_sweep_file(written(tmp_path, text))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"spring.pretension"', '"spring.pretnsion"', "did you mean 'spring.pretension'?"),
        ('"spring.pretension"', '"bearing.damping"', "a design cannot change it"),
        (
            'limits.MaximumCamRadius = {radius = "30 mm"}',
            'limits.NumberRange = {name = "spring.pretnsion", minimum = "1 mm", maximum = "2 mm"}',
            "did you mean 'spring.pretension'?",
        ),
    ],
)
def test_names_of_a_question_are_checked_before_any_point(
    old: str, new: str, words: str, run: Run, tmp_path: Path
) -> None:
    status, out, err = run("sweep", written(tmp_path, DESIGN.replace(old, new)), "--dry-run")
    assert (status, out) == (2, "")
    assert "sweep.toml:12:1: ask.DesignQuestion: " in err
    assert words in err


def test_a_name_that_only_the_first_point_has_is_known(run: Run, tmp_path: Path) -> None:
    """The spring is asked for by an axis: without it the structure would have to decide."""
    text = DESIGN.replace('"motor.inertia" = ["1 mg*m^2"]', '"ask.spring" = ["spring"]')
    text = text.replace("free =", 'spring = "none"\nfree =')
    status, out, _ = run("sweep", written(tmp_path, text), "--dry-run", "--json")
    assert status == 0
    assert json.loads(out)["points"] == 2


def test_a_table_that_only_inner_ones_mention_stands_where_the_first_does() -> None:
    deck = read_deck("[a.b.c]\nx = 1\n[[row]]\ny = 1\n[[row]]\n[row.inner]\ny = 2\n", Path("x.toml"))
    assert deck.place("a") == "x.toml:1:1: a"
    assert deck.place("a.b.d") == "x.toml:1:1: a.b.d"
    assert deck.place("row[2].inner.y") == "x.toml:7:1: row[2].inner.y"
    assert deck.place("row[3]") == "x.toml:3:1: row[3]"
    assert deck.place("row.y") == "x.toml:4:1: row.y"
    known = load_deck("austin2015_figure_consistent")
    assert known.place("spring.rubber.area").split(":")[1] != "1"
