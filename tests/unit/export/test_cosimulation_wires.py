"""Wires: gain with unit, delay in seconds and samples, whatever step and sample times are."""

from __future__ import annotations

import itertools
import math
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign import quantity
from nlsdesign.export import (
    Extrapolated,
    FmuSystem,
    Iterated,
    Late,
    SamplesOf,
    Stepping,
    Wire,
    convergence,
    cosimulate,
    export_fmu,
)
from nlsdesign.export.cosimulation.isolation import Watch
from nlsdesign.export.cosimulation.run_plan import communication_points
from nlsdesign.foundation.errors import (
    ConvergenceError,
    ExportError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model.flat import FlatModel, Variable


def continuous(
    name: str, x: ca.SX, u: ca.SX, rate: ca.SX, shown: ca.SX, variables: Sequence[Variable]
) -> FlatModel:
    """A continuous model of one state, one input and one output."""
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)], [rate, shown, nothing, nothing]
    )
    state, given, output = variables
    return FlatModel(name, name, (state,), (given,), (), (output,), (), equations)


def clock() -> FlatModel:
    """Output t: what an input read tells its age."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    names = [Variable("now", "s", "Time"), Variable("rate", "1", "Rate", 1.0), Variable("now", "s", "Time")]
    return continuous("clock", x, u, u, x, names)


def meter(unit: str = "s") -> FlatModel:
    """Shows its input, and integrates it."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    names = [
        Variable("sum", "1", "Sum"),
        Variable("input", unit, "Input", -7.0),
        Variable("shown", unit, "Input"),
    ]
    return continuous("meter", x, u, u, u, names)


