"""Typical sizes in the step of an observer, and how far its estimate is from linear, by hand."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.feedback.observer.scheduling.angle_form import (
    AngleForm,
    AngleScheduledPlant,
    Coefficients,
    ScheduledNames,
)
from nlsdesign.feedback.observer.scheduling.step import ObserverStep
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import FlatModel, Variable
from nlsdesign.model.transform import with_outputs, with_signal
from tests import observed as ob

TIME, DECAY = 1e-3, 100.0
STRAIN, ANGLE, SPEED = 0.5, 0.8, 40.0  # typical sizes


def coefficients(angles: np.ndarray) -> Coefficients:
    """ẋ = −100·x + 400·θ, θ̇ = ω, ω̇ = input; estimate 3·x + 0.5."""
    a = np.array([[-DECAY, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    count, zero = len(angles), np.zeros((len(angles), 3))
    drive = np.outer(angles, [400.0, 0.0, 0.0])
    estimate = np.tile([3.0, 0.0, 0.0, 0.5], (count, 1))
    return Coefficients(np.tile(a, (count, 1, 1)), drive, zero, estimate, zero, np.zeros((count, 0)))


@pytest.fixture(scope="module")
def step() -> ObserverStep:
    u = ca.SX.sym("u")
    plant = AngleScheduledPlant(
        name="plant",
        states=(
            Variable("x", "1", "strain"),
            Variable("angle", "rad", "angle"),
            Variable("speed", "rad/s", "speed"),
        ),
        angle="angle",
        speed="speed",
        estimate=Variable("torque", "N*m", "torque"),
        inputs=(Variable("u", "rad/s^2", "acceleration"),),
        measured=(),
        at=coefficients,
        rest=lambda angles: np.zeros((len(angles), 3)),
        driven=ca.Function("driven", [u], [u]),
        rows=(2,),
        friction=None,
        sizes=np.array([STRAIN, ANGLE, SPEED]),
        rate_bandwidth=np.inf,
        affine_error=0.0,
    )
    return ObserverStep(plant, CascadeGain(), TIME, np.linspace(-1.0, 1.0, 5))


def test_typical_sizes_of_what_the_matrices_multiply(step: ObserverStep) -> None:
    """The motion changes at a pace of 40/0.8 = 50 1/s: an innovation is 0.05 of the angle in one sample."""
    factors = step.factors()
    assert factors["correction"] == pytest.approx([0.05 * ANGLE])
    assert factors["next"] == pytest.approx([STRAIN, ANGLE, SPEED, 1.0, 50.0 * SPEED, 0.0])
    assert factors["estimate"] == pytest.approx([STRAIN, ANGLE, SPEED, 1.0])


def test_typical_sizes_of_the_sums_are_what_they_add_in_one_sample(step: ObserverStep) -> None:
    fraction = (1.0 - np.exp(-DECAY * TIME)) / (DECAY * TIME)
    largest_drive = 400.0 * (1.0 - fraction) / DECAY  # 400·∫e^(−100(T−s))·s/T ds, the end of a ramp
    expected = [largest_drive, TIME * SPEED, TIME * 50.0 * SPEED]
    scales = step.scales
    for kind in ("next", "prior", "correction"):
        assert scales[kind] == pytest.approx(expected)
    assert scales["estimate"] == pytest.approx([3.0 * STRAIN])


def squared(model: FlatModel) -> FlatModel:
    """Give out the square of the inner strain first."""
    signal = Variable("squared", "1", "square of the inner strain")
    return with_outputs(with_signal(model, signal, lambda n: n[ob.STRAIN] ** 2), ["squared", "motor.angle"])


def test_an_estimate_far_from_linear_has_no_observer() -> None:
    """Strain s₀ kept while the angle jumps to rest strain s: s₀² is off its tangent there by (s₀ − s)²."""
    model = squared(ob.bench(ob.SLOW))
    names = ScheduledNames("motor.angle", "motor.speed", 50.0, np.linspace(-0.3, 0.9, 13), {})
    # From zero strain to the largest, at 0.9 rad, and the other way round: as far off as it is large.
    assert AngleForm(model, names).affine_error() == pytest.approx(1.0, rel=1e-6)
    with pytest.raises(ValueRangeError, match="deviates by 100% of its largest value"):
        design_observer(model, estimate="squared", measured="motor.angle", grid=FixedGrid(-0.3, 0.9))
