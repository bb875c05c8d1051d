"""Springs of other groups: their numbers by other roads, and what the table says of theirs and ours."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from nlsdesign.cli.studies import claims, not_as_claimed
from studies import published_springs as study
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")


def test_the_curves_of_michigan_are_those_of_their_cams() -> None:
    """The roller's centre goes as far as the last entry of R in their Rpsi_debug.mat, by quadrature."""
    x = np.array([-515.067492, 165.591348, 2.82107791, 1.66518795, 2.11789187, 2.82107791, -0.252421590])
    zero, last = x[6], -1.944065314313651
    work, _ = quad(lambda t: x[3] * (t - zero) ** 3 + x[4] * (t - zero) ** 2 + x[5] * (t - zero), zero, last)
    rate, preload = 10714.7851609803, 0.002971789862093903
    centre = 0.0575 - preload + math.sqrt(preload**2 + 2.0 * work / rate)
    assert centre == pytest.approx(82.10904754901224e-3, abs=1e-9), "as they print it"
    assert study.joint_cam(study.knee().targets).centre_radius == pytest.approx(centre, abs=1e-7)
    second = study.joint_cam(study.second_cam().targets).centre_radius
    assert second == pytest.approx(68.08522955695712e-3, abs=1e-7), "their second cam, as they print it"
    assert preload == pytest.approx(study.PRELOAD, rel=1e-6)
    assert rate == pytest.approx(study.SPRING_RATE, rel=1e-9)


def test_the_rolling_pair_of_eth_is_theirs_by_hand() -> None:
    """Full at the end with ½·(35.09 + 1.75) N·20 mm; the torque there is the force times the lever arm."""
    rate = (35.09 - 1.75) / 20e-3
    way = math.sqrt(2.0 * 0.5 * (35.09 + 1.75) * 20e-3 / rate)
    theirs = study.line()
    assert theirs.force == pytest.approx(rate * way, rel=1e-6)
    assert theirs.radius == pytest.approx(math.hypot((19.47e-3 + way) / 2.0, 0.25 / (rate * way)), rel=1e-6)


def test_a_pair_of_such_cams_gives_the_torque_when_it_rolls() -> None:
    """dU/dβ of the coil between the pivots, R(θ) its half, at β = 2θ, on a tangent turned by hand."""
    rate, full = (35.09 - 1.75) / 20e-3, 0.5 * (35.09 + 1.75) * 20e-3
    bent = np.linspace(0.0, math.pi / 2.0, 2001)
    stored = full - 0.25 / math.pi * (math.pi / 2.0) ** 2 + 0.25 / math.pi * bent**2
    halves = (19.47e-3 + np.sqrt(2.0 * stored / rate)) / 2.0
    # The contour is what touches all lines at a distance R(θ) whose normal is turned by θ = β/2.
    turned = bent / 2.0
    slope = np.gradient(halves, turned)
    points = np.column_stack(
        [halves * np.cos(turned) - slope * np.sin(turned), halves * np.sin(turned) + slope * np.cos(turned)]
    )
    assert np.hypot(*points.T).max() == pytest.approx(study.line().radius, rel=1e-3)
    touching = points @ np.array([math.cos(turned[1200]), math.sin(turned[1200])])
    assert int(np.argmax(touching)) == pytest.approx(1200, abs=2), "convex there: the tangent touches once"


@pytest.mark.slow
def test_a_linear_torque_of_a_linear_coil_takes_a_round_drum() -> None:
    """E = c·θ²/2 = k·e²/2, so e = θ·√(c/k): the drum of √(c/k); the force is c·θ over it."""
    answers = {ours.key: ours for ours in study.pulleys()}
    drum = math.sqrt(2.0 / 28e3)
    assert answers["round"].radius == pytest.approx(drum, rel=1e-3)
    assert answers["round"].force == pytest.approx(math.pi / drum, rel=1e-3)
    design = answers["round"].sides["both"]
    assert np.ptp(design.contour.radii[5:]) < 0.01 * drum, "round"
    follows = answers["nearer_anchor"]
    assert follows.met
    assert follows.largest_miss < 1e-3
    assert "hollow" in follows.published.follows


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, study.Results]:
    out = tmp_path_factory.mktemp("published")
    return out, study.main(out, fast=True)


@pytest.mark.slow
def test_the_study_keeps_its_claims(results: tuple[Path, study.Results]) -> None:
    out, found = results
    assert set(found.numbers) == set(claims("published_springs"))
    assert not_as_claimed(found.numbers, claims("published_springs")) == {}
    table = (out / "theirs_ours.txt").read_text(encoding="utf8").splitlines()
    assert len(table) == 1 + len(found.answers)
    assert "Theirs, ours" in (out / "report.html").read_text(encoding="utf8")


@pytest.mark.slow
def test_at_their_preload_ours_is_the_published_cam(results: tuple[Path, study.Results]) -> None:
    """Their points were computed by their program; nothing of them is given to the design."""
    same = [ours for ours in results[1].answers if ours.key == "at_their_preload"]
    assert len(same) == 2
    for ours in same:
        assert ours.radius == pytest.approx(ours.published.radius, abs=5e-6)
        assert ours.force == pytest.approx(ours.published.force, rel=1e-4)


@pytest.mark.slow
def test_each_verdict_says_what_the_numbers_say(results: tuple[Path, study.Results]) -> None:
    for ours in results[1].answers:
        theirs, verdict = ours.published, ours.verdict
        name = f"{theirs.key}, {ours.key}"
        assert ours.met == ("No convex contour" not in verdict), name
        if verdict.startswith("The same"):
            assert ours.radius == pytest.approx(theirs.radius, rel=1e-3), name
        elif "smaller" in verdict.lower():
            assert ours.radius < 0.95 * theirs.radius, name
        if "at no more force" in verdict:
            assert ours.force < 1.001 * theirs.force, name
        assert ("Not better in force" in verdict) == (ours.force > 1.01 * theirs.force), name
        if verdict.startswith("Less force"):
            assert ours.force < 0.7 * theirs.force, name
            assert ours.radius > theirs.radius, name
        assert ("30°" not in verdict) or all(
            abs(math.degrees(angle)) < 30.01
            for design in ours.sides.values()
            for angle in (np.abs(design.contour.pressure_angles).max(),)
        ), name
