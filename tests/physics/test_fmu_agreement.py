"""The plant FMU against an independent integration, and its integrator against theory."""

from __future__ import annotations

import ctypes
import math
from itertools import pairwise

import casadi as ca
import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models import cam_rubber_actuator
from nlsdesign.export import export_c, export_fmu
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.export.compilation.cross_compiler import compile_library
from nlsdesign.export.fmi.fmu import fmu_texts
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel, Variable
from nlsdesign.simulation import simulate
from tests.fmu_unit import opened
from tests.hand_built import plant

STEP = 1e-3


@pytest.fixture(scope="module", autouse=True)
def as_users_compile():
    """The binaries of this file are optimised, as they are outside of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("NLSDESIGN_CFLAGS")
        yield


def by_hand(state: np.ndarray, current: float) -> np.ndarray:
    """The equations of the plant, written once more in plain Python."""
    z, theta, omega = state
    extension = 0.015 * 0.2 * math.log(math.cosh(theta / 0.2))
    lever = 0.015 * math.tanh(theta / 0.2)
    relaxing = 4600.0 * (extension - z)
    torque = 2 * lever * (9000.0 * extension * (1 + 60.0 * extension) + relaxing)
    friction = 0.02 * math.tanh(omega / 0.1) + 1e-3 * omega
    return np.array([relaxing / 200.0, omega, (0.22 * current - friction - torque) / 5.97e-4])


def reference(currents: list[float], lengths: list[float]) -> np.ndarray:
    """States at the communication points, by an explicit method of order 8 with held inputs."""
    state, rows = np.array([0.0, 0.1, 0.0]), []
    for current, length in zip(currents, lengths, strict=True):
        solution = solve_ivp(
            lambda _, x, i=current: by_hand(x, i),
            (0.0, length),
            state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-15,
        )
        state = solution.y[:, -1]
        rows.append(state)
    return np.array(rows)


@pytest.mark.long_cases("even steps-2.0", "uneven steps-3.0")
@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("uneven", [False, True], ids=["even steps", "uneven steps"])
def test_the_plant_agrees_with_an_independent_integration_to_1e_6(version, uneven, tmp_path):
    count = 600
    currents = [3.0 * math.sin(0.02 * k) + (2.0 if k % 100 < 50 else -1.0) for k in range(count)]
    lengths = [STEP * (0.2 + 1.7 * ((7 * k) % 11) / 11 if uneven else 1.0) for k in range(count)]
    expected = reference(currents, lengths)
    names = ["spring.rubber.relaxing.dashpot.extension", "motor.angle", "motor.speed"]
    with opened(export_fmu(plant(), tmp_path / "plant.fmu", version=version)) as unit:
        unit.begin().run()
        found = []
        for current, length in zip(currents, lengths, strict=True):
            unit.set(motor__current=current)
            unit.step(length)
            found.append(unit.get(*names))
    error = np.abs(np.array(found) - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert np.all(np.ptp(expected, axis=0) > [5e-4, 0.3, 5.0])
    assert np.all(error < 1e-6)


def test_the_error_follows_the_tolerance(tmp_path):
    expected = reference([4.0], [0.2])[0]
    errors = []
    with opened(export_fmu(plant(), tmp_path / "plant.fmu")) as unit:
        for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
            unit.raw.reset()
            unit.begin(tolerance=tolerance)
            assert unit.get("solver.relative_tolerance") == [tolerance]
            unit.set(motor__current=4.0)
            unit.run()
            unit.step(0.2)
            found = np.array(
                unit.get("spring.rubber.relaxing.dashpot.extension", "motor.angle", "motor.speed")
            )
            errors.append(np.abs((found - expected) / expected).max())
    for tolerance, error in zip((1e-4, 1e-6, 1e-8, 1e-10), errors, strict=True):
        assert error < 100 * tolerance
    assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))


def test_simulate_fmu_agrees_too(tmp_path):
    count = 200
    times = STEP * np.arange(count + 1)
    currents = 3.0 * np.sin(40 * times)
    signal = np.array(
        list(zip(times, currents, strict=True)), dtype=[("time", float), ("motor.current", float)]
    )
    result = fmpy.simulate_fmu(
        str(export_fmu(plant(), tmp_path / "plant.fmu")),
        stop_time=count * STEP,
        output_interval=STEP,
        input=signal,
    )
    expected = reference(currents[:-1].tolist(), [STEP] * count)
    assert np.abs(result["motor.angle"][1:] - expected[:, 1]).max() < 1e-6 * np.abs(expected[:, 1]).max()


def test_a_stiff_plant_costs_few_steps_and_settles_at_its_rest(tmp_path):
    # Relaxation in 0.2 µs beside a motion of some hundred milliseconds: an explicit method would need steps
    # below a microsecond, 10⁵ of them.
    model = plant().with_values({"spring.rubber.relaxing.dashpot.viscosity": 1e-3})
    with opened(export_fmu(model, tmp_path / "stiff.fmu"), logging=True) as unit:
        unit.begin().run()
        unit.set(motor__current=2.0)
        unit.step(0.1)
        steps = int(unit.log[-1][2].split(": ")[1].split(" ")[0])
        assert steps < 2000
        angle, place = unit.get("motor.angle", "spring.rubber.relaxing.dashpot.extension")
        # The dashpot follows the rubber at once.
        assert place == pytest.approx(0.015 * 0.2 * math.log(math.cosh(angle / 0.2)), rel=1e-4)


# --- the published actuator -----------------------------------------------------------------------


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("deck", ["austin2015_as_printed", "austin2015_figure_consistent"])
def test_the_published_actuator_agrees_with_the_packages_own_simulation_to_1e_6(deck, tmp_path):
    model = flatten(cam_rubber_actuator(load_deck(deck)), inputs=["motor.current"], outputs=["motor.angle"])
    times = STEP * np.arange(401)
    current = 2.0 * np.sin(2 * math.pi * 3.0 * times) + 0.5 * np.sign(
        np.sin(2 * math.pi * 11.0 * times + 0.1)
    )
    signal = np.array(
        list(zip(times, current, strict=True)), dtype=[("time", float), ("motor.current", float)]
    )
    shown = ["motor.angle", "motor.speed", "spring.torque"]
    found = fmpy.simulate_fmu(
        str(export_fmu(model, tmp_path / "plant.fmu")),
        stop_time=times[-1],
        output_interval=STEP,
        input=signal,
        output=shown,
    )
    expected = simulate(model, times, inputs={"motor.current": current}, hold=True)
    for name in shown:
        size = np.abs(expected[name]).max()
        assert size > 1e-2
        assert np.abs(found[name] - expected[name]).max() < 1e-6 * size, name


@pytest.mark.long_cases("cascade")
@pytest.mark.parametrize("gain", [CascadeGain(), None], ids=["cascade", "default"])
def test_the_observer_in_c_agrees_with_the_observer_in_python_to_1e_12(tmp_path, gain):
    deck = load_deck("austin2015_figure_consistent")
    model = flatten(cam_rubber_actuator(deck), inputs=["motor.current"], outputs=["motor.angle"])
    estimator = design_observer(model, gain=gain)
    times = STEP * np.arange(801)
    current = 3.0 * np.sin(2 * math.pi * 3.0 * times)
    angle = simulate(model, times, inputs={"motor.current": current}, hold=True)["motor.angle"]
    given = {"motor.angle": angle, "motor.current": current}
    inputs = np.column_stack([given[v.name] for v in estimator.inputs])
    step, reference = CompiledStep(export_c(estimator, tmp_path)), GuardedModel(estimator)
    pairs = [(step(u), reference.step(u)) for u in inputs.tolist()]
    found, expected = (np.array([side[0] for side in sides]) for sides in zip(*pairs, strict=True))
    assert {status for pair in pairs for _, status in pair} == {0}
    size = np.abs(expected).max(axis=0)
    assert np.all(size > 0)
    # A slow state counts deviations of the deck: one is its size, also where it has hardly moved.
    slow = np.array([".deviation[" in v.name or ".factor[" in v.name for v in estimator.outputs])
    size = np.where(slow, np.maximum(size, 1.0), size)
    # An innovation is the difference of two angles: it cannot be known better than both are rounded.
    rounding = 2.0 * np.finfo(float).eps * np.abs(angle).max()
    off = np.abs(found - expected).max(axis=0)
    names = [v.name for v in estimator.outputs]
    assert {
        n: (o, s) for n, o, s in zip(names, off, size, strict=True) if not o <= 1e-12 * s + rounding
    } == {}


# --- the integrator itself ------------------------------------------------------------------------


def one_model(rate: ca.SX, t: ca.SX, x: ca.SX, start: list[float]) -> FlatModel:
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [t, x, ca.SX.sym("u", 0), ca.SX.sym("p", 0), ca.SX.sym("w", 0)], [rate, x[0], nothing, nothing]
    )
    states = tuple(Variable(f"x[{i + 1}]", "1", "State", value) for i, value in enumerate(start))
    return FlatModel(
        "one", "For the integrator", states, (), (), (Variable("y", "1", "Output"),), (), equations
    )


def stepper(model: FlatModel, folder) -> ctypes.CDLL:
    """Fixed steps of the integrator's one-step function."""
    for path, content in fmu_texts(model, version="3.0", step=STEP).items():
        if path.startswith("sources/"):
            (folder / path).parent.mkdir(exist_ok=True)
            (folder / path).write_bytes(content)
    (folder / "sources" / "fixed.c").write_text(
        """
        #include "model.c"
        #include "integrator.c"
        __attribute__((visibility("default")))
        void fixed(double t, double end, int count, double x[], double error[])
        {
            const double none[1] = {0.0};
            double jacobian[ORDER][ORDER], slope[ORDER], next[ORDER];
            const double h = (end - t) / count;
            for (int k = 0; k < count; ++k, t += h) {
                model_jacobian(t, x, none, none, none, jacobian, slope);
                rodas4(t, h, x, none, none, none, jacobian, slope, next, error);
                for (int i = 0; i < ORDER; ++i) {
                    x[i] = next[i];
                }
            }
        }
        """
    )
    return ctypes.CDLL(str(compile_library([folder / "sources" / "fixed.c"], folder / "fixed.so")))


