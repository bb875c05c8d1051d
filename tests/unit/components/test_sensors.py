"""Sensors: readings against formulas typed here.

Independent road for the delay: the exact frequency response e^(−iωτ), and its Padé approximant from
``scipy.interpolate.pade`` on the Taylor coefficients of the exponential.
"""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import pade

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    CurrentSensor,
    Driven,
    Encoder,
    ForceSensor,
    GearedMotor,
    Inertia,
    Spring,
    TransportDelay,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.sensing.sensors import Sensor
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import simulate

DELAY = 2e-3


def pulled(**sensor: Sensor) -> Assembly:
    return assembly(
        "pulled", grip=Driven(domain=TRANSLATION), spring=tie(Spring(stiffness=1000.0), "grip"), **sensor
    )


@given(st.floats(-10.0, 10.0), st.sampled_from([0.767e-3, 1e-3, 0.25]))
def test_encoder_reads_whole_counts_half_a_count_off_at_most(angle: float, quantum: float) -> None:
    model = flatten(
        assembly("a", wheel=Inertia(inertia=1.0), dial=Encoder(of="wheel.angle", quantum=quantum))
    )
    reading = model.evaluate([angle, 0.0])["dial.reading"]
    assert reading / quantum == pytest.approx(round(reading / quantum), abs=1e-6)
    assert abs(reading - angle) <= quantum / 2 * (1 + 1e-9)


def test_load_cell_and_ammeter_are_lines_and_their_inverse_is_exact() -> None:
    cell = ForceSensor(of="spring.force", gain=1.02, bias=-3.0)
    model = flatten(pulled(cell=cell))
    assert model.evaluate([], [0.01, 0.0])["cell.reading"] == pytest.approx(1.02 * 10.0 - 3.0)
    meter = CurrentSensor(of="motor.current", bias=0.1)
    motor = GearedMotor(inertia=1.0, gear_ratio=1.0, torque_constant=0.1)
    one = flatten(assembly("a", motor=motor, meter=meter))
    assert one.evaluate([0.0, 0.0], [2.0])["meter.reading"] == pytest.approx(2.1)
    for sensor, reading, value in ((cell, 7.2, 10.0), (meter, 2.1, 2.0)):

        class Own:
            def parameter(self, name: str, of: Sensor = sensor) -> float:
                return getattr(of, name).number

        assert sensor.infer(Own(), reading) == pytest.approx(value)  # type: ignore[arg-type]


def response(frequency: float) -> complex:
    model = flatten(pulled(cell=TransportDelay(of="spring.force", delay=DELAY)), inputs=["grip.position"])
    linear = linearise(model, model.start(model.states))
    return complex(linear.to_control()(2j * math.pi * frequency)) / 1000.0


@pytest.mark.parametrize("frequency", [0.5, 5.0, 20.0, 40.0, 60.0])
def test_delay_against_the_exact_phase(frequency: float) -> None:
    """The stated bound (ωτ)⁵/720 on the phase, and no loss of amplitude at all."""
    angle = 2 * math.pi * frequency * DELAY
    found = response(frequency)
    assert abs(found) == pytest.approx(1.0, abs=1e-12)
    error = abs(np.angle(found * np.exp(1j * angle)))
    assert error <= angle**5 / 720 * 1.001 + 1e-12
    assert error >= angle**5 / 720 * 0.8 - 1e-12, "the bound is tight, so the approximant is the (2,2) one"


def test_delay_is_the_pade_approximant_of_the_exponential() -> None:
    taylor = [(-DELAY) ** k / math.factorial(k) for k in range(5)]
    over, under = pade(taylor, 2)
    for frequency in (1.0, 50.0, 300.0):
        s = 2j * math.pi * frequency
        assert response(frequency) == pytest.approx(over(s) / under(s), rel=1e-9)


def test_delayed_reading_of_a_wave_is_the_wave_before() -> None:
    """In time: after the transient the reading of a 5 Hz wave is the force τ earlier."""
    bus = TransportDelay(of="spring.force", delay=DELAY)
    model = flatten(pulled(bus=bus, cell=ForceSensor(of="bus.reading", gain=2.0, bias=1.0)))
    times = np.linspace(0.0, 0.4, 401)
    speed = 2 * math.pi * 5.0
    run = simulate(
        model,
        times,
        inputs={"grip.position": lambda t: 0.01 * math.sin(speed * t), "grip.speed": lambda t: 0.0},
    )
    late = times > 0.05
    expected = 1.0 + 2.0 * 10.0 * np.sin(speed * (times - DELAY))
    assert (
        np.max(np.abs(run["cell.reading"] - expected)[late]) <= 20.0 * (speed * DELAY) ** 5 / 720 * 1.1 + 1e-7
    )


def test_states_of_the_delay_are_of_the_size_of_the_force() -> None:
    """So that the absolute tolerance of the integrator means something for them; units say the same."""
    model = flatten(pulled(cell=TransportDelay(of="spring.force", delay=1e-5)))
    assert {v.unit for v in model.states} == {"N"}
    linear = control.ss(linearise(model, [0.0, 0.0]).to_control())
    rest = -np.linalg.solve(linear.A, linear.B[:, :1])
    assert rest.ravel() == pytest.approx([1000.0, 0.0], abs=1e-6)
