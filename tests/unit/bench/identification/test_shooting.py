"""Fits by simulation: derivatives, multiple shooting, delays, wild samples, what is known before."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.bench.identification import (
    Huber,
    Record,
    Shots,
    Weights,
    fit_by_simulation,
    free_parameter,
    predict_in_windows,
)
from nlsdesign.bench.identification.parameters import Parameter
from nlsdesign.bench.identification.simulation_error import Point, SimulationError
from nlsdesign.bench.identification.windowed_simulation import wired
from nlsdesign.components import Dashpot, Mass, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ConvergenceError, MeasurementError, UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace

MASS, STIFFNESS, DAMPING = 2.0, 80.0, 3.0
STEP, NOISE = 0.02, 1e-3


def model() -> FlatModel:
    """A mass on a spring with a dashpot; what it is declared with is far off."""
    return flatten(
        assembly(
            "slide",
            body=Mass(mass=1.0),
            spring=tie(Spring(stiffness=30.0), "body"),
            guide=tie(Dashpot(damping=1.0), "body"),
        )
    )


@functools.lru_cache
def truth(seed: int, *, late: float = 0.0, seconds: float = 8.0) -> Record:
    """Simulate the slide with SciPy, pushed by three sines."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, STEP)
    phases = rng.uniform(0.0, 6.3, 3)
    force = sum(4.0 * np.sin(2 * np.pi * f * time + a) for f, a in zip((0.4, 0.9, 1.7), phases, strict=True))

    def rate(t: float, x: np.ndarray) -> list[float]:
        push = float(np.interp(t, time, force))
        return [x[1], (push - STIFFNESS * x[0] - DAMPING * x[1]) / MASS]

    fine = np.append(time, time[-1] + STEP)
    found = solve_ivp(
        rate, (0.0, fine[-1]), [0.05, -0.1], t_eval=fine, rtol=1e-8, atol=1e-10, max_step=2 * STEP
    )
    seen = np.interp(time - late, fine, found.y[0]) + NOISE * rng.standard_normal(len(time))
    units = {"body.force": "N", "body.position": "m"}
    return Record(f"run{seed}", Trace(time, {"body.force": force, "body.position": seen}, units, "run"))


NAMES = ("body.mass", "spring.stiffness", "guide.damping")
TRUE = dict(zip(NAMES, (MASS, STIFFNESS, DAMPING), strict=True))


def parameters() -> list[Parameter]:
    return [free_parameter(model().variable(name)) for name in NAMES]


def test_a_step_moves_all_windows_as_the_eliminated_problem_promises() -> None:
    problem = SimulationError(model(), [truth(1, seconds=4.0)], parameters(), shots=Shots(1.0))
    point = problem.start()
    for _ in range(6):  # close the gaps between the windows
        linear = problem.rows(point)
        point = problem.moved(point, linear, np.zeros(linear.slope.shape[1]), 1.0)
    linear = problem.rows(point)
    assert linear.defect < 1e-9
    direction = np.random.default_rng(0).standard_normal(linear.slope.shape[1])
    off = []
    for size in (1e-3, 1e-4):
        moved = problem.moved(point, linear, size * direction, 1.0)
        change = problem.residual(moved) - linear.residual
        off.append(np.abs(change - linear.slope @ (size * direction)).max() / np.abs(change).max())
    assert off[0] < 0.05
    assert off[1] == pytest.approx(0.1 * off[0], rel=0.3), "what the slope misses is of second order"


