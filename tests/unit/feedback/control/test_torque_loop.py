"""The torque controller as a flat model: against the same law typed by hand, and at its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.components import ROTATION, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.control import TorqueGains, torque_controller
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate
from tests import observed as ob

TIME = 1e-3
GAINS = TorqueGains(proportional=20.0, integral=150.0, derivative=0.05, speed_limit=30.0)


@pytest.fixture(scope="module")
def controller() -> FlatModel:
    return torque_controller(ob.bench(), gains=GAINS)


def run(controller: FlatModel, desired: np.ndarray, torque: np.ndarray, angle: np.ndarray) -> Trace:
    inputs = {"spring.torque.desired": desired, "spring.torque": torque, "motor.angle": angle}
    return simulate(controller, TIME * np.arange(len(desired)), inputs=inputs)


def by_hand(desired: np.ndarray, torque: np.ndarray, angle: np.ndarray) -> list[float]:
    """The law of the docstring, without limits."""
    g, currents = GAINS, []
    before = speed = error_before = rate = integral = slow = 0.0
    stiff = ob.INERTIA * 2.0 * math.pi * g.velocity_bandwidth
    for wanted, has, at in zip(desired, torque, angle, strict=True):
        keep = math.exp(-2.0 * math.pi * g.speed_bandwidth * TIME)
        speed = keep * speed + (1.0 - keep) * (at - before) / TIME
        error = wanted - has
        keep = math.exp(-2.0 * math.pi * g.derivative_bandwidth * TIME)
        rate = keep * rate + (1.0 - keep) * (error - error_before) / TIME
        command = g.proportional * error + integral + g.derivative * rate
        currents.append((stiff * (command - speed) + slow + g.compensation * has) / ob.CONSTANT)
        integral += TIME * g.integral * error
        slow += TIME * 2.0 * math.pi * g.velocity_integral * stiff * (command - speed)
        before, error_before = at, error
    return currents


def test_it_is_the_law_that_is_written_down(controller: FlatModel) -> None:
    time = TIME * np.arange(300)
    desired, torque = 0.3 * np.sin(20.0 * time), 0.25 * np.sin(20.0 * time - 0.2)
    angle = 0.1 * np.sin(20.0 * time + 0.1) - 0.1 * np.sin(0.1)
    found = run(controller, desired, torque, angle)["motor.current"]
    assert np.max(np.abs(found)) < 20.0  # within the limit
    assert found == pytest.approx(by_hand(desired, torque, angle), rel=1e-9, abs=1e-12)


def test_names_and_units(controller: FlatModel) -> None:
    assert [v.name for v in controller.inputs] == ["spring.torque.desired", "spring.torque", "motor.angle"]
    assert [v.name for v in controller.outputs] == ["motor.current"]
    names = [
        v.name for v in controller.inputs + controller.outputs + controller.states + controller.parameters
    ]
    assert len(set(names)) == len(names)
    for v in controller.inputs + controller.outputs + controller.states + controller.parameters:
        parse_unit(v.unit)
    # The drive's own numbers keep name, value and source.
    assert controller.values["motor.inertia"] == ob.INERTIA
    assert controller.values["controller.proportional"] == 20.0


def test_gains_are_parameters(controller: FlatModel) -> None:
    slower = controller.with_values({"controller.proportional": 10.0, "controller.integral": 0.0})
    ones = np.ones(3)
    currents = [run(c, 0.1 * ones, 0.0 * ones, 0.0 * ones)["motor.current"][0] for c in (controller, slower)]
    derivative = (
        GAINS.derivative * (1.0 - math.exp(-2.0 * math.pi * GAINS.derivative_bandwidth * TIME)) * 0.1 / TIME
    )
    assert currents[0] - currents[1] == pytest.approx(
        ob.INERTIA * 2.0 * math.pi * 60.0 * 10.0 * 0.1 / ob.CONSTANT, rel=1e-9
    )
    assert derivative > 0.0


def test_the_current_keeps_its_limit_and_nothing_winds_up(controller: FlatModel) -> None:
    count = 2000
    desired = np.concatenate([np.full(count, 50.0), np.full(200, -0.01)])
    zero = np.zeros(len(desired))
    found = run(controller, desired, zero, zero)
    assert np.max(found["motor.current"]) == 20.0
    assert np.max(found["motor.speed.desired"]) == GAINS.speed_limit
    # Two seconds at the limit: without care the integral would be 150·50·2 = 15000 rad/s.
    assert abs(found["torque_loop.integral"][count]) < 10.0
    assert abs(found["velocity_loop.integral"][count]) < 2.0 * ob.CONSTANT * 20.0
    assert np.min(np.abs(found["motor.current"][count + 1 : count + 60])) < 20.0


def test_a_free_integrator_does_integrate(controller: FlatModel) -> None:
    count = 100
    found = run(controller, np.full(count, 0.02), np.zeros(count), np.zeros(count))
    assert found["torque_loop.integral"][-1] == pytest.approx(0.02 * 150.0 * (count - 1) * TIME, rel=1e-9)


def test_bad_settings() -> None:
    with pytest.raises(ValueRangeError, match="proportional"):
        TorqueGains(proportional=-1.0)
    with pytest.raises(ValueRangeError, match="speed_limit"):
        TorqueGains(speed_limit=math.nan)
    with pytest.raises(ValueRangeError, match="sample_time"):
        torque_controller(ob.bench(), sample_time=0.0)
    free = flatten(
        assembly(
            "free", motor=Inertia(inertia=1e-3), spring=tie(Spring(stiffness=1.0, domain=ROTATION), "motor")
        )
    )
    with pytest.raises(ArrangementError, match="needs the motor, but there is none in 'motor'"):
        torque_controller(free)
