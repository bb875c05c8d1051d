"""Bandwidth against impedance: the front is that of its points, and the study keeps its claims."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.cli.studies import claims, not_as_claimed, run_study
from nlsdesign.feedback.control import loop_margins
from nlsdesign.simulation import declared_prior
from studies.alternative_rubber.merits import HELD
from studies.spring_and_gains import Results, Spring
from studies.spring_and_gains.under_margins import (
    LAWS,
    LIMITS,
    angles_of,
    lines_of,
    loops_of,
    published,
    reach_of,
)

NAME = "spring_and_gains"


def made_up(angle: float, bandwidth: list[float], impedance: list[float]) -> Spring:
    return Spring(angle, 1.0, np.ones(len(bandwidth)), np.array(bandwidth), np.array(impedance))


def test_the_front_is_what_no_point_betters() -> None:
    one, other = made_up(40.0, [10.0, 20.0, np.nan], [3.0, 2.0, 0.1]), made_up(53.0, [8.0, 15.0], [2.0, 1.0])
    front = Results((one, other), ()).front
    assert [(s.angle, k) for s, k in front] == [(53.0, 1), (40.0, 1)]


def test_angles_hold_the_torques_of_a_linear_spring() -> None:
    """The soft spring has 1.7 N·m/rad, the stiff one twice that: the angle is torque over stiffness."""
    for name, stiffness in (("soft", 1.7), ("stiff", 3.4)):
        assert angles_of(published()[name]) == pytest.approx(np.array(HELD) / stiffness, rel=1e-6)


def test_reach_is_where_the_speed_limit_is_met_unless_the_current_is_not_enough() -> None:
    loop, angle = loops_of(published()["stiff"])(LAWS[0]), 2.8 / 3.4
    limit = loop.controller.values["controller.speed_limit"]
    assert reach_of(loop, angle) == pytest.approx(limit / (2.0 * np.pi * angle), rel=1e-3)
    # With ten times the inertia ten times the current is needed to turn the motor round.
    heavy = {"motor.inertia": 10.0 * loop.plant.values["motor.inertia"]}
    slower = reach_of(replace(loop, plant=loop.plant.with_values(heavy)), angle)
    assert slower < 0.9 * limit / (2.0 * np.pi * angle)


@pytest.mark.slow
def test_the_largest_gain_keeps_the_margins_of_every_drawn_machine() -> None:
    """Both ways: each drawn machine has them, and with 2 % more gain one has not."""
    (pid, scheduled) = lines_of({"stiff": published()["stiff"]}, draws=2)
    loop_with = loops_of(published()["stiff"])
    for line in (pid, scheduled):
        loop = loop_with(line.law)
        drawn = declared_prior(loop.plant).draws(2, 1)
        worst = {1.0: np.inf, 1.02: np.inf}
        for share in worst:
            for k in range(2):
                plant = loop.plant.with_values({name: float(v[k]) for name, v in drawn.items()})
                controller = loop.controller.with_values({line.law.gain: share * line.largest})
                changed = replace(loop, plant=plant, controller=controller)
                margin = loop_margins(changed, [0.4], opening=changed.desired).gain[0]
                worst[share] = min(worst[share], float(margin))
        assert worst[1.02] < LIMITS.gain_margin <= worst[1.0], line.label


@pytest.mark.slow
def test_the_study_keeps_its_claims(tmp_path: Path) -> None:
    numbers = run_study(NAME, tmp_path)
    assert set(numbers) == set(claims(NAME))
    assert not_as_claimed(numbers, claims(NAME)) == {}
    assert numbers["straight_bandwidth_Hz"] > numbers["published_bandwidth_Hz"]
    assert numbers["straight_impedance_Nm_per_rad"] < numbers["published_impedance_Nm_per_rad"]
    # Below crossover the impedance of a PID loop is 2πf/Kp whatever the spring.
    for name in ("soft", "stiff", "nonlinear"):
        gain = numbers[f"{name}_pid_gain_rad_per_s_per_Nm"]
        assert numbers[f"{name}_pid_impedance_Nm_per_rad"] == pytest.approx(10.0 * np.pi / gain, rel=0.1)


# Half a minute; the front and the margins of drawn machines are held by the tests beside it.
@pytest.mark.slow
def test_the_published_torque_curve_has_the_bandwidth_that_is_claimed(tmp_path: Path) -> None:
    numbers, expected = run_study(NAME, tmp_path, fast=True), claims(NAME)
    linear = [key for key in numbers if key.startswith("nonlinear_")]
    assert len(linear) == 7
    for key in ("published_bandwidth_Hz", "published_impedance_Nm_per_rad", *linear):
        assert expected[key].holds(numbers[key]), key
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf8")
