"""Sensors by two roads: what a record holds against the flat model, and against laws of sampling.

Independent roads: integer arithmetic for counts, the transfer functions of the zero-order hold and of the
first-order differentiator, the statistics of white noise and of rounding.
"""

from __future__ import annotations

import cmath
import math
from fractions import Fraction

import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CurrentSensor,
    Drift,
    Driven,
    Encoder,
    ForceSensor,
    SampleAndHold,
    Sensor,
    Spring,
    Tachometer,
    TorqueSensor,
    TransportDelay,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, measure, simulate


def seen(times: np.ndarray, values: np.ndarray, unit: str, **sensors: Sensor) -> Trace:
    run = Trace(times, {"hand.signal": values}, {"hand.signal": unit})
    return measure(run, assembly("bench", hand=Driven(), **sensors), seed=7)


def first_harmonic(times: np.ndarray, values: np.ndarray, frequency: float) -> complex:
    """Complex amplitude of e^(iωt) over whole periods, the last time left out."""
    return complex(2.0 * np.mean((values * np.exp(-2j * math.pi * frequency * times))[:-1]))


def test_counts_of_a_sampled_encoder_by_integer_arithmetic() -> None:
    """A ramp of 13/10 counts per ms, read at 250 Hz and logged at 1 kHz."""
    times, quantum = np.arange(400) / 1000.0, 1e-3
    angle = 1.3 * quantum * np.arange(400)
    counts = [math.floor(Fraction(13, 10) * (4 * (k // 4)) + Fraction(1, 2)) for k in range(400)]
    before = {
        "samples": SampleAndHold(of="hand.signal", sample_rate=250.0),
        "dial": Encoder(of="samples.reading", quantum=quantum),
    }
    behind = {
        "dial": Encoder(of="hand.signal", quantum=quantum),
        "samples": SampleAndHold(of="dial.reading", sample_rate=250.0),
    }
    for chain in (before, behind):
        last = f"{list(chain)[-1]}.reading"
        reading = seen(times, angle, "rad", **chain)[last]
        assert reading == pytest.approx(quantum * np.array(counts), abs=1e-12)


def test_rounding_of_an_encoder_scatters_by_a_count_over_the_root_of_twelve() -> None:
    times, quantum = np.arange(200_000) / 1000.0, 2e-3
    angle = 1.0 * np.sin(0.7 * times)
    run = seen(times, angle, "rad", dial=Encoder(of="hand.signal", quantum=quantum))
    assert np.std(run["dial.reading"] - angle) == pytest.approx(quantum / math.sqrt(12.0), rel=0.01)


def test_an_encoder_rounds_alike_in_the_flat_model_and_in_a_record() -> None:
    made = assembly("a", hand=Driven(), dial=Encoder(of="hand.angle", quantum=0.01))
    times = np.linspace(0.0, 1.0, 301)
    run = simulate(flatten(made), times, inputs={"hand.angle": 0.3 * np.sin(9.0 * times)})
    assert np.ptp(run["dial.reading"]) > 0.5
    assert measure(run, made, seed=1)["dial.reading"] == pytest.approx(run["dial.reading"], abs=1e-15)


def test_a_held_signal_is_half_a_sample_late_and_smaller_by_sinc() -> None:
    """Zero-order hold: first harmonic sinc(fT)·e^(−iπfT)."""
    frequency, rate = 5.0, 50.0
    times = np.arange(20_001) / 10_000.0
    wave = np.cos(2 * math.pi * frequency * times)
    run = seen(times, wave, "N", held=SampleAndHold(of="hand.signal", sample_rate=rate))
    found = first_harmonic(times, run["held.reading"], frequency)
    share = frequency / rate
    # The run itself is a staircase of 10 kHz: half of such a step more.
    expected = np.sinc(share) * cmath.exp(-1j * math.pi * (share - frequency / 10_000.0))
    assert found == pytest.approx(expected, abs=1e-3)


def pulled(**sensors: Sensor) -> Assembly:
    return assembly(
        "pulled", grip=Driven(domain=TRANSLATION), spring=tie(Spring(stiffness=1000.0), "grip"), **sensors
    )


def waved(made: Assembly, frequency: float) -> tuple[Trace, Trace]:
    """The same 10 N wave in the flat model and as the bench records it."""
    times, speed = np.linspace(0.0, 1.0, 10_001), 2 * math.pi * frequency
    drive = {"grip.position": lambda t: 0.01 * math.sin(speed * t), "grip.speed": lambda t: 0.0}
    run = simulate(flatten(made), times, inputs=drive)
    return run, measure(run, made, seed=3)


@pytest.mark.parametrize(
    "sensors",
    [
        {"late": TransportDelay(of="spring.force", delay=4e-3)},
        {
            "bus": TransportDelay(of="spring.force", delay=4e-3),
            "late": ForceSensor(of="bus.reading", gain=1.1, bias=-2.0),
        },
        {
            "cell": ForceSensor(of="spring.force", gain=0.9, bias=3.0),
            "late": TransportDelay(of="cell.reading", delay=4e-3),
        },
    ],
)
def test_a_delay_in_the_flat_model_is_the_exact_delay_of_the_record(sensors: dict[str, Sensor]) -> None:
    run, record = waved(pulled(**sensors), 8.0)
    late = run.time > 0.05
    error = np.max(np.abs(run["late.reading"] - record["late.reading"])[late])
    bound = 11.0 * (2 * math.pi * 8.0 * 4e-3) ** 5 / 720
    assert error < 1.2 * bound + 1e-3 * 0.05, "Padé error of the flat model, and lines between the samples"
    shift = run["spring.force"] - record["late.reading"]
    assert np.max(np.abs(shift)) > 0.5, "there is a delay to speak of"


def test_a_drift_is_the_same_line_in_the_flat_model_and_in_the_record() -> None:
    chain = {
        "warming": Drift(of="spring.force", drift=-0.8),
        "cell": ForceSensor(of="warming.reading", gain=1.2, bias=0.5),
    }
    run, record = waved(pulled(**chain), 2.0)
    expected = 1.2 * (run["spring.force"] - 0.8 * run.time) + 0.5
    assert run["cell.reading"] == pytest.approx(expected, abs=1e-7)
    assert record["cell.reading"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("order", [("late", "warming"), ("warming", "late")])
def test_delay_drift_and_gain_in_one_chain_against_arithmetic(order: tuple[str, str]) -> None:
    """A 10 N sine behind a delay τ, a drift d and a gain: the drift is as late as what it rides on."""
    delay, drift, gain, bias, frequency = 3e-3, 0.7, 1.3, -2.0, 6.0
    faults = {"late": (TransportDelay, {"delay": delay}), "warming": (Drift, {"drift": drift})}
    chain: dict[str, Sensor] = {}
    source = "spring.force"
    for name in order:
        kind, numbers = faults[name]
        chain[name] = kind(of=source, **numbers)
        source = f"{name}.reading"
    chain["cell"] = ForceSensor(of=source, gain=gain, bias=bias)
    run, record = waved(pulled(**chain), frequency)
    speed, time = 2 * math.pi * frequency, run.time
    since = time - delay if order == ("warming", "late") else time
    expected = gain * (10.0 * np.sin(speed * (time - delay)) + drift * since) + bias
    late = time > 0.05
    bound = 1.1 * gain * 10.0 * (speed * delay) ** 5 / 720 + 1e-5
    assert np.max(np.abs(run["cell.reading"] - expected)[late]) < bound
    assert np.max(np.abs(record["cell.reading"] - expected)[late]) < 1e-5


def test_noise_is_white_of_the_stated_size_and_led_by_the_seed() -> None:
    times = np.arange(100_000) / 1000.0
    cell = ForceSensor(of="hand.signal", bias=2.0, noise=0.5)
    zeros = np.zeros(len(times))
    noise = seen(times, zeros, "N", cell=cell)["cell.reading"]
    assert np.mean(noise) == pytest.approx(2.0, abs=4 * 0.5 / math.sqrt(len(times)))
    assert np.std(noise) == pytest.approx(0.5, rel=4 / math.sqrt(2 * len(times)))
    correlation = np.corrcoef(noise[1:], noise[:-1])[0, 1]
    assert abs(correlation) < 4 / math.sqrt(len(times))
    again = seen(times, zeros, "N", other=cell, cell=cell)
    assert np.array_equal(again["cell.reading"], noise), "another sensor changes nothing"
    assert abs(np.corrcoef(again["other.reading"], noise)[0, 1]) < 4 / math.sqrt(len(times))
    bench = assembly("b", hand=Driven(), cell=cell)
    run = Trace(times, {"hand.signal": zeros}, {"hand.signal": "N"})
    assert not np.array_equal(measure(run, bench, seed=8)["cell.reading"], noise)


@pytest.mark.parametrize(
    ("sensor", "unit", "expected"),
    [
        (TorqueSensor(of="hand.signal", gain=1.5, bias=0.25), "N*m", 1.5 * 2.0 + 0.25),
        (CurrentSensor(of="hand.signal", bias=-0.5), "A", 1.5),
    ],
)
def test_transducer_and_ammeter_are_lines_in_a_record(sensor: Sensor, unit: str, expected: float) -> None:
    times = np.linspace(0.0, 1.0, 11)
    run = seen(times, np.full(11, 2.0), unit, meter=sensor)
    assert run["meter.reading"] == pytest.approx(np.full(11, expected))
    assert run.units["meter.reading"] == unit


def test_a_torque_transducer_is_the_same_line_in_the_flat_model() -> None:
    sensor = TorqueSensor(of="spring.torque", gain=1.5, bias=0.25)
    made = assembly(
        "a", hand=Driven(), spring=tie(Spring(stiffness=4.0, domain=ROTATION), "hand"), cell=sensor
    )
    assert flatten(made).evaluate([], [0.5, 0.0])["cell.reading"] == pytest.approx(1.5 * 2.0 + 0.25)


@pytest.mark.long_cases("20.0", "1.0", "8.0")
@pytest.mark.parametrize("frequency", [1.0, 8.0, 20.0])
def test_a_tachometer_is_a_differentiator_with_a_first_order_roll_off(frequency: float) -> None:
    """jω·ω_c/(jω + ω_c) in the flat model and, at a high rate, in the record."""
    sensor = Tachometer(of="hand.angle", bandwidth=15.0, sample_rate=20_000.0)
    made = assembly("a", hand=Driven(), tacho=sensor)
    times = np.linspace(0.0, 2.0, 40_001)
    speed, corner = 2 * math.pi * frequency, 2 * math.pi * 15.0
    run = simulate(flatten(made), times, inputs={"hand.angle": lambda t: 0.1 * math.sin(speed * t)})
    record = measure(run, made, seed=1)
    expected = 0.1 / 1j * 1j * speed * corner / (1j * speed + corner)
    late = times >= 1.0
    for trace, within in ((run, 1e-5), (record, 4e-3)):
        found = first_harmonic(times[late], trace["tacho.reading"][late], frequency)
        assert found == pytest.approx(expected, rel=within)
        assert trace.units["tacho.reading"] == "rad/s"


def test_one_count_of_an_encoder_shows_as_a_step_of_the_tachometer() -> None:
    """A slow ramp over one count: (1 − a)·q·f_s at once, then decay by a per sample."""
    times, quantum, rate, corner = np.arange(200) / 1000.0, 1e-3, 1000.0, 30.0
    angle = np.where(times < 0.1, 0.0, quantum)
    run = seen(
        times,
        angle,
        "rad",
        dial=Encoder(of="hand.signal", quantum=quantum),
        samples=SampleAndHold(of="dial.reading", sample_rate=rate),
        tacho=Tachometer(of="samples.reading", bandwidth=corner, sample_rate=rate),
    )
    keep = math.exp(-2 * math.pi * corner / rate)
    expected = np.where(times < 0.1, 0.0, (1 - keep) * quantum * rate * keep ** (np.arange(200.0) - 100))
    assert run["tacho.reading"] == pytest.approx(expected, abs=1e-12)
