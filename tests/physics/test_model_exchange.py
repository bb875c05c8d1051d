"""Model exchange: foreign integrators on the equations of an FMU against the package's own simulation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import fmpy
import numpy as np
import pytest

from models import cam_rubber_actuator
from nlsdesign.components import (
    ROTATION,
    CoulombFriction,
    Driven,
    Element,
    Inertia,
    RigidStop,
    Spring,
    StribeckFriction,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.export import export_fmu
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate
from tests.fmu_unit import VERSIONS, Unit, both, opened
from tests.hand_built import plant

STEP = 1e-3


def stairs(times: np.ndarray, values: np.ndarray, name: str) -> np.ndarray:
    """Return an input of fmpy that is held from each sample to the next; it makes an event of each step."""
    rows = [(times[0], values[0])]
    for before, value, time in zip(values, values[1:], times[1:], strict=False):
        rows += [(time, before), (time, value)] if value != before else []
    return np.array([*rows, (times[-1], values[-1])], dtype=[("time", float), (name, float)])


def exchanged(
    path: Path, times: np.ndarray, shown: list[str], tolerance: float, **more: object
) -> np.ndarray:
    """Run an FMU with the integrator CVode of fmpy."""
    return fmpy.simulate_fmu(
        str(path), fmi_type="ModelExchange", stop_time=times[-1], output_interval=times[1] - times[0],
        relative_tolerance=tolerance, output=shown, record_events=False, **more,
    )  # fmt: skip


# --- smooth models --------------------------------------------------------------------------------


def published() -> FlatModel:
    deck = load_deck("austin2015_figure_consistent")
    return flatten(cam_rubber_actuator(deck), inputs=["motor.current"], outputs=["motor.angle"])


@pytest.mark.parametrize(
    ("made", "version"), [(plant, "2.0"), (published, "3.0")], ids=["by hand", "published"]
)
def test_a_foreign_integrator_agrees_and_the_better_the_finer_it_is(made, version, tmp_path):
    """CVode's error accumulates over some hundred steps, so a thousand tolerances are allowed."""
    model, times = made(), STEP * np.arange(301)
    current = 3.0 * np.sin(40.0 * 0.02 * np.floor(times / 0.02 + 1e-9))
    shown = ["motor.angle", "motor.speed", "spring.torque"]
    own = simulate(model, times, inputs={"motor.current": current}, hold=True)
    path = export_fmu(model, tmp_path / "plant.fmu", version=version)
    worst = []
    for tolerance in (1e-5, 1e-7, 1e-9):
        run = exchanged(path, times, shown, tolerance, input=stairs(times, current, "motor.current"))
        assert len(run) == len(times)
        worst.append(max(np.abs(run[n] - own[n]).max() / np.abs(own[n]).max() for n in shown))
        assert worst[-1] < 1e3 * tolerance
    assert worst[0] > worst[1] > worst[2]


@both
def test_casadi_imports_the_plant_and_its_jacobian_is_that_of_central_differences(version, tmp_path):
    model = plant()
    folder = fmpy.extract(
        str(export_fmu(model, tmp_path / "plant.fmu", version=version)), str(tmp_path / "unpacked")
    )
    dae = ca.DaeBuilder("plant", str(folder))
    assert (dae.nx(), dae.nu(), dae.ny()) == (3, 1, 2)
    names = [v.name for v in model.states]
    assert dae.x() == names
    system = dae.create("system", ["x", "u"], ["ode", "y"])
    point, current = np.array([1e-3, 0.3, -2.0]), 1.0
    rate, shown = (np.array(each).ravel() for each in system(point, current))
    expected = model.evaluate(point.tolist(), [current])
    assert rate == pytest.approx([expected[f"der({n})"] for n in names], rel=1e-14)
    assert shown == pytest.approx([expected["motor.angle"], expected["spring.torque"]], rel=1e-14)
    blocks = [np.array(ca.DM(b)) for b in system.jacobian()(point, current, ca.DM.zeros(3), ca.DM.zeros(2))]
    found = np.vstack([np.hstack(blocks[:2]), np.hstack(blocks[2:])])

    def values(x: np.ndarray) -> np.ndarray:
        e = model.evaluate(x[:3].tolist(), x[3:].tolist())
        return np.array([e[f"der({n})"] for n in names] + [e["motor.angle"], e["spring.torque"]])

    at = np.append(point, current)
    for column, size in enumerate([1e-3, 1.0, 10.0, 5.0]):
        step = np.zeros(4)
        step[column] = 1e-5 * size
        slope = (values(at + step) - values(at - step)) / (2 * step[column])
        # Central differences are good to the square of the share that the step is.
        np.testing.assert_allclose(found[:, column], slope, rtol=1e-7, atol=1e-7 * np.abs(slope).max())
    assert math.isfinite(found.sum())


