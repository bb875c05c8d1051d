"""Faults of motor, encoder and cam against closed forms, geometry and another spline."""

from __future__ import annotations

import cmath
import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import BSpline

from nlsdesign.components import (
    DelayedMotor,
    EccentricEncoder,
    Inertia,
    MisshapenCam,
    SaturatingMotor,
    Spring,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.sensing.sensors import Sensor
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.model.transform import with_outputs

MOTOR = {"inertia": 0.01, "gear_ratio": 25.0, "torque_constant": 0.03}
TORQUE_PER_AMPERE = 0.75


def test_a_delayed_motor_has_the_phase_of_its_delay() -> None:
    model = flatten(assembly("a", motor=DelayedMotor(**MOTOR, delay=5e-3)))
    opened = with_outputs(model, ["motor.drive_torque"])
    system = linearise(opened, model.start(model.states), [0.0]).to_control()
    for omega in (1.0, 20.0, 100.0):
        response = complex(system(1j * omega))
        exact = TORQUE_PER_AMPERE * cmath.exp(-1j * omega * 5e-3)
        assert abs(response - exact) < 2.0 * TORQUE_PER_AMPERE * (omega * 5e-3) ** 5 / 720 + 1e-12


def test_a_saturating_motor_follows_its_curve() -> None:
    model = flatten(assembly("a", motor=SaturatingMotor(**MOTOR, saturation_current=4.0)))
    for current in (-9.0, -0.01, 0.0, 4.0, 15.0):
        found = model.evaluate([0.0, 0.0], [current])
        torque = TORQUE_PER_AMPERE * 4.0 * math.sin(math.atan(current / 4.0))
        assert found["motor.drive_torque"] == pytest.approx(torque, rel=1e-12, abs=1e-15)
        assert found["motor.acceleration"] == pytest.approx(torque / 0.01, rel=1e-12, abs=1e-12)
    # The current is held within its limit before the iron saturates.
    beyond = model.evaluate([0.0, 0.0], [1e3])["motor.drive_torque"]
    assert beyond == model.evaluate([0.0, 0.0], [20.0])["motor.drive_torque"]


class _Plain:
    """Gives the numbers of a sensor instead of symbols."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor

    def parameter(self, name: str) -> ca.SX:
        return ca.SX(getattr(self._sensor, name).number)

    def memory(self, name: str) -> ca.SX:
        raise AssertionError(f"an encoder has no state {name}")


def test_an_eccentric_disc_reads_what_geometry_says() -> None:
    """A disc whose centre is off by e turns; the head at radius R sees the mark in its line of sight."""
    radius, offset, place = 20.0, 0.15, 0.7  # mm, mm, rad
    share = offset / radius
    # error = share·sin(θ + place) − share·sin(place), to first order in the share
    disc = EccentricEncoder(
        of="wheel.angle",
        quantum=1e-9,
        sine=share * math.cos(place),
        cosine=share * math.sin(place),
    )
    model = flatten(assembly("a", wheel=Inertia(inertia=1.0), dial=disc))

    def seen(angle: float) -> float:
        centre = offset * cmath.exp(1j * (angle + place))
        return angle - cmath.phase(radius - centre)

    for angle in np.linspace(-1.2, 1.2, 13):
        reading = model.evaluate([float(angle), 0.0])["dial.reading"]
        assert reading == pytest.approx(seen(float(angle)) - seen(0.0), abs=2.0 * share**2)
        back = float(disc.infer(_Plain(disc), ca.SX(reading)))
        assert back == pytest.approx(angle, abs=2.0 * share**4 + 2e-9)


def test_a_disc_on_the_motor_turns_with_the_gear() -> None:
    disc = EccentricEncoder(of="wheel.angle", quantum=1e-9, sine=2e-3, cosine=0.0, order=25.0)
    model = flatten(assembly("a", wheel=Inertia(inertia=1.0), dial=disc))
    reading = model.evaluate([0.3, 0.0])["dial.reading"]
    assert reading - 0.3 == pytest.approx(2e-3 * math.sin(7.5), abs=2e-9)


def test_extension_of_a_misshapen_cam_is_the_integral_of_its_lever_arm() -> None:
    drawn, error = (0.016, 0.014, 0.013, 0.013, 0.014, 0.015), (0.0, 4e-4, 9e-4, -2e-4, 1e-4)
    cam = MisshapenCam(lever_arm=drawn, last_angle=0.9, changeover=1e-6, error=error)
    spring = tie(through(cam, cable=Spring(stiffness=1e3)), "wheel")
    model = flatten(assembly("a", wheel=Inertia(inertia=1.0), spring=spring))

    def spline(values: tuple[float, ...]) -> BSpline:
        step = 0.9 / (len(values) - 3)
        return BSpline((np.arange(len(values) + 4) - 3) * step, np.array(values), 3, extrapolate=False)

    curves = spline(drawn), spline(error)
    for angle in (0.1, 0.37, 0.62, 0.88):
        arm, extension = (
            sum(float(c(angle)) for c in curves),
            sum(quad(c, 0.0, angle, limit=200)[0] for c in curves),
        )
        for sign in (1.0, -1.0):
            found = model.evaluate([sign * angle, 0.0])
            assert found["spring.cam.lever_arm_now"] == pytest.approx(sign * arm, rel=1e-5)
            assert found["spring.cable.extension"] == pytest.approx(extension, rel=1e-4)
