"""What a torque loop must do by its physics: impedance below crossover, response, margin over stiffness."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.control import ClosedLoop, TorqueGains, sine_response, torque_controller, zero_torque
from nlsdesign.feedback.observer import design_observer_with_details
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests import observed as ob

MOVED = {"observer.motor.angle": "plant.spring.angle", "controller.motor.angle": "plant.motor.angle"}


def linear_loop(stiffness: float, gains: TorqueGains, *, moved: bool) -> ClosedLoop:
    bench = ob.linear_actuator(stiffness, moved=False)
    return ClosedLoop(
        plant=ob.linear_actuator(stiffness, moved=True) if moved else bench,
        observer=design_observer_with_details(bench).model,
        controller=torque_controller(bench, gains=gains),
        wires=MOVED if moved else {},
    )


@pytest.mark.long_cases("20.0-8.0", "32.0-3.4")
@pytest.mark.parametrize("stiffness", [3.4, 8.0])
@pytest.mark.parametrize("proportional", [32.0, 20.0])
def test_a_moved_load_feels_its_speed_over_the_gain(stiffness: float, proportional: float) -> None:
    """Below crossover the motor has to follow the load: T = θ_a·ω/(√2·Kp) rms, whatever the spring."""
    loop = linear_loop(stiffness, TorqueGains(proportional=proportional, integral=0.0), moved=True)
    amplitude, frequencies = np.radians(10.0), np.array([0.5, 1.0])
    found = zero_torque(loop, amplitude=amplitude, frequencies=frequencies, cycles=2).rms
    expected = amplitude * 2.0 * np.pi * frequencies / (np.sqrt(2.0) * proportional)
    assert found == pytest.approx(expected, rel=0.05)


def test_the_integrator_makes_slow_motion_softer() -> None:
    """With Ki the torque is θ_a·ω/√2/|Kp + Ki/(jω)|."""
    loop = linear_loop(3.4, TorqueGains(proportional=32.0, integral=200.0), moved=True)
    amplitude, omega = np.radians(10.0), 2.0 * np.pi * 0.5
    found = zero_torque(loop, amplitude=amplitude, frequencies=[0.5], cycles=2).rms[0]
    assert found == pytest.approx(
        amplitude * omega / np.sqrt(2.0) / abs(32.0 + 200.0 / (1j * omega)), rel=0.05
    )


def sampled_response(stiffness: float, g: TorqueGains, frequency: float) -> complex:
    """T/T_d of the linear loop in the z domain, typed by hand; one sample of delay."""
    time = 1e-3
    z = np.exp(2j * np.pi * frequency * time)
    a = np.array([[0.0, 1.0], [-stiffness / ob.INERTIA, -ob.DAMPING / ob.INERTIA]])
    whole = expm(time * np.block([[a, np.array([[0.0], [1.0 / ob.INERTIA]])], [np.zeros((1, 3))]]))
    angle_per_torque = np.linalg.solve(z * np.eye(2) - whole[:2, :2], whole[:2, 2])[0] / z
    keep = np.exp(-2.0 * np.pi * g.speed_bandwidth * time)
    speed = (1.0 - keep) / (1.0 - keep / z) * (1.0 - 1.0 / z) / time
    loop = ob.INERTIA * 2.0 * np.pi * g.velocity_bandwidth
    loop *= 1.0 + time * 2.0 * np.pi * g.velocity_integral / (z - 1.0)
    command = g.proportional + time * g.integral / (z - 1.0)
    per_desired, per_angle = (
        loop * command,
        -loop * (command * stiffness + speed) + g.compensation * stiffness,
    )
    angle = angle_per_torque * per_desired / (1.0 - angle_per_torque * per_angle)
    return stiffness * angle


@pytest.mark.parametrize(
    "gains", [TorqueGains(), TorqueGains(proportional=20.0, integral=0.0, compensation=0.0)]
)
def test_a_linear_loop_has_the_response_of_its_z_transform(gains: TorqueGains) -> None:
    frequencies = [1.0, 5.0, 12.5]
    response = sine_response(
        linear_loop(1.7, gains, moved=False), amplitude=0.3, frequencies=frequencies, cycles=5
    )
    assert response.frequency == pytest.approx(frequencies)
    expected = [sampled_response(1.7, gains, f) for f in frequencies]
    assert response.response == pytest.approx(np.array(expected), rel=2e-3)
    assert response.decibel == pytest.approx(20.0 * np.log10(np.abs(expected)), abs=0.02)
    assert np.all(response.distortion < 5e-3)


def test_an_offset_moves_the_working_point_not_the_fundamental() -> None:
    loop = linear_loop(1.7, TorqueGains(integral=0.0), moved=False)
    plain, lifted = (
        sine_response(loop, amplitude=0.3, frequencies=[2.0], offset=o, cycles=3) for o in (0.0, 0.4)
    )
    assert lifted.response == pytest.approx(plain.response, rel=1e-3)


@pytest.mark.slow
def test_a_fixed_gain_and_a_stiffening_spring_lose_their_margin() -> None:
    """At 2.8 N·m the spring of the figures is several times stiffer: Kp = 32 still holds it, Kp = 70 not."""
    plant = flatten(
        declare(load_deck("austin2015_figure_consistent")), outputs=["motor.angle", "spring.torque"]
    )
    observer, states = design_observer_with_details(plant).model, {}
    reading = "plant.motor_encoder.reading"
    for proportional in (32.0, 70.0):
        controller = torque_controller(plant, gains=TorqueGains(proportional=proportional))
        wires = {"observer.motor.angle": reading, "controller.motor.angle": reading}
        loop = ClosedLoop(plant=plant, observer=observer, controller=controller, wires=wires)
        for amplitude in (0.8, 2.8):
            found = sine_response(loop, amplitude=amplitude, frequencies=[1.0], cycles=2)
            states[proportional, amplitude] = found.verdicts[0].state
            assert np.isfinite(found.distortion[0]) == found.verdicts[0].holds
    assert states == {
        (70.0, 2.8): "limit cycle", (32.0, 2.8): "settled", (70.0, 0.8): "settled", (32.0, 0.8): "settled"
    }  # fmt: skip
