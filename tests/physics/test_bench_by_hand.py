"""The published actuator, typed once more by hand in NumPy, against the package.

Independent roads: the equations of the corrected network (F = F* + F_M, dF_M/dt = a·k·dδ/dt − (k/η)·F_M,
a = A₀/L₀) with the printed numbers typed here and the relaxing force as state instead of the dashpot's
strain; the cam from ``scipy.interpolate.BSpline``; integration by ``scipy.integrate.solve_ivp`` (DOP853,
relative tolerance 1e-11) between the samples. Only the control values of the cam come from the deck.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline

from nlsdesign.components import Driven
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.linear import jacobian_function, linearise, rest_state
from nlsdesign.simulation import simulate

# Austin, Schepelmann and Geyer, IROS 2015: printed; and what DESIGN section 3 takes for the drivetrain.
AREA, LENGTH = 1e-4, 12.5e-3
MODULI = np.array([0.92, 0.58, 0.74, 0.77, 0.47, 1.06]) * 1e6
KNOTS = np.array([0.0, 0.20, 1.06, 2.65, 9.04, 9.05]) * 1e-3
BRANCH = 0.58e6
INERTIA, PER_CURRENT = 5.97e-4, 0.220
VISCOUS, COULOMB, CREEP = 1e-3, 0.02, 0.02
LAST, CHANGEOVER = math.radians(65.0), 1e-3

# deck: force scale, viscosity
CASES = {"austin2015_as_printed": (1.0, 411.0), "austin2015_figure_consistent": (2.55, 21e3)}


class ByHand:
    """The actuator in NumPy; state (F_M of one element, θ, ω)."""

    def __init__(self, name: str) -> None:
        self.scale, self.viscosity = CASES[name]
        row = declare(load_deck(name)).quantities()["spring.cam.lever_arm"].values
        step = LAST / (len(row) - 3)
        self.arm = BSpline(step * np.arange(-3, len(row) + 1), np.array(row), 3)
        self.way = self.arm.antiderivative()

    def cam(self, angle: float) -> tuple[float, float]:
        root = math.sqrt(angle**2 + CHANGEOVER**2)
        along = angle**2 / (root + CHANGEOVER)
        return float(self.way(along) - self.way(0.0)), float(self.arm(along)) * angle / root

    def still(self, extension: float) -> float:
        return self.scale * AREA / LENGTH * float(np.sum(MODULI * np.clip(extension - KNOTS, 0.0, None)))

    def branch_rate(self, branch: float, stretch_rate: float) -> float:
        k = self.scale * BRANCH
        return AREA / LENGTH * k * stretch_rate - k / self.viscosity * branch

    def torque(self, angle: float, branch: float) -> float:
        extension, arm = self.cam(angle)
        return 2 * arm * (self.still(extension) + branch)

    def free(self, current: Callable[[float], float]) -> Callable[[float, np.ndarray], list[float]]:
        def rate(t: float, x: np.ndarray) -> list[float]:
            branch, angle, speed = x
            _, arm = self.cam(angle)
            friction = VISCOUS * speed + COULOMB * math.tanh(speed / CREEP)
            push = PER_CURRENT * current(t) - self.torque(angle, branch) - friction
            return [self.branch_rate(branch, arm * speed), speed, push / INERTIA]

        return rate


def stepped(
    rate: Callable[[float, np.ndarray], list[float]], x0: list[float], times: np.ndarray
) -> np.ndarray:
    """States at the times; each interval on its own, so that no dense output dulls the reference."""
    states, first = [np.array(x0)], None
    for begin, end in pairwise(times):
        found = solve_ivp(
            rate, (begin, end), states[-1], method="DOP853", rtol=1e-11, atol=1e-13, first_step=first
        )
        states.append(found.y[:, -1])
    return np.array(states).T


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("name", CASES)
def test_bench_with_a_sine_current(name: str) -> None:
    """Load side held, 4 A at 2 Hz: angle to 1e-7 and torque to 1e-7 of their largest values."""
    times = np.linspace(0.0, 0.25, 26)

    def current(t: float) -> float:
        return 4.0 * math.sin(4 * math.pi * t)

    hand = ByHand(name)
    x = stepped(hand.free(current), [0.0, 0.0, 0.0], times)
    run = simulate(
        flatten(declare(load_deck(name))), times, inputs={"motor.current": current}, tolerance=1e-12
    )
    torque = np.array([hand.torque(angle, branch) for branch, angle in zip(x[0], x[1], strict=True)])
    force = np.array([hand.still(hand.cam(a)[0]) + b for b, a in zip(x[0], x[1], strict=True)])
    for found, expected in (
        (run["motor.angle"], x[1]),
        (run["motor.speed"], x[2]),
        (run["spring.torque"], torque),
        (run["spring.rubber.force"], force),
        (AREA * run["spring.rubber.relaxing.stress"], x[0]),
        (run["load.reaction"], -torque),
    ):
        assert np.max(np.abs(found - expected)) < 1e-7 * np.max(np.abs(expected))
    assert np.max(torque) > 0.5
    assert np.max(np.abs(x[1])) > math.radians(10)


@pytest.mark.long_cases("austin2015_figure_consistent")
@pytest.mark.parametrize("name", CASES)
def test_spring_with_a_driven_motor(name: str) -> None:
    """The angle is given: one relaxing force is left, and the drivetrain does not matter."""
    made = declare(load_deck(name)).with_part("motor", Driven()).without_part("motor_encoder")
    times = np.linspace(0.0, 0.5, 51)

    def angle(t: float) -> float:
        return 0.7 * math.sin(11 * t)

    def speed(t: float) -> float:
        return 7.7 * math.cos(11 * t)

    hand = ByHand(name)
    rate = lambda t, x: [hand.branch_rate(x[0], hand.cam(angle(t))[1] * speed(t))]  # noqa: E731
    branch = stepped(rate, [0.0], times)[0]
    expected = np.array([hand.torque(angle(t), b) for t, b in zip(times, branch, strict=True)])
    run = simulate(flatten(made), times, inputs={"motor.angle": angle, "motor.speed": speed}, tolerance=1e-11)
    assert np.max(np.abs(run["spring.torque"] - expected)) < 1e-8 * np.max(np.abs(expected))
    friction = VISCOUS * speed(times[7]) + COULOMB * math.tanh(speed(times[7]) / CREEP)
    assert run["motor.reaction"][7] == pytest.approx(expected[7] + friction, rel=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_static_torque_over_the_angle(name: str) -> None:
    hand, model = ByHand(name), flatten(declare(load_deck(name)))
    held = [v.name for v in model.states].index("motor.angle")
    for angle in np.radians(np.linspace(-60, 60, 41)):
        rest = rest_state(model, {"motor.angle": float(angle), "motor.speed": 0.0})
        assert rest[held] == angle
        found = model.evaluate(list(rest))
        assert found["spring.torque"] == pytest.approx(hand.torque(float(angle), 0.0), rel=1e-9, abs=1e-12)
        assert found["spring.rubber.relaxing.stress"] == pytest.approx(0.0, abs=1e-3)


# --- linearisation --------------------------------------------------------------------------------


def everything(model: FlatModel, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    found = model.evaluate(list(x), list(u))
    return np.array(
        [*(found[f"der({v.name})"] for v in model.states), *(found[v.name] for v in model.outputs)]
    )


@pytest.mark.parametrize("name", [*CASES, "austin2015_soft_spring"])
def test_linearisation_against_finite_differences(name: str) -> None:
    """Central differences of the flat model, at random points away from the knots."""
    model = flatten(declare(load_deck(name)), outputs=["spring.torque", "motor.acceleration"])
    draw = np.random.default_rng(8)
    for _ in range(12):
        x = np.array(
            [
                draw.uniform(0.05, 0.6) * draw.choice([-1, 1]),
                draw.normal(),
                *draw.uniform(0, 0.05, len(model.states) - 2),
            ]
        )
        u = draw.uniform(-2, 2, 1)
        linear = linearise(model, list(x), list(u))
        found = np.block([[linear.A, linear.B], [linear.C, linear.D]])
        point, columns = np.concatenate([x, u]), []
        for k in range(len(point)):
            step = np.zeros(len(point))
            step[k] = 1e-6
            up, down = point + step, point - step
            n = len(x)
            columns.append((everything(model, up[:n], up[n:]) - everything(model, down[:n], down[n:])) / 2e-6)
        expected = np.array(columns).T
        assert found == pytest.approx(
            expected, rel=2e-5, abs=1e-4 * max(1.0, float(np.max(np.abs(expected))) * 1e-3)
        )


def test_linear_model_carries_names_and_becomes_a_state_space() -> None:
    model = flatten(declare(load_deck("austin2015_soft_spring")), outputs=["spring.torque"])
    linear = linearise(model, [0.2, 0.0])
    system = linear.to_control()
    assert (system.nstates, system.ninputs, system.noutputs) == (2, 1, 1)
    assert system.state_labels == ["motor_angle", "motor_speed"]
    assert system.dt == 0
    # T(s)/I(s) of an inertia on a spring at rest: friction slope T_c/ω_s + b.
    b = VISCOUS + COULOMB / CREEP
    s = 2j * math.pi * 3.0
    assert system(s) == pytest.approx(1.7 * PER_CURRENT / (INERTIA * s**2 + b * s + 1.7), rel=1e-12)
    assert jacobian_function(model).name() == "linear"
