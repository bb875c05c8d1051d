"""What friction takes from a speed in one sample: it stops but never turns, and rest is no exception."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.feedback.observer.scheduling.step import speed_change

LEVEL, WIDTH, SAMPLE = 40.0, 0.02, 1e-3


def braked() -> ca.Function:
    """Speed after one sample of smoothed dry friction, and its slope."""
    speed = ca.SX.sym("speed")
    after = speed + speed_change(-LEVEL * speed / ca.sqrt(speed**2 + WIDTH**2), speed, SAMPLE)
    return ca.Function("braked", [speed], [after, ca.jacobian(after, speed)])


@pytest.mark.parametrize("speed", [0.0, 1e-21, -1e-21, 1e-12, -1e-9])
def test_the_slope_at_rest_is_that_beside_it(speed: float) -> None:
    """Rounding decides whether an expected speed is zero or 1e-21 rad/s, and must not decide a covariance."""
    after, slope = map(float, braked()(speed))
    assert slope == pytest.approx(np.exp(-SAMPLE * LEVEL / WIDTH), rel=1e-6)
    assert after == pytest.approx(slope * speed, rel=1e-6)


@pytest.mark.parametrize("speed", [0.01, -0.01, 0.5, -3.0])
def test_friction_stops_a_speed_and_does_not_turn_it(speed: float) -> None:
    after = float(braked()(speed)[0])
    assert after * speed >= 0.0
    assert abs(after) < abs(speed)