def test_a_central_difference_gives_the_same_derivative() -> None:
    problem = SimulationError(model(), [truth(1)], parameters(), shots=Shots(1.0, joined=False))
    point = problem.start()
    slope = problem.rows(point).slope
    for i in range(len(NAMES)):
        ahead, back = point.x.copy(), point.x.copy()
        ahead[i] += 1e-6
        back[i] -= 1e-6
        difference = (
            problem.residual(Point(ahead, point.starts)) - problem.residual(Point(back, point.starts))
        ) / 2e-6
        np.testing.assert_allclose(slope[:, i], difference, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("length", [0.5, 2.0, 7.98])
def test_the_true_numbers_are_found_however_long_the_windows_are(length: float) -> None:
    found = fit_by_simulation(model(), [truth(1), truth(2)], parameters(), shots=Shots(length))
    assert found.fit.converged
    for name, value in TRUE.items():
        assert abs(found.fit.values[name] - value) < 4.0 * found.fit.standard_error(name)
        assert found.fit.standard_error(name) < 0.01 * value
    assert found.point.starts[0][0] == pytest.approx([0.05, -0.1], abs=0.01)
    rows = 2 * 400
    assert found.fit.cost == pytest.approx(rows / 2, rel=0.15), "what is left is noise"


def test_windows_join_to_one_simulation() -> None:
    short = fit_by_simulation(model(), [truth(1)], parameters(), shots=Shots(0.5))
    whole = fit_by_simulation(model(), [truth(1)], parameters(), shots=Shots(7.98))
    for name in NAMES:
        assert short.fit.values[name] == pytest.approx(whole.fit.values[name], rel=1e-5)
    assert short.fit.cost == pytest.approx(whole.fit.cost, rel=1e-6)


def test_a_late_sensor_is_found_with_its_delay() -> None:
    late = Parameter("sensor.delay", "s", 0.0, 0.0, np.inf, -0.2, 0.2, "linear", 0.1)
    records = [truth(1, late=0.037), truth(2, late=0.037)]
    wiring = wired(model(), ["body.force", "body.position"], {"body.position": "sensor.delay"})
    found = fit_by_simulation(model(), records, [*parameters(), late], shots=Shots(1.0), wiring=wiring)
    assert found.fit.values["sensor.delay"] == pytest.approx(0.037, abs=1e-3)
    assert found.fit.values["spring.stiffness"] == pytest.approx(STIFFNESS, rel=0.01)
    blind = fit_by_simulation(model(), records, parameters(), shots=Shots(1.0))
    assert blind.fit.cost > 10.0 * found.fit.cost


def test_wild_samples_do_not_decide_under_a_robust_loss() -> None:
    record = truth(1)
    wild = record.trace["body.position"].copy()
    wild[50:380:30] += 0.2
    signals = {**record.trace.signals, "body.position": wild}
    spoiled = Record("wild", Trace(record.trace.time, signals, record.trace.units, "wild"))
    weights = Weights({"body.position": NOISE})
    plain = fit_by_simulation(model(), [spoiled], parameters(), shots=Shots(1.0), weights=weights)
    robust = fit_by_simulation(
        model(), [spoiled], parameters(), shots=Shots(1.0), weights=weights, loss=Huber()
    )
    off = {
        kind: max(abs(f.fit.values[n] / v - 1.0) for n, v in TRUE.items())
        for kind, f in (("plain", plain), ("robust", robust))
    }
    assert off["robust"] < 0.02
    assert off["plain"] > 3.0 * off["robust"]


def test_an_earlier_fit_counts_with_its_covariance() -> None:
    """Two halves, the second with the first as known before, say the same as both at once."""
    records = [truth(1), truth(2)]
    weights = Weights({"body.position": NOISE})
    both = fit_by_simulation(model(), records, parameters(), shots=Shots(1.0), weights=weights)
    first = fit_by_simulation(model(), records[:1], parameters(), shots=Shots(1.0), weights=weights)
    after = fit_by_simulation(
        model(), records[1:], parameters(), shots=Shots(1.0), weights=Weights(weights.sigma, [first.fit])
    )
    for name in NAMES:
        error = both.fit.standard_error(name)
        assert after.fit.values[name] == pytest.approx(both.fit.values[name], abs=0.5 * error)
        assert after.fit.standard_error(name) == pytest.approx(error, rel=0.25)


def test_bounds_hold() -> None:
    free = parameters()
    free[0] = Parameter("body.mass", "kg", 1.0, 1.0, np.inf, 0.5, 1.5, "log")
    found = fit_by_simulation(model(), [truth(1)], free, shots=Shots(1.0))
    assert found.fit.values["body.mass"] == pytest.approx(1.5, rel=1e-6)


def test_a_prediction_runs_from_the_measured_state() -> None:
    exact = model().with_values(TRUE)
    off = model().with_values({**TRUE, "spring.stiffness": 1.2 * STIFFNESS})
    record = truth(3)
    good, bad = (predict_in_windows(m, record, 1.0).rmse("body.position") for m in (exact, off))
    assert good < 8.0 * NOISE, "the speed at the beginning of each window is only measured"
    assert bad > 3.0 * good


def test_what_cannot_be_fitted_is_refused_with_its_name() -> None:
    record = truth(1, seconds=2.0)
    with pytest.raises(MeasurementError, match="there is none to fit"):
        SimulationError(model(), [], parameters(), shots=Shots(1.0))
    with pytest.raises(ValueRangeError, match=r"windows of 0\.01 s.*run1"):
        SimulationError(model(), [record], parameters(), shots=Shots(0.01))
    with pytest.raises(ValueRangeError, match="only windows apart"):
        Shots(1.0, phases=3)
    with pytest.raises(UnknownNameError, match=r"body\.positon"):
        wired(model(), ["body.positon"])
    with pytest.raises(MeasurementError, match=r"nothing to compare.*body\.position"):
        wired(model(), ["body.force"])
    with pytest.raises(MeasurementError, match=r"less than 5 s"):
        predict_in_windows(model(), record, 5.0)


def test_a_simulation_that_runs_away_is_no_result() -> None:
    stiff = model().with_values({"guide.damping": 1e6})
    with pytest.raises(ConvergenceError, match="not finite"):
        fit_by_simulation(stiff, [truth(1)], [], shots=Shots(7.98))


def test_a_number_that_the_records_leave_open_is_said_to_be_open() -> None:
    """Without a push only ratios show: mass, stiffness and damping may all be twice as large."""
    time = np.arange(0.0, 4.0, STEP)
    swing = 0.05 * np.exp(-0.75 * time) * np.cos(6.28 * time)
    noise = NOISE * np.random.default_rng(0).standard_normal(len(time))
    signals = {"body.force": np.zeros(len(time)), "body.position": swing + noise}
    record = Record("free", Trace(time, signals, {"body.force": "N", "body.position": "m"}, "free"))
    weights, shots = Weights({"body.position": NOISE}), Shots(1.0)
    fitted = fit_by_simulation(model(), [record], parameters(), shots=shots, weights=weights).fit
    (words,) = fitted.unidentified()
    assert all(name in words for name in NAMES)
    assert words.count("up") == 3 or words.count("down") == 0
    assert words.endswith("not known at all")
