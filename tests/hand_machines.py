"""Small machines in NumPy: a motor, perhaps a joint behind a spring, and friction that truly sticks.

    Jₘ dωₘ/dt = k I − b ωₘ − friction − spring         J dω/dt = spring − friction − W sin(θ + φ)
    spring = K (θₘ − θ) + D (ωₘ − ω)

Friction is set-valued: a step of it stops a body or slows it, and never turns it. Where there is no spring
the weight acts on the motor. The current follows a wish without any sampling in between.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi, sin
from pathlib import Path

import numpy as np

from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten

_STEP = 5e-5

Level = Callable[[float, float, float], float]
"""Friction of a body from its rate, its angle, and the torque that a spring or a weight puts on it."""


def smooth_body(rate: float, angle: float, load: float) -> float:
    """No dry friction."""
    return 0.0


@dataclass(frozen=True)
class Machine:
    """What is really there, and what its deck says; the records are six sums of sines, 8 s each."""

    inertia: float = 0.02
    constant: float = 1.0  # N·m/A
    damping: float = 0.02
    weight: float = 0.0
    hanging: float = 0.0
    stiffness: float = 0.0  # of a spring between motor and joint; none where zero
    loss: float = 0.0
    joint_inertia: float = 0.03
    friction: Level = smooth_body
    joint_friction: Level = smooth_body
    extra: Callable[[float, float], float] = lambda rate, angle: 0.0  # torque against the motor
    declared: Mapping[str, str] = field(default_factory=dict)  # tables of the deck that differ; "" for none
    rate: float = 500.0
    counts: float = 2.0 * pi / 200_000
    current_noise: float = 0.002
    middle: float = 0.0
    size: float = 0.6
    quickest: float = 1.6  # Hz


_MOTOR = """
[motor]
component = "GearedMotor"
inertia = {{value = {inertia}, unit = "kg*m^2", source = "declared", spread = 0.1}}
gear_ratio = {{value = 1.0, unit = "1", source = "declared"}}
torque_constant = {{value = {constant}, unit = "N*m/A", source = "declared"}}
"""
_BEARING = """
[bearing]
component = "Dashpot"
between = ["motor"]
damping = {{value = {damping}, unit = "N*m*s/rad", source = "declared", spread = 0.5}}
"""
_JOINT = """
[joint]
component = "Inertia"
inertia = {{value = {joint_inertia}, unit = "kg*m^2", source = "declared", spread = 0.1}}
"""
_SPRING = """
[spring]
component = "Spring"
between = ["motor", "joint"]
stiffness = {{value = {stiffness}, unit = "N*m/rad", source = "declared", spread = 0.1}}
"""
_WEIGHT = """
[weight]
component = "GravityLoad"
between = ["{loaded}"]
horizontal_torque = {{value = {weight}, unit = "N*m", source = "declared", spread = 0.1}}
hanging_angle = {{value = {declared_hanging}, unit = "rad", source = "declared"}}
"""
_ENCODER = """
[encoder]
component = "Encoder"
of = "motor.angle"
quantum = {{value = {counts}, unit = "rad", source = "declared"}}
"""
_SECOND_ENCODER = """
[joint_encoder]
component = "Encoder"
of = "joint.angle"
quantum = {{value = {counts}, unit = "rad", source = "declared"}}
"""
_AMMETER = """
[ammeter]
component = "CurrentSensor"
of = "motor.current"
bias = {{value = 0.0, unit = "A", source = "declared"}}
noise = {{value = {current_noise}, unit = "A", source = "declared"}}
"""


def deck_of(machine: Machine) -> str:
    """Return the deck of a machine, with the tables that it declares otherwise."""
    two = machine.stiffness > 0.0
    tables = {
        "motor": _MOTOR,
        "bearing": _BEARING,
        "joint": _JOINT if two else "",
        "spring": _SPRING if two else "",
        "weight": _WEIGHT if machine.weight else "",
        "encoder": _ENCODER,
        "joint_encoder": _SECOND_ENCODER if two else "",
        "ammeter": _AMMETER,
    } | machine.declared
    numbers = {n: getattr(machine, n) for n in machine.__dataclass_fields__}
    head = '[deck]\nname = "machine"\ndescription = "a small machine of a test"\n'
    return head + "".join(
        text.format(**numbers, loaded="joint" if two else "motor", declared_hanging=-machine.hanging)
        for text in tables.values()
    )


def simulated(machine: Machine, seed: int) -> Array:
    """Return time, angle of the motor and of the joint, and current at the samples, shape (n, 4)."""
    draw = np.random.default_rng(seed)
    frequencies, phases = draw.uniform(0.15, machine.quickest, 3), draw.uniform(0.0, 2.0 * pi, 3)
    shares = frequencies**-0.5 / np.sum(frequencies**-0.5)
    time = np.arange(round(8.0 / _STEP)) * _STEP
    angles = 2.0 * pi * np.outer(frequencies, time) + phases[:, None]
    wanted = machine.middle + machine.size * shares @ np.sin(angles)
    speed = machine.size * (shares * 2.0 * pi * frequencies) @ np.cos(angles)
    j, k, joint = machine.inertia, machine.stiffness, machine.joint_inertia
    whole = j + (joint if k else 0.0)
    omega = 30.0
    gain, rate_gain = whole * omega**2, 1.4 * whole * omega
    place = other = float(wanted[0])
    rate = other_rate = float(speed[0])
    rows = []
    for goal, goal_rate in zip(wanted.tolist(), speed.tolist(), strict=True):
        current = (gain * (goal - place) + rate_gain * (goal_rate - rate)) / machine.constant
        rows.append((place, other, current))
        spring = k * (place - other) + machine.loss * (rate - other_rate)
        weight = machine.weight * sin((other if k else place) + machine.hanging)
        load = spring if k else weight
        push = machine.constant * current - machine.damping * rate - load - machine.extra(rate, place)
        rate = _slowed(rate + _STEP * push / j, _STEP * machine.friction(rate, place, load) / j)
        place += _STEP * rate
        if k:
            level = machine.joint_friction(other_rate, other, spring)
            other_rate += _STEP * (spring - weight) / joint
            other_rate = _slowed(other_rate, _STEP * level / joint)
            other += _STEP * other_rate
    every = round(1.0 / (machine.rate * _STEP))
    table = np.column_stack([time, np.array(rows)])[::every]
    table[:, 1:3] = machine.counts * np.round(table[:, 1:3] / machine.counts)
    table[:, 3] += machine.current_noise * draw.standard_normal(len(table))
    return np.asarray(table)


def _slowed(rate: float, most: float) -> float:
    return max(rate - most, 0.0) if rate > 0.0 else min(rate + most, 0.0)


def made(machine: Machine, folder: Path, *, records: int = 4, seed: int = 0) -> tuple[Assembly, RecordSet]:
    """Write deck and records of a machine, and read them as a user would."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "deck.toml").write_text(deck_of(machine), encoding="utf-8")
    two = machine.stiffness > 0.0
    for number in range(records):
        table = simulated(machine, 100 * seed + number)
        heads = "t_s,encoder.reading_rad,joint_encoder.reading_rad,ammeter.reading_A"
        if not two:
            table, heads = table[:, [0, 1, 3]], "t_s,encoder.reading_rad,ammeter.reading_A"
        np.savetxt(folder / f"run_{number}.csv", table, fmt="%.8f", delimiter=",", header=heads, comments="")
    declared = declare(load_deck(folder / "deck.toml"))
    return declared, load_records(folder, flatten(declared))
