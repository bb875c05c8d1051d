"""The data set of hidden effects: the same on a second writing, silent on its labels, scored as described."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import hidden_effects
from benchmarks._effects_answers import results_of
from benchmarks._effects_table import right
from benchmarks.methods import least_squares
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck

KIND, SEED = "screw_carriage", "1"


def written(folder: Path, tiers: str = "clean,single", kinds: str = KIND) -> dict[str, Any]:
    """The labels of a data set that the command has written."""
    command = ["write", str(folder), "--seeds", SEED, "--kinds", kinds, "--tiers", tiers]
    assert hidden_effects.main(command) == 0
    content: dict[str, Any] = json.loads((folder / "truth.json").read_text("utf-8"))["cases"]
    return content


def contents(folder: Path) -> dict[str, bytes]:
    return {f.relative_to(folder).as_posix(): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    written(folder)
    return folder


@pytest.mark.slow
def test_a_second_writing_has_the_same_bytes(data: Path, tmp_path: Path) -> None:
    (tmp_path / "case_999").mkdir()  # left from a larger one
    written(tmp_path)
    assert contents(tmp_path) == contents(data)


def test_a_case_holds_what_a_bench_knows_and_nothing_of_its_label(data: Path) -> None:
    labels = json.loads((data / "truth.json").read_text("utf-8"))["cases"]
    assert sorted(p.name for p in data.iterdir()) == ["README.md", *sorted(labels), "truth.json"]
    for name, label in labels.items():
        files = {file.name for file in (data / name).iterdir()}
        assert {"deck.toml", "records.toml"} < files
        assert all(file.endswith(".csv") for file in files - {"deck.toml", "records.toml"})
        declare(load_deck(data / name / "deck.toml"))
        known = (data / name / "deck.toml").read_text("utf-8") + (data / name / "records.toml").read_text(
            "utf-8"
        )
        assert not any(effect in known for effect in label["hidden"])


def test_the_readme_says_how_it_was_made_and_lists_the_names(data: Path) -> None:
    text = (data / "README.md").read_text("utf-8")
    assert f"hidden_effects write FOLDER --seeds {SEED} --kinds {KIND} --tiers clean,single" in text
    assert "MIT" in text
    assert "| `backlash` |" in text
    assert not {"COMMAND", "FORMAT", "NAMES"} & set(text.split())


def scored(labels: dict[str, Any], answers: dict[str, Any], folder: Path) -> list[bool]:
    """Which cases of given labels are answered right."""
    truth, given = folder / "truth.json", folder / "answers.json"
    truth.write_text(json.dumps({"format": 1, "cases": labels}), "utf-8")
    given.write_text(json.dumps({"format": 1, "method": "m", "cases": answers}), "utf-8")
    return [right(result) for result in results_of(given, truth)[1]]


def label(kind: str, *hidden: str, **more: Any) -> dict[str, Any]:
    tier = "kind single" if hidden else "kind clean"
    given = {"kind": kind, "tier": tier, "hidden": list(hidden), "strength": 1.0, "seed": 0}
    return given | {"condition": "plain", "sizes": {}, "numbers": {}} | more


def test_right_is_the_hidden_name_at_its_body_and_no_other(tmp_path: Path) -> None:
    friction = label("elastic_joint", "joint_coulomb_friction")
    for answer, expected in (
        ({"effects": [{"name": "coulomb_friction", "part": "load"}]}, True),
        ({"effects": [{"name": "coulomb_friction", "part": "motor"}]}, False),
        ({"effects": [{"name": "coulomb_friction", "part": "load"}, {"name": "backlash"}]}, False),
        ({"effects": [], "unknown": True}, False),
        ({"failed": "no licence"}, False),
    ):
        assert scored({"a": friction}, {"a": answer}, tmp_path) == [expected]
    clean = label("geared_joint")
    assert scored({"a": clean}, {"a": {"effects": []}}, tmp_path) == [True]
    assert scored({"a": clean}, {"a": {"effects": [{"name": "backlash"}]}}, tmp_path) == [False]
    assert scored({"a": clean}, {}, tmp_path) == [False], "a case without an answer counts as failed"


@pytest.mark.parametrize(
    ("hidden", "named"),
    [("current_sensor_bias", "constant_force"), ("constant_force", "current_sensor_bias")],
)
def test_a_bias_and_a_constant_force_are_equal_laws(hidden: str, named: str, tmp_path: Path) -> None:
    answer = {"effects": [{"name": named, "part": "motor"}]}
    assert scored({"a": label("screw_carriage", hidden)}, {"a": answer}, tmp_path) == [True]


def test_probabilities_and_intervals_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truths = {"sizes": {"backlash.gap": 2.0}, "numbers": {"motor.inertia": 1.0}}
    answer = {
        "effects": [{"name": "backlash", "probability": 0.8, "numbers": {"spring.gap": [2.1, 0.1]}}],
        "numbers": {"motor.inertia": [1.3, 0.1], "motor.other": [1.0, 0.1], "motor.mass": [None, None]},
    }
    scored({"a": label("geared_joint", "backlash", **truths)}, {"a": answer}, tmp_path)
    command = ["score", str(tmp_path / "answers.json"), "--truth", str(tmp_path / "truth.json")]
    assert hidden_effects.main([*command, "--table", str(tmp_path / "page.md")]) == 0
    said = capsys.readouterr().out
    assert "| 0.040 of 1 | 1/2 (50 %" in said
    assert said.strip() in (tmp_path / "page.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("answers", "says"),
    [
        ({"b": {"effects": []}}, "there is no case 'b'"),
        ({"a": []}, "an answer is a table"),
        ({"a": {"effects": [{"name": "backlas"}]}}, "did you mean 'backlash'"),
        ({"a": {"effects": [{"name": "backlash", "probability": 1.5}]}}, "between 0 and 1"),
        ({"a": {"effects": [{"name": "backlash", "numbers": {"gap": 1.0}}]}}, "is no list"),
        ({"a": {"effects": {}}}, "is no list"),
        ({"a": {"effects": [], "seconds": "long"}}, "is no number"),
    ],
)
def test_wrong_answers_are_refused_in_a_sentence(
    answers: dict[str, Any], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(hidden_effects.AnswerError, match=says):
        scored({"a": label("geared_joint", "backlash")}, answers, tmp_path)
    command = ["score", str(tmp_path / "answers.json"), "--truth", str(tmp_path / "truth.json")]
    assert hidden_effects.main(command) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--kinds", "robot", "no kind 'robot'"),
        ("--tiers", "hard", "no tier 'hard'"),
        ("--seeds", "x", "no seeds"),
    ],
)
def test_wrong_words_write_nothing(
    option: str, value: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = [
        "write",
        str(tmp_path / "set"),
        *(["--seeds", "1"] if option != "--seeds" else []),
        option,
        value,
    ]
    assert hidden_effects.main(command) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "set").exists()


@pytest.mark.slow
def test_plain_least_squares_names_what_is_hidden_in_a_carriage(data: Path, tmp_path: Path) -> None:
    """Seed 1 is none of those by which the method was set, nor of those that are counted."""
    assert hidden_effects.main(
        ["answer", str(data), "--method", "least_squares", "--out", str(tmp_path / "answers.json")]
    ) == 0  # fmt: skip
    name, results = results_of(tmp_path / "answers.json", data / "truth.json")
    assert name == least_squares.NAME
    assert sum(map(right, results)) >= 2, [(r["hidden"], r["named"]) for r in results]
    assert all(result["cpu_seconds"] > 0.0 for result in results)
