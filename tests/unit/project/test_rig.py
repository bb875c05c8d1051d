"""The simulated bench itself: its laws hold, its effects have the size they claim, and it owes nothing to us.

The references are closed forms, conservation laws and `scipy` integrations of the same physics.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp, trapezoid
from scipy.signal import lfilter

from tests.rig import ACTUATORS, Hidden, truth, with_slack_cable
from tests.rig.actuators import Actuator
from tests.rig.bench import CAM_END, History, Servo, simulate
from tests.rig.commands import HOLD_TIME, STEP, Command, hold, sines
from tests.rig.effects import scale_of
from tests.rig.rubber import pull_of, slider_set


def swing(degrees: float, frequency: float, duration: float) -> Command:
    time = np.arange(round(duration / STEP)) * STEP
    return sines(time, np.radians([degrees]), np.array([frequency]), np.zeros(1))


def run(actuator: Actuator, command: Command, **hidden: float) -> History:
    return simulate(actuator, Hidden(**hidden), Servo.for_actuator(actuator), command)


def cam_of(actuator: Actuator, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Extension (even) and lever arm (odd) straight from the formulas."""
    return actuator.cam.extension(np.abs(angle)), np.sign(angle) * actuator.cam.lever_arm(np.abs(angle))


@pytest.fixture(params=("arm", "wrist"))
def actuator(request: pytest.FixtureRequest) -> Actuator:
    """One whose lever arm jumps and one whose lever arm is continuous; the simulation is the same for all."""
    return ACTUATORS[request.param]


every_actuator = pytest.mark.parametrize("actuator", tuple(ACTUATORS), indirect=True)


# --- independence -----------------------------------------------------------------------------------------


def test_rig_imports_only_numpy_scipy_and_the_standard_library(root: Path) -> None:
    allowed = set(sys.stdlib_module_names) | {"numpy", "scipy"}
    files = sorted((root / "tests" / "rig").glob("*.py"))
    assert len(files) >= 8
    for file in files:
        others = {"mujoco"} if file.name == "mujoco_machines.py" else set()
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                assert node.level <= 1, f"{file.name}:{node.lineno} reaches outside the rig"
                names = [node.module or ""] if node.level == 0 else []
            for name in names:
                assert name.split(".")[0] in allowed | others, f"{file.name}:{node.lineno} imports {name}"


# --- actuators --------------------------------------------------------------------------------------------


@every_actuator
def test_lever_arm_is_the_derivative_of_a_growing_extension(actuator: Actuator) -> None:
    angle, small = np.linspace(1e-3, actuator.cam.last_angle, 400), 1e-5
    slope = (actuator.cam.extension(angle + small) - actuator.cam.extension(angle - small)) / (2 * small)
    np.testing.assert_allclose(actuator.cam.lever_arm(angle), slope, rtol=1e-6)
    assert np.all(slope > 0.0)
    assert actuator.cam.extension(np.zeros(1)) == pytest.approx(0.0, abs=1e-15)


@every_actuator
def test_built_numbers_lie_within_the_declared_spread_and_use_it(actuator: Actuator) -> None:
    built = [truth(actuator, {}, seed)[0] for seed in range(200)]
    ratios = {
        "k": [b.rubber.k / actuator.rubber.k for b in built],
        "k_star": [b.rubber.k_star[1] / actuator.rubber.k_star[1] for b in built],
        "J": [b.drivetrain.inertia / actuator.drivetrain.inertia for b in built],
        "n kT": [b.drivetrain.torque_per_ampere / actuator.drivetrain.torque_per_ampere for b in built],
    }
    for name, ratio in ratios.items():
        assert 0.94 <= min(ratio) < 0.945, name
        assert 1.055 < max(ratio) <= 1.06, name
    eta = [np.log(b.rubber.eta / actuator.rubber.eta) / np.log(1.3) for b in built]
    b = [np.log(b.drivetrain.viscosity / actuator.drivetrain.viscosity) / np.log(1.6) for b in built]
    for exponent in (eta, b):
        assert -1.0 <= min(exponent) < -0.95
        assert 0.95 < max(exponent) <= 1.0


