"""Co-simulation: wires by name, order and delay as stated, everything cleaned up whatever happens."""

from __future__ import annotations

import functools
import math
import os
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.export import cosimulate, export_fmu
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.foundation.errors import (
    ConvergenceError,
    ExportError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model.flat import FlatModel, Variable
from tests.hand_built import SAMPLE_TIME, controller, observer, plant

LOOP = {
    "observer.motor.angle": "plant.motor.angle",
    "observer.motor.current": "controller.motor.current",
    "controller.torque.actual": "observer.spring.torque",
    "plant.motor.current": "controller.motor.current",
}
ORDER = ("observer", "controller", "plant")


def desired(time: float) -> float:
    return 0.5 * math.sin(6.0 * time)


@pytest.fixture(scope="module")
def loop(tmp_path_factory) -> dict[str, Path]:
    """Plant as FMI 2.0, observer and controller as FMI 3.0."""
    folder = tmp_path_factory.mktemp("loop")
    return {
        "plant": export_fmu(plant(), folder / "plant.fmu", version="2.0"),
        "observer": export_fmu(observer(), folder / "observer.fmu"),
        "controller": export_fmu(controller(), folder / "controller.fmu"),
    }


@pytest.fixture(autouse=True)
def _nothing_left(tmp_path, monkeypatch):
    """Every test runs with a temporary folder of its own that must be empty in the end."""
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    here, mapped = os.getcwd(), loaded()
    yield
    assert list(place.iterdir()) == []
    assert os.getcwd() == here
    assert loaded() == mapped


def loaded() -> set[str]:
    """Libraries from unpacked FMUs that are mapped into this process."""
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return set()
    return {
        line.split(maxsplit=5)[-1]
        for line in maps.read_text().splitlines()
        if "nlsdesign-cosimulation" in line
    }


@functools.cache
def monolithic(count: int, *, late: bool) -> np.ndarray:
    """The same loop in one program: angle, torque estimate and current that hold at each sample.

    ``late``: observer's torque and controller's current arrive one sample late, and before the first sample
    the instances show what it would give. Otherwise only the observer is told the last sample's current, and
    zero, the start of that input, before the first.
    """
    model, state = plant(), np.array([0.0, 0.1, 0.0])
    parameters = model.start(model.parameters)
    estimator, regulator = GuardedModel(observer()), GuardedModel(controller())
    torque, current, rows = 0.0, 0.0, []
    if late:
        torque = GuardedModel(observer()).step([0.1, 0.0])[0][0]
        current = GuardedModel(controller()).step([desired(0.0), torque])[0][0]
    for k in range(count + 1):
        new_torque = estimator.step([state[1], current])[0][0]
        new_current = regulator.step([desired(k * SAMPLE_TIME), torque if late else new_torque])[0][0]
        acting = current if late else new_current
        torque, current = new_torque, new_current
        rows.append([state[1], torque, current])
        solution = solve_ivp(
            lambda t, x, u=acting: np.array(model.equations(t, x, u, parameters, [])[0]).ravel(),
            (0.0, SAMPLE_TIME), state, method="DOP853", rtol=1e-11, atol=1e-14,
        )  # fmt: skip
        state = solution.y[:, -1]
    return np.array(rows)


@pytest.mark.long_cases(
    "all read first-0.00025", "all read first-0.01", "one after another-0.0007", "one after another-None"
)
@pytest.mark.parametrize("step", [None, SAMPLE_TIME / 4, 0.0007, 0.01])
@pytest.mark.parametrize("order", [(), ORDER], ids=["all read first", "one after another"])
def test_the_closed_loop_is_that_of_one_program_whatever_the_step(order, step, loop):
    count = 120
    run = cosimulate(
        fmus=loop,
        wires=LOOP,
        inputs={"controller.torque.desired": desired},
        stop=count * SAMPLE_TIME,
        order=order,
        step=step,
    )
    every = (len(run.time) - 1) // count
    np.testing.assert_allclose(run.time[::every], SAMPLE_TIME * np.arange(count + 1), rtol=1e-12)
    found = np.column_stack(
        [run["plant.motor.angle"], run["observer.spring.torque"], run["controller.motor.current"]]
    )
    found = found[::every]
    expected = monolithic(count, late=not order)
    assert run.step == (step or SAMPLE_TIME)
    assert np.all(np.ptp(expected, axis=0) > [0.05, 0.3, 0.3])
    assert np.abs(found - expected).max(axis=0) == pytest.approx(0, abs=1e-6)
    # The two orders are different systems; the comparison can tell them apart.
    assert np.abs(found - monolithic(count, late=bool(order))).max() > 1e-3


def test_the_stated_delays_are_those_of_the_run(loop):
    run = {
        order: cosimulate(fmus=loop, wires=LOOP, inputs={}, stop=0.002, order=order)
        for order in ((), ORDER, ("plant", "observer", "controller"))
    }
    assert dict(run[()].delays) == {
        "observer.motor.angle": 0.0,
        "observer.motor.current": SAMPLE_TIME,
        "controller.torque.actual": SAMPLE_TIME,
        "plant.motor.current": SAMPLE_TIME,
    }
    assert dict(run[ORDER].delays) == {
        "observer.motor.angle": 0.0,
        "observer.motor.current": SAMPLE_TIME,
        "controller.torque.actual": 0.0,
        "plant.motor.current": 0.0,
    }
    # A sample reads a continuous value at its own time, whatever the order.
    assert run["plant", "observer", "controller"].delays["observer.motor.angle"] == 0.0


def test_the_result_has_named_columns_with_units_and_the_given_inputs(loop):
    table = ([0.0, 0.01, 0.02], [0.0, 2.0, -2.0])
    run = cosimulate(
        fmus={"plant": loop["plant"]}, wires={}, inputs={"plant.motor.current": table}, stop=0.03
    )
    assert run.time == pytest.approx(np.arange(31) * 1e-3)
    np.testing.assert_allclose(run["plant.motor.current"], np.interp(run.time, *table))
    assert run.trace.units["plant.spring.torque"] == "N*m/rad"
    assert run.trace.units["plant.motor.angle"] == "rad"
    assert "plant.der(motor.speed)" in run.trace
    rate = np.gradient(run["plant.motor.angle"], run.time)
    np.testing.assert_allclose(run["plant.motor.speed"][2:-2], rate[2:-2], atol=0.05)


def test_parameters_and_start_values_are_set(loop):
    def angle(**values: float) -> np.ndarray:
        given = {f"plant.{name.replace('__', '.')}": value for name, value in values.items()}
        return cosimulate(fmus={"plant": loop["plant"]}, wires={}, inputs={}, stop=0.02, parameters=given)[
            "plant.motor.angle"
        ]

    assert angle(motor__angle=0.3)[0] == 0.3
    assert abs(angle(motor__inertia=6e-3)[-1] - angle()[-1]) > 1e-3


def test_samples_are_kept_with_a_finer_communication_step(loop):
    signals = {"observer.motor.angle": lambda t: 0.3 + t, "observer.motor.current": math.cos}
    fine = cosimulate(
        fmus={"observer": loop["observer"]}, wires={}, inputs=signals, stop=0.05, step=SAMPLE_TIME / 4
    )
    coarse = cosimulate(fmus={"observer": loop["observer"]}, wires={}, inputs=signals, stop=0.05)
    np.testing.assert_allclose(
        fine["observer.spring.torque"][::4], coarse["observer.spring.torque"], rtol=1e-12
    )
    held = fine["observer.spring.torque"][:-1].reshape(-1, 4)
    assert np.all(held == held[:, :1])


# --- mistakes -------------------------------------------------------------------------------------


def plain(loop, **changes):
    given = {"fmus": loop, "wires": LOOP, "inputs": {"controller.torque.desired": desired}, "stop": 0.01}
    return cosimulate(**(given | changes))


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"wires": {"observer.motor.angel": "plant.motor.angle"}}, UnknownNameError, "observer.motor.angle"),
        ({"wires": {"observer.motor.angle": "plant.motor.angel"}}, UnknownNameError, "plant.motor.angle"),
        ({"wires": {"observer.motor.angle": "plant.motor.inertia"}}, UnknownNameError, "wire from output"),
        ({"inputs": {"controler.torque.desired": desired}}, UnknownNameError, "controller.torque.desired"),
        ({"inputs": {"plant.motor.current": desired}}, ExportError, "by a wire and by a signal"),
        ({"parameters": {"plant.motor.inertai": 1.0}}, UnknownNameError, "plant.motor.inertia"),
        ({"parameters": {"plant.motor.inertia": -1.0}}, ExportError, "must lie in"),
        ({"wires": {"observer.motor.angle": "plant.spring.torque"}}, UnitError, "N*m/rad"),
        ({"order": ("plant", "observer")}, ValueRangeError, "each of plant, observer, controller once"),
        ({"order": ("plant", "observer", "controler")}, UnknownNameError, "did you mean 'controller'"),
        ({"step": 1e-12}, ValueRangeError, "communication points"),
        ({"step": -1.0}, ValueRangeError, "positive"),
        ({"stop": 0.0}, ValueRangeError, "positive"),
        ({"inputs": {"plant.motor.current": lambda t: math.nan}, "wires": {}}, ExportError, "current = nan"),
    ],
)  # fmt: skip
def test_a_mistake_is_named(changes, error, words, loop):
    with pytest.raises(error) as caught:
        plain(loop, **changes)
    assert words in str(caught.value)


