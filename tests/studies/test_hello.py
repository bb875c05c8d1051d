"""The first study a newcomer reads: short, complete, and its numbers come out."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from nlsdesign.cli import studies as runner
from nlsdesign.foundation.errors import NlsError
from tests.undrawn import without_drawing

MOST_LINES = 49


@pytest.fixture(scope="module")
def hello(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    out = tmp_path_factory.mktemp("hello")
    with without_drawing():
        return out, runner.run_study("hello", out)


def test_the_study_keeps_its_claims(hello: tuple[Path, dict[str, float]]) -> None:
    out, results = hello
    assert set(results) == set(runner.claims("hello"))
    assert runner.not_as_claimed(results, runner.claims("hello")) == {}
    report = (out / "report.html").read_text(encoding="utf8")
    assert "spring.cam.lever_arm" in report.replace("<wbr>", "")
    assert "The design meets its target" in report
    assert report.count("<figure") == 6, (
        "the cam twice, torque, limits, made springs by cause and over the angle"
    )


def test_it_fits_on_one_page(root: Path) -> None:
    assert len((root / "studies" / "hello.py").read_text(encoding="utf8").splitlines()) <= MOST_LINES


def test_it_is_listed_beside_modules_and_packages() -> None:
    listed = CliRunner().invoke(runner.study, ["list"]).output
    for name in ("hello", "austin2015", "audit_published_model", "emps"):
        assert name in listed.split()
    assert not any(name.startswith("_") for name in runner.study_names())


# --- the runner notices -------------------------------------------------------------------------------


def test_a_number_that_is_off_or_absent_is_not_as_claimed() -> None:
    expected = {name: runner.Claim(1.0, 0.1, "1", "") for name in ("near", "off", "absent")}
    wrong = runner.not_as_claimed({"near": 1.05, "off": 1.2}, expected)
    assert wrong == {
        "off": "off = 1.2, expected 1 ± 0.1",
        "absent": "absent was not computed, expected 1 ± 0.1",
    }
    assert runner.not_as_claimed({}, expected) == {}  # skipped: its measurements are elsewhere


def test_a_wrong_number_ends_with_status_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = {"length_m": runner.Claim(2.0, 0.1, "m", "")}
    monkeypatch.setattr(runner, "claims", lambda _: other)
    monkeypatch.setattr(runner, "run_study", lambda *_, **__: {"length_m": 1.0})
    run = CliRunner().invoke(runner.study, ["run", "hello", "--out", str(tmp_path / "out")])
    assert run.exit_code == 1
    assert "not as claimed: length_m = 1, expected 2 ± 0.1" in run.stderr
    other["length_m"] = runner.Claim(1.0, 0.1, "m", "")
    run = CliRunner().invoke(runner.study, ["run", "hello", "--out", str(tmp_path / "out"), "--json"])
    assert run.exit_code == 0
    assert json.loads(run.stdout)["results"] == {"length_m": 1.0}


def test_results_without_numbers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NlsError, match=r"returned dict, which has no property 'numbers'"):
        runner.run_study(str(study(tmp_path, "{'length_m': 1.0}")), tmp_path)
    assert isinstance(SimpleNamespace(numbers={}), runner.Results)


def study(folder: Path, results: str) -> Path:
    """A study of somebody else, in a file of its own."""
    file = folder / "mine.py"
    head = "from types import SimpleNamespace\n"
    file.write_text(f"{head}def main(out, fast=False):\n    return {results}\n", encoding="utf8")
    return file
