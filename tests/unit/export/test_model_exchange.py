"""Model exchange keeps the standard: phases, counts, states that jump, copies, importers of any skill."""

from __future__ import annotations

import ctypes
import math
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from nlsdesign.components import (
    ROTATION,
    Backlash,
    CoulombFriction,
    Fixed,
    Inertia,
    RigidStop,
    Spring,
    StribeckFriction,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.export import export_fmu
from nlsdesign.export.compilation.cross_compiler import STRICT, run_compiler
from nlsdesign.export.fmi.fmu import fmi_headers
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.fmu_unit import VERSIONS, ExchangeUnit, Refused, both, exchanging, freed, opened, unpacked
from tests.hand_built import observer, plant

J, K, T = 1e-3, 2.0, 0.05


def rubbing() -> FlatModel:
    rub, spring = CoulombFriction(sliding_effort=T), Spring(stiffness=K, domain=ROTATION)
    return flatten(
        assembly("rubbing", wheel=Inertia(inertia=J), rub=tie(rub, "wheel"), spring=tie(spring, "wheel"))
    )


def stopped() -> FlatModel:
    stop = RigidStop(lower=0.0, upper=1.0, restitution=0.6, resting_speed=1e-3)
    return flatten(assembly("stopped", wheel=Inertia(inertia=J), stop=tie(stop, "wheel")))


def geared() -> FlatModel:
    """Two bodies with a backlash between them; two frictions on the motor are one switch."""
    inside = (("spring", Spring(stiffness=50.0, domain=ROTATION)),)
    return flatten(
        assembly(
            "geared",
            motor=Inertia(inertia=J),
            load=Inertia(inertia=2 * J),
            rub=tie(StribeckFriction(sliding_effort=0.01, breakaway=0.01, stribeck_speed=0.5), "motor"),
            bench=Fixed(),
            brush=tie(CoulombFriction(sliding_effort=0.005), "motor", "bench"),
            pad=tie(CoulombFriction(sliding_effort=0.005), "load"),
            backlash=tie(Backlash(gap=0.02, members=inside), "motor", "load"),
        )
    )


MODELS = {"plant": plant, "rubbing": rubbing, "stopped": stopped, "geared": geared}


@pytest.fixture(scope="module")
def units(tmp_path_factory) -> dict[tuple[str, str], Path]:
    """FMU of each model and version."""
    folder = tmp_path_factory.mktemp("fmu")
    return {
        (name, version): export_fmu(made(), folder / f"{name}{version}.fmu", version=version)
        for name, made in MODELS.items()
        for version in VERSIONS
    }


# --- description and sources ----------------------------------------------------------------------


@both
@pytest.mark.parametrize("name", MODELS)
def test_the_description_is_valid_and_counts_states_and_indicators(name, version, units):
    assert validate_fmu(str(units[name, version])) == []
    model = MODELS[name]()
    located = len(model.switching.switches) if model.switching and model.switching.jumps else 0
    with unpacked(units[name, version]) as folder:
        text = (Path(folder) / "modelDescription.xml").read_bytes()
    schema = (
        Path(fmpy.__file__).parent / "schema" / f"fmi{version[0]}" / f"fmi{version[0]}ModelDescription.xsd"
    )
    root = etree.fromstring(text)
    etree.XMLSchema(etree.parse(str(schema))).assertValid(root)
    description = fmpy.read_model_description(str(units[name, version]))
    assert description.numberOfContinuousStates == len(model.states)
    assert description.numberOfEventIndicators == located
    (exchange,) = root.iter("ModelExchange")
    if version == "3.0":
        assert exchange.get("needsCompletedIntegratorStep") == ("true" if located else "false")
        (simulating,) = root.iter("CoSimulation")
        assert simulating.get("hasEventMode", "false") == ("true" if located else "false")
        with exchanging(units[name, version]) as unit:
            assert unit.raw.getNumberOfEventIndicators() == located
            assert unit.raw.getNumberOfContinuousStates() == len(model.states)
    else:
        assert exchange.get("completedIntegratorStepNotNeeded") == ("false" if located else "true")


@pytest.mark.long_cases("3.0", "2.0")
@both
def test_the_sources_of_a_model_with_switches_compile_without_a_warning(version, units, tmp_path):
    with unpacked(units["geared", version]) as folder:
        main = Path(folder) / "sources" / f"fmi{version[0]}.c"
        run_compiler(
            [*STRICT, "-O2", "-fPIC", "-shared", "-isystem", str(fmi_headers()), str(main), "-o",
             str(tmp_path / "strict.so")], about="geared",
        )  # fmt: skip


@both
def test_a_sampled_model_offers_co_simulation_only(version, tmp_path):
    path = export_fmu(observer(points=5), tmp_path / "observer.fmu", version=version)
    assert fmpy.read_model_description(str(path)).modelExchange is None
    with unpacked(path) as folder, pytest.raises(Exception, match="instantiate"):
        ExchangeUnit(folder)


# --- phases and values ----------------------------------------------------------------------------


@both
def test_derivatives_nominals_and_states_are_those_of_the_model(version, units):
    model = MODELS["plant"]()
    with exchanging(units["plant", version]) as unit:
        unit.begin(start=3.0).run()
        stated = {v.name: float(v.nominal) for v in unit.description.modelVariables if v.nominal}
        assert unit.nominals() == [stated[v.name] for v in model.states]
        assert unit.states() == [v.start for v in model.states]
        draw = np.random.default_rng(4)
        for _ in range(5):
            point = (draw.uniform(-1, 1, 3) * [v.nominal for v in model.states]).tolist()
            unit.set(motor__current=float(draw.uniform(-5, 5)))
            unit.place(3.0 + draw.uniform(), point)
            expected = model.evaluate(point, unit.get("motor.current"))
            assert unit.rates() == pytest.approx(
                [expected[f"der({v.name})"] for v in model.states], rel=1e-13
            )
            assert unit.get("spring.torque") == pytest.approx([expected["spring.torque"]], rel=1e-13)
            assert unit.states() == point
        assert unit.raw.completedIntegratorStep() == (False, False)


@both
def test_calls_in_the_wrong_phase_or_of_the_wrong_length_are_refused(version, units):
    with exchanging(units["rubbing", version]) as unit:
        row = (ctypes.c_double * 3)()
        for call in (
            lambda: unit.raw.setTime(1.0),
            unit.raw.enterContinuousTimeMode,
            unit.raw.enterEventMode,
            unit.raw.completedIntegratorStep,
            lambda: unit.place(0.0, [0.0, 0.0]),
        ):
            with pytest.raises(Refused):
                call()
            assert "not allowed in this phase" in unit.log[-1][2]
        unit.begin().run()
        with pytest.raises(Refused):
            unit.raw.setContinuousStates(row, 3)
        assert "there are 2 continuous states, not 3" in unit.log[-1][2]
        with pytest.raises(Refused):
            unit.raw.getEventIndicators(row, 2)
        with pytest.raises(Refused):
            unit.raw.setTime(math.nan)
        with pytest.raises(Refused):
            unit.update()  # needs the event mode
        with pytest.raises(Refused):
            unit.set(rub__mode=1.0)
        unit.place(1e300, [0.0, 0.0])
        unit.raw.terminate()


@both
def test_a_copy_holds_the_modes_and_fits_only_an_instance_of_its_purpose(version, units):
    with exchanging(units["rubbing", version]) as unit:
        unit.set(wheel__angle=0.02)  # 0.04 N·m of 0.05: it sticks
        unit.begin().run()
        assert unit.get("rub.mode") == [0.0]
        assert unit.get("rub.torque") == [pytest.approx(-0.04, rel=1e-14)]
        copy = unit.raw.getFMUState()
        written = unit.raw.serializeFMUState(copy)
        unit.place(0.1, [0.1, 0.0])
        unit.event()
        assert unit.get("rub.mode") == [-1.0]
        assert unit.rates() == [0.0, pytest.approx((0.05 - 0.2) / J)]
        unit.raw.setFMUState(copy)
        assert unit.get("time", "rub.mode", "wheel.angle") == [0.0, 0.0, 0.02]
        assert unit.rates() == [0.0, 0.0]
        with unpacked(units["rubbing", version]) as folder, freed(ExchangeUnit(folder)) as other:
            read = other.raw.deserializeFMUState(written)
            other.raw.setFMUState(read)
            assert other.get("rub.mode", "wheel.angle") == [0.0, 0.02]
            other.place(0.3, [0.02, 0.0])
        with opened(units["rubbing", version]) as stepping:
            with pytest.raises(Refused):
                stepping.raw.deserializeFMUState(written)
            assert "another purpose" in stepping.log[-1][2]
            with pytest.raises(Refused):
                stepping.raw.setFMUState(copy)
            stepping.begin().run()
            stepping.step(1e-3)
        unit.raw.freeFMUState(copy)


# --- importers of any skill -----------------------------------------------------------------------


@both
@pytest.mark.parametrize("share", [1.0, 1.0 - 1e-16, 1.0 + 1e-15, 1.1])
def test_what_sticks_is_let_go_wherever_the_importer_has_stopped(share, version, units):
    """Exactly where the load is what the friction holds, before it by rounding, or behind it."""
    with exchanging(units["rubbing", version]) as unit:
        unit.begin().run()
        assert unit.get("rub.mode") == [0.0]
        unit.set(wheel__torque=0.5 * T)
        assert unit.indicators() == [pytest.approx(0.5 * T)]
        assert unit.rates() == [0.0, 0.0]
        unit.set(wheel__torque=share * T)
        assert unit.raw.completedIntegratorStep() == (share > 1.0, False)
        assert unit.event() is False
        if share >= 1.0:
            assert unit.get("rub.mode") == [1.0]
        unit.set(wheel__torque=2 * T)
        if unit.raw.completedIntegratorStep()[0]:
            unit.event()
        assert unit.rates() == [0.0, pytest.approx(T / J)]


@both
def test_a_step_past_an_event_is_noticed_when_it_is_completed(version, units):
    with exchanging(units["rubbing", version]) as unit:
        unit.set(wheel__speed=1.0)
        unit.begin().run()
        assert unit.get("rub.mode") == [1.0]
        unit.place(0.1, [0.01, -1e-3])  # it has turned round in between
        assert unit.raw.completedIntegratorStep() == (True, False)
        assert unit.event() is True
        # Friction at rest holds 0.05 N·m, the spring pulls with 0.02: it sticks, with the rate exactly zero.
        assert unit.get("rub.mode", "wheel.speed", "wheel.angle") == [0.0, 0.0, 0.01]
        assert unit.rates() == [0.0, 0.0]
        assert unit.raw.completedIntegratorStep() == (False, False)


@both
def test_an_impact_changes_the_speed_and_the_last_one_rests(version, units):
    with exchanging(units["stopped", version]) as unit:
        unit.set(wheel__angle=0.5, wheel__speed=-0.3)
        unit.begin().run()
        unit.set(wheel__torque=-0.02)
        unit.place(1.0, [-1e-9, -0.3])
        assert unit.indicators()[0] < 0.0
        assert unit.event() is True
        assert unit.states() == [-1e-9, pytest.approx(0.18, rel=1e-14)]
        assert unit.indicators()[0] > 0.0
        unit.place(2.0, [-1e-12, -9e-4])
        assert unit.event() is True
        assert unit.states() == [-1e-12, 0.0]
        assert unit.rates() == [0.0, 0.0]
        # The stop pushes against the torque, also where rounding has left the body a little inside.
        unit.place(2.5, [1e-13, 0.0])
        assert unit.get("stop.mode", "stop.torque") == [0.0, pytest.approx(-0.02, rel=1e-14)]
        unit.set(wheel__torque=0.01)
        assert unit.raw.completedIntegratorStep() == (True, False)
        unit.event()
        assert unit.get("stop.mode", "stop.torque") == [1.0, 0.0]


def integrated(unit: ExchangeUnit, times: list[float], finest: float) -> np.ndarray:
    """Integrate by steps of the classical method of Runge and Kutta and find events by halving."""
    rows, length = [unit.states()], 2e-4

    def tried(time: float, start: np.ndarray, h: float) -> np.ndarray:
        slopes: list[np.ndarray] = []
        for share in (0.0, 0.5, 0.5, 1.0):
            at = start + share * h * slopes[-1] if slopes else start
            unit.place(time + share * h, at.tolist())
            slopes.append(np.array(unit.rates()))
        return start + h / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])

    for end in times[1:]:
        while unit.time < end - 1e-12:
            time, start, h = unit.time, np.array(unit.states()), min(length, end - unit.time)
            unit.place(time + h, tried(time, start, h).tolist())
            if min(unit.indicators()) < 0.0:
                low, high = 0.0, h
                while high - low > finest:
                    middle = 0.5 * (low + high)
                    unit.place(time + middle, tried(time, start, middle).tolist())
                    low, high = (low, middle) if min(unit.indicators()) < 0.0 else (middle, high)
                unit.place(time + high, tried(time, start, high).tolist())
            if unit.raw.completedIntegratorStep()[0]:
                unit.event()
        rows.append(unit.states())
    return np.array(rows)


@both
def test_frictions_and_a_backlash_by_an_integrator_of_the_test(version, units):
    model, times = geared(), np.linspace(0.0, 0.2, 21)
    start = {"motor.speed": 2.0}
    own = simulate(model, times, start=start, tolerance=1e-11)
    assert {e.name for e in own.events} == {"rub+brush", "pad", "backlash.ahead", "backlash.behind"}
    with exchanging(units["geared", version]) as unit:
        unit.put(start)
        unit.begin().run()
        assert unit.get("rub_and_brush.mode", "pad.mode") == [1.0, 0.0]
        found = integrated(unit, times.tolist(), 1e-12)
    for i, variable in enumerate(model.states):
        size = np.abs(own[variable.name]).max()
        # Fourth order at 0.2 ms and some 200 rad/s: (0.04)^5/120 per step, over a thousand steps 1e-6.
        assert np.abs(found[:, i] - own[variable.name]).max() < 2e-6 * size, variable.name