def sampler(period: float) -> FlatModel:
    """Shows at each sample what it reads."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)], [x + 1, u, nothing, nothing]
    )
    state, given = Variable("count", "1", "Samples"), Variable("input", "s", "Input", -7.0)
    shown = Variable("shown", "s", "What was read")
    return FlatModel("sampler", "Sampler", (state,), (given,), (), (shown,), (), equations, period)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("wires")
    models = {
        "clock": clock(), "meter": meter(), "metres": meter("m"), "fast": sampler(1e-3),
        "slow": sampler(2.5e-3),
    }  # fmt: skip
    return {name: export_fmu(model, folder / f"{name}.fmu") for name, model in models.items()}


LATE = [
    (k, delay, step)
    for k, delay in enumerate((0.002, 0.0026, 0.001, 0.003, 0.0025, 0.0))
    for number, step in enumerate((None, 0.00025, 0.00033, 0.005))
    if (k + number) % 2
]
"""Every other pair of wire and step is left to the whole run."""


def chosen(fmus: dict[str, Path], *names: str) -> dict[str, Path]:
    return {name: fmus[name] for name in names}


# --- gains ---------------------------------------------------------------------------------------


@pytest.mark.long_cases("-1.0")
@pytest.mark.parametrize("gain", [1.0, -1.0, 0.25])
def test_a_gain_multiplies(gain: float, fmus: dict[str, Path]) -> None:
    wires = {"meter.input": Wire("clock.now", gain=gain)}
    run = cosimulate(fmus=chosen(fmus, "clock", "meter"), wires=wires, inputs={}, stop=0.02)
    np.testing.assert_allclose(run["meter.shown"], gain * run.time, atol=1e-12)
    np.testing.assert_allclose(run["meter.input"], gain * run.time, atol=1e-12)


def test_units_are_checked_with_the_gain(fmus: dict[str, Path]) -> None:
    def run(gain: object) -> np.ndarray:
        wires = {"metres.input": Wire("clock.now", gain=gain)}  # type: ignore[arg-type]
        return cosimulate(fmus=chosen(fmus, "clock", "metres"), wires=wires, inputs={}, stop=0.02)[
            "metres.shown"
        ]

    np.testing.assert_allclose(run(quantity(20.0, "mm/s")), np.linspace(0.0, 0.02, 21) * 0.02, atol=1e-14)
    with pytest.raises(UnitError, match=r"'metres\.input' \[m\].*'clock\.now', which is in \[s\].*a unit"):
        run(2.0)
    with pytest.raises(UnitError, match="gain in N/s does not lead from one to the other"):
        run(quantity(1.0, "N/s"))


def test_a_gain_in_other_units_of_a_foreign_fmu_is_converted(tmp_path: Path, fmus: dict[str, Path]) -> None:
    other = export_fmu(meter("ms"), tmp_path / "other.fmu")
    given = {"clock": fmus["clock"], "other": other}
    with pytest.raises(UnitError):
        cosimulate(fmus=given, wires={"other.input": "clock.now"}, inputs={}, stop=0.01)
    wires = {"other.input": Wire("clock.now", gain=quantity(1.0, "1"))}
    run = cosimulate(fmus=given, wires=wires, inputs={}, stop=0.01)
    np.testing.assert_allclose(run["other.shown"], 1e3 * run.time, atol=1e-9)


# --- delays --------------------------------------------------------------------------------------


@pytest.mark.long_cases(
    "0.003-0.001", "0.003-0.0007", "0.00235-0.00013", "0.00235-0.001", "0.0001-0.0007", "0.0001-0.00013"
)  # fmt: skip
@pytest.mark.parametrize("step", [1e-3, 7e-4, 1.3e-4])
@pytest.mark.parametrize("delay", [3e-3, 2.35e-3, 1e-4])
def test_a_continuous_value_is_late_by_seconds(delay: float, step: float, fmus: dict[str, Path]) -> None:
    wires = {"meter.input": Wire("clock.now", delay=delay)}
    run = cosimulate(fmus=chosen(fmus, "clock", "meter"), wires=wires, inputs={}, stop=0.01, step=step)
    arrived = run.time > delay + 1e-9
    np.testing.assert_allclose(run["meter.shown"][arrived], run.time[arrived] - delay, atol=1e-12)
    # Until then the input keeps its start value.
    np.testing.assert_array_equal(run["meter.shown"][run.time < delay - 1e-9], -7.0)
    assert run.delays["meter.input"] == delay


@pytest.mark.long_cases(*(f"wire{k}-{d}-{s}" for k, d, s in LATE))
@pytest.mark.parametrize("step", [None, 2.5e-4, 3.3e-4, 5e-3])
@pytest.mark.parametrize(
    ("wire", "delay"),
    [
        (Wire("fast.shown", delay=2e-3), 2e-3),
        (Wire("fast.shown", delay=2.6e-3), 2.6e-3),
        (Late("fast.shown"), 1e-3),
        (Wire("fast.shown", delay=SamplesOf("fast", 3)), 3e-3),
        (Wire("fast.shown", delay=SamplesOf("slow")), 2.5e-3),
        (Wire("fast.shown"), 0.0),
    ],
)
def test_a_sampled_value_is_late_by_what_the_wire_says_whatever_the_step(
    wire: Wire, delay: float, step: float | None, fmus: dict[str, Path]
) -> None:
    """At t the meter reads what the sampler read of the clock at its last sample before t less the delay."""
    run = cosimulate(
        fmus=chosen(fmus, "clock", "fast", "slow", "meter"),
        wires={"fast.input": "clock.now", "slow.input": "clock.now", "meter.input": wire},
        inputs={},
        stop=0.02,
        step=step,
        order=("fast", "slow", "clock", "meter"),
    )
    assert run.delays["meter.input"] == pytest.approx(delay, rel=1e-12)
    arrived = run.time > delay - 1e-9
    expected = np.floor((run.time - delay) / 1e-3 + 1e-6) * 1e-3
    np.testing.assert_allclose(run["meter.shown"][arrived], expected[arrived], atol=1e-12)
    np.testing.assert_array_equal(run["meter.shown"][~arrived], -7.0)
    # The integral sees every moment, not only the rows; exact, for the value is constant between rows.
    held = run["meter.shown"]
    np.testing.assert_allclose(run["meter.sum"][1:], np.cumsum(held[:-1] * np.diff(run.time)), atol=1e-12)


def test_samplers_that_are_no_multiples_step_at_their_own_samples(fmus: dict[str, Path]) -> None:
    run = cosimulate(
        fmus=chosen(fmus, "clock", "fast", "slow"),
        wires={"fast.input": "clock.now", "slow.input": "fast.shown"},
        inputs={},
        stop=0.02,
        order=("clock", "fast", "slow"),
    )
    fast = np.floor(run.time / 1e-3 + 1e-6) * 1e-3
    np.testing.assert_allclose(run["fast.shown"], fast, atol=1e-12)
    last = np.floor(run.time / 2.5e-3 + 1e-6) * 2.5e-3
    np.testing.assert_allclose(run["slow.shown"], np.floor(last / 1e-3 + 1e-6) * 1e-3, atol=1e-12)
    assert {1e-3, 2.5e-3, 5e-3} <= set(np.round(run.time, 9).tolist())


def test_communication_points_hold_every_sample_once() -> None:
    points = communication_points(1.0, 4e-4, periods=[1e-3, 1.5e-3, 0.1], changes=[(1e-3, 2.4e-3)])
    for period in (1e-3, 1.5e-3, 0.1):
        samples = period * np.arange(int(1.0 / period + 1e-6) + 1)
        assert np.max(np.min(np.abs(points[:, None] - samples[None, :]), axis=0)) < 1e-12
    assert np.min(np.diff(points)) > 9e-5
    assert np.max(np.diff(points)) <= 4e-4 * (1 + 1e-9)
    assert points[0] == 0.0
    assert points[-1] == 1.0


# --- signals from outside, halving ---------------------------------------------------------------


def test_a_jump_of_a_signal_at_a_point_is_no_slope(fmus: dict[str, Path]) -> None:
    """The step of the clock's rate is held exactly, and what its wire extrapolates does not see it."""
    inputs = {"clock.rate": lambda t: 1.0 if t < 0.005 else -1.0}
    wires = {"meter.input": "clock.now"}
    run = cosimulate(fmus=chosen(fmus, "clock", "meter"), wires=wires, inputs=inputs, stop=0.01, step=1e-3)
    np.testing.assert_allclose(run["clock.now"], 0.005 - np.abs(run.time - 0.005), atol=1e-12)


