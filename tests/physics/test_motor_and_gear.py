"""Motors and gears by two roads.

Independent roads: the straight line between stall and no-load, the characteristic polynomial of the motor,
powers typed here and integrated by Simpson's rule, a gear solved case by case for the direction of power, the
same train written in another order, and a very stiff shaft instead of a rigid one.
"""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.optimize import brentq

from nlsdesign.components import (
    ROTATION,
    Assembly,
    CoulombFriction,
    CurrentDrivenMotor,
    Dashpot,
    Gear,
    GearedMotor,
    Inertia,
    LossyGear,
    Spring,
    VoltageDrivenMotor,
    parallel,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import simulate

# A motor of 150 W: Maxon RE 40, 24 V, rounded.
ROTOR, CONSTANT, RESISTANCE, INDUCTANCE = 1.4e-5, 0.0302, 0.3, 8.2e-5
CURRENT, SUPPLY = 20.0, 24.0
WINDING = {
    "inertia": ROTOR, "torque_constant": CONSTANT, "resistance": RESISTANCE, "current_limit": CURRENT,
    "voltage_limit": SUPPLY,
}  # fmt: skip


def by_voltage(**more: float) -> VoltageDrivenMotor:
    return VoltageDrivenMotor(**{**WINDING, "inductance": INDUCTANCE, **more})


def by_current(**more: float) -> CurrentDrivenMotor:
    return CurrentDrivenMotor(**{**WINDING, **more})


def integral(power: np.ndarray, times: np.ndarray) -> np.ndarray:
    return cumulative_simpson(power, x=times, initial=0.0)


# --- motors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [-1.2, -0.4, 0.0, 0.3, 0.7, 0.95, 1.0, 1.3])
def test_torque_over_speed_is_the_line_from_stall_to_no_load_under_the_current_limit(share: float) -> None:
    """Two points make the line: stall torque k·U/R at rest, none at U/k; the amplifier cuts it at I_max."""
    no_load, stall = SUPPLY / CONSTANT, CONSTANT * SUPPLY / RESISTANCE
    found = flatten(assembly("m", motor=by_current())).evaluate([0.0, share * no_load], [1e3])
    line = stall * (1.0 - share)
    assert found["motor.drive_torque"] == pytest.approx(min(line, CONSTANT * CURRENT), abs=1e-12)
    assert found["motor.voltage"] <= SUPPLY * (1 + 1e-12)
    assert found["motor.electrical_power"] == pytest.approx(
        found["motor.drive_torque"] * share * no_load + found["motor.winding_loss"], abs=1e-9
    )


@pytest.mark.parametrize("load", [0.0, 0.1, 0.4])
def test_a_motor_at_a_voltage_settles_on_the_same_line(load: float) -> None:
    made = assembly(
        "m", motor=by_voltage(), brake=Inertia(inertia=1e-9), hub=Gear(between=("motor", "brake"), ratio=1.0)
    )
    times = np.linspace(0.0, 0.6, 601)
    run = simulate(flatten(made), times, inputs={"motor.wanted_voltage": 18.0, "brake.torque": -load})
    no_load, stall = 18.0 / CONSTANT, CONSTANT * 18.0 / RESISTANCE
    assert run["motor.speed"][-1] == pytest.approx(no_load * (1.0 - load / stall), rel=1e-5)
    assert run["motor.drive_torque"][-1] == pytest.approx(load, abs=1e-6)


def test_the_current_of_a_held_rotor_rises_with_the_time_constant_of_the_winding() -> None:
    """I = U/R·(1 − e^(−tR/L)), far below the limit; a rotor of 1000 kg·m² does not move."""
    times = np.linspace(0.0, 2e-3, 201)
    model = flatten(assembly("m", motor=by_voltage(inertia=1e3)))
    run = simulate(model, times, inputs={"motor.wanted_voltage": 3.0})
    expected = 3.0 / RESISTANCE * -np.expm1(-times * RESISTANCE / INDUCTANCE)
    assert run["motor.current"] == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_the_poles_of_the_motor_are_the_roots_of_its_polynomial() -> None:
    """J·L·s² + J·R·s + k² = 0, and a root at zero for the angle."""
    model = flatten(assembly("m", motor=by_voltage()), inputs=["motor.wanted_voltage"])
    found = np.sort_complex(np.linalg.eigvals(linearise(model, [0.0, 0.0, 0.0]).to_control().A))
    roots = np.roots([ROTOR * INDUCTANCE, ROTOR * RESISTANCE, CONSTANT**2])
    assert found == pytest.approx(np.sort_complex(np.append(roots, 0.0)), rel=1e-9, abs=1e-6)


def test_the_current_never_passes_the_limit_while_the_supply_can_hold_it() -> None:
    times = np.linspace(0.0, 0.1, 5001)
    model = flatten(assembly("m", motor=by_voltage(inertia=1e-3, current_limit=12.0)))
    run = simulate(
        model, times, inputs={"motor.wanted_voltage": lambda t: 24.0 * math.copysign(1.0, math.sin(90 * t))}
    )
    assert np.max(np.abs(run["motor.current"])) <= 12.0 * (1 + 1e-6)
    assert np.max(run["motor.current"]) > 11.9
    assert np.min(run["motor.current"]) < -11.9
    assert np.max(np.abs(run["motor.voltage"])) <= SUPPLY


@pytest.mark.slow
def test_electrical_power_is_mechanical_power_heat_and_field() -> None:
    """∫U·I = ∫k·I·ω + ∫R·I² + ½L·I² at every moment, driven into both limits."""
    times = np.linspace(0.0, 0.3, 60_001)
    made = assembly(
        "m", motor=by_voltage(inertia=4e-5), spring=tie(Spring(stiffness=0.02, domain=ROTATION), "motor")
    )
    wave = {"motor.wanted_voltage": lambda t: 40.0 * math.sin(60.0 * t)}
    run = simulate(flatten(made), times, inputs=wave)
    current, speed = run["motor.current"], run["motor.speed"]
    put_in = integral(run["motor.voltage"] * current, times)
    heat = integral(RESISTANCE * current**2, times)
    field = 0.5 * INDUCTANCE * current**2
    stored = 0.5 * 4e-5 * speed**2 + 0.5 * 0.02 * run["motor.angle"] ** 2
    assert np.max(np.abs(put_in - heat - field - stored)) < 1e-5 * np.max(put_in)
    assert np.max(np.abs(run["motor.voltage"])) == pytest.approx(SUPPLY)
    assert np.max(np.abs(current)) > 0.99 * CURRENT, "both limits were met"


def test_a_slow_current_driven_motor_is_the_limit_of_no_inductance() -> None:
    """At L → 0 the motor at the voltage R·I + k·ω carries I."""
    times = np.linspace(0.0, 0.05, 501)
    ideal = simulate(
        flatten(assembly("m", motor=by_current(inertia=1e-3))), times, inputs={"motor.current": 8.0}
    )
    real = simulate(
        flatten(assembly("m", motor=by_voltage(inertia=1e-3, inductance=1e-7))),
        times, inputs={"motor.wanted_voltage": ideal["motor.voltage"]},
    )  # fmt: skip
    assert real["motor.speed"] == pytest.approx(ideal["motor.speed"], abs=1e-3 * ideal["motor.speed"][-1])


# --- gears ----------------------------------------------------------------------------------------


def test_rigidly_geared_inertias_are_one_state_pair_and_the_reflected_motor() -> None:
    """The same as a geared motor with J = n²·J_r + J_w, which is written as one body."""
    ratio, wheel = 6.0, 3e-3
    shaft = tie(
        parallel(k=Spring(stiffness=2.0, domain=ROTATION), c=Dashpot(damping=0.01, domain=ROTATION)), "wheel"
    )
    motor = by_current(voltage_limit=1e4)
    made = assembly("a", motor=motor, wheel=Inertia(inertia=wheel), shaft=shaft,
                    gear=Gear(between=("motor", "wheel"), ratio=ratio))  # fmt: skip
    model = flatten(made)
    assert [v.name for v in model.states] == ["motor.angle", "motor.speed"]
    whole = GearedMotor(inertia=wheel + ratio**2 * ROTOR, gear_ratio=ratio, torque_constant=CONSTANT)
    one = flatten(assembly("b", wheel=whole, shaft=shaft))
    times, drive = np.linspace(0.0, 1.0, 1001), lambda t: 3.0 * math.sin(25 * t)
    run = simulate(model, times, inputs={"motor.current": drive})
    expected = simulate(one, times, inputs={"wheel.current": drive})
    for name in ("wheel.angle", "wheel.speed", "shaft.torque"):
        assert run[name] == pytest.approx(expected[name], abs=1e-6 * np.ptp(expected[name]))
    assert np.max(np.abs(run["gear.loss"])) < 1e-9
    # Newton at the wheel alone: what the gear gives, less the shaft, accelerates it.
    assert run["gear.torque"] == pytest.approx(
        wheel * run["wheel.acceleration"] + run["shaft.torque"], abs=1e-9
    )


def test_a_rigid_gear_is_the_limit_of_a_stiff_shaft() -> None:
    shaft = parallel(k=Spring(stiffness=1e5, domain=ROTATION), c=Dashpot(damping=0.5, domain=ROTATION))
    bodies = {"one": Inertia(inertia=2e-3), "two": Inertia(inertia=5e-3)}
    soft = assembly("s", **bodies, shaft=tie(shaft, "one", "two"))
    stiff = assembly("r", **bodies, hub=Gear(between=("one", "two"), ratio=1.0))
    times, push = (
        np.linspace(0.0, 0.2, 201),
        {"one.torque": lambda t: 0.3 * math.cos(20 * t), "two.torque": -0.1},
    )
    expected, run = simulate(flatten(soft), times, inputs=push), simulate(flatten(stiff), times, inputs=push)
    assert run["two.angle"] == pytest.approx(expected["two.angle"], abs=2e-4 * np.ptp(expected["two.angle"]))
    assert len(flatten(stiff).states) == 2


@pytest.mark.parametrize(("at", "level"), [("wheel", 0.1), ("motor", 0.1 / 8.0)])
def test_dry_friction_anywhere_in_a_train_sticks_as_on_the_reflected_body(at: str, level: float) -> None:
    """On the motor's shaft a gear makes an n-th of the friction torque as strong."""
    ratio, wheel, spring = 8.0, 2e-3, tie(Spring(stiffness=0.3, domain=ROTATION), "wheel")
    friction, gear = (
        tie(CoulombFriction(sliding_effort=level), at),
        Gear(between=("motor", "wheel"), ratio=ratio),
    )
    made = assembly("a", motor=by_current(), wheel=Inertia(inertia=wheel), gear=gear, s=spring, f=friction)
    dry = tie(CoulombFriction(sliding_effort=0.1), "wheel")
    one = assembly("b", wheel=Inertia(inertia=wheel + ratio**2 * ROTOR), s=spring, f=dry)
    times = np.linspace(0.0, 1.5, 1501)
    run = simulate(flatten(made), times, inputs={"motor.current": lambda t: 0.8 * math.sin(8.0 * t)})
    expected = simulate(
        flatten(one), times, inputs={"wheel.torque": lambda t: ratio * CONSTANT * 0.8 * math.sin(8.0 * t)}
    )
    assert run["wheel.angle"] == pytest.approx(expected["wheel.angle"], abs=1e-6)
    stuck = run["wheel.speed"] == 0.0
    assert np.array_equal(stuck, expected["wheel.speed"] == 0.0)
    assert 20 < np.sum(stuck) < 1000


def lossy(ratio: float = 8.0, **more: float) -> LossyGear:
    return LossyGear(between=("motor", "wheel"), ratio=ratio, efficiency=0.75, back_efficiency=0.6, **more)


@pytest.mark.parametrize("ratio", [8.0, -8.0])
@pytest.mark.parametrize("turning", [-30.0, 30.0])
@pytest.mark.parametrize("torque", [-0.4, 0.4])
def test_a_lossy_gear_at_constant_speed_passes_its_efficiency(
    ratio: float, turning: float, torque: float
) -> None:
    """The wheel holds the load still in speed: P_out/P_in is η forward and η_b backward, never above one."""
    made = assembly(
        "a",
        motor=by_current(voltage_limit=1e4, current_limit=1e3),
        wheel=Inertia(inertia=1e-2),
        gear=lossy(ratio),
    )
    model = flatten(made)
    start = {"motor.angle": 0.0, "motor.speed": turning}

    def unbalanced(load: float) -> float:
        drive = {"motor.current": torque / CONSTANT, "wheel.torque": load}
        found = model.evaluate([start[v.name] for v in model.states], [drive[v.name] for v in model.inputs])
        return found["motor.acceleration"]

    load = brentq(unbalanced, -50.0, 50.0, xtol=1e-12)
    motor_power, load_power = torque * turning, load * turning / ratio
    if motor_power > 0:
        assert -load_power / motor_power == pytest.approx(0.75, rel=1e-9)
    else:
        assert -motor_power / load_power == pytest.approx(0.6, rel=1e-9)


def case_by_case(drive: float, load: float, speed: float, sizes: tuple[float, float, float]) -> float:
    """Acceleration of the motor behind a lossy gear, trying both directions of power for what fits."""
    rotor, wheel, ratio = sizes
    sliding = abs(math.tanh(speed / 0.02))
    shares = {True: 1 - 0.25 * sliding, False: 1 + (1 / 0.6 - 1) * sliding}
    fitting = []
    for forward, share in shares.items():
        # rotor·a = drive − T1; wheel·a/ratio = load + ratio·T1·share
        matrix = np.array([[rotor, 1.0], [wheel / ratio, -ratio * share]])
        acceleration, given = np.linalg.solve(matrix, [drive, load])
        if (given * speed > 0) == forward:
            fitting.append(acceleration)
    assert len(fitting) == 1
    return float(fitting[0])


def test_a_lossy_gear_between_two_inertias_against_trying_both_directions() -> None:
    draw, sizes = random.Random(4), (ROTOR, 2e-3, 8.0)
    model = flatten(
        assembly("a", motor=by_current(voltage_limit=1e4), wheel=Inertia(inertia=2e-3), gear=lossy())
    )
    for _ in range(300):
        speed, current, load = draw.uniform(-0.1, 0.1), draw.uniform(-10, 10), draw.uniform(-2, 2)
        inputs = {"motor.current": current, "wheel.torque": load}
        found = model.evaluate([0.0, speed], [inputs[v.name] for v in model.inputs])
        expected = case_by_case(CONSTANT * current, load, speed, sizes)
        assert found["motor.acceleration"] == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert found["gear.loss"] >= 0.0


@pytest.mark.parametrize("size", [1.0, 1e9])
def test_the_residual_of_a_lossy_gear_is_relative_to_its_torques(size: float) -> None:
    """At torques of 10⁹ N·m rounding alone leaves more than 10⁻⁹ N·m, which is nothing."""
    made = assembly("a", motor=by_current(voltage_limit=1e4), wheel=Inertia(inertia=2e-3), gear=lossy())
    model = flatten(made)
    for load in np.linspace(-1.7, 1.3, 31):
        inputs = [{"wheel.torque": load * size}.get(v.name, 0.0) for v in model.inputs]
        residual = model.equations(0.0, [0.0, 3.0], inputs, model.start(model.parameters), [])[3]
        assert residual.numel() == 1
        assert abs(float(residual)) < 1e-12


@pytest.mark.slow
def test_a_swing_through_a_lossy_gear_against_another_integrator_and_its_power_balance() -> None:
    sizes, stiffness = (ROTOR, 2e-3, 8.0), 3.0
    made = assembly("a", motor=by_current(voltage_limit=1e4), wheel=Inertia(inertia=2e-3), gear=lossy(),
                    spring=tie(Spring(stiffness=stiffness, domain=ROTATION), "wheel"))  # fmt: skip

    def current(t: float) -> float:
        return 4.0 * math.sin(17.0 * t)

    def slope(t: float, x: np.ndarray) -> list[float]:
        return [x[1], case_by_case(CONSTANT * current(t), -stiffness * x[0] / 8.0, x[1], sizes)]

    times = np.linspace(0.0, 0.8, 16_001)
    run = simulate(flatten(made), times, inputs={"motor.current": current})
    other = solve_ivp(
        slope, (0.0, 0.8), [0.0, 0.0], method="DOP853", t_eval=times[::400], rtol=1e-8, atol=1e-10
    )
    assert run["motor.angle"][::400] == pytest.approx(other.y[0], abs=1e-5 * np.ptp(other.y[0]))
    put_in = integral(run["motor.drive_torque"] * run["motor.speed"], times)
    stored = 0.5 * ROTOR * run["motor.speed"] ** 2 + 0.5 * 2e-3 * run["wheel.speed"] ** 2
    stored = stored + 0.5 * stiffness * run["wheel.angle"] ** 2
    lost = integral(run["gear.loss"], times)
    assert np.max(np.abs(put_in - stored - lost)) < 1e-5 * np.max(put_in)
    assert np.min(run["gear.loss"]) >= 0.0
    assert lost[-1] > 0.1 * put_in[-1]


def long_train(order: tuple[str, ...]) -> Assembly:
    """Motor, first gear, countershaft, second gear, wheel: two lossy gears and a branch."""
    parts = {
        "motor": by_current(voltage_limit=1e4),
        "counter": Inertia(inertia=1e-4),
        "wheel": Inertia(inertia=2e-2),
        "fan": Inertia(inertia=5e-5),
        "first": LossyGear(between=("motor", "counter"), ratio=4.0, efficiency=0.8, back_efficiency=0.7),
        "second": LossyGear(between=("counter", "wheel"), ratio=-5.0, efficiency=0.9, back_efficiency=0.85),
        "belt": Gear(between=("fan", "motor"), ratio=2.0),
        "spring": tie(Spring(stiffness=20.0, domain=ROTATION), "wheel"),
    }
    return assembly("train", **{name: parts[name] for name in order})


ORDERS = [
    ("motor", "counter", "wheel", "fan", "first", "second", "belt", "spring"),
    ("wheel", "spring", "second", "counter", "first", "motor", "belt", "fan"),
    ("counter", "fan", "belt", "motor", "wheel", "spring", "first", "second"),
]


def test_a_train_is_the_same_whichever_body_leads_it() -> None:
    times = np.linspace(0.0, 0.5, 501)
    drive = {"motor.current": lambda t: 6.0 * math.sin(11.0 * t), "fan.torque": -2e-3}
    runs = [simulate(flatten(long_train(order)), times, inputs=drive) for order in ORDERS]
    for run, order in zip(runs, ORDERS, strict=True):
        assert len(flatten(long_train(order)).states) == 2
        for name in ("motor.angle", "wheel.speed", "first.torque", "second.input_torque", "belt.torque"):
            assert run[name] == pytest.approx(runs[0][name], abs=2e-6 * np.ptp(runs[0][name]))
        assert min(np.min(run["first.loss"]), np.min(run["second.loss"])) >= 0.0
    assert runs[0]["wheel.speed"] == pytest.approx(-runs[0]["motor.speed"] / 20.0)
    assert runs[0]["fan.speed"] == pytest.approx(2.0 * runs[0]["motor.speed"])


def test_a_train_obeys_newton_body_by_body() -> None:
    run = simulate(
        flatten(long_train(ORDERS[1])), np.linspace(0.0, 0.5, 501),
        inputs={"motor.current": lambda t: 6.0 * math.sin(11.0 * t), "fan.torque": -2e-3},
    )  # fmt: skip
    at = {
        "motor": (ROTOR, run["motor.drive_torque"] - run["first.input_torque"] + run["belt.torque"]),
        "fan": (5e-5, -2e-3 - run["belt.input_torque"]),
        "counter": (1e-4, run["first.torque"] - run["second.input_torque"]),
        "wheel": (2e-2, run["second.torque"] - run["spring.torque"]),
    }
    for body, (inertia, torque) in at.items():
        assert inertia * run[f"{body}.acceleration"] == pytest.approx(torque, abs=1e-9)
