"""A motor that moves a carriage through a screw or a rack, by two roads.

Independent roads: one reflected mass with its equation typed here and integrated by Radau, the same train
written from the carriage, and the work of motor, spring and friction by Simpson's rule.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    CurrentDrivenMotor,
    Dashpot,
    Encoder,
    Fixed,
    Inertia,
    Mass,
    Rack,
    Screw,
    Spring,
    parallel,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare, write_deck
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.mechanics.gear import Transmission
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import NlsError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import measure, simulate, sine

ROTOR, CONSTANT, MASS, STIFFNESS, DAMPING = 3.0e-5, 0.04, 1.7, 900.0, 12.0
RADIUS, LEAD = 0.011, -0.008
RACK = Rack(between=("motor", "carriage"), radius=RADIUS)
SCREW = Screw(between=("motor", "carriage"), lead=LEAD)


def machine(joint: Transmission, *, from_carriage: bool = False) -> Assembly:
    """A carriage on a spring and a damper, driven by a motor; its parts in one order or the other."""
    motor = CurrentDrivenMotor(
        inertia=ROTOR, torque_constant=CONSTANT, resistance=0.5, current_limit=20.0, voltage_limit=1000.0
    )
    buffer = parallel(
        spring=Spring(stiffness=STIFFNESS, domain=TRANSLATION),
        damper=Dashpot(damping=DAMPING, domain=TRANSLATION),
    )
    bodies = {"motor": motor, "carriage": Mass(mass=MASS)}
    order = reversed(bodies) if from_carriage else bodies
    return assembly(
        "axis", **{name: bodies[name] for name in order}, joint=joint, buffer=tie(buffer, "carriage"),
        scale=Encoder(of="carriage.position", quantum=quantity(5.0, "um")),
    )  # fmt: skip


def swung(made: Assembly, times: np.ndarray) -> dict[str, np.ndarray]:
    current = sine("motor.current", 3.0, 9.0 / (2.0 * math.pi))
    run = simulate(flatten(made), times, inputs=current, tolerance=1e-10)
    names = ("motor.angle", "motor.speed", "motor.drive_torque", "carriage.position", "carriage.speed")
    return {name: run[name] for name in (*names, "joint.force", "joint.input_torque")}


@pytest.mark.long_cases("False-joint0-0.011", "True-joint1--0.0012732395447351628")
@pytest.mark.parametrize(("joint", "travel"), [(RACK, RADIUS), (SCREW, LEAD / (2.0 * math.pi))])
@pytest.mark.parametrize("from_carriage", [False, True])
def test_a_carriage_moves_as_one_reflected_mass(
    joint: Transmission, travel: float, from_carriage: bool
) -> None:
    times = np.linspace(0.0, 1.0, 401)

    def rate(time: float, state: np.ndarray) -> list[float]:
        force = CONSTANT * 3.0 * math.sin(9.0 * time) / travel - STIFFNESS * state[0] - DAMPING * state[1]
        return [state[1], force / (MASS + ROTOR / travel**2)]

    exact = solve_ivp(rate, (0.0, 1.0), [0.0, 0.0], method="Radau", t_eval=times, rtol=1e-10, atol=1e-13).y
    found = swung(machine(joint, from_carriage=from_carriage), times)
    size = np.max(np.abs(exact), axis=1)
    assert np.ptp(exact[0]) > 1e-3
    assert found["carriage.position"] == pytest.approx(exact[0], abs=1e-6 * size[0])
    assert found["carriage.speed"] == pytest.approx(exact[1], abs=1e-6 * size[1])
    assert found["motor.angle"] == pytest.approx(exact[0] / travel, abs=1e-6 * size[0] / abs(travel))


@pytest.mark.parametrize("joint", [RACK, SCREW])
def test_what_the_motor_gives_is_stored_or_lost(joint: Transmission) -> None:
    times = np.linspace(0.0, 1.0, 4001)
    run = swung(machine(joint), times)
    given = run["motor.drive_torque"] * run["motor.speed"]
    work = cumulative_simpson(given, x=times, initial=0.0)
    lost = cumulative_simpson(DAMPING * run["carriage.speed"] ** 2, x=times, initial=0.0)
    moving = 0.5 * (ROTOR * run["motor.speed"] ** 2 + MASS * run["carriage.speed"] ** 2)
    stored = moving + 0.5 * STIFFNESS * run["carriage.position"] ** 2
    assert work == pytest.approx(stored + lost, abs=1e-6 * float(np.max(np.abs(work))))
    through = run["joint.input_torque"] * run["motor.speed"]
    assert through == pytest.approx(run["joint.force"] * run["carriage.speed"], abs=1e-12)


def test_an_encoder_counts_along_the_line() -> None:
    made, times = machine(RACK), np.linspace(0.0, 0.5, 501)
    run = simulate(flatten(made), times, inputs={"motor.current": 2.0 * np.sin(9.0 * times)})
    reading = measure(run, made, seed=1)["scale.reading"]
    counts = reading / 5e-6
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    assert reading == pytest.approx(run["carriage.position"], abs=2.5e-6 * (1.0 + 1e-9))
    assert len(np.unique(np.round(counts))) > 50


def test_the_deck_of_an_axis_is_read_back_as_the_same_machine(tmp_path: Path) -> None:
    made = machine(SCREW)
    write_deck(made, tmp_path / "axis.toml")
    again = declare(load_deck(tmp_path / "axis.toml"))
    assert str(again).partition("\n")[2] == str(made).partition("\n")[2]
    assert flatten(again).values == flatten(made).values


@pytest.mark.parametrize(
    ("joint", "first", "second", "says"),
    [
        (RACK, Mass(mass=1.0), Inertia(inertia=1.0), 'write between = ["carriage", "motor"]'),
        (SCREW, Inertia(inertia=1.0), Inertia(inertia=1.0), "take Gear"),
        (RACK, Mass(mass=1.0), Mass(mass=1.0), "tie the two with a spring"),
        (RACK, Inertia(inertia=1.0), Fixed(domain=TRANSLATION), "is prescribed"),
    ],
)
def test_what_cannot_be_joined_is_said(joint: Transmission, first: object, second: object, says: str) -> None:
    with pytest.raises(NlsError) as error:
        assembly("wrong", motor=first, carriage=second, joint=joint)
    assert says in str(error.value)


def test_a_screw_without_lead_is_refused() -> None:
    with pytest.raises(NlsError, match="a screw of lead zero moves nothing"):
        Screw(between=("motor", "carriage"), lead=0.0)
    with pytest.raises(NlsError, match="a pinion of radius zero moves nothing"):
        Rack(between=("motor", "carriage"), radius=0.0)