def fixed(library: ctypes.CDLL, start: list[float], end: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    x, error = (ctypes.c_double * len(start))(*start), (ctypes.c_double * len(start))()
    library.fixed(ctypes.c_double(0.0), ctypes.c_double(end), count, x, error)
    return np.array(x), np.array(error)


def test_the_integrator_is_of_order_four_and_its_error_estimate_of_order_four_per_step(tmp_path):
    # Nonlinear, time-dependent, with a known solution: x = (sin t, e^(−t) cos t).
    t, x = ca.SX.sym("t"), ca.SX.sym("x", 2)
    first, second = ca.sin(t), ca.exp(-t) * ca.cos(t)
    rate = ca.vertcat(
        ca.cos(t) + 3 * (x[0] ** 2 - first**2) * x[1] - (x[0] - first),
        -second - ca.exp(-t) * ca.sin(t) - 2 * (x[1] - second) * (1 + x[0] ** 2) + ca.sin(x[0] - first),
    )
    library = stepper(one_model(rate, t, x, [0.0, 1.0]), tmp_path)
    end = 1.6
    exact = np.array([math.sin(end), math.exp(-end) * math.cos(end)])
    counts = [20, 40, 80, 160]
    errors = [np.linalg.norm(fixed(library, [0.0, 1.0], end, n)[0] - exact) for n in counts]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] > 1e-13
    assert np.all(np.abs(orders - 4.0) < 0.25), orders

    # The embedded method has order 3, so the estimate of one step shrinks as h⁴.
    estimates = [np.linalg.norm(fixed(library, [0.0, 1.0], h, 1)[1]) for h in (0.08, 0.04, 0.02)]
    slopes = np.log2(np.array(estimates[:-1]) / estimates[1:])
    assert np.all(np.abs(slopes - 4.0) < 0.35), slopes