def test_halving_tells_the_order(fmus: dict[str, Path]) -> None:
    system = FmuSystem(fmus=chosen(fmus, "clock", "meter"), wires={"meter.input": "clock.now"})
    study = convergence(system, inputs={"clock.rate": lambda t: math.cos(200.0 * t)}, stop=0.02, halvings=3)
    assert study.steps == (1e-3, 5e-4, 2.5e-4, 1.25e-4)
    assert all(one > other for one, other in itertools.pairwise(study.differences["meter.sum"]))
    np.testing.assert_allclose(study.orders("meter.sum"), 2.0, atol=0.2)
    with pytest.raises(ValueRangeError, match="from 2 to 10"):
        convergence(system, inputs={}, stop=0.02, halvings=1)


# --- mistakes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: Wire("clock.now", gain=math.nan), ValueRangeError, "a gain must be finite"),
        (lambda: Wire("clock.now", delay=-1e-3), ValueRangeError, "at least 0"),
        (lambda: SamplesOf("fast", -1), ValueRangeError, "at least 0"),
        (lambda: Stepping(0.0), ValueRangeError, "positive"),
        (lambda: Stepping(patience=0.0), ValueRangeError, "positive"),
        (lambda: Iterated(rounds=0), ValueRangeError, "at least 1"),
    ],
)
def test_an_impossible_number_is_named(make: object, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()  # type: ignore[operator]


def test_late_needs_something_sampled(fmus: dict[str, Path]) -> None:
    def run(wire: Wire) -> None:
        cosimulate(fmus=chosen(fmus, "clock", "meter"), wires={"meter.input": wire}, inputs={}, stop=0.01)

    with pytest.raises(ExportError, match=r"late by samples of 'clock', which is not sampled.*seconds"):
        run(Late("clock.now"))
    with pytest.raises(UnknownNameError, match="did you mean 'clock'"):
        run(Wire("clock.now", delay=SamplesOf("clok")))


def test_a_loop_of_direct_feedthrough_that_does_not_settle_is_named(fmus: dict[str, Path]) -> None:
    """Two meters show each other's value, twice as large each time round."""
    given = {"one": fmus["meter"], "other": fmus["meter"]}
    wires = {"one.input": Wire("other.shown", gain=2.0), "other.input": "one.shown"}
    with pytest.raises(ConvergenceError, match=r"wires between one, other at 0 s.*direct feedthrough"):
        cosimulate(fmus=given, wires=wires, inputs={}, stop=0.01)


def test_a_coupling_that_does_not_converge_is_no_result(tmp_path: Path) -> None:
    """A stiff spring between two masses: far too long a step, and one that is short enough."""
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    nothing = ca.SX(0, 1)
    signature = [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)]
    equations = ca.Function("e", signature, [ca.vertcat(x[1], 1e4 * (u - x[0])), x[0], nothing, nothing])
    state, speed = Variable("place", "m", "Place", 0.1), Variable("speed", "m/s", "Speed")
    given = Variable("other", "m", "Place of the other")
    mass = FlatModel("mass", "Mass", (state, speed), (given,), (), (state,), (), equations)
    file = export_fmu(mass, tmp_path / "mass.fmu")
    wires = {"one.other": "two.place", "two.other": "one.place"}

    def run(step: float) -> np.ndarray:
        parameters = {"two.place": -0.1}
        result = cosimulate(
            fmus={"one": file, "two": file}, wires=wires, inputs={}, stop=0.1, parameters=parameters,
            step=Stepping(step, coupling=Extrapolated()),
        )  # fmt: skip
        return result["one.place"] - 0.1 * np.cos(math.sqrt(2e4) * result.time)

    with pytest.raises(ConvergenceError, match=r"coupling does not converge in steps of 0\.01 s"):
        run(0.01)
    assert np.max(np.abs(run(1e-4))) < 0.01