# --- rubber and cable -------------------------------------------------------------------------------------


@pytest.mark.long_cases("wrist")
def test_static_hold_has_the_force_of_the_closed_form(actuator: Actuator) -> None:
    time = np.arange(round(2 * HOLD_TIME / STEP)) * STEP
    history = run(actuator, hold(time))
    end = [round(HOLD_TIME / STEP) - 1, -1]
    extension, lever_arm = cam_of(actuator, history.cam_angle[end])
    force = actuator.rubber.equilibrium(extension)
    np.testing.assert_allclose(history.force[end], force, rtol=1e-5)
    torque = actuator.drivetrain.torque_per_ampere * history.current[end]
    np.testing.assert_allclose(torque, lever_arm * force, rtol=1e-5)


@pytest.mark.long_cases("wrist")
def test_smooth_motion_equals_a_variable_step_integration(actuator: Actuator) -> None:
    servo, drive, rubber = Servo.for_actuator(actuator), actuator.drivetrain, actuator.rubber
    command = hold(np.arange(round(0.4 / STEP)) * STEP)
    history = run(actuator, command)

    def right_side(t: float, x: np.ndarray) -> list[float]:
        angle, speed, memory = x
        wanted = np.interp(t, command.time, servo.stiffness * command.angle + servo.damping * command.speed)
        current = wanted - servo.stiffness * angle - servo.damping * speed
        extension, lever_arm = (float(v) for v in cam_of(actuator, np.array(angle)))
        spring = lever_arm * (float(rubber.equilibrium(np.array(extension))) + memory)
        torque = drive.torque_per_ampere * current - drive.viscosity * speed - spring
        relaxing = rubber.shape * rubber.k * lever_arm * speed - memory / rubber.relaxation_time
        return [speed, torque / drive.inertia, relaxing]

    exact = solve_ivp(
        right_side, (0.0, 0.4), [0.0, 0.0, 0.0], t_eval=command.time, rtol=1e-9, atol=1e-12, max_step=1e-3
    )
    force = rubber.equilibrium(cam_of(actuator, exact.y[0])[0]) + exact.y[2]
    assert history.force.min() >= 0.0
    # The fixed step may cost half a step of time: far below one encoder count and the noise of the sensor.
    assert np.max(np.abs(history.motor_angle - exact.y[0])) < 0.2 * actuator.sensors.angle_quantum
    assert np.max(np.abs(history.force - force)) < 0.2 * actuator.sensors.force_noise


@pytest.mark.parametrize("hidden", [{}, {"slack": 4e-4}, {"branch_modulus": 5e5, "branch_time": 0.3}])
def test_contact_is_complementary_and_slack_rubber_relaxes(
    actuator: Actuator, hidden: dict[str, float]
) -> None:
    history = run(with_slack_cable(actuator), swing(20.0, 5.0, 1.0), **hidden)
    rubber = actuator.rubber
    wanted = cam_of(actuator, history.cam_angle)[0] - hidden.get("slack", 0.0)
    growth = np.diff(history.extension, prepend=0.0)
    memory = np.zeros_like(growth)
    for k, tau in (
        (rubber.k, rubber.relaxation_time),
        (hidden.get("branch_modulus", 0.0), hidden.get("branch_time", 1.0)),
    ):
        q = np.exp(-STEP / tau)
        memory += lfilter([rubber.shape * k * tau / STEP * (1.0 - q)], [1.0, -q], growth)
    resistance = rubber.equilibrium(history.extension) + memory
    slack = history.extension - wanted
    assert np.all(history.force >= 0.0)
    assert np.all(slack > -1e-8)  # the table of the cam is good to some nanometres
    np.testing.assert_allclose(history.force, resistance, atol=1e-7)
    assert np.all(history.force[slack > 1e-6] == 0.0)
    assert np.mean(slack > 1e-6) > 0.05, "the swing is meant to go slack"


