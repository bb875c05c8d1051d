"""Bandwidth against impedance: the front is that of its points, and the study keeps its claims."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.cli.studies import claims, not_as_claimed, run_study
from studies.spring_and_gains import Results, Spring

NAME = "spring_and_gains"


def made_up(angle: float, bandwidth: list[float], impedance: list[float]) -> Spring:
    return Spring(angle, 1.0, np.ones(len(bandwidth)), np.array(bandwidth), np.array(impedance))


def test_the_front_is_what_no_point_betters() -> None:
    one, other = made_up(40.0, [10.0, 20.0, np.nan], [3.0, 2.0, 0.1]), made_up(53.0, [8.0, 15.0], [2.0, 1.0])
    front = Results((one, other), ()).front
    assert [(s.angle, k) for s, k in front] == [(53.0, 1), (40.0, 1)]


@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    numbers = run_study(NAME, tmp_path)
    assert set(numbers) == set(claims(NAME))
    assert not_as_claimed(numbers, claims(NAME)) == {}
    assert numbers["straight_bandwidth_Hz"] > numbers["published_bandwidth_Hz"]
    assert numbers["straight_impedance_Nm_per_rad"] < numbers["published_impedance_Nm_per_rad"]


def test_the_published_torque_curve_has_the_bandwidth_that_is_claimed(tmp_path: Path) -> None:
    numbers, expected = run_study(NAME, tmp_path, fast=True), claims(NAME)
    for key in ("published_bandwidth_Hz", "published_impedance_Nm_per_rad"):
        assert expected[key].holds(numbers[key])
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf8")