def test_roll_back_needs_fmus_that_can(tmp_path: Path, fmus: dict[str, Path]) -> None:
    plain = tmp_path / "plain.fmu"
    with zipfile.ZipFile(fmus["meter"]) as old, zipfile.ZipFile(plain, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                assert b'canGetAndSetFMUState="true"' in content
                content = content.replace(b'canGetAndSetFMUState="true"', b"")
                content = content.replace(b'canSerializeFMUState="true"', b"")
            new.writestr(name, content)
    given = {"clock": fmus["clock"], "meter": plain}
    wires = {"meter.input": "clock.now"}
    with pytest.raises(ExportError, match=r"'meter'.*cannot keep and restore its state.*Extrapolated"):
        cosimulate(fmus=given, wires=wires, inputs={}, stop=0.01, step=Stepping(coupling=Iterated()))
    run = cosimulate(fmus=given, wires=wires, inputs={}, stop=0.01)
    np.testing.assert_allclose(run["meter.shown"], run.time, atol=1e-12)


def test_a_run_says_how_far_it_is(fmus: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """The run waits at each row until that row has been told, so that no speed decides what is told."""
    told, tell = os.pipe()
    at_row = Watch.at_row

    def waiting_at_row(watch: Watch, row: int) -> None:
        at_row(watch, row)
        watch(watch.cells[0], watch.cells[1])
        heard = b""
        while f"{0.1 * row:.3f} of".encode() not in heard:
            heard += os.read(told, 4096)

    class Noted:
        def __init__(self) -> None:
            self.texts: list[str] = []

        def note(self, text: str) -> None:
            self.texts.append(text)
            os.write(tell, text.encode())

    monkeypatch.setattr(Watch, "at_row", waiting_at_row)
    noted = Noted()
    stepping = Stepping(0.1, progress=noted, patience=60.0)
    cosimulate(fmus=chosen(fmus, "clock"), wires={}, inputs={}, stop=0.6, step=stepping)
    rows = [text for text, _ in itertools.groupby(noted.texts)]
    assert rows[:7] == [f"{0.1 * row:.3f} of 0.6 s" for row in range(7)]
