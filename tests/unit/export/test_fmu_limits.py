"""What an FMU does at its limits: absurd steps, damaged states, large clocks, functions it does not offer."""

from __future__ import annotations

import ctypes
import math
import re
import time
from itertools import pairwise
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import pytest

from nlsdesign.export import export_fmu
from nlsdesign.model.flat import FlatModel, Variable
from tests.fmu_unit import Refused, Unit, both, exported, opened, unpacked
from tests.hand_built import SAMPLE_TIME, controller, observer, plant

MODELS = {"plant": plant(), "observer": observer(points=5), "controller": controller()}
UNIX = 1.7e9
"""A start time in s since 1970; neighbouring numbers are 0.24 µs apart there."""


@pytest.fixture(scope="module")
def units(tmp_path_factory) -> dict[tuple[str, str], Path]:
    return exported(MODELS, tmp_path_factory.mktemp("fmu"))


each_model = pytest.mark.parametrize("name", MODELS)


@both
@each_model
def test_every_function_of_the_standard_is_exported(name, version, units):
    headers = Path(fmpy.__file__).parent / "c-code" / f"fmi{version[0]}Functions.h"
    named = set(re.findall(r"FMI\d_Export\s+fmi\d\w+TYPE\s+(fmi\d\w+)\s*;", headers.read_text()))
    assert len(named) == (44 if version == "2.0" else 75)
    with unpacked(units[name, version]) as folder:
        (binary,) = (p for p in (Path(folder) / "binaries").rglob("*.so"))
        library = ctypes.CDLL(str(binary))
        assert {each for each in named if not hasattr(library, each)} == set()


# --- bounded work ---------------------------------------------------------------------------------


@both
@pytest.mark.parametrize("name", ["observer", "controller"])
def test_an_absurd_step_of_a_sampled_model_is_refused_at_once_and_changes_nothing(name, version, units):
    shown = ["time", *(v.name for v in MODELS[name].outputs)]
    with opened(units[name, version]) as unit:
        unit.begin().run()
        unit.step(5 * SAMPLE_TIME)
        before = unit.get(*shown)
        for length in (1e300, 1e15, 1e6):
            began = time.perf_counter()
            with pytest.raises(Refused) as refused:
                unit.raw.doStep(currentCommunicationPoint=unit.time, communicationStepSize=length)
            assert time.perf_counter() - began < 0.1
            assert refused.value.status == 3
            assert re.search(r"would need \S+ samples.*at most 40000000", unit.log[-1][2])
            assert unit.get(*shown) == before
        unit.step(SAMPLE_TIME)


@both
def test_an_hour_of_samples_is_taken_in_one_step(version, units):
    with opened(units["controller", version]) as unit:
        unit.begin().run()
        unit.set(torque__desired=1e-6)
        unit.step(3600.0)
        # 40 A·rad/(N·m·s) of integral gain and 2 A·rad/(N·m) of proportional one.
        last = 3600.0 - SAMPLE_TIME
        assert unit.get("motor.current") == [pytest.approx(1e-6 * (2.0 + 40.0 * last), rel=1e-9)]


def swinging() -> FlatModel:
    """An oscillation at 100 rad/s that no friction ends."""
    x, nothing = ca.SX.sym("x", 2), ca.SX(0, 1)
    empty = [ca.SX.sym(name, 0) for name in "upw"]
    rate = ca.vertcat(100.0 * x[1], -100.0 * x[0])
    equations = ca.Function("e", [ca.SX.sym("t"), x, *empty], [rate, x[0], nothing, nothing])
    states = tuple(Variable(f"x[{i}]", "1", "State", start) for i, start in ((1, 1.0), (2, 0.0)))
    return FlatModel("swinging", "For ever", states, (), (), (Variable("y", "1", "Output"),), (), equations)


@pytest.mark.long_cases("1000000000.0-3.0", "1e+300-2.0")
@both
@pytest.mark.parametrize("length", [1e9, 1e300])
def test_a_step_that_needs_too_many_steps_of_the_integrator_is_refused(length, version, tmp_path):
    with opened(export_fmu(swinging(), tmp_path / "swing.fmu", version=version)) as unit:
        unit.begin().run()
        unit.step(1e-3)
        before = unit.get("time", "x[1]", "x[2]")
        began = time.perf_counter()
        with pytest.raises(Refused):
            unit.raw.doStep(currentCommunicationPoint=unit.time, communicationStepSize=length)
        assert time.perf_counter() - began < 10.0
        assert "needs more than 200000 steps of the integrator" in unit.log[-1][2]
        assert unit.get("time", "x[1]", "x[2]") == before
        unit.step(1e-3)  # it goes on with a possible one
        assert unit.get("x[1]") == [pytest.approx(math.cos(0.2), abs=1e-7)]


# --- a written state ------------------------------------------------------------------------------


def shaken(unit: Unit, count: int) -> list[list[float]]:
    """Step with a rough input and return the outputs after each step."""
    by_kind = {
        kind: [v.name for v in unit.description.modelVariables if v.causality == kind]
        for kind in ("input", "output")
    }
    rows = []
    for k in range(count):
        unit.put({name: 0.3 * math.sin(0.2 * k * (i + 1)) for i, name in enumerate(by_kind["input"])})
        unit.step(SAMPLE_TIME)
        rows.append(unit.get(*by_kind["output"]))
    return rows


