"""The prediction of the adaptive filter against integration by hand and against differences."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.observer import FixedGrid, Trust, design_adaptive_observer
from nlsdesign.feedback.observer.adaptive.filter_equations import FilterEquations, FilterNoise
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten

TIME = 1e-3
NOISE = FilterNoise(angle=2e-4, acceleration=5.0, estimate=0.01, safe_inputs={})


@pytest.fixture(scope="module")
def plant() -> FlatModel:
    return flatten(declare(load_deck("austin2015_soft_spring")))


@pytest.fixture(scope="module")
def filter_(plant: FlatModel) -> FilterEquations:
    design = design_adaptive_observer(plant, grid=FixedGrid(-0.2, 0.2, points=11))
    return FilterEquations(design.step, design.compact, Trust(), NOISE)


def expected_states(filter_: FilterEquations) -> ca.Function:
    """(memory, slow states, columns of the table) -> the states that are expected at a sample."""
    memory, slow = ca.SX.sym("memory", filter_.n), ca.SX.sym("slow", filter_.slow)
    return ca.Function("expected", [memory, slow, filter_.w], [filter_.expected_states(memory, slow)])


def table(filter_: FilterEquations) -> np.ndarray:
    """Columns of the table in the middle of its range."""
    columns = np.array([c.values for c in filter_.compact.columns])
    return columns[:, columns.shape[1] // 2]


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_friction_moves_the_angle_by_what_it_takes_from_the_speed(
    plant: FlatModel, filter_: FilterEquations, speed: float
) -> None:
    """ω̇ = −(τ/J)·sign ω for one sample: the angle falls behind ω₀·T by the integral of what is lost."""
    rate = -np.sign(speed) * plant.values["dry_friction.sliding_effort"] / plant.values["motor.inertia"]
    time = np.linspace(0.0, TIME, 1001)
    assert abs(rate * TIME) < 0.2 * abs(speed), "the speed stays well away from zero"
    memory = np.zeros(filter_.n)
    memory[filter_.speed] = speed
    states = expected_states(filter_)
    moving, standing = (
        states(m, np.zeros(filter_.slow), table(filter_)).full().ravel() for m in (memory, 0.0 * memory)
    )
    moved = moving - standing - memory
    assert moved[filter_.speed] == pytest.approx(rate * TIME, rel=0.02)
    assert moved[filter_.angle] == pytest.approx(np.trapezoid(rate * time, time), rel=0.02)


def test_slopes_are_taken_at_the_deck_and_not_at_the_estimate(filter_: FilterEquations) -> None:
    """By differences at the deck; an estimate that lies elsewhere changes the states but no slope."""
    memory, slow = ca.SX.sym("memory", filter_.n), ca.SX.sym("slow", filter_.slow)
    states = filter_.expected_states(memory, slow)
    slopes = ca.Function("slopes", [memory, slow, filter_.w], [filter_.slopes(states, memory, slow)])
    at, away = np.zeros(filter_.n), np.full(filter_.slow, 1.5)
    at[filter_.speed] = 3.0
    read, width = expected_states(filter_), 1e-4

    def differences(around: np.ndarray) -> np.ndarray:
        """Central differences of the states by each slow state."""
        sides = [
            [read(at, around + sign * width * unit, table(filter_)).full().ravel() for sign in (1.0, -1.0)]
            for unit in np.eye(filter_.slow)
        ]
        return np.array([(up - down) / (2.0 * width) for up, down in sides]).T

    nominal = slopes(at, 0.0 * away, table(filter_)).full()
    np.testing.assert_allclose(nominal[:, filter_.n :], differences(0.0 * away), rtol=1e-5, atol=1e-12)
    np.testing.assert_array_equal(slopes(at, away, table(filter_)).full(), nominal)
    apart = np.abs(differences(away) - nominal[:, filter_.n :])
    assert np.max(apart) > 0.05 * np.max(np.abs(nominal[:, filter_.n :])), "the slopes at the estimate differ"