@pytest.mark.parametrize("hidden", [{}, {"slack": 4e-4}, {"branch_modulus": 5e5, "branch_time": 0.3}])
def test_rubber_that_buckles_follows_the_cam_and_never_pushes(
    actuator: Actuator, hidden: dict[str, float]
) -> None:
    history = run(actuator, swing(20.0, 5.0, 1.0), **hidden)
    rubber = actuator.rubber
    extension = np.maximum(cam_of(actuator, history.cam_angle)[0] - hidden.get("slack", 0.0), 0.0)
    np.testing.assert_allclose(history.extension, extension, atol=1e-8)
    resistance = rubber.equilibrium(extension)
    for k, tau in (
        (rubber.k, rubber.relaxation_time),
        (hidden.get("branch_modulus", 0.0), hidden.get("branch_time", 1.0)),
    ):
        q = np.exp(-STEP / tau)
        growth = np.diff(extension, prepend=0.0)
        resistance += lfilter([rubber.shape * k * tau / STEP * (1.0 - q)], [1.0, -q], growth)
    # The table of the cam is good to some nanometres, and the memory adds up what each step rounds.
    scale = 1e-7 * rubber.shape * (sum(rubber.k_star) + rubber.k)
    np.testing.assert_allclose(history.force, np.maximum(resistance, 0.0), atol=scale)
    assert np.mean(history.force == 0.0) > 0.05, "the swing is meant to buckle"


@pytest.mark.long_cases("wrist")
def test_cable_in_series_follows_from_its_own_stiffness(actuator: Actuator) -> None:
    stiffness = 5.0 * scale_of(actuator).stiffness
    time = np.arange(round(HOLD_TIME / STEP)) * STEP
    history = run(actuator, hold(time), cable_stiffness=stiffness)
    stretch = cam_of(actuator, history.cam_angle)[0] - history.extension
    np.testing.assert_allclose(history.force, stiffness * np.maximum(stretch, 0.0), atol=1e-8 * stiffness)
    at_rest = actuator.rubber.equilibrium(history.extension[-1:])[0]
    assert history.force[-1] == pytest.approx(at_rest, rel=1e-5)
    assert stretch[-1] > 5e-5


def test_maxwell_branch_loses_the_energy_of_the_textbook(actuator: Actuator) -> None:
    """Loss per cycle of a Maxwell element under δ = δ₀ + A sin ωt: π A² K ωτ / (1 + (ωτ)²)."""
    rubber = actuator.rubber
    omega, amplitude = 0.7 / rubber.relaxation_time, 1e-3
    cycle = round(2.0 * np.pi / omega / STEP)
    extension = 5e-3 + amplitude * np.sin(2.0 * np.pi * np.arange(20 * cycle) / cycle)
    pull = pull_of(rubber, Hidden(), STEP)
    force = np.array([pull(float(d))[0] for d in extension])
    loss = trapezoid(force[-cycle - 1 :], extension[-cycle - 1 :])
    turn = 2.0 * np.pi / (cycle * STEP) * rubber.relaxation_time
    expected = np.pi * amplitude**2 * rubber.shape * rubber.k * turn / (1.0 + turn**2)
    assert loss == pytest.approx(expected, rel=2e-3)