# --- sharp models ---------------------------------------------------------------------------------

J, K, T, PULL = 1e-3, 2.0, 0.05, 0.021


class Case(NamedTuple):
    """A sharp model with what it starts from, what drives it, and the efforts that hold at the end."""

    model: FlatModel
    start: dict[str, float]
    driven: dict[str, float]
    rate: str
    rests: bool
    holding: tuple[str, ...]


def rubbing(friction: Element) -> FlatModel:
    spring = tie(Spring(stiffness=K, domain=ROTATION), "wheel")
    return flatten(assembly("rubbing", wheel=Inertia(inertia=J), rub=tie(friction, "wheel"), spring=spring))


def bouncing() -> FlatModel:
    stop = RigidStop(lower=0.0, upper=1.0, restitution=0.6, resting_speed=1e-3)
    return flatten(assembly("stopped", wheel=Inertia(inertia=J), stop=tie(stop, "wheel")))


def clutch() -> FlatModel:
    rub = tie(CoulombFriction(sliding_effort=T), "driver", "driven")
    return flatten(assembly("clutch", driver=Inertia(inertia=2 * J), driven=Inertia(inertia=5 * J), rub=rub))


def struck() -> FlatModel:
    """Two bodies that stick to each other; where one strikes a stop, the other one slips."""
    spring, rub = Spring(stiffness=K, domain=ROTATION), CoulombFriction(sliding_effort=T)
    return flatten(
        assembly(
            "struck",
            motor=Inertia(inertia=J),
            load=Inertia(inertia=2 * J),
            rub=tie(rub, "motor", "load"),
            spring=tie(spring, "motor"),
            stop=tie(RigidStop(lower=-0.1, upper=0.1, restitution=0.5), "load"),
        )
    )


def belt() -> FlatModel:
    """Stick–slip on a belt that moves: the rate that is held is that to the belt, an input."""
    spring, rub = tie(Spring(stiffness=K, domain=ROTATION), "wheel"), tie(STRIBECK, "wheel", "belt")
    return flatten(assembly("belt", belt=Driven(), wheel=Inertia(inertia=J), spring=spring, rub=rub))


STRIBECK = StribeckFriction(sliding_effort=0.03, breakaway=0.04, stribeck_speed=0.5)
DROPPED, SPEED = {"wheel.angle": 0.33}, "wheel.speed"
SHARP = {
    "coulomb": lambda: Case(
        rubbing(CoulombFriction(sliding_effort=T)), DROPPED, {}, SPEED, True, ("rub.torque",)
    ),
    "stribeck": lambda: Case(rubbing(STRIBECK), DROPPED, {}, SPEED, True, ("rub.torque", "spring.torque")),
    "bouncing": lambda: Case(
        bouncing(), {"wheel.angle": 0.5}, {"wheel.torque": -0.02}, SPEED, True, ("stop.torque",)
    ),
    "clutch": lambda: Case(
        clutch(), {"driver.speed": 2.0}, {"driver.torque": PULL}, "driver.speed", False, ("rub.torque",)
    ),
    "struck": lambda: Case(struck(), {"motor.speed": 2.0, "load.speed": 2.0}, {}, "load.speed", False, ()),
    "belt": lambda: Case(belt(), {SPEED: 0.4}, {"belt.speed": 0.4}, SPEED, False, ()),
}
TIMES = np.linspace(0.0, 1.0, 101)
each_sharp = pytest.mark.parametrize("name", SHARP)
FAST = [("coulomb", "2.0"), *((name, "3.0") for name in SHARP)]
each_sharp_unit = pytest.mark.parametrize(
    ("name", "version"),
    [
        pytest.param(name, version, marks=[] if (name, version) in FAST else [pytest.mark.slow])
        for name in SHARP
        for version in VERSIONS
    ],
)


