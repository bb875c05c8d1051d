"""Simulation: exact solutions, other integrators, inputs of every kind, what is refused.

Independent roads: closed forms of linear systems (matrix exponential), ``scipy.integrate.solve_ivp`` with
another method and tight tolerances, and the recursion of a discrete model by hand.
"""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CoulombFriction,
    Dashpot,
    Driven,
    Inertia,
    Mass,
    Regularised,
    Spring,
    parallel,
    series,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import (
    ConvergenceError,
    MeasurementError,
    NlsError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model import FlatModel, Table, Variable, flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import Trace, simulate
from nlsdesign.simulation.input_signals import drives_of
from nlsdesign.simulation.integrate import integrate_implicitly
from nlsdesign.simulation.runge_kutta import TooStiffError, integrate_explicitly

TIMES = np.linspace(0.0, 2.0, 201)


def swing(damping: float = 0.3) -> Assembly:
    return assembly(
        "swing",
        mass=Mass(mass=1.3),
        spring=tie(Spring(stiffness=40.0), "mass"),
        dashpot=tie(series(k=Spring(stiffness=25.0), c=Dashpot(damping=damping)), "mass"),
    )


def exact(model: FlatModel, times: np.ndarray, u: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """Linear system with inputs in lines between samples: matrix exponential of the augmented system."""
    linear = linearise(model, model.start(model.states))
    n, m = linear.B.shape
    x = [x0]
    for k in range(len(times) - 1):
        h = times[k + 1] - times[k]
        big = np.zeros((n + 2 * m, n + 2 * m))
        big[:n, :n], big[:n, n : n + m], big[n : n + m, n + m :] = linear.A, linear.B, np.eye(m)
        z = np.concatenate([x[-1], u[:, k], (u[:, k + 1] - u[:, k]) / h])
        x.append((expm(big * h) @ z)[:n])
    return np.array(x).T


# --- accuracy -------------------------------------------------------------------------------------


def test_samples_run_in_lines_between_times() -> None:
    model = flatten(swing())
    force = np.random.default_rng(1).normal(size=len(TIMES))
    run = simulate(model, TIMES, inputs={"mass.force": force}, start={"mass.position": 0.2})
    expected = exact(model, TIMES, force[None], np.array([0.2, 0.0, 0.0]))
    for name, row in zip([v.name for v in model.states], expected, strict=True):
        assert np.max(np.abs(run[name] - row)) <= 1e-9 * np.max(np.abs(row)), name


def test_samples_can_be_held() -> None:
    model = flatten(swing())
    force = np.random.default_rng(2).normal(size=len(TIMES))
    run = simulate(model, TIMES, inputs={"mass.force": force}, hold=True)
    linear = linearise(model, [0.0, 0.0, 0.0])
    x = np.zeros(3)
    block = expm(np.block([[linear.A, linear.B], [np.zeros((1, 4))]]) * 0.01)
    for k in range(len(TIMES) - 1):
        x = block[:3, :3] @ x + block[:3, 3] * force[k]
    assert [run[v.name][-1] for v in model.states] == pytest.approx(list(x), rel=1e-9)


def test_functions_are_held_too_if_asked() -> None:
    model = flatten(swing())
    held = simulate(model, TIMES, inputs={"mass.force": np.sin(3 * TIMES)}, hold=True)
    asked = simulate(model, TIMES, inputs={"mass.force": lambda t: math.sin(3 * t)}, hold=True)
    assert np.array_equal(held["mass.position"], asked["mass.position"])


@pytest.mark.parametrize("sine", [math.sin, np.sin])
def test_smooth_functions_are_followed_between_the_samples(sine: object) -> None:
    """Ten samples per second, a wave of 1 Hz: lines between samples would be 1 % off."""
    model = flatten(swing())
    times = np.linspace(0.0, 2.0, 21)
    drive = {"mass.force": lambda t: sine(2 * math.pi * t)}  # type: ignore[operator]
    run = simulate(model, times, inputs=drive, tolerance=1e-11)
    linear = linearise(model, [0.0, 0.0, 0.0])
    # The wave as two more states.
    big = np.zeros((5, 5))
    big[:3, :3], big[:3, 3] = linear.A, linear.B[:, 0]
    big[3, 4], big[4, 3] = 2 * math.pi, -2 * math.pi
    expected = np.array([(expm(big * t) @ [0, 0, 0, 0, 1.0])[:3] for t in times]).T
    for name, row in zip([v.name for v in model.states], expected, strict=True):
        assert np.max(np.abs(run[name] - row)) <= 1e-9 * np.max(np.abs(row)), name


def test_a_jump_between_two_samples_is_found() -> None:
    model = flatten(assembly("free", wheel=Inertia(inertia=2.0)))
    times = np.linspace(0.0, 1.0, 8)
    run = simulate(model, times, inputs={"wheel.torque": lambda t: 3.0 if t > 0.4321 else 0.0})
    after = np.clip(times - 0.4321, 0.0, None)
    assert run["wheel.speed"] == pytest.approx(1.5 * after, abs=1e-8)
    assert run["wheel.angle"] == pytest.approx(0.75 * after**2, abs=1e-8)


# Quicker: physics/test_dry_friction.py
@pytest.mark.slow
def test_dry_friction_against_another_integrator() -> None:
    """Narrow corners: tanh(ω/ω_s) with ω_s = 0.01 rad/s, Radau with tolerances of 1e-11 beside it."""
    made = assembly(
        "rub",
        wheel=Inertia(inertia=1e-3),
        spring=tie(Spring(stiffness=2.0, domain=ROTATION), "wheel"),
        rub=tie(CoulombFriction(sliding_effort=0.05, contact=Regularised(creep_speed=0.01)), "wheel"),
    )
    times = np.linspace(0.0, 0.5, 51)
    run = simulate(flatten(made), times, start={"wheel.angle": 0.3}, tolerance=1e-11)

    def rate(_: float, x: np.ndarray) -> list[float]:
        return [x[1], (-2.0 * x[0] - 0.05 * np.tanh(x[1] / 0.01)) / 1e-3]

    other = solve_ivp(rate, (0, 0.5), [0.3, 0.0], method="Radau", t_eval=times, rtol=1e-11, atol=1e-13)
    assert np.max(np.abs(run["wheel.angle"] - other.y[0])) < 2e-8
    assert np.max(np.abs(run["wheel.speed"] - other.y[1])) < 2e-6


def test_energy_of_inertia_and_spring_stays() -> None:
    """A hundred swings without loss: ½Jω² + ½kθ² stays to 1e-8, and the phase is √(k/J)·t."""
    made = assembly(
        "w", wheel=Inertia(inertia=0.02), spring=tie(Spring(stiffness=8.0, domain=ROTATION), "wheel")
    )
    period = 2 * math.pi / math.sqrt(8.0 / 0.02)
    times = np.linspace(0.0, 100 * period, 2001)
    run = simulate(flatten(made), times, start={"wheel.angle": 0.5})
    energy = 0.01 * run["wheel.speed"] ** 2 + 4.0 * run["wheel.angle"] ** 2
    assert np.max(np.abs(energy / energy[0] - 1)) < 1e-8
    assert np.max(np.abs(run["wheel.angle"] - 0.5 * np.cos(20.0 * times))) < 1e-7


def test_tolerance_is_obeyed() -> None:
    model = flatten(swing())
    force = np.random.default_rng(3).normal(size=21)
    times = np.linspace(0.0, 2.0, 21)
    expected = exact(model, times, force[None], np.zeros(3))
    errors = []
    for tolerance in (1e-4, 1e-7, 1e-10):
        run = simulate(model, times, inputs={"mass.force": force}, tolerance=tolerance)
        errors.append(
            max(np.max(np.abs(run[v.name] - x)) for v, x in zip(model.states, expected, strict=True))
        )
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-10


# --- stiff models ---------------------------------------------------------------------------------


def stiff_swing() -> FlatModel:
    """A relaxation time of 1e-9 s beside a swing of a second."""
    return flatten(swing(damping=2.5e-8))


@pytest.mark.parametrize("drive", ["samples", "function"])
def test_stiff_models_are_handed_over(drive: str) -> None:
    """Explicit steps would be 4e-9 s; the implicit method gets there, and meets the exact solution."""
    model = stiff_swing()
    given = np.sin(3 * TIMES) if drive == "samples" else lambda t: math.sin(3 * t)
    with pytest.raises(TooStiffError):
        integrate_explicitly(
            model, drives_of(model, TIMES, {"mass.force": given}, hold=False), np.zeros(3), 1e-9
        )
    run = simulate(model, TIMES, inputs={"mass.force": given})
    if drive == "samples":
        expected = exact(model, TIMES, np.sin(3 * TIMES)[None], np.zeros(3))[0]
    else:
        linear = linearise(model, [0.0, 0.0, 0.0])
        big = np.zeros((5, 5))
        big[:3, :3], big[:3, 3], big[3, 4], big[4, 3] = linear.A, linear.B[:, 0], 3.0, -3.0
        expected = np.array([(expm(big * t) @ [0, 0, 0, 0, 1.0])[0] for t in TIMES])
    assert np.max(np.abs(run["mass.position"] - expected)) < 1e-7 * np.max(np.abs(expected))


@pytest.mark.parametrize("hold", [False, True])
def test_both_methods_agree_with_several_inputs(hold: bool) -> None:
    """A mass between a force and a moving grip: three inputs, none of which may be taken for another."""
    inside = parallel(k=Spring(stiffness=40.0), c=Dashpot(damping=0.5))
    made = assembly(
        "m", mass=Mass(mass=1.3), grip=Driven(domain=TRANSLATION), link=tie(inside, "mass", "grip")
    )
    model, times, draw = flatten(made), np.linspace(0.0, 1.0, 21), np.random.default_rng(6)
    given = {v.name: draw.normal(size=21) for v in model.inputs}
    drives = drives_of(model, times, given, hold=hold)
    explicit, _ = integrate_explicitly(model, drives, np.array([0.1, 0.0]), 1e-10)
    implicit = integrate_implicitly(model, drives, 0, np.array([0.1, 0.0]), 1e-10)
    for one, other in zip(explicit, implicit, strict=True):
        assert np.max(np.abs(one - other)) < 1e-7 * np.max(np.abs(one))


def test_time_itself_may_stand_in_the_equations() -> None:
    """ẋ = t·cos t, x = t·sin t + cos t − 1; by both methods."""
    t, x = ca.SX.sym("t"), ca.SX.sym("x")
    none = [ca.SX.sym(n, 0) for n in "upw"]
    model = FlatModel(
        "clock",
        "",
        (Variable("x", "1", "x"),),
        (),
        (),
        (),
        (),
        ca.Function("e", [t, x, *none], [t * ca.cos(t), ca.SX(0, 1), ca.SX(0, 1), ca.SX(0, 1)]),
    )
    times = np.linspace(0.0, 6.0, 13)
    expected = times * np.sin(times) + np.cos(times) - 1.0
    assert simulate(model, times)["x"] == pytest.approx(expected, abs=1e-9)
    other = integrate_implicitly(model, drives_of(model, times, {}, hold=False), 0, np.zeros(1), 1e-9)
    assert other[0] == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("hold", [False, True])
def test_both_methods_agree_where_both_work(hold: bool) -> None:
    model = flatten(swing(damping=0.05))
    times = np.linspace(0.0, 1.0, 41)
    given = {"mass.force": np.random.default_rng(5).normal(size=41)}
    drives = drives_of(model, times, given, hold=hold)
    explicit, _ = integrate_explicitly(model, drives, np.array([0.1, 0.0, 0.0]), 1e-10)
    implicit = integrate_implicitly(model, drives, 0, np.array([0.1, 0.0, 0.0]), 1e-10)
    for one, other in zip(explicit, implicit, strict=True):
        assert np.max(np.abs(one - other)) < 1e-7 * np.max(np.abs(one))


def test_implicit_method_follows_functions_with_corners() -> None:
    model = flatten(swing())
    times = np.linspace(0.0, 1.0, 5)

    def drive(t: float) -> float:
        return abs(math.sin(5 * t)) + (2.0 if t > 0.3 else 0.0)

    drives = drives_of(model, times, {"mass.force": drive}, hold=False)
    one, _ = integrate_explicitly(model, drives, np.zeros(3), 1e-11)
    other = integrate_implicitly(model, drives, 0, np.zeros(3), 1e-9)
    assert np.max(np.abs(one - other)) < 1e-4 * np.max(np.abs(one))


# --- what comes out -------------------------------------------------------------------------------


def test_a_trace_holds_everything_by_name_with_units() -> None:
    model = flatten(swing())
    run = simulate(model, TIMES, inputs={"mass.force": 2.0})
    for variable in model.states + model.inputs + model.signals + model.outputs:
        assert run[variable.name].shape == TIMES.shape
        assert run.units[variable.name] == variable.unit
    k = 100
    at = model.evaluate([run[v.name][k] for v in model.states], [2.0])
    for name in ("spring.force", "dashpot.force", "mass.acceleration"):
        assert run[name][k] == pytest.approx(at[name], rel=1e-12)


def test_models_without_states_are_evaluated() -> None:
    model = flatten(
        assembly(
            "s",
            p=Driven(domain=TRANSLATION),
            s=tie(parallel(k=Spring(stiffness=3), c=Dashpot(damping=2)), "p"),
        )
    )
    run = simulate(model, TIMES, inputs={"p.position": np.sin(TIMES), "p.speed": np.cos(TIMES)})
    assert run["s.force"] == pytest.approx(3 * np.sin(TIMES) + 2 * np.cos(TIMES), abs=1e-13)


def test_start_values_come_from_the_model_and_can_be_given() -> None:
    model = flatten(swing()).with_values({"mass.position": 0.1, "mass.force": 4.0})
    run = simulate(model, TIMES, start={"mass.speed": 2.0})
    assert (run["mass.position"][0], run["mass.speed"][0], run["mass.force"][7]) == (0.1, 2.0, 4.0)


def test_discrete_models_are_stepped() -> None:
    """x⁺ = a·x + w(u)·u with a table, by hand."""
    x, u, p, w = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p"), ca.SX.sym("w")
    table = Table("u", -1.0, 2.0, (Variable("w", "1", "w"),), np.array([[1.0], [3.0]]))
    model = FlatModel(
        "d",
        "",
        (Variable("x", "1", "x", 0.5),),
        (Variable("u", "1", "u"),),
        (Variable("p", "1", "p", 0.9),),
        (Variable("y", "1", "y"),),
        (),
        ca.Function("e", [ca.SX.sym("t"), x, u, p, w], [p * x + w * u, 2 * x, ca.SX(0, 1), ca.SX(0, 1)]),
        0.01,
        (table,),
    )
    times = 0.01 * np.arange(6)
    drive = np.array([-1.0, -0.5, 0.0, 0.5, 1.0, 5.0])
    run = simulate(model, times, inputs={"u": drive})
    state = 0.5
    for k in range(6):
        assert run["x"][k] == pytest.approx(state, rel=1e-14)
        assert run["y"][k] == pytest.approx(2 * state, rel=1e-14)
        state = 0.9 * state + float(np.clip(2.0 + drive[k], 1.0, 3.0)) * drive[k]
    with pytest.raises(ValueRangeError, match="sample time"):
        simulate(model, 2 * times)


def test_traces_interpolate_grow_and_write(tmp_path: Path) -> None:
    run = Trace(np.array([0.0, 1.0, 2.0]), {"a.b": np.array([0.0, 2.0, 1.0])}, {"a.b": "N"}, "t")
    assert run.at(np.array([0.5, 3.0]))["a.b"].tolist() == [1.0, 1.0]
    more = run.with_signals({"c": np.ones(3)}, {"c": "m"})
    assert "c" in more
    assert "c" not in run
    assert [*more] == [*more.keys()] == ["a.b", "c"]
    assert {name: values[0] for name, values in more.items()} == {"a.b": 0.0, "c": 1.0}
    assert dict(more)["c"].tolist() == [1.0, 1.0, 1.0]
    more.write_csv(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["time [s]", "a.b [N]", "c [m]"]
    assert [float(v) for v in rows[2]] == [1.0, 2.0, 1.0]
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]
    with pytest.raises(UnknownNameError):
        _ = run["a.c"]
    with pytest.raises(MeasurementError):
        Trace(np.zeros(3), {"a": np.zeros(2)}, {"a": "1"})


# --- what is refused ------------------------------------------------------------------------------

REFUSED = {
    "an input that is not there": ({"inputs": {"mass.forse": 1.0}}, UnknownNameError, "mass.force"),
    "a state that is not there": ({"start": {"mass.positoin": 1.0}}, UnknownNameError, "mass.position"),
    "a sample that is no number": (
        {"inputs": {"mass.force": np.where(TIMES == 1.0, np.nan, 0)}},
        ValueRangeError,
        "t = 1 s",
    ),
    "a function that gives none": (
        {"inputs": {"mass.force": lambda t: math.nan if t > 1 else 0.0}},
        ValueRangeError,
        "not finite",
    ),
    "too few samples": ({"inputs": {"mass.force": np.zeros(7)}}, ValueRangeError, "shape"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_inputs_that_cannot_be(name: str) -> None:
    given, kind, said = REFUSED[name]
    with pytest.raises(kind, match=said):
        simulate(flatten(swing()), TIMES, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("times", [[0.0], [0.0, 0.0], [0.0, 2.0, 1.0], [0.0, math.nan], [[0.0, 1.0]]])
def test_times_that_do_not_ascend(times: list[float]) -> None:
    with pytest.raises(NlsError):
        simulate(flatten(swing()), np.array(times))


def test_an_explosion_is_an_error_not_a_number() -> None:
    """ẋ = x² reaches infinity at t = 1."""
    x = ca.SX.sym("x")
    none = [ca.SX.sym(n, 0) for n in "upw"]
    model = FlatModel(
        "boom",
        "",
        (Variable("x", "1", "x", 1.0),),
        (),
        (),
        (),
        (),
        ca.Function("e", [ca.SX.sym("t"), x, *none], [x**2, ca.SX(0, 1), ca.SX(0, 1), ca.SX(0, 1)]),
    )
    assert simulate(model, np.array([0.0, 0.5]))["x"][-1] == pytest.approx(2.0, rel=1e-9)
    with pytest.raises(ConvergenceError):
        simulate(model, np.array([0.0, 0.5, 1.5]))


def test_an_equation_that_was_not_solved_is_an_error() -> None:
    """A dry brake in series with a spring cannot carry more than its sliding torque."""
    made = assembly(
        "slip",
        shaft=Driven(),
        s=tie(
            series(
                k=Spring(stiffness=1.0, domain=ROTATION),
                brake=CoulombFriction(sliding_effort=0.1, contact=Regularised(creep_speed=0.02)),
            ),
            "shaft",
        ),
    )
    model = flatten(made)
    ramp = {"shaft.angle": lambda t: 0.05 * t, "shaft.speed": lambda t: 0.05}
    assert simulate(model, np.linspace(0, 1, 11), inputs=ramp)["s.torque"][-1] < 0.1
    with pytest.raises(ConvergenceError):
        simulate(model, np.array([0.0, 0.01]), inputs={"shaft.angle": 1.0, "shaft.speed": 0.0})


def test_copies_of_a_model_do_not_share_numbers() -> None:
    """The step is compiled once for all copies; the numbers are handed to it each time."""
    model = flatten(swing())
    other = model.with_values({"spring.stiffness": 160.0})
    again = replace(model, name="again")
    runs = [simulate(m, TIMES, start={"mass.position": 0.1})["mass.position"] for m in (model, other, again)]
    assert np.array_equal(runs[0], runs[2])
    assert not np.allclose(runs[0], runs[1])


def test_no_oscillation_is_lost_on_a_coarse_grid() -> None:
    """A swing of 0.3 s seen every 5 s: the steps are the integrator's own affair."""
    made = assembly(
        "w",
        wheel=Inertia(inertia=0.02),
        d=tie(Dashpot(damping=1e-4, domain=ROTATION), "wheel"),
        spring=tie(Spring(stiffness=8.0, domain=ROTATION), "wheel"),
    )
    run = simulate(flatten(made), np.array([0.0, 5.0, 10.0]), start={"wheel.angle": 0.5})
    decay = 1e-4 / 0.04
    speed = math.sqrt(400.0 - decay**2)
    expected = 0.5 * math.exp(-decay * 10) * (math.cos(speed * 10) + decay / speed * math.sin(speed * 10))
    assert run["wheel.angle"][-1] == pytest.approx(expected, abs=1e-7)
