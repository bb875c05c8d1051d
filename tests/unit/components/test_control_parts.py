"""The parts of a torque controller, each against its equations typed by hand, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    CoulombFriction,
    CurrentDrivenMotor,
    Dashpot,
    Driven,
    Fixed,
    Gear,
    Inertia,
    Spring,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import Assembly, assembly
from nlsdesign.feedback.control import (
    BackCalculation,
    ConditionalIntegration,
    DisturbanceObserver,
    FilteredDifference,
    FrictionCompensation,
    GivenRate,
    PidTorque,
    ScheduledTorque,
    TorqueGains,
    TorqueLaw,
    VelocityLoop,
    check_torque,
    largest_torque,
    torque_controller,
)
from nlsdesign.feedback.control.laws.known_drive import torque_limit
from nlsdesign.feedback.control.laws.law_writer import AntiWindup
from nlsdesign.feedback.control.laws.torque_loop import largest_speed, rate_remarks
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import Trace, simulate
from tests import observed as ob

TIME = 1e-3
STIFFNESS = 2.5


def run(controller: FlatModel, **inputs: np.ndarray) -> Trace:
    names = {v.name.replace(".", "_"): v.name for v in controller.inputs}
    given = {names[key]: values for key, values in inputs.items()}
    step = controller.sample_time or 0.0
    return simulate(controller, step * np.arange(len(next(iter(given.values())))), inputs=given)


def linear_bench(*ends: str, **parts: object) -> FlatModel:
    """The drive of the published actuator with a linear spring, which knows no cam."""
    machine = dict(ob.actuator(friction=0.02).parts)
    machine["spring"] = tie(Spring(stiffness=STIFFNESS, domain=ROTATION), *(ends or ("motor", "load")))
    return flatten(assembly("linear", **(machine | parts)))


def direct_drive(**parts: object) -> Assembly:
    """A motor that declares its winding, on a shaft with a rigid gear; one turn of the spring per three."""
    motor = CurrentDrivenMotor(
        inertia=2e-5, torque_constant=0.05, resistance=0.4, current_limit=15.0, voltage_limit=12.0
    )
    machine = {
        "rotor": motor,
        "output": Inertia(inertia=9e-5),
        "train": Gear(between=("rotor", "output"), ratio=3.0),
        "wall": Fixed(),
        "coil": tie(Spring(stiffness=STIFFNESS, domain=ROTATION), "output", "wall"),
        "oil": tie(Dashpot(damping=6e-4, domain=ROTATION), "output"),
    }
    return assembly("direct", **(machine | parts))


# --- the PID as it was before it was made of parts ----------------------------------------------------


def pid_by_hand(desired: np.ndarray, torque: np.ndarray, angle: np.ndarray, g: TorqueGains) -> list[float]:
    """The law of ``TorqueGains`` with its limits, typed again in plain numbers."""
    before = speed = error_before = rate = integral = slow = 0.0
    stiff = ob.INERTIA * 2.0 * math.pi * g.velocity_bandwidth
    currents = []
    for wanted, has, at in zip(desired, torque, angle, strict=True):
        keep = math.exp(-2.0 * math.pi * g.speed_bandwidth * TIME)
        speed = keep * speed + (1.0 - keep) * (at - before) / TIME
        error = wanted - has
        keep = math.exp(-2.0 * math.pi * g.derivative_bandwidth * TIME)
        rate = keep * rate + (1.0 - keep) * (error - error_before) / TIME
        asked = g.proportional * error + integral + g.derivative * rate
        command = min(max(asked, -g.speed_limit), g.speed_limit)
        wanted_current = (stiff * (command - speed) + slow + g.compensation * has) / ob.CONSTANT
        current = min(max(wanted_current, -20.0), 20.0)
        currents.append(current)
        beyond_speed, beyond_current = asked - command, wanted_current - current
        if error * beyond_speed <= 0.0 and error * beyond_current <= 0.0:
            integral += TIME * g.integral * error
        if (command - speed) * beyond_current <= 0.0:
            slow += TIME * 2.0 * math.pi * g.velocity_integral * stiff * (command - speed)
        before, error_before = at, error
    return currents


def test_the_gains_give_the_law_that_they_always_gave_also_at_the_limits() -> None:
    time = TIME * np.arange(1500)
    desired = 6.0 * np.sin(9.0 * time) + 0.5 * np.sign(np.sin(41.0 * time))
    torque, angle = 2.0 * np.sin(9.0 * time - 0.5), 0.9 * np.sin(9.0 * time - 0.5) + 0.9 * np.sin(0.5)
    gains = TorqueGains(derivative=0.02, speed_limit=40.0)
    controller = torque_controller(ob.bench(), gains=gains)
    found = run(controller, spring_torque_desired=desired, spring_torque=torque, motor_angle=angle)
    expected = pid_by_hand(desired, torque, angle, gains)
    limited = np.mean(np.abs(expected) == 20.0)
    assert 0.05 < limited < 0.95
    assert found["motor.current"] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_gains_in_one_list_are_the_same_parts() -> None:
    plant, gains = ob.bench(), TorqueGains(proportional=20.0)
    one = torque_controller(plant, gains=gains)
    other = torque_controller(plant, law=gains.law, velocity=gains.velocity)
    assert one.values == other.values
    with pytest.raises(ArrangementError, match="are those of a PID law"):
        torque_controller(plant, gains=gains, law=PidTorque())


def test_by_default_speed_by_tangent_stiffness_or_a_pid_that_says_why() -> None:
    """The inputs stay the same: with a moved load the scheduled law wants the angle of the spring."""
    fixed = ob.bench()
    default, asked = (torque_controller(fixed, law=law) for law in (None, ScheduledTorque()))
    assert (default.values, default.description) == (asked.values, asked.description)
    moved = torque_controller(flatten(ob.actuator(load=Driven())))
    assert "controller.proportional" in moved.values
    assert "would have to be given spring.angle as well" in moved.description
    assert {v.name for v in moved.inputs} == {v.name for v in default.inputs}
    asked_for = torque_controller(fixed, law=PidTorque())
    assert "would have to be given" not in asked_for.description


# --- the scheduled law ------------------------------------------------------------------------------------


def scheduled_by_hand(desired: np.ndarray, torque: np.ndarray, floor: float) -> list[float]:
    """Speed command for a linear spring: (dT_d/dt + ω_c·e)/√(k² + k₀²)."""
    before = rate = 0.0
    commands = []
    for wanted, has in zip(desired, torque, strict=True):
        keep = math.exp(-2.0 * math.pi * 150.0 * TIME)
        rate = keep * rate + (1.0 - keep) * (wanted - before) / TIME
        before = wanted
        asked = (rate + 2.0 * math.pi * 8.0 * (wanted - has)) / math.hypot(STIFFNESS, floor)
        commands.append(min(max(asked, -30.0), 30.0))
    return commands


def test_the_scheduled_law_is_what_is_written_down() -> None:
    time = TIME * np.arange(400)
    desired, torque = 2.0 * np.sin(40.0 * time), 1.7 * np.sin(40.0 * time - 0.3)
    law = ScheduledTorque(bandwidth=8.0, stiffness_floor=0.7, speed_limit=30.0)
    controller = torque_controller(linear_bench(), law=law)
    found = run(controller, spring_torque_desired=desired, spring_torque=torque, motor_angle=0.0 * time)
    expected = scheduled_by_hand(desired, torque, 0.7)
    assert np.max(np.abs(expected)) == 30.0
    assert found["motor.speed.desired"] == pytest.approx(expected, rel=1e-6)


def test_the_acceleration_known_beforehand_is_that_of_the_feedforward() -> None:
    """A desired torque that grows as t² wants the constant acceleration T̈_d/k."""
    time = TIME * np.arange(200)
    desired = 4.0 * time**2
    inner = VelocityLoop(integral=0.0, friction=None, compensation=0.0)
    laws = [ScheduledTorque(stiffness_floor=0.0, acceleration_share=share) for share in (0.0, 1.0)]
    currents = [
        run(
            torque_controller(linear_bench(), law=law, velocity=inner),
            spring_torque_desired=desired, spring_torque=desired, motor_angle=0.0 * time,
        )["motor.current"][-1]
        for law in laws
    ]  # fmt: skip
    assert currents[1] - currents[0] == pytest.approx(ob.INERTIA * 8.0 / STIFFNESS / ob.CONSTANT, rel=1e-6)


def test_the_rate_may_be_given() -> None:
    law = ScheduledTorque(rate=GivenRate(), stiffness_floor=0.0)
    controller = torque_controller(linear_bench(), law=law)
    assert [v.name for v in controller.inputs][3] == "spring.torque.desired.rate"
    zero = np.zeros(3)
    found = run(
        controller, spring_torque_desired=zero, spring_torque=zero, motor_angle=zero,
        spring_torque_desired_rate=np.full(3, 5.0),
    )  # fmt: skip
    assert found["motor.speed.desired"] == pytest.approx(5.0 / STIFFNESS)


def test_the_stiffness_is_the_slope_of_the_torque_at_rest() -> None:
    """T(θ) = 2·h(θ)·F*(δ(θ)) typed by hand, differenced, at angles between the corners of its law."""
    controller = torque_controller(ob.bench(), law=ScheduledTorque())
    (table,) = controller.tables
    assert table.argument == "motor.angle"

    def torque(angle: float) -> float:
        fine = np.linspace(0.0, angle, 4001)
        extension = float(np.trapezoid(ob.lever_arm(fine), fine))
        return ob.ELEMENTS * float(ob.lever_arm(np.array(angle))) * ob.equilibrium_force(extension)

    for angle in (0.25, 0.45, 0.65, 0.95, 1.1):
        slope = (torque(angle + 1e-4) - torque(angle - 1e-4)) / 2e-4
        assert table.look_up(angle)[0] == pytest.approx(slope, rel=0.01), angle
        assert table.look_up(-angle)[0] == pytest.approx(slope, rel=0.01), angle
    assert table.look_up(0.0)[0] < 0.05
    secant = torque(1.6) / 1.6
    assert controller.values["controller.stiffness_floor"] == pytest.approx(0.2 * secant, rel=0.01)


def test_a_moved_load_has_an_angle_of_the_spring_of_its_own() -> None:
    moved = flatten(ob.actuator(load=Driven()))
    controller = torque_controller(moved, law=ScheduledTorque())
    assert [v.name for v in controller.inputs][-1] == "spring.angle"
    fixed = torque_controller(ob.bench(), law=ScheduledTorque())
    np.testing.assert_allclose(controller.tables[0].values, fixed.tables[0].values, atol=1e-9)


def test_a_spring_behind_a_gear_and_one_that_is_tied_the_other_way_round() -> None:
    geared = torque_controller(flatten(direct_drive()), law=ScheduledTorque(stiffness_floor=0.0))
    backward = torque_controller(linear_bench("load", "motor"), law=ScheduledTorque(stiffness_floor=0.0))
    for controller in (geared, backward):
        np.testing.assert_allclose(controller.tables[0].values, STIFFNESS, rtol=1e-9)
    one = np.ones(2)
    found = run(geared, coil_torque_desired=one, coil_torque=0.0 * one, rotor_angle=0.0 * one)
    first = 2.0 * math.pi * 12.0 + (1.0 - math.exp(-2.0 * math.pi * 0.15)) / TIME
    # Three turns of the motor for one of the spring.
    assert found["rotor.speed.desired"][0] == pytest.approx(3.0 * min(first / STIFFNESS, 60.0))
    found = run(backward, spring_torque_desired=one, spring_torque=0.0 * one, motor_angle=0.0 * one)
    assert found["motor.speed.desired"][0] < 0.0 < found["spring.stiffness.scheduled"][0]


def test_the_table_of_a_geared_cam_is_over_the_angle_of_the_motor() -> None:
    """What the table sums to over the angle of the spring is the torque at the end of the contour."""
    plant = flatten(declare(load_deck("one_sided_cable_drive")))
    (table,) = torque_controller(plant, law=ScheduledTorque()).tables
    assert table.argument == "motor.angle"
    assert table.lower == pytest.approx(-12.0 * math.pi / 2.0)
    cells = np.full(len(table.values), table.step / 12.0)
    cells[[0, -1]] /= 2.0
    end = 12.0 * math.pi / 2.0
    strain = "spring.cable.rope.rubber.relaxing.dashpot.strain"
    x = [end if v.name == "motor.angle" else 0.0 for v in plant.states]
    x[[v.name for v in plant.states].index(strain)] = plant.evaluate(x)["spring.cable.rope.rubber.strain"]
    assert table.values[:, 0] @ cells == pytest.approx(plant.evaluate(x)["spring.torque"], rel=2e-3)
    grid = table.lower + table.step * np.arange(len(table.values))
    assert np.all(table.values[grid < -0.5, 0] < 1e-3)  # the cable is slack


# --- velocity loop, friction, disturbance -----------------------------------------------------------------


def friction_current(plant: FlatModel, speed: float, width: float) -> float:
    """Current of the compensation alone at a commanded speed."""
    law = ScheduledTorque(rate=GivenRate(), stiffness_floor=0.0, acceleration_share=0.0)
    both = []
    for friction in (None, FrictionCompensation(width=width)):
        inner = VelocityLoop(friction=friction, integral=0.0)
        controller = torque_controller(plant, law=law, velocity=inner)
        rates = {f"{controller.inputs[0].name}.rate".replace(".", "_"): np.full(2, speed * STIFFNESS)}
        others = {v.name.replace(".", "_"): np.zeros(2) for v in controller.inputs}
        both.append(run(controller, **(others | rates))[controller.outputs[0].name][0])
    return float(both[1] - both[0])


def test_friction_is_read_off_the_equations_of_the_plant() -> None:
    plant = linear_bench()
    # Far from standstill: T_c + b·ω, half of either sign apart.
    for speed in (2.0, -2.0):
        expected = math.copysign(0.02, speed) + ob.DAMPING * speed
        assert friction_current(plant, speed, 0.01) == pytest.approx(expected / ob.CONSTANT, rel=1e-4)
    assert friction_current(plant, 0.0, 1.0) == 0.0
    s, width = math.hypot(0.5, 1.0), 1.0
    expected = (0.02 + ob.DAMPING * s) * 0.5 / s
    assert friction_current(plant, 0.5, width) == pytest.approx(expected / ob.CONSTANT, rel=1e-6)
    names = set(torque_controller(plant, law=ScheduledTorque()).values)
    assert {"dry_friction.sliding_effort", "bearing.damping", "motor.gear_ratio"} <= names


def test_friction_behind_a_rigid_gear_is_that_of_the_motor() -> None:
    """A dashpot at the output is felt by the motor through the square of the ratio."""
    motor_speed = 3.0 * 4.0
    expected = 6e-4 / 9.0 * motor_speed / 0.05
    assert friction_current(flatten(direct_drive()), 4.0, 1e-3) == pytest.approx(expected, rel=1e-6)


def test_the_current_is_held_within_what_the_supply_can_push() -> None:
    controller = torque_controller(flatten(direct_drive()), law=ScheduledTorque())
    assert "voltage" not in controller.description
    count, speed = 400, 150.0
    angle = speed * TIME * np.arange(count)
    found = run(
        controller, coil_torque_desired=np.full(count, 100.0), coil_torque=np.zeros(count), rotor_angle=angle
    )["rotor.current"]
    assert found[-1] == pytest.approx((12.0 - 0.05 * speed) / 0.4, rel=1e-9)
    assert found[0] == 15.0
    assert "no voltage is limited" in torque_controller(ob.bench()).description


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_disturbance_observer_finds_what_acts_on_the_motor(delay: int) -> None:
    """An inertia that is driven by the currents as late as they act, and by 0.3 N·m from outside."""
    inner = VelocityLoop(friction=None, integral=0.0, disturbance=DisturbanceObserver(12.0, delay))
    controller = torque_controller(linear_bench(), law=PidTorque(), velocity=inner)
    x = controller.start(controller.states)
    names = [v.name for v in controller.states]
    angle = speed = 0.0
    waiting, seen = [0.0] * delay, []
    keep = math.exp(-2.0 * math.pi * 12.0 * TIME)
    for k in range(120):
        given = [0.5 * math.sin(0.3 * k), 0.0, angle]
        following, current, _, _ = controller.equations(
            0.0, x, given, controller.start(controller.parameters), []
        )
        x = np.array(following).ravel()
        seen.append(x[names.index("disturbance_observer.torque")])
        waiting.append(float(current))
        acceleration = (ob.CONSTANT * waiting.pop(0) + 0.3) / ob.INERTIA
        angle, speed = angle + TIME * speed + TIME**2 / 2.0 * acceleration, speed + TIME * acceleration
    # From the second interval on its only error is the start of its filter.
    late = np.array(seen[2:]) - 0.3
    assert late[1:] == pytest.approx(keep * late[:-1], abs=1e-9)
    assert seen[-1] == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("windup", [ConditionalIntegration(), BackCalculation()])
def test_nothing_winds_up(windup: AntiWindup) -> None:
    law, inner = PidTorque(integral=400.0, windup=windup), VelocityLoop(windup=windup)
    controller = torque_controller(ob.bench(), law=law, velocity=inner)
    count = 3000
    desired = np.concatenate([np.full(count, 50.0), np.full(100, -0.01)])
    zero = np.zeros(len(desired))
    found = run(controller, spring_torque_desired=desired, spring_torque=zero, motor_angle=zero)
    assert np.max(found["motor.current"]) == 20.0
    # Without care the integral would be 400·50·3 = 60,000 rad/s.
    assert abs(found["torque_loop.integral"][count]) < 2500.0
    assert np.min(found["motor.current"][-50:]) < 20.0


def test_back_calculation_is_the_law_that_is_written_down() -> None:
    law = PidTorque(proportional=10.0, integral=50.0, speed_limit=5.0, windup=BackCalculation(0.05))
    inner = VelocityLoop(friction=None, integral=0.0, compensation=0.0, bandwidth=1.0)
    controller = torque_controller(ob.bench(), law=law, velocity=inner)
    found = run(
        controller, spring_torque_desired=np.ones(60), spring_torque=np.zeros(60), motor_angle=np.zeros(60)
    )
    integral = [0.0]
    for _ in range(59):
        beyond = max(10.0 + integral[-1] - 5.0, 0.0)
        integral.append(integral[-1] + TIME * (50.0 - beyond / 0.05))
    assert np.max(np.abs(found["motor.current"])) < 20.0
    assert found["torque_loop.integral"] == pytest.approx(integral, rel=1e-9)


def test_the_change_of_the_command_can_be_limited() -> None:
    for law in (PidTorque(acceleration_limit=300.0), ScheduledTorque(acceleration_limit=300.0)):
        controller = torque_controller(linear_bench(), law=law)
        found = run(
            controller,
            spring_torque_desired=np.ones(80),
            spring_torque=np.zeros(80),
            motor_angle=np.zeros(80),
        )["motor.speed.desired"]
        assert np.max(np.diff(found)) == pytest.approx(0.3)
        assert found[0] == pytest.approx(0.3)


# --- what can be held, what is refused --------------------------------------------------------------------


def test_the_largest_torque_is_what_the_current_leaves_beside_friction() -> None:
    plant = linear_bench()
    assert largest_torque(plant) == pytest.approx(20.0 * ob.CONSTANT - 0.02 - ob.DAMPING, rel=1e-9)
    assert "current" in torque_limit(plant).reason
    # The supply pushes no more than (12 V − k·ω)/R through this winding, less than its 15 A at 1 rad/s.
    weak = flatten(direct_drive()).with_values({"rotor.voltage_limit": 4.0})
    assert largest_torque(weak) == pytest.approx(3.0 * 0.05 * (4.0 - 0.05) / 0.4 - 6e-4 / 3.0, rel=1e-6)
    check_torque(plant, 4.3)
    with pytest.raises(
        ValueRangeError, match=r"torque 4\.5 N·m: is more than the drive can hold, 4\.379 N·m"
    ):
        check_torque(plant, 4.5)
    with pytest.raises(ValueRangeError, match="nan"):
        check_torque(plant, math.nan)


def test_a_command_has_the_range_and_the_rate_of_the_drive() -> None:
    """By hand: k·I − friction on both sides; slope of the spring times the declared speed of the encoder."""

    def wished(plant: FlatModel, **law: Any) -> Variable:
        (wish,) = (v for v in torque_controller(plant, **law).inputs if v.name == "spring.torque.desired")
        return wish

    most = 20.0 * ob.CONSTANT - 0.02 - ob.DAMPING
    linear = wished(linear_bench())
    assert (linear.minimum, linear.maximum) == pytest.approx((-most, most), rel=1e-9)
    assert linear.largest_rate == math.inf
    deck = flatten(declare(load_deck("austin2015_soft_spring")))
    soft = wished(deck)
    assert soft.maximum == pytest.approx(most, rel=1e-9)
    assert soft.largest_rate == pytest.approx(1.7 * deck.values["motor_encoder.largest_rate"], rel=1e-6)
    cable = flatten(declare(load_deck("one_sided_cable_drive")))
    pull = wished(cable)
    assert sorted((pull.minimum, pull.maximum), key=abs) == pytest.approx([0.0, largest_torque(cable)])
    loose = wished(flatten(ob.actuator(load=Inertia(inertia=1e-3))), gains=TorqueGains())
    assert (loose.minimum, loose.maximum, loose.largest_rate) == (-math.inf, math.inf, math.inf)


def test_a_declared_rate_below_what_the_drive_reaches_is_remarked() -> None:
    """By hand: J·ω²/2 = τ·(θ − θ₀) + k·(θ₀² − θ²)/2; a simulation loses some to the rubber."""
    deck = flatten(declare(load_deck("austin2015_soft_spring")))
    stiffness, most = 1.7, 20.0 * ob.CONSTANT - 0.02 - ob.DAMPING
    end = math.pi / 2.0
    by_hand = math.sqrt(
        2.0 / 5.97e-4 * (most * 2.0 * end)
    )  # both ends of ±90° before k·θ = τ, energies alike
    assert most / stiffness > end
    assert largest_speed(deck) == pytest.approx(by_hand, rel=1e-9)

    plant = flatten(declare(load_deck("austin2015_figure_consistent")))
    reversed_ = simulate(
        plant, np.linspace(0.0, 1.05, 10501),
        inputs={"motor.current": lambda t: -20.0 * min(1.0, t / 0.4) if t < 1.0 else 20.0},
    )["motor.speed"].max()  # fmt: skip
    assert reversed_ < largest_speed(plant) < 1.05 * reversed_
    (remark,) = rate_remarks(plant)
    assert "95 rad/s, the drive reaches 171.4 rad/s" in remark
    assert "declare at least 172 rad/s" in remark
    assert rate_remarks(plant.with_values({"motor_encoder.largest_rate": 172.0})) == []


def test_the_end_of_the_contour_limits_too() -> None:
    strong = ob.bench().with_values({"motor.current_limit": 200.0})
    limit = torque_limit(strong)
    assert "contour" in limit.reason
    fine = np.linspace(0.0, 1.6, 20001)
    extension = float(np.trapezoid(ob.lever_arm(fine), fine))
    force = ob.equilibrium_force(extension)
    assert limit.torque == pytest.approx(2.0 * float(ob.lever_arm(np.array(1.6))) * force, rel=1e-3)


@pytest.mark.parametrize(
    ("law", "velocity", "sample_time", "said"),
    [
        (ScheduledTorque(bandwidth=120.0), VelocityLoop(), 1e-3, "torque loop 120 Hz.*100 Hz"),
        (PidTorque(), VelocityLoop(bandwidth=60.0), 2e-3, "velocity loop 60 Hz.*50 Hz.*72° of phase"),
        (ScheduledTorque(bandwidth=50.0), VelocityLoop(), 1e-3, "above that of the velocity loop inside, 45"),
        (PidTorque(), VelocityLoop(disturbance=DisturbanceObserver(150.0)), 1e-3, "observer 150 Hz.*100 Hz"),
        (PidTorque(windup=BackCalculation(1e-4)), VelocityLoop(), 1e-3, "below the sample time"),
        (PidTorque(), VelocityLoop(), math.nan, "sample_time"),
    ],
)
def test_what_the_sample_time_does_not_carry_is_refused(
    law: TorqueLaw, velocity: VelocityLoop, sample_time: float, said: str
) -> None:
    with pytest.raises(ValueRangeError, match=said):
        torque_controller(ob.bench(), law=law, velocity=velocity, sample_time=sample_time)


def test_defaults_are_what_the_sample_time_carries() -> None:
    slow = torque_controller(ob.bench(), law=ScheduledTorque(), sample_time=4e-3).values
    assert (slow["controller.bandwidth"], slow["controller.velocity_bandwidth"]) == (3.0, 11.25)
    assert torque_controller(ob.bench(), sample_time=2e-3).values["controller.velocity_bandwidth"] == 22.5
    fast = torque_controller(ob.bench(), law=ScheduledTorque(), sample_time=1e-4).values
    assert (fast["controller.bandwidth"], fast["controller.velocity_bandwidth"]) == (12.0, 45.0)


def test_a_part_called_controller_is_not_mixed_up_with_the_settings() -> None:
    named = tie(Dashpot(damping=1e-4, domain=ROTATION), "controller")
    parts = dict(ob.actuator().parts)
    motor = parts.pop("motor")
    machine = {
        "controller": motor,
        "spring": tie(parts["spring"].element, "controller", "load"),
        "oil": named,
    }
    plant = flatten(assembly("odd", load=Fixed(), **machine))
    controller = torque_controller(plant, law=ScheduledTorque())
    assert controller.values["controller.inertia"] == ob.INERTIA
    assert controller.values["controller.bandwidth"] == 12.0


@pytest.mark.parametrize(
    "part",
    [
        lambda: ScheduledTorque(bandwidth=-3.0),
        lambda: ScheduledTorque(stiffness_floor=math.inf),
        lambda: VelocityLoop(bandwidth=-1.0),
        lambda: FilteredDifference(-1.0),
        lambda: FrictionCompensation(width=math.nan),
        lambda: FrictionCompensation(width=0.0),
        lambda: DisturbanceObserver(bandwidth=-1.0),
        lambda: DisturbanceObserver(delay=-1),
        lambda: BackCalculation(0.0),
        lambda: PidTorque(acceleration_limit=-1.0),
    ],
)
def test_a_setting_out_of_range_is_refused(part: object) -> None:
    with pytest.raises(ValueRangeError):
        part()  # type: ignore[operator]


def test_a_load_that_nothing_holds_is_named() -> None:
    loose = flatten(ob.actuator(load=Inertia(inertia=1e-3)))
    with pytest.raises(ArrangementError, match=r"body 'load'.*moves freely.*Fixed load"):
        torque_controller(loose, law=ScheduledTorque())
    with pytest.raises(ArrangementError, match=r"body 'load'.*no torque can be held"):
        largest_torque(loose)


def test_a_spring_that_the_motor_does_not_turn_is_named() -> None:
    parts = dict(direct_drive().parts) | {"coil": tie(Spring(stiffness=1.0, domain=ROTATION), "far", "wall")}
    elsewhere = flatten(assembly("elsewhere", far=Inertia(inertia=1e-3), **parts))
    with pytest.raises(ArrangementError, match=r"spring 'coil'.*is not turned by the motor 'rotor'"):
        torque_controller(elsewhere)


def test_every_law_has_finite_slopes_at_rest() -> None:
    everything = VelocityLoop(disturbance=DisturbanceObserver(), windup=BackCalculation())
    for law in (PidTorque(windup=BackCalculation()), ScheduledTorque(), ScheduledTorque(rate=GivenRate())):
        controller = torque_controller(ob.bench(friction=0.02), law=law, velocity=everything)
        for angle in (0.0, 0.3, 0.9):
            before = {"motor.angle.previous": angle, "torque_loop.desired.previous": 0.5}
            x = [before.get(v.name, 0.0) for v in controller.states]
            linear = linearise(controller, x, [0.5, 0.5, angle, 0.0][: len(controller.inputs)])
            at = list(linear.inputs).index("spring.torque.desired")
            assert linear.D[0, at] > 0.0


def test_a_spring_without_stiffness_needs_a_floor() -> None:
    with pytest.raises(ValueRangeError, match=r"stiffness_floor 0 N·m/rad.*no stiffness at 0 rad"):
        torque_controller(ob.bench(), law=ScheduledTorque(stiffness_floor=0.0))
    controller = torque_controller(ob.bench(), law=ScheduledTorque())
    with pytest.raises(ValueRangeError, match="stiffness_floor"):
        controller.with_values({"controller.stiffness_floor": 0.0})


def test_sharp_friction_is_told_to_be_smoothed() -> None:
    sharp = tie(CoulombFriction(sliding_effort=0.02), "motor")
    with pytest.raises(ArrangementError, match="smooth form"):
        torque_controller(linear_bench(dry_friction=sharp), law=ScheduledTorque())
