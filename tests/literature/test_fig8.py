"""Torque over angle: the decks against the measured points of Fig. 8 and against the targets of their cams.

Independent roads: points read off the published figure; the two targets as formulas; the spread of a power
law fitted to the same points by ``scipy.optimize.least_squares``, below which no power law can come.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.linear import rest_state

from .published import (
    FIG_8_NONLINEAR,
    FIG_8_SOFT,
    MODEL_RELATIVE_ERROR,
    MODEL_RMSE,
    SOFT_STIFFNESS,
    STIFF_STIFFNESS,
    TARGET_ANGLE,
    TARGET_TORQUE,
)


def model_of(name: str) -> FlatModel:
    return flatten(declare(load_deck(name)), outputs=["spring.torque"])


def static_torque(model: FlatModel, angles: np.ndarray) -> np.ndarray:
    found = []
    for angle in angles:
        rest = rest_state(model, {"motor.angle": float(angle), "motor.speed": 0.0})
        found.append(model.evaluate(list(rest))["spring.torque"])
    return np.array(found)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_figure_consistent_deck_against_the_measured_points() -> None:
    """RMSE 0.076 N·m and 14.0 % mean relative error, where the authors' dynamic model has 0.10 and 13.6 %.

    The relative error is taken over the points above 0.1 N·m: in the dead zone the torque is 0.01 N·m, and
    over all points the mean would be 39 % for an error of 0.02 N·m. The RMSE lies 0.2 % above that of the
    best power law, so the cam follows its target; the rest is the target's own distance to the points.
    """
    angles, torques = FIG_8_NONLINEAR.T
    error = static_torque(model_of("austin2015_figure_consistent"), angles) - torques
    assert rms(error) < MODEL_RMSE
    assert rms(error) == pytest.approx(0.0763, abs=0.001)
    large = np.abs(torques) > 0.1
    relative = 100 * float(np.mean(np.abs(error[large] / torques[large])))
    assert relative < 1.1 * MODEL_RELATIVE_ERROR
    best = least_squares(lambda p: np.sign(angles) * p[0] * np.abs(angles) ** p[1] - torques, [4.0, 2.0])
    assert best.x == pytest.approx([4.35, 2.09], abs=0.005)
    assert rms(best.fun) == pytest.approx(0.076, abs=5e-4)
    assert rms(error) < 1.01 * rms(best.fun)


def test_the_printed_parameters_miss_the_measured_points() -> None:
    """Printed law and 2014 target give twice the torque of Fig. 8: why there are two decks."""
    angles, torques = FIG_8_NONLINEAR.T
    error = static_torque(model_of("austin2015_as_printed"), angles) - torques
    assert rms(error) > 5 * MODEL_RMSE


# Quicker: that of the other deck, below
@pytest.mark.slow
def test_cam_of_the_printed_deck_reproduces_its_target() -> None:
    """5 N·m·(e^θ − 1)/(e^53° − 1): 8.9 mN·m rms, 44 at most, where a knot of the sharp law lies.

    The cam was designed on rounded knots and acts on the sharp law, so it cannot be exact.
    """
    angles = np.radians(np.linspace(0.5, 53.0, 106))
    target = TARGET_TORQUE * np.expm1(angles) / np.expm1(TARGET_ANGLE)
    error = static_torque(model_of("austin2015_as_printed"), angles) - target
    assert rms(error) < 10e-3
    assert np.max(np.abs(error)) < 50e-3


def test_cam_of_the_figure_consistent_deck_reproduces_its_target() -> None:
    """4.35 N·m·θ^2.09: 7.8 mN·m rms, a tenth of the distance of that target to the points."""
    angles = np.radians(np.linspace(0.5, 53.0, 106))
    error = static_torque(model_of("austin2015_figure_consistent"), angles) - 4.35 * angles**2.09
    assert rms(error) < 10e-3
    assert np.max(np.abs(error)) < 30e-3


@pytest.mark.parametrize(
    ("name", "stiffness"),
    [("austin2015_soft_spring", SOFT_STIFFNESS), ("austin2015_stiff_spring", STIFF_STIFFNESS)],
)
def test_linear_springs(name: str, stiffness: float) -> None:
    angles = np.array([-0.4, 0.0, 0.3])
    assert static_torque(model_of(name), angles) == pytest.approx(stiffness * angles, rel=1e-12, abs=1e-15)


def test_soft_spring_against_its_measured_points() -> None:
    """Slope 1.74 N·m/rad, 2.5 % above the printed 1.7; residual of the line 8 mN·m."""
    angles, torques = FIG_8_SOFT.T
    slope, offset = np.polyfit(angles, torques, 1)
    assert slope == pytest.approx(SOFT_STIFFNESS, rel=0.05)
    assert rms(torques - slope * angles - offset) < 0.01