class Units(dict[tuple[str, str], Path]):
    """FMU of each sharp case and version, written when it is asked for."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    def __missing__(self, key: tuple[str, str]) -> Path:
        name, version = key
        self[key] = export_fmu(SHARP[name]().model, self.folder / f"{name}{version}.fmu", version=version)
        return self[key]


@pytest.fixture(scope="module")
def sharp(tmp_path_factory) -> Units:
    return Units(tmp_path_factory.mktemp("sharp"))


def after_last_event(run: Trace) -> np.ndarray:
    return run.time > run.events[-1].time + 1e-3


@each_sharp_unit
def test_a_foreign_integrator_finds_the_events_of_a_sharp_model(name, version, sharp):
    """States as for smooth models, in units of their value or nominal value: CVode measures by them."""
    case = SHARP[name]()
    own = simulate(case.model, TIMES, start=case.start, inputs=case.driven, tolerance=1e-11)
    assert len(own.events) >= 1
    shown = [*(v.name for v in case.model.states), *case.holding]
    description = fmpy.read_model_description(str(sharp[name, version]))
    nominal = {v.name: float(v.nominal) for v in description.modelVariables if v.nominal}
    worst = []
    for tolerance in (1e-7, 1e-9):
        run = exchanged(sharp[name, version], TIMES, shown, tolerance, start_values=case.start | case.driven)
        sizes = {n: max(np.abs(own[n]).max(), nominal[n]) for n in (v.name for v in case.model.states)}
        worst.append(max(np.abs(run[n] - own[n]).max() / size for n, size in sizes.items()))
        assert worst[-1] < 1e3 * tolerance
        rest = after_last_event(own)
        if case.rests:
            assert np.all(run[case.rate][rest] == 0.0)
        for n in case.holding:
            # What holds is seen where it sticks, also when what is held is the rate between two bodies. It
            # carries the error of the efforts that it balances.
            size = max(np.abs(own[v.name]).max() for v in case.model.outputs)
            assert run[n][rest] == pytest.approx(own[n][rest], rel=0.0, abs=1e3 * tolerance * size)
            assert np.all(np.abs(run[n][rest]) > 1e-3)
    assert worst[1] < worst[0]


@each_sharp_unit
def test_co_simulation_of_a_sharp_model_locates_its_own_events(name, version, sharp):
    """An L-stable method of order four with its tolerance per step, over some hundred steps."""
    case = SHARP[name]()
    own = simulate(case.model, TIMES, start=case.start, inputs=case.driven, tolerance=1e-11)
    shown = [*(v.name for v in case.model.states), *case.holding]
    for interval in (0.01, 0.25):
        times = np.arange(round(1.0 / interval) + 1) * interval
        places = np.searchsorted(TIMES, times - 1e-9)
        run = fmpy.simulate_fmu(
            str(sharp[name, version]), fmi_type="CoSimulation", stop_time=1.0, output_interval=interval,
            start_values=case.start | case.driven, relative_tolerance=1e-9, output=shown,
        )  # fmt: skip
        for n in shown:
            assert np.abs(run[n] - own[n][places]).max() < 1e-6 * np.abs(own[n]).max(), n
        if case.rests:
            assert run[case.rate][-1] == 0.0


@each_sharp
def test_event_mode_and_early_return_stop_at_the_events(name, sharp):
    case = SHARP[name]()
    own = simulate(case.model, TIMES, start=case.start, inputs=case.driven, tolerance=1e-11)
    run = fmpy.simulate_fmu(
        str(sharp[name, "3.0"]), fmi_type="CoSimulation", stop_time=1.0, output_interval=0.01,
        start_values=case.start | case.driven, relative_tolerance=1e-10, output=[case.rate],
        use_event_mode=True, early_return_allowed=True,
    )  # fmt: skip
    off_grid = [t for t in run["time"].tolist() if abs(100 * t - round(100 * t)) > 1e-6]
    events = sorted({e.time for e in own.events if abs(100 * e.time - round(100 * e.time)) > 1e-6})
    # Before and after each event.
    assert off_grid == pytest.approx([t for t in events for _ in range(2)], abs=1e-8)
    assert len(events) >= 1


def test_two_bodies_that_stick_keep_their_momentum(sharp):
    """A torque of 0.021 N·m for 1 s and 2 rad/s of the driver; both bodies are as one after they meet."""
    run = exchanged(
        sharp["clutch", "3.0"], TIMES, ["driver.speed", "driven.speed", "rub.torque"], 1e-9,
        start_values={"driver.speed": 2.0, "driver.torque": PULL},
    )  # fmt: skip
    # Relative deceleration T/(2 J) + T/(5 J) − 0.021/(2 J).
    meet = 2.0 / (T / (2 * J) + T / (5 * J) - PULL / (2 * J))
    stuck = meet + 1e-3 < TIMES
    assert 0.05 < meet < 0.5
    assert np.all(np.abs(run["driver.speed"] - run["driven.speed"])[stuck] < 1e-14)
    assert run["driven.speed"][stuck] == pytest.approx(
        (2 * J * 2.0 + PULL * TIMES[stuck]) / (7 * J), rel=1e-7
    )
    assert run["rub.torque"][stuck] == pytest.approx(np.full(stuck.sum(), PULL * 5 / 7), rel=1e-12)


def test_a_short_touch_within_one_long_step_is_not_missed(sharp):
    """Thrown at the upper stop and free again at the end of the only step: 0.9 + 2.2·t − 10·t²."""
    start, length = {"wheel.angle": 0.9, "wheel.speed": 2.2}, 0.2
    with opened(sharp["bouncing", "3.0"]) as unit:
        unit.put(start)
        unit.begin().run()
        unit.set(wheel__torque=-0.02)
        unit.step(length)
        found = unit.get("wheel.angle", "wheel.speed")
    # Meets 1 at the smaller root of 10·t² − 2.2·t + 0.1 = 0 with 2.2 − 20·t, and leaves with 0.6 of that.
    meets = (2.2 - math.sqrt(2.2**2 - 4.0)) / 20.0
    speed, rest = -0.6 * (2.2 - 20.0 * meets), length - meets
    assert 0.9 + 2.2 * length - 10.0 * length**2 < 1.0
    assert found == pytest.approx([1.0 + speed * rest - 10.0 * rest**2, speed - 20.0 * rest], rel=1e-9)


@both
def test_events_are_located_at_a_large_time_as_from_zero(version, sharp):
    rows = []
    with opened(sharp["coulomb", version]) as unit:
        for start in (0.0, 1.7e9):
            unit.raw.reset()
            unit.put(DROPPED)
            unit.begin(start=start).run()
            for _ in range(600):
                unit.step(STEP)
            rows.append(unit.get("wheel.angle", "wheel.speed", "rub.mode"))
    assert rows[0][1:] == [0.0, 0.0]
    assert rows[1] == pytest.approx(rows[0], rel=1e-12)


@each_sharp_unit
def test_a_restored_copy_of_a_sharp_model_goes_on_bit_by_bit(name, version, sharp):
    case = SHARP[name]()
    shown = [v.name for v in (*case.model.states, *case.model.outputs)]

    def stepped(unit: Unit) -> list[list[float]]:
        rows = []
        for k in range(150):
            unit.step(STEP * (1 + k % 4))
            rows.append(unit.get(*shown))
        return rows

    with opened(sharp[name, version]) as unit:
        unit.put(case.start | case.driven)
        unit.begin().run()
        stepped(unit)
        copy, time = unit.raw.getFMUState(), unit.time
        written = unit.raw.serializeFMUState(copy)
        first = stepped(unit)
        unit.raw.setFMUState(copy)
        unit.raw.freeFMUState(copy)
        unit.time = time
        assert stepped(unit) == first
        with opened(sharp[name, version]) as other:
            read = other.raw.deserializeFMUState(written)
            other.raw.setFMUState(read)
            other.raw.freeFMUState(read)
            other.time = time
            assert stepped(other) == first


@pytest.mark.parametrize(("kind", "version"), [("ModelExchange", "3.0"), ("CoSimulation", "2.0")])
def test_the_published_actuator_with_dry_friction_that_sticks(kind, version, tmp_path):
    actuator = cam_rubber_actuator(load_deck("austin2015_figure_consistent"))
    law = CoulombFriction(sliding_effort=0.1)
    rubs = [
        name for name, part in actuator.parts if isinstance(getattr(part, "element", None), CoulombFriction)
    ]
    actuator = actuator.with_part(rubs[0], law)
    model = flatten(actuator, inputs=["motor.current"], outputs=["motor.angle"])
    times = STEP * np.arange(401)
    current = 1.0 * np.sin(12.0 * 0.02 * np.floor(times / 0.02 + 1e-9))
    own = simulate(model, times, inputs={"motor.current": current}, hold=True, tolerance=1e-10)
    assert sum(e.what == "sticks" for e in own.events) >= 2
    shown = ["motor.angle", "motor.speed"]
    run = fmpy.simulate_fmu(
        str(export_fmu(model, tmp_path / "sharp.fmu", version=version)), fmi_type=kind, stop_time=times[-1],
        output_interval=STEP, relative_tolerance=1e-9, output=shown, record_events=False,
        input=stairs(times, current, "motor.current"),
    )  # fmt: skip
    for name in shown:
        assert np.abs(run[name] - own[name]).max() < 1e-6 * np.abs(own[name]).max(), name
    stuck = own["motor.speed"] == 0.0
    assert stuck.sum() > 20
    # Apart from the samples next to an event.
    inside = stuck & np.roll(stuck, 1) & np.roll(stuck, -1)
    assert np.all(run["motor.speed"][inside] == 0.0)


def test_an_event_within_a_tiny_step_does_not_hang(sharp):
    """A step far below the rounding of the clock."""
    with opened(sharp["bouncing", "3.0"]) as unit:
        unit.put({"wheel.angle": 0.0, "wheel.speed": -1.0})
        unit.begin().run()
        for length in (1e-290, 1e-300):
            unit.step(length)
        unit.step(STEP)
        assert unit.get("wheel.speed") == [pytest.approx(0.6, rel=1e-9)]
