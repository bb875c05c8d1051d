"""What dry friction does to angle and speed within one sample of the observer, against a fine integration."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.feedback.observer import CascadeGain, FixedGrid, ObserverDesign, design_observer_with_details
from nlsdesign.model import flatten
from tests import observed as ob

TIME = 1e-3
FRICTION = 0.2  # N·m, of the motor
GRID = FixedGrid(-0.2, 0.2, points=41)


@pytest.fixture(scope="module")
def designs() -> dict[bool, ObserverDesign]:
    """The same observer with and without dry friction in its plant."""
    actuators = {True: ob.actuator(ob.SLOW, friction=FRICTION), False: ob.actuator(ob.SLOW)}
    return {
        braked: design_observer_with_details(flatten(each), sample_time=TIME, gain=CascadeGain(), grid=GRID)
        for braked, each in actuators.items()
    }


def expected_angle(design: ObserverDesign, speed: float) -> float:
    """Return the angle that an observer expects one sample after it was at zero angle with a speed."""
    model = design.model
    state = [{"motor.speed.memory": speed}.get(v.name, 0.0) for v in model.states]
    angle = 0.05
    found = model.evaluate(state, [angle if v.name == "motor.angle" else 0.0 for v in model.inputs])
    return angle - found["motor.angle.innovation"]


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_friction_moves_the_angle_by_what_it_takes_from_the_speed(
    designs: dict[bool, ObserverDesign], speed: float
) -> None:
    """ω̇ = −(τ/J)·sign ω for one sample: the angle falls behind ω₀·T by the integral of what is lost."""
    steps = 1000
    time, rate = np.linspace(0.0, TIME, steps + 1), -np.sign(speed) * FRICTION / ob.INERTIA
    lost = np.trapezoid(rate * time, time)
    assert abs(rate * TIME) < 0.2 * abs(speed), "the speed stays well away from zero"
    moved = expected_angle(designs[True], speed) - expected_angle(designs[False], speed)
    assert moved == pytest.approx(lost, rel=0.02)
    assert moved * speed < 0.0, "behind, not ahead"
