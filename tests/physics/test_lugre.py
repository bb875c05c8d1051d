"""LuGre friction: sticks without drift, follows its Stribeck curve, loses what bristles lose.

Independent roads: the steady torque g(ω) + b·ω written here, the bristle as a spring below break-away, and
``scipy.integrate.solve_ivp`` with LSODA on the equations written here with the elasto-plastic half sine.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from nlsdesign.components import Driven, Inertia, LuGreFriction, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import simulate

J = 1e-3
NUMBERS = {
    "stiffness": 100.0, "bristle_damping": 0.1, "damping": 2e-3, "sliding_effort": 0.05, "breakaway": 0.03,
    "stribeck_speed": 0.2, "elastic_share": 0.7,
}  # fmt: skip
RUB = LuGreFriction(**NUMBERS)  # type: ignore[arg-type]


def level(speed: float) -> float:
    return 0.05 + 0.03 * math.exp(-((speed / 0.2) ** 2))


@pytest.mark.parametrize("speed", [-3.0, -0.15, 0.02, 0.2, 1.5])
def test_the_stribeck_curve_at_steady_speed(speed: float) -> None:
    made = assembly("turned", crank=Driven(), rub=tie(RUB, "crank"))
    # The bristles settle over their deflection of 0.5 mrad to 0.8 mrad: forty times that.
    times = np.linspace(0.0, 0.03 / abs(speed), 11)
    drive = {"crank.speed": speed, "crank.angle": lambda t: speed * t}
    run = simulate(flatten(made), times, inputs=drive)
    expected = math.copysign(level(speed), speed) + 2e-3 * speed
    assert run["rub.torque"][-1] == pytest.approx(expected, rel=1e-8)


def test_it_sticks_without_drift_below_break_away() -> None:
    """A pulsating load that drifts the original law by creeping: here the body returns to where it was."""
    model = flatten(assembly("held", wheel=Inertia(inertia=J), rub=tie(RUB, "wheel")))
    times = np.linspace(0.0, 60.0, 61)
    pulse = {"wheel.torque": lambda t: 0.03 + 0.02 * math.sin(2 * math.pi * t)}
    # Below 0.7 of the 0.08 N·m at standstill the bristles are a spring of 100 N·m/rad.
    start = {"wheel.angle": 3e-4, "rub.deflection": 3e-4}
    run = simulate(model, times, inputs=pulse, start=start)
    assert run["wheel.angle"][30:] == pytest.approx(np.full(31, run["wheel.angle"][30]), abs=1e-9)
    assert run["wheel.angle"] == pytest.approx(run["rub.deflection"], abs=1e-9)
    assert np.max(np.abs(run["wheel.angle"] - 3e-4)) < 3e-4


def test_below_break_away_it_is_a_spring_with_a_damper() -> None:
    model = flatten(assembly("held", wheel=Inertia(inertia=J), rub=tie(RUB, "wheel")))
    poles = np.linalg.eigvals(linearise(model, [0.0, 1e-12, 0.0]).A)
    decay, beat = (0.1 + 2e-3) / (2 * J), 100.0 / J
    swinging = poles[np.abs(poles.imag) > 1.0]
    assert len(swinging) == 2
    assert swinging.real == pytest.approx(np.full(2, -decay), rel=1e-6)
    assert np.abs(swinging) == pytest.approx(np.full(2, math.sqrt(beat)), rel=1e-6)


@pytest.mark.slow
def test_against_another_integrator_and_power_balance() -> None:
    """Slips and sticks in turn under a sine; work = ½Jω² + ½σ₀z² + ∫ of what bristles and oil lose."""
    model = flatten(assembly("rubbed", wheel=Inertia(inertia=J), rub=tie(RUB, "wheel")))
    times = np.linspace(0.0, 0.6, 30_001)
    run = simulate(model, times, inputs={"wheel.torque": lambda t: 0.12 * math.sin(15 * t)}, tolerance=1e-10)

    def bending(z: float, speed: float) -> float:
        most = level(speed) / 100.0
        if z * speed <= 0.0 or abs(z) < 0.7 * most:
            return speed
        share = 1.0
        if abs(z) < most:
            share = 0.5 * math.sin(math.pi * (abs(z) - 0.85 * most) / (0.3 * most)) + 0.5
        return speed * (1 - share * abs(z) / most)

    def rate(t: float, x: np.ndarray) -> list[float]:
        change = bending(x[2], x[1])
        torque = 100.0 * x[2] + 0.1 * change + 2e-3 * x[1]
        return [x[1], (0.12 * math.sin(15 * t) - torque) / J, change]

    other = solve_ivp(
        rate, (0, 0.6), np.zeros(3), method="LSODA", t_eval=times[::3000], rtol=1e-10, atol=1e-13
    )
    assert run["wheel.angle"][::3000] == pytest.approx(other.y[0], abs=2e-7)
    assert np.max(np.abs(run["wheel.angle"])) > 0.01
    speed, bent = run["wheel.speed"], run["rub.deflection"]
    change = np.array([bending(z, v) for z, v in zip(bent, speed, strict=True)])
    work = cumulative_simpson(0.12 * np.sin(15 * times) * speed, x=times, initial=0.0)
    stored = J / 2 * speed**2 + 50.0 * bent**2
    lost = 100.0 * bent * (speed - change) + 0.1 * change * speed + 2e-3 * speed**2
    balance = work - stored - cumulative_simpson(lost, x=times, initial=0.0)
    assert np.max(np.abs(balance)) < 2e-5 * np.max(work)
