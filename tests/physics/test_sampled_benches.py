"""Records of machines that bend between samples, by hand in NumPy: the declared model leaves noise alone.

Nothing is missing in these machines, so the mean square of what a block leaves is about one in units of its
noise. The equations are typed here and integrated by ``scipy.integrate.solve_ivp`` with a relative tolerance
of 1e-8; only their numbers come from the decks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error import block_noise
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace

Rate = Callable[[float, Array], list[float]]
TEMPLATES = Path(__file__).parents[2] / "models" / "templates"
FINE = {"motor_encoder.quantum": 5e-6}
NOISE_ALONE = 1.4
"""Mean square from which a diagnosis calls a block open."""


def assembly(template: str) -> Assembly:
    return declare(load_deck(str(TEMPLATES / f"{template}.toml")))


def numbers(actuator: Assembly) -> dict[str, float]:
    return dict(flatten(actuator).values)


def counted(values: Array, quantum: float) -> Array:
    return quantum * np.round(values / quantum)


def moved(rate: Rate, time: Array) -> Array:
    path = solve_ivp(
        rate, (0.0, float(time[-1])), [0.0, 0.0], "RK45", time, rtol=1e-8, atol=1e-9, max_step=1e-3
    )
    assert path.success
    return np.asarray(path.y[0])


def record_of(name: str, time: Array, signals: dict[str, tuple[Array, str]]) -> Record:
    trace = Trace(
        time, {k: v for k, (v, _) in signals.items()}, {k: u for k, (_, u) in signals.items()}, name
    )
    return Record(name, trace)


def rubbed_spring(step: float) -> tuple[Assembly, RecordSet]:
    """A motor against a spring with dry friction, moved at 1 and 3 Hz, so that it rings at 8 Hz."""
    actuator = assembly("linear-spring").with_values(FINE)
    n = numbers(actuator)
    records = []
    for name, amplitude, frequency in (("slow", 4.0, 1.0), ("quick", 3.0, 3.0)):

        def rate(
            t: float, y: Array, amplitude: float = amplitude, w: float = math.tau * frequency
        ) -> list[float]:
            torque = n["motor.gear_ratio"] * n["motor.torque_constant"] * amplitude * math.sin(w * t)
            rubbing = n["dry_friction.sliding_effort"] * math.tanh(y[1] / n["dry_friction.creep_speed"])
            torque -= n["spring.stiffness"] * y[0] + n["bearing.damping"] * y[1] + rubbing
            return [y[1], torque / n["motor.inertia"]]

        time = np.arange(0.0, 2.0, step)
        angle = counted(moved(rate, time), n["motor_encoder.quantum"])
        current = amplitude * np.sin(math.tau * frequency * time)
        signals = {"motor_encoder.reading": (angle, "rad"), "motor.current": (current, "A")}
        records.append(record_of(name, time, signals))
    columns = (
        Column("angle", "motor_encoder.reading", "rad", quantum=n["motor_encoder.quantum"]),
        Column("current", "motor.current", "A"),
    )
    return actuator, RecordSet(tuple(records), columns)


def geared_limb() -> tuple[Assembly, RecordSet]:
    """A limb behind a lossy gear, whose small currents are measured with a noise of a tenth."""
    actuator = assembly("geared-joint")
    n, ratio = numbers(actuator), numbers(actuator)["gear.ratio"]
    weight = n["weight.mass"] * n["weight.gravity"] * n["weight.arm"]
    records = []
    for seed, (amplitude, frequency) in enumerate(((0.4, 2.0), (0.3, 1.0), (0.3, 3.0))):

        def rate(
            t: float, y: Array, amplitude: float = amplitude, w: float = math.tau * frequency
        ) -> list[float]:
            drive = n["motor.torque_constant"] * amplitude * math.sin(w * t)
            load = weight * math.sin(y[0] / ratio) + n["bearing.damping"] * y[1] / ratio
            sliding = abs(math.tanh(y[1] / n["gear.creep_speed"]))
            shares = (
                1.0 - (1.0 - n["gear.efficiency"]) * sliding,
                1.0 + (1.0 / n["gear.back_efficiency"] - 1.0) * sliding,
            )
            for k, share in enumerate(shares):
                # The torque on the limb is what goes into the gear, times ratio and share.
                inertia = n["motor.inertia"] + n["limb.inertia"] / (ratio**2 * share)
                acceleration = (drive - load / (ratio * share)) / inertia
                into = drive - n["motor.inertia"] * acceleration
                if (into * y[1] > 0.0) == (k == 0):
                    break
            return [y[1], acceleration]

        time, draw = np.arange(0.0, 1.5, 1e-3), np.random.default_rng(seed)
        command = amplitude * np.sin(math.tau * frequency * time)
        reading = command + n["current_sensor.noise"] * draw.standard_normal(len(time))
        signals = {
            "motor_encoder.reading": (counted(moved(rate, time), n["motor_encoder.quantum"]), "rad"),
            "current_sensor.reading": (reading, "A"),
            "motor.current": (command, "A"),
        }
        records.append(record_of(f"run {seed}", time, signals))
    columns = (
        Column("angle", "motor_encoder.reading", "rad", quantum=n["motor_encoder.quantum"]),
        Column("measured current", "current_sensor.reading", "A"),
        Column("current", "motor.current", "A"),
    )
    return actuator, RecordSet(tuple(records), columns)


def squares(actuator: Assembly, records: RecordSet, block: str) -> dict[str, float]:
    """Return the mean square of what a block of the declared model leaves of each record."""
    blocks = blocks_of(flatten(actuator), records.signals)
    bench = Bench(records, blocks)
    chosen = next(b for b in blocks if b.name == block)
    driven = bench.driven(chosen, [])
    every = bench.evidence(driven, bench.records.records, {})
    return {each.record.name: float(np.mean(each.residual({})[0] ** 2)) for each in every}


@pytest.mark.long_cases("0.005")
@pytest.mark.parametrize("step", [1e-3, 5e-3])
def test_dry_friction_that_turns_over_between_samples_is_no_missing_effect(
    step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = rubbed_spring(step)
    assert max(squares(*machine, "motor").values()) < NOISE_ALONE
    if step == 5e-3:
        monkeypatch.setattr(block_noise, "_reverses", lambda rate: np.zeros(len(rate), dtype=bool))
        assert max(squares(*machine, "motor").values()) > NOISE_ALONE, "or the test would show nothing"


@pytest.mark.slow
def test_noise_that_a_lossy_gear_rectifies_is_no_missing_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = geared_limb()
    assert max(squares(*machine, "motor").values()) < NOISE_ALONE
    monkeypatch.setattr(block_noise, "rectified", lambda *_: {})
    assert max(squares(*machine, "motor").values()) > NOISE_ALONE, "or the test would show nothing"
