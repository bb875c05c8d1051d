"""The studies of real measurements keep their claims where the measurements are at hand."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.cli.studies import claims, run_study
from studies import emps
from studies._measured import data_folder
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

NAMES = ("emps", "vhb4910")
BOUNDS = {
    "emps": {
        "better_error_over_1s_mm": 1.75,
        "better_error_over_3s1_mm": 2.85,
        "better_force_error_percent": 3.7,
    },
    "vhb4910": {"better_error_held_out_percent": 4.0},
}
"""What has to be reached, however it is done."""
NAMED = {
    "emps": {"coulomb_friction", "constant_force"},
    "vhb4910": {"second_relaxation", "cable_slack"},
}


# The measurements are no part of the project: they may not travel with it.
measured = pytest.mark.skipif(
    "NLSDESIGN_SHARED" not in os.environ, reason="NLSDESIGN_SHARED does not name the folder of measurements"
)


@measured
def test_the_drive_lacks_what_its_publishers_identified() -> None:
    """The diagnosis of the study, without its fit by simulation, which takes most of the time."""
    published = nls.models.positioning_drive(nls.load_deck("janot2019_positioning_drive"))
    bare, folder = emps.viscous_only(published), data_folder("emps", None)
    assert folder is not None
    records = nls.load_records(folder, nls.flatten(bare), mapping=emps.MAPPING)
    found = nls.diagnose(bare, records, catalogue=emps.RIVALS)
    assert found.verdict == "named"
    assert {effect.name for effect in found.effects} == NAMED["emps"]
    # The published numbers are of a fit over the same motion; those of a balance of forces are not far off.
    assert emps.fitted_numbers(found.actuator) == pytest.approx(emps.fitted_numbers(published), rel=0.1)
    before, after = (emps.drive_error(drive, records) for drive in (found.declared, found.actuator))
    assert after.force < BOUNDS["emps"]["better_force_error_percent"] < 0.25 * before.force


@measured
@pytest.mark.long_cases("emps-fast", "emps-whole", "vhb4910-fast")
@pytest.mark.parametrize(("name", "way"), [("emps", "fast"), ("emps", "whole"), ("vhb4910", "fast")])
def test_the_study_keeps_its_claims(name: str, way: str, tmp_path: Path) -> None:
    """The fast way tries few effects on the drive and fits it over fewer windows."""
    results = run_study(name, tmp_path, fast=way == "fast")
    expected = claims(name)
    assert set(results) == set(expected)
    for key, claim in expected.items():
        assert claim.holds(results[key]), (key, results[key], claim)
    for key, bound in BOUNDS[name].items():
        assert results[key] <= bound, (key, results[key])
    verdict = json.loads((tmp_path / "verdict.json").read_text(encoding="utf8"))
    assert verdict["verdict"] == "named"
    assert {effect["name"] for effect in verdict["effects"]} == NAMED[name]
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf8")


@pytest.mark.parametrize("name", NAMES)
def test_without_the_measurements_the_study_says_why_it_has_no_result(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NLSDESIGN_SHARED", raising=False)
    assert run_study(name, tmp_path) == {}
    assert f"skipped: The measurements '{name}'" in capsys.readouterr().out
    assert "NLSDESIGN_SHARED" in (tmp_path / "report.html").read_text(encoding="utf8")
