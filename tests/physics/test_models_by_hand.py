"""The systems of ``models/`` that hold no spring behind a cam, against equations typed here.

Independent roads: the published equation of the positioning drive under scipy's integrator, its power balance
and final speed; for the strip the relaxation of parallel Maxwell branches in closed form, and the length at
which a buckled strip is taut again, found by bisection.
"""

from __future__ import annotations

import math
from dataclasses import replace

import fmpy
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from models import elastomer_specimen, positioning_drive
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.export import export_c, export_fmu
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from nlsdesign.model.linear import linearise
from nlsdesign.simulation import Trace, simulate

# What Janot, Gautier and Brunot 2019 publish: M, Fv, Fc, offset, drive gain.
MASS, VISCOUS, COULOMB, OFFSET, GAIN = 95.1089, 203.5034, 20.3935, -3.1648, 35.1507
CREEP = 1e-3

DRIVE = positioning_drive(load_deck("janot2019_positioning_drive"))
STRIP = elastomer_specimen(load_deck("vhb4910_specimen"))


def voltage(time: float) -> float:
    return 2.0 * math.sin(2 * math.pi * 0.7 * time) + 1.1 * math.sin(2 * math.pi * 1.9 * time)


def driven(times: np.ndarray) -> Trace:
    return simulate(flatten(DRIVE), times, inputs={"carriage.voltage": voltage})


def test_the_drive_agrees_with_its_equation_typed_here() -> None:
    def rate(time: float, x: np.ndarray) -> list[float]:
        friction = VISCOUS * x[1] + COULOMB * math.tanh(x[1] / CREEP)
        return [x[1], (GAIN * voltage(time) - friction - OFFSET) / MASS]

    times = np.linspace(0.0, 3.0, 301)
    # Through each reversal the friction turns within a millimetre per second: stiff, hence Radau.
    wanted = solve_ivp(rate, (0.0, 3.0), [0.0, 0.0], "Radau", times, rtol=1e-9, atol=1e-12).y
    found = driven(times)
    assert np.ptp(wanted[0]) > 0.05
    assert found["carriage.position"] == pytest.approx(wanted[0], abs=1e-7)
    assert found["carriage.speed"] == pytest.approx(wanted[1], abs=1e-6)


def test_work_put_into_the_drive_is_stored_or_lost() -> None:
    times = np.linspace(0.0, 3.0, 30_001)
    run = driven(times)
    speed = run["carriage.speed"]
    friction = VISCOUS * speed + COULOMB * np.tanh(speed / CREEP)
    work = cumulative_simpson(GAIN * run["carriage.voltage"] * speed, x=times, initial=0.0)
    lost = cumulative_simpson(friction * speed, x=times, initial=0.0)
    stored = MASS / 2 * speed**2 + OFFSET * run["carriage.position"]
    assert np.max(np.abs(work - lost - stored)) < 1e-5 * np.max(np.abs(work))
    assert lost[-1] > 0.3 * np.max(np.abs(work))


@pytest.mark.parametrize("volts", [1.5, -1.5])
def test_the_drive_ends_at_the_speed_at_which_all_forces_cancel(volts: float) -> None:
    # The time constant is M/Fv = 0.47 s.
    run = simulate(flatten(DRIVE), np.linspace(0.0, 12.0, 13), inputs={"carriage.voltage": volts})
    speed = (GAIN * volts - math.copysign(COULOMB, volts) - OFFSET) / VISCOUS
    assert run["carriage.speed"][-1] == pytest.approx(speed, rel=1e-8)


def test_the_voltage_is_held_within_its_limit() -> None:
    model = flatten(DRIVE)
    forces = [model.evaluate([0.0, 0.0], [v])["carriage.drive_force"] for v in (-30.0, 10.0, 11.0)]
    assert forces == pytest.approx([-10.0 * GAIN, 10.0 * GAIN, 10.0 * GAIN])


def test_around_a_steady_speed_the_drive_is_an_integrator_behind_a_lag() -> None:
    line = linearise(flatten(DRIVE), [0.0, 0.1])
    assert sorted(np.linalg.eigvals(line.A).real) == pytest.approx([-VISCOUS / MASS, 0.0])


# --- strip of elastomer ---------------------------------------------------------------------------

