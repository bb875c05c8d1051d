"""The study of the published actuator runs, writes what it promises, and keeps its claims."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

from nlsdesign.cli.studies import claims, run_study

FILES = (
    "report.html", "actuator.toml", "designed.toml", "c/observer.c", "c/observer.h", "fmu/plant.fmu",
    "fmu/observer.fmu", "fmu/controller.fmu", "fmu/plant_fmi2.fmu", "drawing/cam.dxf", "drawing/cam.svg",
    "diagnosis/verdict.json", "diagnosis/model.toml",
)  # fmt: skip


class Pictures(HTMLParser):
    """Counts the drawings of a page."""

    count = 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.count += tag == "svg"


def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    results = run_study("austin2015", tmp_path, fast=True)
    expected = claims("austin2015")
    assert set(results) == set(expected)
    for name, claim in expected.items():
        assert claim.holds(results[name]), (name, results[name], claim)
    for name in FILES:
        assert (tmp_path / name).stat().st_size > 0, name
    page = Pictures()
    page.feed((tmp_path / "report.html").read_text(encoding="utf8"))
    assert page.count >= 10
    verdict = json.loads((tmp_path / "diagnosis" / "verdict.json").read_text(encoding="utf8"))
    assert (verdict["verdict"], [e["name"] for e in verdict["effects"]]) == ("named", ["second_relaxation"])
    error = verdict["error"]["held_out"]
    assert error["after"] <= 1.3 * verdict["error"]["noise_floor"]
    assert error["before"] > 5.0 * error["after"]
