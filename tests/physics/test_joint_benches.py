"""Weights, uneven friction, voltage motors and controllers against closed forms and equations typed here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from nlsdesign import components as c
from nlsdesign.components import ROTATION, Assembly, assembly, tie
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.model.transform import with_outputs
from nlsdesign.simulation import simulate
from tests.physics.table import Row

_HERE = "test_joint_benches.py::test_"

ROWS: tuple[Row, ...] = (
    Row(c.GravityLoad, "m·l²·θ̈ = −m·g·l·sin θ", ("simulation of a large swing", "complete elliptic integral"),
        _HERE + "the_period_of_a_large_swing_is_the_elliptic_integral"),
    Row(c.ConstantLoad, "J·ω̇ = −T₀", ("simulation", "parabola"),
        _HERE + "a_constant_torque_gives_a_parabola"),
    Row(c.AsymmetricFriction, "Newton", ("located stop", "J·ω₀/(T_c·(1 ± a))"),
        _HERE + "uneven_friction_stops_a_wheel_sooner_in_one_direction"),
    Row(c.ResistiveMotor, "k·(U − k·ω) = R·J·ω̇", ("simulation", "exponential run-up"),
        _HERE + "a_motor_without_inductance_runs_up_exponentially"),
    Row(c.DriveLag, "first-order lag", ("linearised flat model", "1/(1 + iωT)"),
        _HERE + "a_lag_has_the_response_of_one_time_constant"),
    Row(c.PositionLoop, "PID with limit", ("flat model", "Radau on the loop typed here"),
        _HERE + "a_limited_position_loop_follows_its_equations"),
    Row(c.SpeedLoop, "characteristic polynomial", ("poles of the flat cascade", "roots"),
        _HERE + "the_poles_of_a_cascade_are_the_roots_of_its_polynomial"),
)  # fmt: skip

INERTIA, CONSTANT, RESISTANCE = 2e-3, 0.5, 4.0
MOTOR = {"inertia": INERTIA, "torque_constant": CONSTANT, "resistance": RESISTANCE, "voltage_limit": 7.4}


def wheel(**ties: c.Tie) -> Assembly:
    return assembly("wheel", wheel=c.Inertia(inertia=INERTIA), **ties)


@pytest.mark.parametrize("amplitude", [0.1, 1.5, 3.0])
def test_the_period_of_a_large_swing_is_the_elliptic_integral(amplitude: float) -> None:
    mass, arm, hanging = 0.49, 0.1, 0.4
    load = c.GravityLoad(weight=c.MassOnArm(mass=mass, arm=arm, gravity=9.81), hanging_angle=hanging)
    made = assembly("a", wheel=c.Inertia(inertia=mass * arm**2), weight=tie(load, "wheel"))
    period = 4.0 * math.sqrt(arm / 9.81) * ellipk(math.sin(amplitude / 2) ** 2)
    model = flatten(made).with_values({"wheel.angle": hanging + amplitude})
    run = simulate(model, np.linspace(0.0, period, 41), tolerance=1e-10)
    assert run["wheel.angle"][-1] - hanging == pytest.approx(amplitude, abs=1e-6)
    assert run["wheel.angle"][20] - hanging == pytest.approx(-amplitude, abs=1e-6)
    given = c.GravityLoad(
        weight=c.HorizontalTorque(horizontal_torque=mass * 9.81 * arm), hanging_angle=hanging
    )
    other = flatten(made.with_part("weight", tie(given, "wheel")))
    assert other.evaluate([1.0, 0.0]) == pytest.approx(flatten(made).evaluate([1.0, 0.0]), rel=1e-12)


def test_a_constant_torque_gives_a_parabola() -> None:
    load = tie(c.ConstantLoad(load=Quantity(0.03, "N*m")), "wheel")
    run = simulate(flatten(wheel(load=load)), np.linspace(0.0, 1.0, 11))
    assert run["wheel.angle"] == pytest.approx(-0.5 * 0.03 / INERTIA * run.time**2, abs=1e-9)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_uneven_friction_stops_a_wheel_sooner_in_one_direction(sense: float) -> None:
    friction = c.AsymmetricFriction(sliding_effort=0.02, asymmetry=0.25)
    model = flatten(wheel(friction=tie(friction, "wheel"))).with_values({"wheel.speed": 5.0 * sense})
    stop = INERTIA * 5.0 / (0.02 * (1.0 + 0.25 * sense))
    run = simulate(model, np.array([0.0, 0.98 * stop, 1.02 * stop, 2.0 * stop]))
    assert run["wheel.speed"][1] * sense == pytest.approx(0.02 * 5.0, rel=1e-3)
    assert abs(run["wheel.speed"][2:]) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_uneven_friction_holds_up_to_another_torque_in_each_direction() -> None:
    friction = tie(c.AsymmetricFriction(sliding_effort=0.02, asymmetry=0.25), "wheel")
    for torque, moves in ((0.0249, False), (0.0251, True), (-0.0149, False), (-0.0151, True)):
        run = simulate(
            flatten(wheel(friction=friction)), np.linspace(0.0, 1.0, 5), inputs={"wheel.torque": torque}
        )
        assert (abs(run["wheel.angle"][-1]) > 1e-3) == moves, torque


def test_the_smooth_form_of_uneven_friction_takes_power_at_every_speed() -> None:
    friction = c.AsymmetricFriction(sliding_effort=0.02, asymmetry=-1.0).smooth(0.1)
    model = flatten(wheel(friction=tie(friction, "wheel")))
    for speed in np.linspace(-1.0, 1.0, 41):
        assert model.evaluate([0.0, speed])["friction.torque"] * speed >= 0.0
    assert model.evaluate([0.0, -5.0])["friction.torque"] == pytest.approx(-0.04, rel=1e-9)
    assert model.evaluate([0.0, 5.0])["friction.torque"] == pytest.approx(0.0, abs=1e-9)


def test_a_motor_without_inductance_runs_up_exponentially() -> None:
    model = flatten(assembly("a", motor=c.ResistiveMotor(**MOTOR)))
    run = simulate(model, np.linspace(0.0, 0.2, 21), inputs={"motor.wanted_voltage": 6.0})
    slow = CONSTANT**2 / (RESISTANCE * INERTIA)
    assert run["motor.speed"] == pytest.approx(6.0 / CONSTANT * -np.expm1(-slow * run.time), rel=1e-6)
    held = model.evaluate([0.0, 1.0], [20.0])
    assert held["motor.drive_torque"] == pytest.approx(CONSTANT * (7.4 - CONSTANT) / RESISTANCE)
    weak = flatten(assembly("a", motor=c.ResistiveMotor(**MOTOR, current_limit=0.5)))
    assert weak.evaluate([0.0, 0.0], [-6.0])["motor.drive_torque"] == pytest.approx(-0.25)


def test_a_lag_has_the_response_of_one_time_constant() -> None:
    slow = c.Inertia(inertia=INERTIA, chain=(("amplifier", c.DriveLag(time_constant=0.012)),))
    model = with_outputs(flatten(assembly("a", wheel=slow)), ["wheel.acceleration"])
    system = linearise(model, model.start(model.states), [0.0]).to_control()
    for omega in (1.0, 80.0, 900.0):
        expected = 1.0 / INERTIA / (1.0 + 1j * omega * 0.012)
        assert complex(system(1j * omega)) == pytest.approx(expected, rel=1e-9)


GAIN, DAMPING, RESET, LIMIT = 8.5, 0.6, 0.2, 3.0


def loop() -> c.PositionLoop:
    return c.PositionLoop(
        proportional=Quantity(GAIN, "V/rad"),
        limit=Quantity(LIMIT, "V"),
        rate=c.RateFeedback(derivative=Quantity(DAMPING, "V*s/rad")),
        memory=c.Integral(reset_time=RESET),
    )


@pytest.mark.slow
def test_a_limited_position_loop_follows_its_equations() -> None:
    """A goal that steps: at first the voltage is held at its limit and the memory stands still."""
    motor = c.ResistiveMotor(**MOTOR, chain=(("loop", loop()),))
    weight = tie(c.GravityLoad(weight=c.HorizontalTorque(horizontal_torque=0.2)), "motor")
    model = flatten(assembly("a", motor=motor, weight=weight))
    assert [(v.name, v.unit) for v in model.inputs] == [("motor.goal", "rad")]
    times = np.linspace(0.0, 3.0, 301)
    run = simulate(model, times, inputs={"motor.goal": 1.2}, tolerance=1e-9)

    def rates(_: float, x: np.ndarray) -> list[float]:
        angle, speed, memory = x
        error = 1.2 - angle
        wanted = GAIN * error - DAMPING * speed + memory
        volts = min(max(wanted, -LIMIT), LIMIT)
        stands = abs(wanted) > LIMIT and wanted * error > 0.0
        torque = CONSTANT * (volts - CONSTANT * speed) / RESISTANCE - 0.2 * math.sin(angle)
        return [speed, torque / INERTIA, 0.0 if stands else GAIN * error / RESET]

    hand = solve_ivp(rates, (0.0, 3.0), [0.0] * 3, "Radau", times, rtol=1e-9, atol=1e-11, max_step=1e-3)
    assert run["motor.angle"] == pytest.approx(hand.y[0], abs=2e-5)
    assert np.max(run["motor.wanted_voltage"]) == LIMIT
    assert run["motor.angle"][-1] == pytest.approx(1.2, abs=2e-3)


def test_the_poles_of_a_cascade_are_the_roots_of_its_polynomial() -> None:
    """J·s³ + K_s·s² + K_s·(K_p + 1/T_n)·s + K_s·K_p/T_n = 0."""
    outer, inner, reset = 20.0, 0.4, 0.05
    chain = (
        ("position", c.PositionLoop(proportional=Quantity(outer, "rad/s/rad"), limit=Quantity(9.0, "rad/s"))),
        ("pace", c.SpeedLoop(
            proportional=Quantity(inner, "N*m*s/rad"), limit=Quantity(9.0, "N*m"),
            memory=c.Integral(reset_time=reset),
        )),
    )  # fmt: skip
    model = flatten(assembly("a", wheel=c.Inertia(inertia=INERTIA, chain=chain)))
    found = np.linalg.eigvals(linearise(model, model.start(model.states), [1e-3]).to_control().A)
    roots = np.roots([INERTIA, inner, inner * (outer + 1.0 / reset), inner * outer / reset])
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(roots), rel=1e-9)


def test_a_controller_of_other_units_than_the_drive_is_refused() -> None:
    with pytest.raises(ArrangementError, match="part 'loop' of GearedMotor: PositionLoop gives V; here A"):
        c.GearedMotor(inertia=0.01, gear_ratio=25.0, torque_constant=0.03, chain=(("loop", loop()),))
    with pytest.raises(ArrangementError, match="by extension"):
        c.LinearDrive(mass=1.0, force_constant=1.0, voltage_limit=9.0, chain=(("loop", loop()),))
    with pytest.raises(ArrangementError, match="DriveSaturation gives A; here V"):
        c.ResistiveMotor(**MOTOR, chain=(("iron", c.DriveSaturation(saturation_current=1.0)),))
    with pytest.raises(ArrangementError, match="is a Spring, which does not lie between a command"):
        c.Inertia(inertia=1.0, chain=(("spring", c.Spring(stiffness=1.0, domain=ROTATION)),))