AREA, LENGTH, ELASTIC = 10e-6, 80e-3, 40e3
BRANCHES = ((100e3, 250e3), (40e3, 2.4e6))


def pulled(times: np.ndarray, position: np.ndarray) -> Trace:
    rate = np.gradient(position, times)
    return simulate(flatten(STRIP), times, inputs={"grip.position": position, "grip.speed": rate})


def test_the_strip_relaxes_as_parallel_maxwell_branches_do() -> None:
    # Ramp to 50 % strain in 2 s, then held; σ of a branch after the ramp: η·r·(1 − e^(−T/τ))·e^(−t/τ).
    ramp, rate = 2.0, 0.25
    times = np.linspace(0.0, 120.0, 1201)
    run = pulled(times, LENGTH * rate * np.minimum(times, ramp))
    held = times > ramp
    stress = ELASTIC * rate * ramp + sum(
        eta * rate * (1 - math.exp(-ramp * k / eta)) * np.exp(-(times[held] - ramp) * k / eta)
        for k, eta in BRANCHES
    )
    assert run["load_cell.reading"][held] == pytest.approx(AREA * stress, rel=1e-6)
    assert run["load_cell.reading"][held][-1] < 0.6 * run["load_cell.reading"].max()


def test_the_strip_hangs_slack_on_the_way_back_until_it_rests() -> None:
    """Back at constant rate: the force vanishes where k·ε + Σσᵢ does, and never turns to pushing."""
    rate, ramp = 0.05, 10.0

    def stress(back: float) -> float:
        found = ELASTIC * rate * (ramp - back)
        for k, eta in BRANCHES:
            peak, decay = eta * rate * (1 - math.exp(-ramp * k / eta)), math.exp(-back * k / eta)
            found += peak * decay - eta * rate * (1 - decay)
        return found

    low, high = 0.0, ramp
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if stress(middle) > 0 else (low, middle)
    times = np.linspace(0.0, 2 * ramp, 20_001)
    run = pulled(times, LENGTH * rate * (ramp - np.abs(times - ramp)))
    slack = times[(run["strip.force"] <= 1e-9) & (times > ramp)]
    assert slack[0] - ramp == pytest.approx(low, abs=2e-3)
    assert run["strip.force"].min() >= 0.0
    assert slack[-1] == times[-1]


# --- all that every model can do -----------------------------------------------------------------


@pytest.mark.parametrize("made", [DRIVE, STRIP], ids=lambda made: made.name)
def test_decks_and_functions_say_the_same(made: Assembly, tmp_path) -> None:
    assert declare(load_deck(made.name)) == made
    assert declare(read_deck(deck_text(made), tmp_path / "again.toml")) == made


@pytest.mark.parametrize("made", [DRIVE, STRIP], ids=lambda made: made.name)
def test_the_equations_in_c_give_the_same_numbers(made: Assembly, tmp_path) -> None:
    # A step of C is the flat function itself; here it gives the derivatives.
    model = flatten(made)
    step = CompiledStep(export_c(replace(model, sample_time=1e-3), tmp_path))
    inputs = [0.03 * (1 + k) for k in range(len(model.inputs))]
    wanted = model.equations(0.0, [0.0, 0.0], inputs, model.start(model.parameters), [])
    outputs, status = step(inputs)
    assert status == 0
    assert list(outputs) == pytest.approx(np.array(wanted[1]).ravel().tolist(), rel=1e-12)


def test_the_drive_as_fmu_moves_as_it_does_here(tmp_path) -> None:
    times = np.linspace(0.0, 1.0, 101)
    signal = np.array([(t, voltage(t)) for t in times], dtype=[("time", float), ("carriage.voltage", float)])
    found = fmpy.simulate_fmu(
        str(export_fmu(flatten(DRIVE), tmp_path / "drive.fmu", step=0.01)),
        stop_time=1.0, output_interval=0.01, input=signal, output=["carriage.position"],
    )  # fmt: skip
    held = simulate(flatten(DRIVE), times, inputs={"carriage.voltage": signal["carriage.voltage"]}, hold=True)
    assert np.ptp(held["carriage.position"]) > 0.02
    assert found["carriage.position"] == pytest.approx(held["carriage.position"], abs=1e-6)