def test_the_integrator_damps_infinitely_stiff_motion_at_once(tmp_path):
    # L-stability: for dx/dt = λ x the factor of one step goes to 0 as λ h goes to −∞.
    t, x = ca.SX.sym("t"), ca.SX.sym("x", 2)
    factors = {}
    for stiffness in (1e1, 1e3, 1e6, 1e9):
        folder = tmp_path / f"{stiffness:g}"
        folder.mkdir()
        library = stepper(one_model(ca.vertcat(-stiffness * x[0], -x[1]), t, x, [1.0, 1.0]), folder)
        factors[stiffness] = fixed(library, [1.0, 1.0], 1.0, 1)[0]
    assert abs(factors[1e1][0]) < 0.2
    assert abs(factors[1e3][0]) < 1e-2
    assert abs(factors[1e6][0]) < 1e-5
    assert abs(factors[1e9][0]) < 1e-7
    assert factors[1e9][1] == pytest.approx(math.exp(-1.0), rel=3e-3)


def test_an_oscillation_keeps_its_energy_within_the_tolerance(tmp_path):
    t, x = ca.SX.sym("t"), ca.SX.sym("x", 2)
    model = one_model(ca.vertcat(100.0 * x[1], -100.0 * x[0]), t, x, [1.0, 0.0])
    with opened(export_fmu(model, tmp_path / "swing.fmu")) as unit:
        unit.begin().run()
        unit.step(2 * math.pi * 10 / 100.0)
        x1, x2 = unit.get("x[1]", "x[2]")
    assert math.hypot(x1, x2) == pytest.approx(1.0, abs=1e-5)
    assert abs(x2) < 1e-5
