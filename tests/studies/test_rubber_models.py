"""The comparison of rubber models keeps its claims, and says what it must say of the laws."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.cli.studies import claims, run_study
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

LINEAR = ("Hooke", "Kelvin_Voigt", "Maxwell", "standard_linear_solid", "Burgers")


@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = run_study("rubber_models_compared", tmp_path)
    expected = claims("rubber_models_compared")
    assert set(results) == set(expected)
    for name, claim in expected.items():
        assert claim.holds(results[name]), (name, results[name], claim)
    for label in ("fig6", "bench"):
        printed = results[f"{label}_stiffening_solid_printed_test_percent"]
        assert all(results[f"{label}_{law}_test_percent"] > 2.0 * printed for law in LINEAR)
    assert len(capsys.readouterr().out.splitlines()) >= 18
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf8")
