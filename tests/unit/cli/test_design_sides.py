"""Both sides of a cam designed from the shell."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.command_line import Run, files_in, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

JOB = """
free = ["spring.sides.cam.contour", "spring.sides.pretension"]
[target]
PowerTorque = {coefficient = 11.16, exponent = 1.4, angle = "24.36 deg"}
[back_target]
PowerTorque = {coefficient = 4.036, exponent = 1.0, angle = "17.65 deg"}
[search]
starts = 1
[tolerance]
draws = 0
"""


def test_each_side_has_a_report_beside_one_deck(run: Run, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text(JOB, encoding="utf-8")
    words = ("design", "--deck", "spring_beside_drive", "--task", "job.toml", "--out", "o")
    status, out, _ = run(*words, "--json")
    numbers = json.loads(out)
    assert status == 0
    assert numbers["chosen_by"] == "front"
    assert all(numbers[side]["met"] for side in ("front", "back"))
    written = {"model.toml", "front.html", "back.html", "cam.dxf", "cam_back.csv"}
    assert written <= set(files_in(tmp_path / "o"))


def test_a_side_takes_a_curve(run: Run) -> None:
    given = ("design", "--deck", "spring_beside_drive", "--maximum", "1 N*m", "--angle", "20 deg")
    status, _, err = run(*given, "--back-target", 'TaskTarget = {joint = "hip", body_mass = "75 kg"}')
    assert status == 2
    assert "back_target: is a task -> give a curve" in err
