"""The study of the published torque loop keeps its claims, and decides its statements as it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.cli import studies as runner
from studies.austin2015_closed_loop import main
from studies.austin2015_closed_loop.statement import NOT_REPRODUCED, OTHERWISE, REPRODUCED
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

OUTCOMES = {
    "Fig. 8": REPRODUCED,
    "less output impedance": REPRODUCED,
    "rises to 0.62": NOT_REPRODUCED,
    "like the soft one": REPRODUCED,
    "like the stiff one": REPRODUCED,
    "overshoot": OTHERWISE,
    "unstable beyond 2 Hz": REPRODUCED,
    "gentler integral": OTHERWISE,
    "gain margin": REPRODUCED,
}


@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    results = main(tmp_path, fast=True)
    assert runner.not_as_claimed(results.numbers, runner.claims("austin2015_closed_loop")) == {}
    for words, outcome in OUTCOMES.items():
        (statement,) = (s for s in results.statements if words in s.stated)
        assert statement.outcome == outcome, statement
        assert statement.trials
    names = {"fig08.svg", "fig09.svg", "fig10_low.svg", "fig10_high.svg", "report.html"}
    assert names <= {path.name for path in tmp_path.iterdir()}
    assert "limit cycle" in (tmp_path / "report.html").read_text(encoding="utf8")