def test_a_file_that_is_no_fmu_or_for_another_machine_is_named(loop, tmp_path):
    (tmp_path / "text.fmu").write_text("no archive")
    with pytest.raises(ExportError, match=r"instance 'plant' .*text\.fmu.*not a valid archive"):
        plain(loop | {"plant": tmp_path / "text.fmu"})
    foreign = export_fmu(plant(), tmp_path / "foreign.fmu", platforms=["x86_64-windows"])
    if os.name != "nt":
        with pytest.raises(ExportError, match="no binary for this machine"):
            plain(loop | {"plant": foreign})
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(loop["observer"]) as old, zipfile.ZipFile(broken, "w") as new:
        for name in old.namelist():
            new.writestr(name, b"not a library" if name.startswith("binaries/") else old.read(name))
    with pytest.raises(ExportError, match="does not load"):
        plain(loop | {"observer": broken})
    with pytest.raises(ExportError, match="one word without a dot"):
        plain({"my.plant": loop["plant"]}, wires={}, inputs={})


def test_an_instance_that_fails_says_when_and_why(tmp_path):
    x, u, nothing = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)], [x**2 + u, x, nothing, nothing]
    )
    state = Variable("x", "1", "State", 1.0)
    model = FlatModel(
        "exploding",
        "No solution after 1 s",
        (state,),
        (Variable("u", "1", "Input"),),
        (),
        (state,),
        (),
        equations,
    )
    for version in ("2.0", "3.0"):
        file = export_fmu(model, tmp_path / "x.fmu", version=version)
        with pytest.raises(
            ConvergenceError, match=r"instance 'x', step from (0\.9\d*|1) s.*no step size gives"
        ):
            cosimulate(fmus={"x": file}, wires={}, inputs={}, stop=2.0, step=0.01)


