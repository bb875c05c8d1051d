"""Faults of motor, encoder and cam against closed forms, geometry and another spline."""

from __future__ import annotations

import cmath
import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad, trapezoid
from scipy.interpolate import BSpline

from nlsdesign.components import (
    CamWithProfileError,
    ClockDrift,
    CommandCompression,
    CommandSaturation,
    DriveDelay,
    Driven,
    DrivePart,
    DriveSaturation,
    Eccentricity,
    Element,
    EncoderOffset,
    GearedMotor,
    GradualSaturation,
    Inertia,
    LoadNonlinearity,
    SpotFriction,
    Spring,
    TorqueConstantDrift,
    WavyFriction,
    WindingHeat,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import Assembly, assembly
from nlsdesign.components.sensing.sensors import Sensor
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.model.transform import with_outputs
from nlsdesign.simulation import simulate

MOTOR = {"inertia": 0.01, "gear_ratio": 25.0, "torque_constant": 0.03}
TORQUE_PER_AMPERE = 0.75


def driven(**chain: DrivePart) -> Assembly:
    return assembly("a", motor=GearedMotor(**MOTOR, chain=tuple(chain.items())))


def test_a_delayed_motor_has_the_phase_of_its_delay() -> None:
    model = flatten(driven(delay=DriveDelay(delay=5e-3)))
    opened = with_outputs(model, ["motor.drive_torque"])
    system = linearise(opened, model.start(model.states), [0.0]).to_control()
    for omega in (1.0, 20.0, 100.0):
        response = complex(system(1j * omega))
        exact = TORQUE_PER_AMPERE * cmath.exp(-1j * omega * 5e-3)
        assert abs(response - exact) < 2.0 * TORQUE_PER_AMPERE * (omega * 5e-3) ** 5 / 720 + 1e-12


def test_a_saturating_motor_follows_its_curve() -> None:
    model = flatten(driven(iron=DriveSaturation(saturation_current=4.0)))
    for current in (-9.0, -0.01, 0.0, 4.0, 15.0):
        found = model.evaluate([0.0, 0.0], [current])
        torque = TORQUE_PER_AMPERE * 4.0 * math.sin(math.atan(current / 4.0))
        assert found["motor.drive_torque"] == pytest.approx(torque, rel=1e-12, abs=1e-15)
        assert found["motor.acceleration"] == pytest.approx(torque / 0.01, rel=1e-12, abs=1e-12)
    # The current is held within its limit before the iron saturates.
    beyond = model.evaluate([0.0, 0.0], [1e3])["motor.drive_torque"]
    assert beyond == model.evaluate([0.0, 0.0], [20.0])["motor.drive_torque"]


@pytest.mark.parametrize("order", [("delay", "iron"), ("iron", "delay")])
def test_a_late_motor_that_saturates_is_both_in_any_order(order: tuple[str, str]) -> None:
    """Under a slow sine of 1.5 times the saturation current: n·k_T·I_s·sin(arctan(I(t − τ)/I_s))."""
    delay, saturation, speed = 4e-3, 4.0, 2 * math.pi * 5.0
    parts = {"delay": DriveDelay(delay=delay), "iron": DriveSaturation(saturation_current=saturation)}
    model = flatten(driven(**{name: parts[name] for name in order}))
    times = np.linspace(0.0, 0.6, 1201)
    run = simulate(model, times, inputs={"motor.current": lambda t: 6.0 * math.sin(speed * t)})
    earlier = 6.0 * np.sin(speed * (times - delay))
    expected = TORQUE_PER_AMPERE * saturation * np.sin(np.arctan(earlier / saturation))
    settled = times > 0.1
    error = np.abs(run["motor.drive_torque"] - expected)[settled]
    # Behind the iron the wave has harmonics k, each with a phase error below (kωτ)⁵/720.
    amplitudes = 2.0 * np.abs(np.fft.rfft(expected[-401:-1])) / 400
    harmonics = np.arange(1, 20)
    bound = amplitudes[harmonics] @ np.minimum((harmonics * speed * delay) ** 5 / 720, 2.0)
    assert np.max(error) < 1.2 * bound + 1e-6
    at_once = TORQUE_PER_AMPERE * saturation * np.sin(np.arctan(6.0 * np.sin(speed * times) / saturation))
    assert np.max(np.abs(run["motor.drive_torque"] - at_once)[settled]) > 0.1


def test_a_motor_takes_only_parts_of_a_drive() -> None:
    with pytest.raises(ArrangementError, match=r"'spring' of GearedMotor.*is a Spring"):
        driven(spring=Spring(stiffness=1.0))  # type: ignore[arg-type]
    with pytest.raises(ArrangementError, match=r"name 'inertia'.*is taken"):
        driven(inertia=DriveDelay(delay=1e-3))


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
    disc = Eccentricity(
        of="wheel.angle",
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


def test_an_encoder_whose_zero_is_off_reads_as_much_too_much_everywhere() -> None:
    off = EncoderOffset(of="wheel.angle", offset=0.02)
    model = flatten(assembly("a", wheel=Inertia(inertia=1.0), dial=off))
    for angle in (-0.7, 0.0, 0.4):
        reading = model.evaluate([angle, 0.0])["dial.reading"]
        assert reading == pytest.approx(angle + 0.02)
        assert float(off.infer(_Plain(off), ca.SX(reading))) == pytest.approx(angle)
    assert off.recorded(np.arange(2.0), np.array([0.0, 0.3]), np.random.default_rng(0))[1] == 0.32


def test_a_disc_on_the_motor_turns_with_the_gear() -> None:
    disc = Eccentricity(of="wheel.angle", sine=2e-3, cosine=0.0, order=25.0)
    model = flatten(assembly("a", wheel=Inertia(inertia=1.0), dial=disc))
    reading = model.evaluate([0.3, 0.0])["dial.reading"]
    assert reading - 0.3 == pytest.approx(2e-3 * math.sin(7.5), abs=2e-9)


def test_extension_of_a_misshapen_cam_is_the_integral_of_its_lever_arm() -> None:
    drawn, error = (0.016, 0.014, 0.013, 0.013, 0.014, 0.015), (0.0, 4e-4, 9e-4, -2e-4, 1e-4)
    cam = CamWithProfileError(lever_arm=drawn, last_angle=0.9, changeover=1e-6, error=error)
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


def torques(part: DrivePart, current: float, times: np.ndarray) -> np.ndarray:
    """Torque of the motor with one part in its drive, under a steady current."""
    run = simulate(flatten(driven(part=part)), times, inputs={"motor.current": lambda t: current})
    return np.asarray(run["motor.drive_torque"])


@pytest.mark.parametrize("current", [-9.0, -0.01, 0.0, 4.0, 15.0])
def test_what_falls_with_the_command_follows_its_curve(current: float) -> None:
    iron = flatten(driven(part=CommandSaturation(saturation=4.0)))
    found = iron.evaluate([0.0, 0.0], [current])["motor.drive_torque"]
    assert found == pytest.approx(TORQUE_PER_AMPERE * 4.0 * math.sin(math.atan(current / 4.0)), abs=1e-12)
    gradual = flatten(driven(part=GradualSaturation(saturation=4.0)))
    found = gradual.evaluate([0.0, 0.0], [current])["motor.drive_torque"]
    # The gain falls as 1/(1 + (u/u_s)²); the effort is its integral.
    sum_of_gains = quad(lambda u: 1.0 / (1.0 + (u / 4.0) ** 2), 0.0, current, epsabs=1e-13)[0]
    assert found == pytest.approx(TORQUE_PER_AMPERE * sum_of_gains, abs=1e-12)
    # A source whose inner resistance is |u|/u_h of the load: of u that share is left.
    weak = flatten(driven(part=CommandCompression(halving=4.0)))
    found = weak.evaluate([0.0, 0.0], [current])["motor.drive_torque"]
    inner = abs(current) / 4.0
    assert found == pytest.approx(TORQUE_PER_AMPERE * current * (1.0 / (1.0 + inner)), abs=1e-12)


def test_a_winding_warms_as_a_body_with_one_time_constant() -> None:
    times, cooling = np.linspace(0.0, 6.0, 601), 2.0
    found = torques(WindingHeat(halving=10.0, cooling_time=cooling), 5.0, times)
    heat = 0.25 * (1.0 - np.exp(-times / cooling))
    assert found == pytest.approx(TORQUE_PER_AMPERE * 5.0 / (1.0 + heat), rel=1e-5)


def test_a_torque_constant_drifts_along_its_curve() -> None:
    times = np.linspace(0.0, 6.0, 61)
    line = torques(TorqueConstantDrift(drift=0.02), 5.0, times)
    assert line == pytest.approx(TORQUE_PER_AMPERE * 5.0 * (1.0 + 0.02 * times), rel=1e-5)
    settled = torques(TorqueConstantDrift(drift=0.02, settling_time=0.5), 5.0, times)
    assert settled[-1] == pytest.approx(TORQUE_PER_AMPERE * 5.0 * 1.01, rel=1e-4)


def test_a_cell_is_off_most_in_the_middle_of_its_scale() -> None:
    cell = LoadNonlinearity(of="spring.force", nonlinearity=0.04, full_scale=200.0)
    loads = np.linspace(-200.0, 200.0, 401)
    readings = cell.recorded(np.arange(401.0), loads, np.random.default_rng(1))
    line = loads * readings[-1] / 200.0
    assert np.max(np.abs(readings - line)) == pytest.approx(0.04 * 200.0 / 4.0, rel=1e-3)
    numbers = _Plain(cell)
    behind = [float(ca.DM(ca.evalf(cell.infer(numbers, ca.SX(each))))) for each in readings[::40]]
    assert behind == pytest.approx(loads[::40], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("rate", [-2e-3, 2e-3])
def test_a_clock_that_loses_time_reads_an_earlier_value(rate: float) -> None:
    machine = assembly(
        "a",
        grip=Driven(),
        spring=tie(Spring(stiffness=Quantity(1.0, "N*m/rad")), "grip"),
        cell=ClockDrift(of="spring.torque", rate=rate),
    )
    omega, times = 10.0, np.linspace(0.0, 3.0, 1501)
    run = simulate(
        flatten(machine),
        times,
        inputs={
            "grip.angle": lambda t: math.sin(omega * t),
            "grip.speed": lambda t: omega * math.cos(omega * t),
        },
    )
    error = run["cell.reading"] - np.sin(omega * times * (1.0 - rate))
    assert np.max(np.abs(error)[100:]) < 2e-4
    assert np.max(np.abs(run["cell.reading"] - np.sin(omega * times))) > 0.05


SPOT = SpotFriction(sliding_effort=0.2, place=0.3, width=0.05).smooth(1e-4)
WAVY = WavyFriction(sliding_effort=0.2, sine=0.05, cosine=0.1).smooth(1e-4)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(
    ("law", "low", "high", "expected"),
    [(SPOT, -0.7, 1.3, 0.2 * 0.05 * math.sqrt(math.pi)), (WAVY, 0.0, 2.0 * math.pi, 2.0 * math.pi * 0.2)],
)
def test_friction_of_a_place_takes_its_work(
    law: Element, low: float, high: float, expected: float, sense: float
) -> None:
    model = flatten(assembly("a", shaft=Inertia(inertia=1.0), rub=tie(law, "shaft")))
    angles = np.linspace(low, high, 401)
    torque = [sense * model.evaluate([a, sense])["rub.torque"] for a in angles]
    assert trapezoid(torque, angles) == pytest.approx(expected, rel=1e-6)
