"""Random smooth monotone targets: met at once, or after the first advice; six of the benchmark's hundred."""

from __future__ import annotations

import numpy as np
import pytest

import nlsdesign as nls
from benchmarks.random_targets import DECKS, FREE, KEEP, Line, lines, random_target
from nlsdesign.design.optimisation.loosening import Freed
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

QUICK = [(DECKS[0], 4), (DECKS[1], 2)]
SLOW = [(DECKS[0], 3), (DECKS[0], 5), (DECKS[1], 4), (DECKS[1], 5)]
CASES = [*QUICK, *(pytest.param(case, marks=pytest.mark.slow) for case in SLOW)]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def line(request: pytest.FixtureRequest) -> Line:
    deck, seed = request.param
    return next(iter(lines([deck], [seed])))


@pytest.mark.long_cases("austin2015_as_printed-2", "austin2015_figure_consistent-4")
def test_a_target_is_met_at_once_or_after_the_first_advice(line: Line) -> None:
    assert line.verdict != "not met", line


@pytest.mark.slow
@pytest.mark.long_cases("austin2015_figure_consistent-4")
def test_a_miss_says_so_and_what_to_do(line: Line) -> None:
    assert line.first.error is not None
    if line.first.error > 0.01:
        assert line.first.words.startswith("MISSES ITS TARGET")
        named = line.first.advice[0]
        freed = named if isinstance(named, Freed) else named[1]
        assert all(name in line.first.words for name in (freed.names if freed else ()))
        assert isinstance(named, Freed) or str(named[0]) in line.first.words
    else:
        assert line.first.words == ""


@pytest.mark.slow
def test_the_error_is_that_of_the_machine_as_declared() -> None:
    """The torque follows from cam and rubber by hand: N·h(θ)·F at the extension of the flat model."""
    actuator = nls.models.cam_rubber_actuator(nls.load_deck(DECKS[1]))
    target = random_target(2)
    design = nls.design_cam(actuator, target=target, free=FREE, keep=KEEP)
    contour, rubber = design.contour, design.actuator.quantities()
    extension = np.concatenate(
        [[0.0], np.cumsum(np.diff(contour.angles) * (contour.lever_arms[1:] + contour.lever_arms[:-1]) / 2)]
    )
    stretch = extension + rubber["spring.pretension"].number
    strain = stretch / rubber["spring.rubber.rest_length"].number
    moduli = np.array(rubber["spring.rubber.stiff.modulus"].values)
    knots = np.array(rubber["spring.rubber.stiff.knots"].values)
    stress = np.maximum(strain[:, None] - knots, 0.0) @ moduli
    torque = 2.0 * contour.lever_arms * rubber["spring.rubber.area"].number * stress
    reported = np.interp(contour.angles, design.check.angles, design.check.torques)
    assert torque == pytest.approx(reported, abs=1e-3 * target.largest)
    off = reported - target.torque(contour.angles)
    assert (np.sqrt(np.mean(off**2)) < 0.01 * target.largest) == design.met


@pytest.mark.parametrize("seed", range(1, 51))
def test_a_target_rises_all_the_way(seed: int) -> None:
    target = random_target(seed)
    torque = target.torque(np.linspace(0.0, target.last_angle, 2001))
    assert np.all(np.diff(torque) > 0.0)
    assert 3.0 <= torque[-1] <= 6.0
    assert 40.0 <= np.degrees(target.last_angle) <= 60.0
    steps = np.diff(torque, 2) / np.diff(torque)[1:]
    assert np.max(np.abs(steps)) < 0.3
