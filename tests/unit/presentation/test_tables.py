"""Results as data frames, data sets, CasADi, SymPy and python-control, and back again."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import control
import numpy as np
import pytest
import sympy

from nlsdesign.bench.discrepancy import verdict_frames
from nlsdesign.bench.discrepancy.reporting.verdict import Course, NamedEffect, RecordGap, Verdict
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import design_cam
from nlsdesign.design.optimisation.pareto import FrontPoint, ParetoFront
from nlsdesign.feedback.analysis import Stability, over_angle
from nlsdesign.feedback.observer import SpreadErrors
from nlsdesign.foundation.csv_tables import data_frame, data_set
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError, MissingLibraryError, NlsError, ValueRangeError
from nlsdesign.model import FlatModel, casadi_dae, flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import Trace, simulate
from tests.cam_cases import CONCAVE, KEEP, PRETENSION, TARGET, actuator

DECK = "austin2015_figure_consistent"


def plant(name: str = "janot2019_positioning_drive") -> FlatModel:
    return flatten(declare(load_deck(name)))


@pytest.fixture(scope="module")
def trace() -> Trace:
    time = np.linspace(0.0, 1.0, 5)
    signals = {"motor.angle": np.sin(time), "spring.torque": 2.0 * time}
    return Trace(time, signals, {"motor.angle": "rad", "spring.torque": "N*m"}, "run")


def assert_same(one: Trace, other: Trace) -> None:
    assert (list(one.signals), dict(one.units), one.name) == (
        list(other.signals),
        dict(other.units),
        other.name,
    )
    np.testing.assert_array_equal(one.time, other.time)
    for name, values in one.signals.items():
        np.testing.assert_array_equal(values, other[name])


def test_a_trace_comes_back_from_a_data_frame(trace: Trace) -> None:
    pytest.importorskip("pandas")
    frame = trace.to_frame()
    assert frame.index.name == "time_s"
    assert frame.attrs["units"] == {"time_s": "s", "motor.angle": "rad", "spring.torque": "N*m"}
    assert_same(trace, Trace.from_frame(frame, name="run"))


def test_a_trace_comes_back_from_a_data_set_and_its_file(trace: Trace) -> None:
    pytest.importorskip("xarray")
    data = trace.to_xarray()
    assert (data["spring.torque"].attrs, data["time"].attrs) == ({"units": "N*m"}, {"units": "s"})
    assert float(data["spring.torque"].interp(time=0.6)) == pytest.approx(1.2)
    assert_same(trace, Trace.from_xarray(data))


def test_columns_need_a_unit_and_that_of_si(trace: Trace) -> None:
    pytest.importorskip("pandas")
    frame = trace.to_frame()
    frame.attrs.clear()
    with pytest.raises(MeasurementError, match=r"column 'motor.angle': has no unit -> give units="):
        Trace.from_frame(frame)
    with pytest.raises(MeasurementError, match=r"is in 'deg', a trace holds SI"):
        Trace.from_frame(frame, units={"motor.angle": "deg"})
    units = {"motor.angle": "rad", "spring.torque": "N*m"}
    assert_same(trace, Trace.from_frame(frame, units=units, name="run"))


@pytest.mark.parametrize(("library", "made"), [("pandas", data_frame), ("xarray", data_set)])
def test_a_missing_library_is_named_with_the_command(
    monkeypatch: pytest.MonkeyPatch, library: str, made: Any, trace: Trace
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    call = trace.to_frame if made is data_frame else trace.to_xarray
    with pytest.raises(MissingLibraryError, match=rf"needs {library}.*pip install 'nlsdesign\[tables\]'"):
        call()


def test_a_chart_as_frame_and_data_set() -> None:
    pytest.importorskip("xarray")
    chart = over_angle(
        flatten(declare(load_deck(DECK)), outputs=["spring.torque"]),
        [Stability()],
        angles=np.radians([5.0, 10.0, 20.0]),
    )
    frame, data = chart.to_frame(), chart.to_xarray()
    for column in chart.columns:
        np.testing.assert_array_equal(frame[column.name], chart[column.name])
        np.testing.assert_array_equal(data[column.name], chart[column.name])
        assert frame.attrs["units"][column.name] == data[column.name].attrs["units"] == column.unit
    np.testing.assert_array_equal(frame.index, chart.at)
    assert data[chart.argument.name].attrs["units"] == "rad"


@pytest.mark.slow
def test_a_design_and_its_tolerance_as_frames() -> None:
    pytest.importorskip("pandas")
    design = design_cam(
        actuator(CONCAVE),
        target=TARGET,
        free=PRETENSION,
        keep=KEEP,
    )
    frames = design.to_frames()
    torque = frames["torque"]
    np.testing.assert_array_equal(torque["torque"] - torque["target"], torque["error"])
    assert np.max(np.abs(torque["error"])) == design.check.largest
    numbers = frames["numbers"].set_index("name")
    assert numbers.loc["spring.pretension", "value"] == pytest.approx(
        1e3 * design.values["spring.pretension"].number
    )
    assert numbers.loc["spring.pretension", "unit"] == "mm"
    arms = numbers.filter(like="spring.cam.lever_arm", axis=0)
    assert tuple(arms["value"]) == design.values["spring.cam.lever_arm"].shown
    assert set(arms["unit"]) == {"m"}
    limit = frames["limits"].set_index("unit").loc["mm"].iloc[0]
    shown = next(state for state in design.limits if state.unit == "mm")
    assert limit["bound"] == pytest.approx(1e3 * shown.bound)
    assert len(numbers) == sum(len(q.values) for _, q in design.changes)
    assert set(frames["limits"].loc[frames["limits"]["active"], "limit"]) == set(design.active_limits)
    curves = frames["curves"]
    assert set(curves.columns) <= set(curves.attrs["units"])
    # The slope of the extension over the angle is the lever arm.
    slope = np.gradient(curves["extension"], curves.index)
    np.testing.assert_allclose(slope[2:-2], curves["lever_arm"].to_numpy()[2:-2], rtol=0.02, atol=1e-5)
    assert design.tolerance is not None
    tolerance = design.tolerance.to_frames()
    assert float(np.quantile(tolerance["draws"]["as_built"], 0.95)) == design.tolerance.quantiles[-1].value
    assert list(tolerance["causes"]["cause"]) == [each.cause.name for each in design.tolerance.causes]
    assert tolerance["causes"]["share"].is_monotonic_decreasing
    assert (tolerance["band"]["p05"] <= tolerance["band"]["p95"]).all()


def test_a_front_as_a_frame() -> None:
    pytest.importorskip("pandas")
    points = tuple(
        FrontPoint((0.001 * k, 2e-6), (("area", 1e-6 * k),), ("m^2",), ("strain",)) for k in (1, 2)
    )
    target = TARGET
    front = ParetoFront(target, ("error", "rubber"), ("mN*m", "cm^3"), points, (), ())
    frame = front.to_frame()
    assert frame["error"].tolist() == pytest.approx([1.0, 2.0])
    assert frame["rubber"].tolist() == pytest.approx([2.0, 2.0])
    assert frame["area"].tolist() == [1e-6, 2e-6]
    assert frame.attrs["units"] == {"error": "mN*m", "rubber": "cm^3", "area": "m^2"}


def test_errors_over_the_spread_as_a_data_set() -> None:
    pytest.importorskip("xarray")
    drawn = np.arange(12.0).reshape(2, 3, 2)
    causes = {"area": np.ones((2, 2)), "counts": np.zeros((2, 2))}
    errors = SpreadErrors(("a", "b"), (2.0, 5.0), "N*m", 1.0, np.eye(2), drawn, causes, np.zeros(0), 0)
    data = errors.to_xarray()
    assert dict(data.sizes) == {"observer": 2, "frequency": 2, "draw": 3, "cause": 2}
    assert float(data["drawn"].sel(observer="b", frequency=5.0, draw=1)) == drawn[1, 1, 1]
    median = data["drawn"].quantile(0.5, dim="draw").sel(observer="b")
    np.testing.assert_allclose(median, errors.quantile("b", 0.5))
    assert float(data["causes"].sel(cause="area").min()) == 1.0
    assert data["exact"].attrs["units"] == "N*m"


def test_a_verdict_as_frames() -> None:
    pytest.importorskip("pandas")
    gaps = (RecordGap("spring", "a", "fit", 50.0, 20.0, 10.0, 500, "N"),
            RecordGap("spring", "b", "held_out", 10.0, 3.0, 2.0, 100, "N"))  # fmt: skip
    numbers = {"rub.sliding_effort": (0.06, "N*m", 0.002)}
    effect = NamedEffect("coulomb_friction", "rub", numbers, (), 0.9, "", "")
    time = np.arange(3.0)
    course = Course("b", "cell.reading", "N", time, time, time + 1.0, time + 0.5, 0.1)
    machine = declare(load_deck("dfki_pendulum"))
    frames = verdict_frames(Verdict("named", (effect,), (), gaps, "spring", (), machine, machine, course))
    assert frames["gaps"][["before", "after"]].to_numpy().tolist() == [[50.0, 20.0], [10.0, 3.0]]
    row = ["coulomb_friction", "rub.sliding_effort", 0.06, "N*m", 0.002]
    assert frames["effects"].to_numpy().tolist() == [row]
    assert (frames["course"]["before"] - frames["course"]["measured"] == 1.0).all()
    assert frames["numbers"].empty


def test_casadi_integrates_the_plant_as_the_package_does() -> None:
    model = plant()
    dae = casadi_dae(model)
    outputs = ca.Function("y", [dae["x"], dae["u"], dae["p"]], [dae.pop("y")])
    run = ca.integrator("run", "cvodes", dae, 0.0, 0.2, {"reltol": 1e-10, "abstol": 1e-12})
    p = model.start(model.parameters)
    end = run(x0=model.start(model.states), u=[2.0], p=p)["xf"]
    own = simulate(model, np.linspace(0.0, 0.2, 11), inputs={model.inputs[0].name: lambda _: 2.0})
    np.testing.assert_allclose(
        np.array(end).ravel(), [own[v.name][-1] for v in model.states], rtol=1e-6, atol=1e-9
    )
    shown = np.array(outputs(end, [2.0], p)).ravel()
    np.testing.assert_allclose(shown, [own[v.name][-1] for v in model.outputs], rtol=1e-6, atol=1e-9)


def test_a_sampled_model_is_no_equation_for_an_integrator() -> None:
    from tests.hand_built import observer

    with pytest.raises(ValueRangeError, match="is sampled"):
        casadi_dae(observer())


@pytest.mark.parametrize("name", ["austin2015_soft_spring", "dfki_pendulum", "janot2019_positioning_drive"])
def test_sympy_has_the_whole_equations(name: str) -> None:
    model = plant(name)
    equations = model.symbolic_equations(longest=math.inf)
    rng = np.random.default_rng(2)
    x = [rng.normal(v.start, 0.2 * v.nominal) for v in model.states]
    u = [rng.normal(v.start, 0.2) for v in model.inputs]
    known: dict[Any, float] = {sympy.Symbol(n, real=True): v for n, v in model.values.items()}
    for group, values in ((model.states, x), (model.inputs, u)):
        known |= {sympy.Symbol(v.name, real=True): each for v, each in zip(group, values, strict=True)}
    for defined, expression in equations.definitions.items():
        known[sympy.Symbol(defined, real=True)] = float(expression.subs(known))
    own = model.evaluate(x, u)
    for state, expression in equations.derivatives.items():
        assert not expression.atoms(sympy.core.function.AppliedUndef)
        assert float(expression.subs(known)) == pytest.approx(own[f"der({state})"], rel=1e-12)
    for signal in (*model.outputs, *model.signals):
        if sympy.Symbol(signal.name, real=True) in known:
            value = known[sympy.Symbol(signal.name, real=True)]
            assert value == pytest.approx(own[signal.name], rel=1e-12, abs=1e-12)


def test_control_has_the_linear_model_with_its_names() -> None:
    model = plant(DECK)
    linear = linearise(model, [0.3, 0.0, 0.0])
    system = linear.to_control()
    for ours, theirs in (
        (linear.A, system.A),
        (linear.B, system.B),
        (linear.C, system.C),
        (linear.D, system.D),
    ):
        np.testing.assert_array_equal(ours, theirs)
    labels = (system.state_labels, system.input_labels, system.output_labels)
    names = (linear.states, linear.inputs, linear.outputs)
    assert labels == tuple([name.replace(".", "_") for name in group] for group in names)
    jw = 2j * math.pi * 3.0
    response = linear.C @ np.linalg.solve(jw * np.eye(3) - linear.A, linear.B) + linear.D
    np.testing.assert_allclose(control.ss(system)(jw), response[0, 0], rtol=1e-9)


def test_a_frame_is_not_needed_to_import_the_room(tmp_path: Path) -> None:
    import nlsdesign.foundation.csv_tables as room

    assert "pandas" not in vars(room)
    assert issubclass(MissingLibraryError, NlsError)