@both
@each_model
def test_a_damaged_state_is_refused_and_the_instance_stays_as_it_was(name, version, units):
    with opened(units[name, version]) as unit:
        unit.begin().run()
        shaken(unit, 7)
        copy, moment = unit.raw.getFMUState(), unit.time
        written = unit.raw.serializeFMUState(copy)
        expected = shaken(unit, 5)
        unit.raw.setFMUState(copy)
        unit.raw.freeFMUState(copy)
        unit.time = moment
        draw = np.random.default_rng(3)
        for place in range(len(written)):
            flipped = bytearray(written)
            flipped[place] ^= 1 << int(draw.integers(8))
            with pytest.raises(Refused):
                unit.raw.deserializeFMUState(bytes(flipped))
        for _ in range(300):
            flipped = bytearray(written)
            for bit in draw.integers(8 * len(written), size=4).tolist():
                flipped[bit // 8] ^= 1 << (bit % 8)
            if bytes(flipped) != written:
                with pytest.raises(Refused):
                    unit.raw.deserializeFMUState(bytes(flipped))
        for cut in (0, 1, 8, len(written) // 2, len(written) - 1):
            with pytest.raises(Refused):
                unit.raw.deserializeFMUState(written[:cut])
        with pytest.raises(Refused):
            unit.raw.deserializeFMUState(written + b"\0")
        assert "not a state of this model" in unit.log[-1][2]
        assert shaken(unit, 5) == expected


# --- large clocks ---------------------------------------------------------------------------------


def by_adding(start: float, count: int) -> list[tuple[float, float]]:
    """Times as a loop ``t += step`` makes them; each sum is rounded."""
    point, pairs = start, []
    for _ in range(count):
        pairs.append((point, SAMPLE_TIME))
        point += SAMPLE_TIME
    return pairs


def by_multiplying(start: float, count: int) -> list[tuple[float, float]]:
    """Times ``start + k·step``, and the step itself."""
    return [(start + k * SAMPLE_TIME, SAMPLE_TIME) for k in range(count)]


def by_differences(start: float, count: int) -> list[tuple[float, float]]:
    """Times ``start + k·step`` and their differences, as fmpy makes them."""
    points = [start + k * SAMPLE_TIME for k in range(count + 1)]
    return [(a, b - a) for a, b in pairwise(points)]


CLOCKS = pytest.mark.parametrize("clock", [by_adding, by_multiplying, by_differences])


@pytest.mark.long_cases("by_adding-2.0", "by_adding-3.0", "by_multiplying-2.0", "by_differences-3.0")
@both
@CLOCKS
def test_samples_are_counted_at_a_large_time(clock, version, units):
    """Twenty thousand samples from a Unix time are those from zero, one per step."""
    count, desired = 20_000, [0.3 * math.sin(0.01 * k) for k in range(20_000)]
    with opened(units["controller", version]) as unit:
        unit.begin(start=UNIX).run()
        found = []
        for (point, length), wanted in zip(clock(UNIX, count), desired, strict=True):
            unit.set(torque__desired=wanted)
            unit.raw.doStep(currentCommunicationPoint=point, communicationStepSize=length)
            found += unit.get("motor.current")
    # The integral part is the sum of all errors before, so one sample too many or too few is seen.
    before = SAMPLE_TIME * 40.0 * np.concatenate([[0.0], np.cumsum(desired)[:-1]])
    assert np.abs(before).max() < 5.0
    assert found == pytest.approx(2.0 * np.array(desired) + before, abs=1e-9)


@both
@CLOCKS
def test_a_plant_moves_at_a_large_time_as_from_zero(clock, version, units):
    shown = ("motor.angle", "motor.speed", "spring.torque")
    rows = []
    with opened(units["plant", version]) as unit:
        for start in (0.0, UNIX):
            unit.raw.reset()
            unit.begin(start=start).run()
            unit.set(motor__current=2.0)
            for point, length in clock(start, 2000):
                unit.raw.doStep(currentCommunicationPoint=point, communicationStepSize=length)
            rows.append(unit.get(*shown))
    # Differences of rounded times are off by 0.24 µs at most, at some 10 rad/s and 1000 rad/s².
    assert rows[1] == pytest.approx(rows[0], rel=1e-6, abs=1e-6)


@both
def test_a_clock_that_cannot_tell_samples_apart_is_refused(version, units):
    with opened(units["observer", version]) as unit:
        unit.begin(start=1e13).run()
        with pytest.raises(Refused):
            unit.step(1.0)
        assert "too coarse for samples" in unit.log[-1][2]


@both
@each_model
def test_a_communication_point_beside_the_clock_is_still_refused(name, version, units):
    with opened(units[name, version]) as unit:
        for start in (0.0, UNIX):
            unit.raw.reset()
            unit.begin(start=start).run()
            unit.step(SAMPLE_TIME)
            for off in (0.01 * SAMPLE_TIME, -0.01 * SAMPLE_TIME, 1.0):
                with pytest.raises(Refused):
                    unit.raw.doStep(
                        currentCommunicationPoint=unit.time + off, communicationStepSize=SAMPLE_TIME
                    )
                assert "the model stands at" in unit.log[-1][2]
            unit.step(SAMPLE_TIME)