def test_sliders_give_a_loop_that_knows_no_rate(actuator: Actuator) -> None:
    """Iwan: each loop loses Σ 4 φ (A − φ/κ) over the sliders that slip, at whatever speed."""
    scale, amplitude = scale_of(actuator), 0.25 * scale_of(actuator).extension
    hidden = Hidden(slider_force=0.08 * scale.force, slider_stiffness=0.6 * scale.stiffness)
    losses = []
    for cycle in (400, 4000):
        phase = 2.0 * np.pi * np.arange(3 * cycle) / cycle
        extension = 0.7 * scale.extension + amplitude * np.sin(phase)
        with_sliders, without = (pull_of(actuator.rubber, h, STEP) for h in (hidden, Hidden()))
        extra = np.array([with_sliders(float(d))[0] - without(float(d))[0] for d in extension])
        losses.append(trapezoid(extra[-cycle - 1 :], extension[-cycle - 1 :]))
        assert np.max(np.abs(extra)) == pytest.approx(hidden.slider_force, rel=1e-6)
    kappa, phi = slider_set(hidden.slider_force, hidden.slider_stiffness)
    slipping = np.maximum(amplitude - phi / kappa, 0.0)
    assert losses == pytest.approx([float(np.sum(4.0 * phi * slipping))] * 2, rel=0.01)


def test_turned_cam_shifts_force_over_angle(actuator: Actuator) -> None:
    time = np.arange(round(HOLD_TIME / STEP)) * STEP
    history = run(actuator, hold(time), cam_offset=0.04)
    extension, _ = cam_of(actuator, history.motor_angle[-1:] - 0.04)
    assert history.force[-1] == pytest.approx(actuator.rubber.equilibrium(extension)[0], rel=1e-5)


# --- drivetrain -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [0.0, 0.3])
def test_work_of_the_motor_is_stored_or_lost(actuator: Actuator, level: float) -> None:
    """∫ T I ω dt = ½ J ω² + ∫ b ω² dt + ∫ level |ω| dt + ∫ F dδ."""
    history, drive = run(actuator, swing(30.0, 2.0, 1.2), friction=level), actuator.drivetrain
    speed = np.gradient(history.motor_angle, STEP)
    extension, _ = cam_of(actuator, history.cam_angle)

    def work(power: np.ndarray) -> np.ndarray:
        return cumulative_trapezoid(power, dx=STEP, initial=0.0)

    supplied = work(drive.torque_per_ampere * history.current * speed)
    spring = cumulative_trapezoid(history.force, extension, initial=0.0)
    lost = work(drive.viscosity * speed**2) + work(level * np.abs(speed))
    balance = supplied - 0.5 * drive.inertia * speed**2 - lost - spring
    assert np.max(np.abs(balance)) < 2e-3 * np.max(np.abs(spring))
    if level:
        assert lost[-1] > 0.3 * np.max(spring), "friction is meant to matter here"


@pytest.mark.long_cases("wrist")
def test_coulomb_friction_moves_the_current_by_twice_its_level(actuator: Actuator) -> None:
    level, per_ampere = 0.12 * scale_of(actuator).torque, actuator.drivetrain.torque_per_ampere
    history = run(actuator, swing(25.0, 0.5, 2.6), friction=level)
    clean = run(actuator, swing(25.0, 0.5, 2.6))

    def width(h: History) -> float:
        """Current on the way up minus on the way down, at the same 10°."""
        later = h.time > 0.55
        up, down = later & (h.motor_speed > 0.1), later & (h.motor_speed < -0.1)
        at = np.radians(10.0)
        rising = np.interp(at, h.motor_angle[up & (h.time > 2.0)], h.current[up & (h.time > 2.0)])
        first = down & (h.time < 1.5)
        falling = np.interp(-at, -h.motor_angle[first], h.current[first])
        return float(rising - falling)

    assert width(history) - width(clean) == pytest.approx(2.0 * level / per_ampere, rel=0.03)
    assert np.mean(history.motor_speed[2000:] == 0.0) > 0.01, "stiction stops the drive completely"


