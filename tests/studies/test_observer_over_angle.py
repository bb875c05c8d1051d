"""The study of stability and observability over the angle keeps its claims, and writes what it shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.cli import studies as runner
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    results = runner.run_study("observer_over_angle", tmp_path, fast=True)
    assert runner.not_as_claimed(results, runner.claims("observer_over_angle")) == {}
    names = {"poles.svg", "observability.svg", "forms.svg", "report.html"}
    assert names <= {path.name for path in tmp_path.iterdir()}
    text = (tmp_path / "report.html").read_text(encoding="utf8")
    assert "decays with -70.4 1/s: detectable" in text