def test_a_signal_that_raises_leaves_nothing_behind(loop):
    def broken(time: float) -> float:
        if time > 0.005:
            raise RuntimeError("sensor cable")
        return 0.0

    with pytest.raises(RuntimeError, match="sensor cable"):
        plain(loop, inputs={"controller.torque.desired": broken})


def test_units_that_differ_by_the_radian_only_are_joined(tmp_path, loop):
    base = controller()
    inputs = tuple(replace(v, unit="N*m") if v.name == "torque.actual" else v for v in base.inputs)
    other = export_fmu(replace(base, inputs=inputs), tmp_path / "controller.fmu")
    run = plain(loop | {"controller": other})
    np.testing.assert_array_equal(run["plant.motor.angle"], plain(loop)["plant.motor.angle"])


@pytest.mark.skipif(
    not hasattr(os, "fork"), reason="without fork FMUs always run in this process: nothing to compare"
)
def test_without_fork_the_fmus_run_in_this_process_with_the_same_result(loop, monkeypatch):
    isolated = plain(loop)
    monkeypatch.delattr(os, "fork")
    here = plain(loop)
    for name in isolated.trace.signals:
        np.testing.assert_array_equal(here[name], isolated[name])
    with pytest.raises(ExportError, match="current = nan"):
        plain(loop, wires={}, inputs={"plant.motor.current": lambda t: math.nan})
