"""The study of torque curves from walking keeps its claims; a spring never makes it worse."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.cli.studies import claims, load_study, not_as_claimed, run_study
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")


# Half a minute; the fast way below runs the same steps for fewer ratios.
@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    results = run_study("torque_curve_from_gait", tmp_path)
    expected = claims("torque_curve_from_gait")
    assert set(results) == set(expected)
    assert not_as_claimed(results, expected) == {}
    assert results["ankle_heat_curve_J"] < results["ankle_heat_linear_J"] < results["ankle_heat_rigid_J"]
    report = (tmp_path / "report.html").read_text(encoding="utf8")
    assert report.count("<svg") == 11
    # The designed spring cannot do better than the convex optimum, and costs little more.
    assert (
        results["ankle_heat_curve_J"]
        <= results["ankle_heat_designed_J"]
        <= 1.02 * results["ankle_heat_curve_J"]
    )
    assert "no bound is proved" in report


@pytest.mark.slow
def test_the_fast_way_looks_at_some_of_the_ratios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study("torque_curve_from_gait")
    assert set(study.COARSE) < set(study.RATIOS)
    monkeypatch.setattr(study, "COARSE", study.COARSE[1:])  # for this test one of them is enough
    results = study.main(tmp_path, fast=True)
    assert results.ankle_gear_ratio in study.COARSE
