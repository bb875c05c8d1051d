"""The one-sided cable drive against its equations typed here, and all that every model can do.

Independent road: motor, gear (trying both directions of power), cam (scipy's spline), guide, cable and rubber
written by hand and integrated by scipy; the FMU carries its own integrator; the stiffness is a difference of
hand-written torques.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad, solve_ivp
from scipy.interpolate import BSpline
from scipy.optimize import brentq

from models import one_sided_cable_drive
from nlsdesign.components import VoltageDrivenMotor
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.export import export_c, export_fmu
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.analysis import Observability, Stability, over_angle
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, measure, simulate

DRIVE = one_sided_cable_drive(load_deck("one_sided_cable_drive"))

# The numbers of the deck, in SI.
ROTOR, CONSTANT, DRUM, RATIO = 140e-7, 30e-3, 0.5e-4, 12.0
FORWARD, BACKWARD, GEAR_CREEP, BEARING = 0.81, 0.77, 0.05, 0.002
ARMS, END, ONSET, PRETENSION = (6, 6, 7, 9, 12, 15, 17, 18, 18), math.pi / 2, math.radians(2.0), 1e-3
FRICTION, WRAP, CABLE_CREEP = 0.12, math.pi / 2, 1e-3
AREA, LENGTH, RELAXING, VISCOSITY = 1e-4, 25e-3, 0.58e6, 20e3
MODULI, KNOTS, WIDTH = (0.92e6, 0.58e6, 0.74e6, 0.77e6), (0.0, 0.016, 0.0848, 0.212), 0.005

_STEP = END / (len(ARMS) - 3)
CAM = BSpline(_STEP * np.arange(-3, len(ARMS) + 1), 1e-3 * np.array(ARMS), 3)
TAKEN = CAM.antiderivative()


def set_in(angle: float) -> float:
    r = min(max(angle / ONSET, 0.0), 1.0)
    return 3 * r**2 - 2 * r**3


def cam(angle: float) -> tuple[float, float]:
    """Extension and lever arm."""
    on = quad(set_in, 0.0, min(max(angle, 0.0), ONSET))[0] + max(angle - ONSET, 0.0)
    held = min(on, END)
    return float(TAKEN(held) - TAKEN(0.0) + CAM(held) * (on - held)), float(CAM(held)) * set_in(angle)


def softplus(value: float) -> float:
    return WIDTH * float(np.logaddexp(0.0, value / WIDTH))


def stress(strain: float, flowed: float) -> float:
    still = MODULI[0] * strain + sum(
        k * (softplus(strain - at) - softplus(-at)) for k, at in zip(MODULI[1:], KNOTS[1:], strict=True)
    )
    return still + RELAXING * (strain - flowed)


def spring(angle: float, speed: float, flowed: float) -> tuple[float, float]:
    """Torque on the drum and rate of the dashpot."""
    extension, arm = cam(angle)
    strain = (PRETENSION + extension) / LENGTH
    if stress(strain, flowed) < 0.0:
        strain = brentq(lambda e: stress(e, flowed), -1.0, 3.0, xtol=1e-14)
    pull = AREA * max(stress(strain, flowed), 0.0)
    pull *= math.exp(FRICTION * WRAP * math.tanh(arm * speed / CABLE_CREEP))
    return arm * pull, RELAXING * (strain - flowed) / VISCOSITY


def current(time: float) -> float:
    return 3.0 + 6.0 * math.sin(7.0 * time)


def slope(time: float, x: np.ndarray) -> list[float]:
    angle, speed, flowed = x[0] / RATIO, x[1] / RATIO, x[2]
    torque, flow = spring(angle, speed, flowed)
    # What the supply of 24 V can push through 0.3 ohm at this speed.
    low, high = ((u - CONSTANT * x[1]) / 0.3 for u in (-24.0, 24.0))
    drive = CONSTANT * min(max(current(time), low), high)
    load, sliding = -torque - BEARING * speed, abs(math.tanh(x[1] / GEAR_CREEP))
    for forward, share in ((True, 1 - (1 - FORWARD) * sliding), (False, 1 + (1 / BACKWARD - 1) * sliding)):
        matrix = np.array([[ROTOR, 1.0], [DRUM / RATIO, -RATIO * share]])
        acceleration, given = np.linalg.solve(matrix, [drive, load])
        if (given * x[1] > 0) == forward:
            return [x[1], float(acceleration), flow]
    raise AssertionError("no direction of power fits")


def driven(times: np.ndarray, tolerance: float = 1e-9) -> Trace:
    return simulate(flatten(DRIVE), times, inputs={"motor.current": current}, tolerance=tolerance)


# Quicker: the same of the other drive in test_models_by_hand.py
@pytest.mark.slow
def test_the_drive_agrees_with_its_equations_typed_here() -> None:
    times = np.linspace(0.0, 0.8, 161)
    wanted = solve_ivp(slope, (0.0, 0.8), [0.0] * 3, "Radau", times, rtol=1e-7, atol=1e-9).y
    run = driven(times)
    assert run["drum.angle"].max() > 0.8
    assert np.max(np.abs(run["motor.voltage"])) == pytest.approx(24.0), "the supply was at its limit"
    assert run["spring.cable.rope.rubber.strain"].max() > 0.3
    assert run["motor.angle"] == pytest.approx(wanted[0], abs=2e-5 * np.ptp(wanted[0]))
    assert run["motor.speed"] == pytest.approx(wanted[1], abs=2e-4 * np.ptp(wanted[1]))
    flowed = run["spring.cable.rope.rubber.relaxing.dashpot.strain"]
    assert flowed == pytest.approx(wanted[2], abs=2e-5 * np.ptp(wanted[2]))


# Quicker: the same of the other drive in test_models_by_hand.py
@pytest.mark.slow
def test_work_put_in_by_the_winding_is_stored_or_lost() -> None:
    times = np.linspace(0.0, 1.2, 6_001)
    run = driven(times, tolerance=1e-8)
    motor, drum = run["motor.speed"], run["drum.speed"]
    strain = run["spring.cable.rope.rubber.strain"]
    flowed = run["spring.cable.rope.rubber.relaxing.dashpot.strain"]

    def integral(power: np.ndarray) -> np.ndarray:
        return cumulative_simpson(power, x=times, initial=0.0)

    grid = np.linspace(0.0, strain.max(), 4001)
    energy = cumulative_simpson([stress(e, e) for e in grid], x=grid, initial=0.0)
    rubber = np.interp(strain, grid, energy) + RELAXING / 2 * (strain - flowed) ** 2
    rubber = AREA * LENGTH * (rubber - rubber[0])
    flow = AREA * LENGTH * RELAXING**2 * (strain - flowed) ** 2 / VISCOSITY
    arm = run["spring.cam.lever_arm_now"]
    guide = (run["spring.cable.force"] - run["spring.cable.rope.force"]) * arm * drum
    work = integral(CONSTANT * run["motor.winding_current"] * motor)
    stored = 0.5 * (ROTOR * motor**2 + DRUM * drum**2) + rubber
    lost = integral(run["gear.loss"] + BEARING * drum**2 + flow + guide)
    assert np.max(np.abs(work - stored - lost)) < 2e-4 * np.max(np.abs(work))
    assert min(np.min(run["gear.loss"]), np.min(guide), np.min(flow)) >= 0.0
    assert lost[-1] > 0.2 * np.max(work)


def test_the_cable_only_pulls_and_only_for_positive_angles() -> None:
    times = np.linspace(0.0, 1.0, 2001)
    pushed = simulate(flatten(DRIVE), times, inputs={"motor.current": lambda t: 8.0 * math.sin(6.0 * t)})
    assert np.min(pushed["spring.torque"]) >= 0.0
    behind = pushed["drum.angle"] <= 0.0
    assert np.max(np.abs(pushed["spring.torque"][behind])) == 0.0
    assert np.max(pushed["spring.torque"]) > 1.0
    assert np.min(pushed["drum.angle"]) < -0.5


def test_the_bench_writes_down_what_its_sensors_see() -> None:
    times = np.linspace(0.0, 0.5, 5001)
    run = driven(times)
    record = measure(run, DRIVE, seed=11)
    angle = record["motor_encoder.reading"]
    assert np.all(np.diff(angle)[np.arange(5000) % 10 != 9] == 0.0), "held for ten steps of 0.1 ms"
    assert np.max(np.abs(angle - run["motor.angle"])) < 0.5 * 0.767e-3 + 1e-3 * np.max(
        np.abs(run["motor.speed"])
    )
    assert np.std(record["load_cell.reading"] - run["spring.cable.rope.force"]) == pytest.approx(
        0.5, rel=0.05
    )
    noise = record["current_sensor.reading"] - run["motor.winding_current"]
    assert np.std(noise) == pytest.approx(0.04, rel=0.05)


def test_the_chart_over_the_angle_shows_the_slope_of_the_torque() -> None:
    model = flatten(DRIVE, outputs=["motor.angle", "spring.torque"])
    angles = RATIO * np.array([0.3, 0.8, 1.2])
    views = [Observability(measured=("motor.angle",)), Stability()]
    chart = over_angle(model, views, angles=angles, angle="motor.angle")

    def relaxed(angle: float) -> float:
        return spring(angle, 0.0, (PRETENSION + cam(angle)[0]) / LENGTH)[0]

    for at, found in zip(angles / RATIO, chart["stiffness.slow"], strict=True):
        expected = (relaxed(at + 1e-5) - relaxed(at - 1e-5)) / 2e-5 / RATIO
        assert found == pytest.approx(expected, rel=1e-5)
    assert np.all(chart["stiffness.fast"] > chart["stiffness.slow"])
    assert np.all(chart["observability.rank"] == 3)
    for mode in ("sliding_forward", "sliding_backward", "stuck"):
        assert np.all(chart[f"{mode}.decay"] < 0.0)


def test_the_same_drive_at_a_voltage_has_the_current_as_a_state_and_the_same_stiffness() -> None:
    winding = DRIVE["motor"].parameters()
    made = DRIVE.with_part("motor", VoltageDrivenMotor(**winding, inductance=8e-5)).without_part(
        "current_sensor"
    )
    angles, views = RATIO * np.array([0.3, 0.8]), [Observability(measured=("motor.angle",)), Stability()]
    charts = []
    for each in (DRIVE, made):
        model = flatten(each, outputs=["motor.angle", "spring.torque"])
        charts.append(over_angle(model, views, angles=angles, angle="motor.angle"))
    assert "motor.current" in [v.name for v in flatten(made).states]
    assert list(charts[1]["observability.rank"]) == [4, 4]
    assert charts[1]["stiffness.slow"] == pytest.approx(charts[0]["stiffness.slow"], rel=1e-9)
    # Shorted at its clamps the motor brakes, k²/R; an ideal current source lets it go.
    shorted, open_ = (chart["sliding_forward.damping_ratio"] for chart in reversed(charts))
    assert np.all(shorted >= open_)


def test_the_deck_and_the_function_say_the_same(tmp_path: Path) -> None:
    assert declare(load_deck("one_sided_cable_drive")) == DRIVE
    assert declare(read_deck(deck_text(DRIVE), tmp_path / "again.toml")) == DRIVE
    assert all(q.source != "not stated" for q in DRIVE.quantities().values())


def test_the_equations_in_c_give_the_same_numbers(tmp_path: Path) -> None:
    # A step of C is the flat function itself; here it gives the outputs.
    model = flatten(DRIVE, outputs=["spring.torque", "drum.acceleration", "motor_encoder.reading"])
    step = CompiledStep(export_c(replace(model, sample_time=1e-3), tmp_path))
    inputs = [0.7 * (1 + k) for k in range(len(model.inputs))]
    wanted = model.equations(0.0, [0.0] * 3, inputs, model.start(model.parameters), [])
    outputs, status = step(inputs)
    assert status == 0
    assert abs(outputs[1]) > 1.0
    assert list(outputs) == pytest.approx(np.array(wanted[1]).ravel().tolist(), rel=1e-12)


def test_the_drive_as_fmu_moves_as_it_does_here(tmp_path: Path) -> None:
    times = np.linspace(0.0, 0.6, 121)
    signal = np.array([(t, current(t)) for t in times], dtype=[("time", float), ("motor.current", float)])
    unit = export_fmu(flatten(DRIVE, outputs=["drum.angle"]), tmp_path / "drive.fmu", step=0.005)
    found = fmpy.simulate_fmu(
        str(unit), stop_time=0.6, output_interval=0.005, input=signal, output=["drum.angle"]
    )
    held = simulate(flatten(DRIVE), times, inputs={"motor.current": signal["motor.current"]}, hold=True)
    assert np.ptp(held["drum.angle"]) > 0.3
    assert found["drum.angle"] == pytest.approx(held["drum.angle"], abs=1e-5)