def test_nothing_moves_below_the_breakaway_torque(actuator: Actuator) -> None:
    level, rise, kp = 0.1, 0.2, Servo.for_actuator(actuator).stiffness
    time = np.arange(round(1.0 / STEP)) * STEP
    top = 1.5 * (level + rise) / (kp * actuator.drivetrain.torque_per_ampere)  # rad, wanted in the end
    command = Command(time, top * time, np.zeros_like(time))
    history = run(actuator, command, friction=level, breakaway=rise, stribeck_speed=0.3)
    breaks = np.argmax(history.motor_speed != 0.0)
    torque = history.current[breaks - 1] * actuator.drivetrain.torque_per_ampere
    assert torque == pytest.approx(level + rise, rel=1e-3)
    assert np.all(history.motor_angle[:breaks] == 0.0)


def test_backlash_stays_within_its_stops_and_both_are_used(actuator: Actuator) -> None:
    gap = 0.05
    history = run(actuator, swing(25.0, 1.0, 2.0), gap=gap)
    lead = history.motor_angle - history.cam_angle
    assert np.max(np.abs(lead)) <= 0.5 * gap * (1.0 + 1e-9)
    for stop in (-0.5, 0.5):
        assert np.mean(np.abs(lead - stop * gap) < 1e-9) > 0.1


def test_backlash_of_no_width_is_a_rigid_gear(actuator: Actuator) -> None:
    command = swing(25.0, 2.0, 1.0)
    level = 0.1 * scale_of(actuator).torque
    rigid, tight = run(actuator, command, friction=level), run(actuator, command, friction=level, gap=1e-9)
    np.testing.assert_allclose(tight.motor_angle, rigid.motor_angle, atol=1e-6)
    np.testing.assert_allclose(tight.force, rigid.force, atol=1e-2)


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_a_machine_that_runs_away_is_held_at_the_end_of_its_cam(actuator: Actuator, gap: float) -> None:
    time = np.arange(round(0.6 / STEP)) * STEP
    still, turned = Command(time, np.zeros_like(time), np.zeros_like(time)), 0.3
    servo = Servo.for_actuator(actuator)
    history = simulate(actuator, Hidden(gap=gap), servo, still, lambda t, _: 12.0 if t < turned else -12.0)
    angle = history.cam_angle
    assert np.abs(angle).max() == CAM_END == angle[round(turned / STEP)] == -angle[-1]
    assert (angle[round(turned / STEP) + 1 :] < CAM_END).all()  # it comes off at once
    assert history.motor_speed[round(turned / STEP)] == 0.0


@pytest.mark.long_cases("wrist")
def test_ripple_and_disturbance_appear_in_the_current_they_cost(actuator: Actuator) -> None:
    per_ampere, size = actuator.drivetrain.torque_per_ampere, 0.1
    time = np.arange(round(2.0 / STEP)) * STEP
    pushed = run(actuator, Command(time, 0.0 * time, 0.0 * time), disturbance=size, disturbance_frequency=4.0)
    drive = actuator.drivetrain
    extension, lever_arm = cam_of(actuator, pushed.cam_angle)
    acceleration = np.gradient(np.gradient(pushed.motor_angle, STEP), STEP)
    missing = (
        drive.inertia * acceleration
        + drive.viscosity * np.gradient(pushed.motor_angle, STEP)
        + lever_arm * pushed.force
        - per_ampere * pushed.current
    )
    half = pushed.time > 1.0
    for phase, expected in ((np.sin, size), (np.cos, 0.0)):
        found = 2.0 * np.mean(missing[half] * phase(2.0 * np.pi * 4.0 * pushed.time[half]))
        assert found == pytest.approx(expected, abs=0.01 * size)

    rippled = run(actuator, swing(25.0, 0.1, 3.0), ripple=size, ripple_order=20.0)
    _, lever_arm = cam_of(actuator, rippled.cam_angle)
    moving = rippled.time > 0.6
    missing = per_ampere * rippled.current - lever_arm * rippled.force
    wave = np.column_stack([np.sin(20.0 * rippled.motor_angle), rippled.motor_speed, np.ones(moving.size)])
    found = np.linalg.lstsq(wave[moving], missing[moving], rcond=None)[0][0]
    assert found == pytest.approx(size, rel=0.02)
    assert extension.max() < 2e-3
