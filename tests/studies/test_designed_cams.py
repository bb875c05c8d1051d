"""The studies of designed cams keep their claims, and their drawings and decks hold what they say."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.cli.studies import claims, not_as_claimed, run_study
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import equilibrium_torque
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.mark.slow
def test_what_is_freed_decides_what_is_reached(tmp_path: Path) -> None:
    results = run_study("joint_cam_design", tmp_path, fast=True)
    assert set(results) == set(claims("joint_cam_design"))
    assert not_as_claimed(results, claims("joint_cam_design")) == {}
    # Asked for by the project: at most 28 mN·m with fixed rubber, 0.05 with free rubber.
    assert results["of_2014_fixed_rubber_mNm_rms"] <= 28.0
    assert results["of_2014_free_rubber_mNm_rms"] <= 0.05
    report = (tmp_path / "report.html").read_text(encoding="utf8")
    assert "MISSES ITS TARGET" in report
    assert "free spring.rubber.rest_length" in report.replace("<wbr>", "")


@pytest.fixture(scope="module")
def finger(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    out = tmp_path_factory.mktemp("finger")
    return out, dict(run_study("one_sided_finger_drive", out, fast=True))


@pytest.mark.slow
def test_the_finger_keeps_its_claims(finger: tuple[Path, dict[str, float]]) -> None:
    _, results = finger
    assert set(results) == set(claims("one_sided_finger_drive"))
    assert not_as_claimed(results, claims("one_sided_finger_drive")) == {}


@pytest.mark.slow
def test_the_written_deck_has_the_torque_that_was_asked_for(finger: tuple[Path, dict[str, float]]) -> None:
    out, _ = finger
    model = flatten(declare(load_deck(str(out / "designed.toml"))))
    angle = np.radians(np.linspace(5.0, 80.0, 16))
    # 1 N·m·(e^θ − 1)/(e^θₑ − 1), written out; friction of the guide stands still at rest.
    wanted = (np.exp(angle) - 1.0) / (np.exp(np.radians(80.0)) - 1.0)
    assert equilibrium_torque(model, "spring", angle) == pytest.approx(wanted, abs=5e-3)


@pytest.mark.slow
def test_the_edge_lies_one_cable_radius_inside_the_centre_line(finger: tuple[Path, dict[str, float]]) -> None:
    out, _ = finger
    lines = (out / "drawing" / "cam_centre_line.csv").read_text(encoding="utf8").splitlines()
    table = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    centre = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in table])
    lines = (out / "drawing" / "cam.csv").read_text(encoding="utf8").splitlines()
    edge = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    ends = np.array(
        [[float(row["start_x_mm"]), float(row["start_y_mm"])] for row in edge if row["start_x_mm"]]
    )
    nearest = np.min(np.hypot(*(ends[:, None, :] - centre[None, :, :]).transpose(2, 0, 1)), axis=1)
    assert np.min(nearest) == pytest.approx(0.6, abs=0.01)
    assert np.sum(np.abs(nearest - 0.6) < 0.01) >= 10
