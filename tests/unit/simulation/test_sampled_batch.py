"""Many runs of one sampled system: each is the run alone, compiled code gives the same."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import CoulombFriction, Inertia, assembly, tie
from nlsdesign.export import natively
from nlsdesign.export.compilation import compiled_step
from nlsdesign.export.compilation.columns_in_c import ColumnsInC, sampled_run_in_c
from nlsdesign.feedback.control import ClosedLoop, PidTorque, torque_controller
from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.foundation.errors import ExportError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import column_runs, sampled_batch
from nlsdesign.simulation.buffered import Translate, as_it_is
from nlsdesign.simulation.column_graph import ColumnGraph
from nlsdesign.simulation.sampled_batch import SampledSystem, run_batch
from nlsdesign.sweeps import run_sweep as same_bits_module
from nlsdesign.sweeps.run_sweep import same_bits
from tests import observed as ob

DESIRED = "controller.spring.torque.desired"
KEPT = ("plant.spring.torque", "observer.spring.torque", "plant.motor.current")


@pytest.fixture(scope="module")
def plant() -> FlatModel:
    return ob.bench(ob.SLOW, friction=0.02)


@pytest.fixture(scope="module")
def loop(plant: FlatModel) -> ClosedLoop:
    observer = design_observer(plant, gain=CascadeGain(), grid=FixedGrid(-1.2, 1.2, points=241))
    controller = torque_controller(plant, law=PidTorque())
    return ClosedLoop(plant=plant, observer=observer, controller=controller, wires=ob.WIRES)


@pytest.fixture(scope="module")
def system(loop: ClosedLoop) -> SampledSystem:
    return loop.system([DESIRED])


def wanted(time: float) -> float:
    return 0.3 * np.sin(2.0 * np.pi * 4.0 * time)


def test_each_run_of_a_batch_is_the_run_alone(loop: ClosedLoop, system: SampledSystem) -> None:
    """Longer than a chunk; inertia, a gain and the desired torque differ from run to run."""
    inertias, gains, sizes = (
        np.array([4e-4, 6e-4, 9e-4]),
        np.array([20.0, 30.0, 40.0]),
        np.array([1.0, 0.5, 2.0]),
    )
    time = 1e-3 * np.arange(301)
    batch = run_batch(
        system, 0.3, inputs={DESIRED: sizes[:, None] * np.array([wanted(t) for t in time])},
        parameters={"plant.motor.inertia": inertias, "controller.controller.proportional": gains}, keep=KEPT,
    )  # fmt: skip
    assert np.all(batch.finite)
    for i in range(3):
        alone = ClosedLoop(
            plant=loop.plant.with_values({"motor.inertia": inertias[i]}),
            observer=loop.observer,
            controller=loop.controller.with_values({"controller.proportional": gains[i]}),
            wires=ob.WIRES,
        ).run(0.3, inputs={DESIRED: lambda t, size=sizes[i]: size * wanted(t)})
        for name in KEPT:
            size = np.max(np.abs(alone[name]))
            assert size > 0.05
            assert np.max(np.abs(batch[name][i] - alone[name])) < 1e-9 * size, name


def test_compiled_code_gives_the_same(system: SampledSystem) -> None:
    runs = [
        run_batch(
            system, 0.3, inputs={DESIRED: wanted}, parameters={"plant.motor.inertia": np.array([4e-4, 9e-4])},
            keep=KEPT, **translated,
        )
        for translated in ({}, {"translate": natively})
    ]  # fmt: skip
    for name in KEPT:
        assert np.max(np.abs(runs[0][name] - runs[1][name])) < 1e-9, name


@pytest.mark.parametrize(("translate", "columns"), [(as_it_is, 11), (natively, 301)])
def test_columns_are_the_runs_alone(
    monkeypatch: pytest.MonkeyPatch, system: SampledSystem, translate: Translate, columns: int
) -> None:
    """Random numbers of plant and controller, also no multiple of eight columns, by NumPy and compiled.

    The operations are those of the single run. Compiled they give its bits; the elementary functions of NumPy
    may differ in the last digit, 2e-16, which a stable loop does not let grow beyond a few of them.
    """
    monkeypatch.setattr(column_runs, "MANY", 2)
    monkeypatch.setattr(sampled_batch, "COLUMNS", 100)
    random = np.random.default_rng(columns)
    numbers = {
        "plant.motor.inertia": random.uniform(4e-4, 9e-4, columns),
        "plant.spring.pretension": random.uniform(0.0, 1e-3, columns),
        "controller.controller.proportional": random.uniform(5.0, 15.0, columns),
    }
    start = {"plant.motor.angle": random.uniform(-0.1, 0.1, columns)}
    given = {"inputs": {DESIRED: wanted}, "keep": KEPT}
    batch = run_batch(system, 0.02, parameters=numbers, start=start, translate=translate, **given)
    for i in (0, columns // 2, columns - 1):
        one, begin = ({name: v[i : i + 1] for name, v in each.items()} for each in (numbers, start))
        alone = run_batch(system, 0.02, parameters=one, start=begin, **given)
        for name in KEPT:
            size = np.max(np.abs(alone[name]))
            allowed = 0.0 if translate is natively else 1e-10 * size
            assert size > 1e-6
            assert np.max(np.abs(batch[name][i] - alone[name][0])) <= allowed, (i, name)


def test_without_a_compiler_a_sweep_has_the_bits_of_compiled_code(
    monkeypatch: pytest.MonkeyPatch, system: SampledSystem
) -> None:
    """Also with so many columns that NumPy would be quicker, and where compiling fails in mid-run."""
    monkeypatch.setattr(column_runs, "MANY", 2)
    given = {"inputs": {DESIRED: wanted}, "keep": KEPT}
    numbers = {"plant.motor.inertia": np.linspace(4e-4, 9e-4, 9)}

    def without(*_: object, **__: object) -> None:
        raise ExportError("compiler", "is not there")

    runs = []
    broken_places = (
        None,
        (same_bits_module, "quickest", lambda: as_it_is),
        (compiled_step, "_built", without),
    )
    for place in broken_places:
        column_runs._column_run.cache_clear()
        with monkeypatch.context() as broken:
            if place is not None:
                broken.setattr(*place)
            runs.append(run_batch(system, 0.3, parameters=numbers, translate=same_bits, **given))
    column_runs._column_run.cache_clear()
    for name in KEPT:
        assert np.max(np.abs(runs[0][name])) > 0.05
        assert runs[0][name].tobytes() == runs[1][name].tobytes() == runs[2][name].tobytes(), name


def test_observers_of_other_numbers_share_compiled_code(
    monkeypatch: pytest.MonkeyPatch, plant: FlatModel
) -> None:
    """Tables and gains are given to the code, so a sweep of machines compiles once and gives each its own."""
    codes = []

    def noted(graph: ColumnGraph) -> ColumnsInC:
        codes.append(sampled_run_in_c(graph))
        return codes[-1]

    monkeypatch.setattr(compiled_step, "sampled_run_in_c", noted)
    for inertia in (5.3e-4, 7.1e-4):
        machine = plant.with_values({"motor.inertia": inertia})
        observer = design_observer(machine, gain=CascadeGain(), grid=FixedGrid(-1.2, 1.2, points=31))
        made = ClosedLoop(
            plant=machine, observer=observer, controller=torque_controller(machine), wires=ob.WIRES
        ).system([DESIRED])
        given = {"inputs": {DESIRED: wanted}, "keep": KEPT, "start": {"plant.motor.angle": np.zeros(8)}}
        batch = run_batch(made, 0.02, translate=natively, **given)
    alone = run_batch(made, 0.02, translate=as_it_is, **given)
    assert all(np.array_equal(batch[name], alone[name]) for name in KEPT), "the second has its own numbers"
    assert codes[0].text == codes[1].text
    assert not np.array_equal(codes[0].numbers, codes[1].numbers)


def test_a_plant_whose_laws_jump_is_refused(loop: ClosedLoop) -> None:
    rubbing = flatten(
        assembly(
            "rubbing",
            motor=Inertia(inertia=quantity(1e-3, "kg*m^2", source="assumed")),
            rub=tie(CoulombFriction(sliding_effort=0.1), "motor"),
        )
    )
    with pytest.raises(ValueRangeError, match=r"sharp laws rub.*smoothed\(assembly\)"):
        SampledSystem(plant=rubbing, blocks={"observer": loop.observer}, sources={}, driven=None)


@pytest.mark.parametrize("translate", [as_it_is, natively])
def test_a_run_that_diverges_is_marked_and_leaves_the_others_alone(
    loop: ClosedLoop, translate: Translate
) -> None:
    """One Runge-Kutta step per sample is unstable for a damping of 50 N·m·s/rad on the printed inertia."""
    coarse = ClosedLoop(
        plant=loop.plant, observer=loop.observer, controller=loop.controller, wires=ob.WIRES, substeps=1
    )
    batch = run_batch(
        coarse.system([DESIRED]), 2.0, inputs={DESIRED: 0.0}, start={"plant.motor.speed": 1.0},
        parameters={"plant.bearing.damping": np.array([0.5, 50.0])}, keep=("plant.motor.angle",),
        translate=translate,
    )  # fmt: skip
    assert batch.finite.tolist() == [True, False]
    assert np.all(np.isfinite(batch["plant.motor.angle"][0]))
    assert np.isnan(batch["plant.motor.angle"][1, -1])


def test_names_and_lengths_are_checked(system: SampledSystem) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'plant\.motor\.inertia'"):
        run_batch(system, 0.1, inputs={DESIRED: 0.0}, parameters={"plant.motor.inertai": 1.0}, keep=KEPT)
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.torque'"):
        run_batch(system, 0.1, inputs={DESIRED: 0.0}, keep=("plant.spring.torqe",))
    with pytest.raises(ValueRangeError, match="the run has 101 samples"):
        run_batch(system, 0.1, inputs={DESIRED: np.zeros(50)}, keep=KEPT)
    with pytest.raises(ValueRangeError, match=r"arrays of \[2, 3\] values"):
        run_batch(
            system, 0.1, inputs={DESIRED: 0.0}, keep=KEPT,
            parameters={"plant.motor.inertia": np.ones(2), "plant.bearing.damping": np.ones(3)},
        )  # fmt: skip
