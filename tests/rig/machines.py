"""Machines without a cam: a joint that lifts a weight, a spindle, and a drive whose shaft twists.

    Jₘ dωₘ/dt = T I' − b ωₘ + push − ripple − drag − friction − shaft
    J_l dω_l/dt = shaft − W sin(θ_l) − W₁ sin(θ_l + φ)        shaft = K (θₘ − θ_l) + D (ωₘ − ω_l)

Without a shaft both are one inertia.  A position loop I = clip(k_P (θ* − θₘ) + k_D (θ̇* − ωₘ) + k_I ∫, ±I_max)
moves them; friction is the set-valued law of `bench`.  Measured are the angle of the motor side, in counts,
and the current.  All numbers are invented.

``joint``    one inertia with a declared weight W on an arm, measured 250 times a second
``spindle``  one inertia, declared so; a hidden shaft (``drivetrain_resonance``) moves a share of it away
``shaft``    two inertias and the shaft between them, all declared
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import sin
from pathlib import Path

import numpy as np

from .actuators import Sensors
from .bench import friction_level, prox
from .commands import STEP, Command, sines, steps
from .conditions import PLAIN, Conditions
from .effects import Hidden, applied
from .faults import acting_current

FRICTIONS = ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "position_dependent_friction")
DRIVES = (
    "quadratic_drag", "torque_ripple", "drive_delay", "torque_constant_saturation", "constant_torque",
    "torque_constant_drift", "winding_heat", "angle_sensor_eccentricity",
)  # fmt: skip
OUTSIDE_ON_MACHINES = (
    "periodic_disturbance", "time_varying_load", "external_push", "hardening_stop", "rubbing_spot",
    "amplifier_dead_zone",
)  # fmt: skip


@dataclass(frozen=True)
class Motions:
    """What the loop is told to do: sines, steps and a multisine."""

    sines: Mapping[str, tuple[float, float, float]]  # degrees, Hz, s
    holds: tuple[float, ...]  # degrees
    hold_time: float  # s
    rise: float  # s
    multisine: tuple[float, ...]  # Hz
    peak: float  # degrees, of the multisine
    multisine_time: float  # s


@dataclass(frozen=True)
class Machine:
    """What its makers declare; the spreads are 6 %, and a factor of 1.6 on both viscosities."""

    name: str
    inertia: float  # kg·m², of both sides together
    torque_per_ampere: float  # N·m/A, gear ratio times torque constant
    gear_ratio: float
    viscosity: float  # N·m·s/rad
    typical_torque: float  # N·m, to which hidden effects are scaled
    motions: Motions
    sensors: Sensors
    ripple_order: int
    bandwidth: float  # rad/s, of the loop
    current_limit: float  # A
    effects: tuple[str, ...]
    outside: tuple[str, ...] = OUTSIDE_ON_MACHINES
    weight: float = 0.0  # N·m, with the arm level
    load_share: float = 0.0  # of the inertia, behind the shaft
    shaft_stiffness: float = 0.0  # N·m/rad
    shaft_damping: float = 0.0  # N·m·s/rad

    @property
    def motor_inertia(self) -> float:
        """Inertia of the motor side, kg·m²."""
        return (1.0 - self.load_share) * self.inertia

    @property
    def load_inertia(self) -> float:
        """Inertia behind the shaft, kg·m²."""
        return self.load_share * self.inertia


JOINT = Machine(
    name="joint",
    inertia=0.21,
    torque_per_ampere=2.6,
    gear_ratio=52.0,
    viscosity=0.16,
    typical_torque=3.4,
    motions=Motions(
        sines={
            "sine_30deg_0.2Hz": (30.0, 0.2, 12.0),
            "sine_70deg_0.5Hz": (70.0, 0.5, 8.0),
            "sine_35deg_1.3Hz": (35.0, 1.3, 5.0),
            "sine_12deg_3.0Hz": (12.0, 3.0, 4.0),
        },
        holds=(25.0, 70.0, 10.0, -45.0, 0.0, 55.0),
        hold_time=2.0,
        rise=0.35,
        multisine=(0.2, 0.5, 0.9, 1.6, 2.6),
        peak=50.0,
        multisine_time=10.0,
    ),
    sensors=Sensors(counts=8192, current_noise=0.015, sample_rate=250.0),
    ripple_order=12,
    bandwidth=35.0,
    current_limit=9.0,
    effects=(*FRICTIONS, "load_dependent_friction", *DRIVES, "gravity_load"),
    weight=3.4,
)

_FAST = Motions(
    sines={
        "sine_60deg_0.3Hz": (60.0, 0.3, 10.0),
        "sine_40deg_1.0Hz": (40.0, 1.0, 6.0),
        "sine_12deg_4.0Hz": (12.0, 4.0, 4.0),
        "sine_3deg_10Hz": (3.0, 10.0, 3.0),
    },
    holds=(20.0, 60.0, 5.0, -40.0, 0.0, 30.0),
    hold_time=1.2,
    rise=0.12,
    multisine=(0.4, 1.1, 2.3, 4.1, 6.7, 9.1, 12.3),
    peak=15.0,
    multisine_time=8.0,
)
SPINDLE = Machine(
    name="spindle",
    inertia=0.018,
    torque_per_ampere=0.85,
    gear_ratio=10.0,
    viscosity=0.035,
    typical_torque=1.1,
    motions=_FAST,
    sensors=Sensors(counts=16384, current_noise=0.02, sample_rate=1000.0),
    ripple_order=14,
    bandwidth=60.0,
    current_limit=15.0,
    effects=(*FRICTIONS, *DRIVES, "drivetrain_resonance"),
)
SHAFT = replace(
    SPINDLE,
    name="shaft",
    inertia=0.026,
    load_share=0.55,
    shaft_stiffness=62.0,
    shaft_damping=0.05,
    bandwidth=28.0,
    ripple_order=8,
    sensors=Sensors(counts=16384, current_noise=0.025, sample_rate=500.0),
    effects=(*FRICTIONS, *DRIVES),
)
MACHINES = {machine.name: machine for machine in (JOINT, SPINDLE, SHAFT)}

_BUILD, _COMMAND, _EFFECT, _NOISE, _CONDITIONS = range(10, 15)


def _stream(seed: int, purpose: int, record: int = 0) -> np.random.Generator:
    return np.random.default_rng([seed, purpose, record])


def _sizes(machine: Machine, draw: np.random.Generator) -> dict[str, dict[str, float]]:
    """Fields of `Hidden` that each effect sets, at strength 1; shares of the typical torque as on the cam."""
    torque = machine.typical_torque
    current = torque / machine.torque_per_ampere
    about = 1.3 ** draw.uniform(-1.0, 1.0, size=6)
    phase = draw.uniform(0.0, 2.0 * np.pi, size=4)
    place = draw.uniform(0.35, 0.65)
    fastest = max(np.radians(a) * 2.0 * np.pi * f for a, f, _ in machine.motions.sines.values())
    return {
        "coulomb_friction": {"friction": 0.12 * torque},
        "stribeck_friction": {
            "friction": 0.08 * torque, "breakaway": 0.12 * torque, "stribeck_speed": 0.3 * about[0],
        },
        "asymmetric_friction": {"friction": 0.10 * torque, "constant_torque": -0.05 * torque},
        "position_dependent_friction": {"place_friction": 0.10 * torque, "place_phase": phase[0]},
        "load_dependent_friction": {"load_friction": 0.10},
        "quadratic_drag": {"drag": 0.25 * torque / fastest**2},
        "torque_ripple": {
            "ripple": 0.08 * torque, "ripple_order": machine.ripple_order, "ripple_phase": phase[1],
        },
        "drive_delay": {"drive_delay": 0.2 / machine.bandwidth},
        "torque_constant_saturation": {"saturation": 1.0 / (1.5 * current)},
        "constant_torque": {"constant_torque": 0.06 * torque},
        "current_sensor_bias": {"current_bias": 0.06 * current},
        "torque_constant_drift": {"constant_drift": 0.02},
        "winding_heat": {"winding_heat": 0.08 / current**2},
        "angle_sensor_eccentricity": {"eccentricity": 0.02, "disc_phase": phase[2]},
        "gravity_load": {"weight": 0.20 * torque, "weight_phase": phase[3]},
        "drivetrain_resonance": {"shaft_share": 0.5},
        "periodic_disturbance": {
            "disturbance": 0.17 * torque, "disturbance_frequency": 7.0 * about[1],
            "disturbance_phase": phase[0],
        },
        "time_varying_load": {
            "slow_load": 0.12 * torque, "slow_frequency": 0.15 * about[2], "slow_phase": phase[1],
        },
        "external_push": {"push": 0.5 * torque, "push_place": place, "push_time": 0.3 * about[3]},
        "hardening_stop": {"stop": 0.5 * torque / 0.25**2},
        "rubbing_spot": {"spot_friction": 0.25 * torque},
        "amplifier_dead_zone": {"dead_zone": 0.10 * current},
    }  # fmt: skip


def machine_truth(machine: Machine, effects: Mapping[str, float], seed: int) -> tuple[Machine, Hidden]:
    """The machine as built, within the declared spread, and the sizes of what is hidden."""
    u = _stream(seed, _BUILD).uniform(-1.0, 1.0, size=7)
    built = replace(
        machine,
        inertia=machine.inertia * (1.0 + 0.06 * u[0]),
        torque_per_ampere=machine.torque_per_ampere * (1.0 + 0.06 * u[1]),
        viscosity=machine.viscosity * 1.6 ** u[2],
        weight=machine.weight * (1.0 + 0.06 * u[3]),
        shaft_stiffness=machine.shaft_stiffness * (1.0 + 0.06 * u[4]),
        shaft_damping=machine.shaft_damping * 1.6 ** u[5],
    )
    hidden = applied(_sizes(machine, _stream(seed, _EFFECT)), effects)
    if hidden.shaft_share:
        # A shaft with its own frequency about 9 Hz while the motor is held.
        share = min(hidden.shaft_share, 0.8)
        stiffness = share * built.inertia * (2.0 * np.pi * 9.0 * 1.2 ** u[6]) ** 2
        damping = 0.08 * (stiffness * share * built.inertia) ** 0.5
        built = replace(built, load_share=share, shaft_stiffness=stiffness, shaft_damping=damping)
    return built, hidden


def machine_commands(machine: Machine, draw: np.random.Generator) -> dict[str, Command]:
    """The six commands of a set, by the name of the record."""
    motions = machine.motions

    def clock(duration: float) -> np.ndarray:
        return np.arange(round(duration / STEP)) * STEP

    made = {
        name: sines(clock(duration), np.radians([amplitude]), np.array([frequency]), np.zeros(1))
        for name, (amplitude, frequency, duration) in motions.sines.items()
    }
    made["hold"] = steps(
        clock(motions.hold_time * len(motions.holds)),
        np.radians(motions.holds),
        motions.hold_time,
        motions.rise,
    )
    frequencies = np.array(motions.multisine)
    phases = draw.uniform(0.0, 2.0 * np.pi, size=frequencies.size)
    raw = sines(clock(motions.multisine_time), frequencies**-1.0, frequencies, phases)
    scale = np.radians(motions.peak) / np.max(np.abs(raw.angle))
    made["multisine"] = Command(raw.time, scale * raw.angle, scale * raw.speed)
    return made


@dataclass(frozen=True)
class Run:
    """True signals at every step, arrays of shape (n,)."""

    time: np.ndarray  # s
    angle: np.ndarray  # rad, motor side
    speed: np.ndarray  # rad/s, half a step before the angle
    load_angle: np.ndarray  # rad
    current: np.ndarray  # A


def _pushes(hidden: Hidden, time: np.ndarray) -> Iterator[float]:
    """Torque on the motor side that goes with time alone, N·m."""
    push = hidden.disturbance * np.sin(
        2.0 * np.pi * hidden.disturbance_frequency * time + hidden.disturbance_phase
    )
    push += hidden.slow_load * np.sin(2.0 * np.pi * hidden.slow_frequency * time + hidden.slow_phase)
    since = (time - hidden.push_place * time[-1]) / hidden.push_time
    push += hidden.push * np.where((since > 0.0) & (since < 1.0), np.sin(np.pi * since), 0.0)
    return iter((push + hidden.constant_torque).tolist())


def simulate_machine(declared: Machine, built: Machine, hidden: Hidden, command: Command) -> Run:
    """Run one record from rest, under a loop that was tuned on the declared numbers."""
    gain = declared.inertia * declared.bandwidth / declared.torque_per_ampere
    k_p, k_d, k_i = gain * declared.bandwidth, 1.6 * gain, 2.0 * gain * declared.bandwidth
    limit, per_ampere, viscosity = built.current_limit, built.torque_per_ampere, built.viscosity
    motor_inertia, load_inertia = built.motor_inertia, built.load_inertia
    shaft, damping, weight = built.shaft_stiffness, built.shaft_damping, built.weight
    more, tilt = hidden.weight, hidden.weight_phase
    level, act = friction_level(hidden), acting_current(hidden)
    ripple, order, phase, drag = hidden.ripple, hidden.ripple_order, hidden.ripple_phase, hidden.drag
    stop, stop_place = hidden.stop, hidden.stop_place
    angle = speed = load_angle = load_speed = integral = 0.0
    rows: list[tuple[float, float, float, float]] = []
    feed = (k_p * command.angle + k_d * command.speed).tolist()

    for wanted, target, push in zip(feed, command.angle.tolist(), _pushes(hidden, command.time), strict=True):
        current = wanted - k_p * angle - k_d * speed + integral
        if -limit <= current <= limit:
            integral += STEP * k_i * (target - angle)
        else:
            current = limit if current > 0.0 else -limit
        rows.append((angle, speed, load_angle, current))
        load = weight * sin(load_angle) if weight else 0.0
        if more:
            load += more * sin(load_angle + tilt) - more * sin(tilt)
        push += per_ampere * (current if act is None else act(current)) - viscosity * speed
        if drag:
            push -= drag * speed * abs(speed)
        if ripple:
            push -= ripple * sin(order * angle + phase)
        if stop and abs(angle) > stop_place:
            way = abs(angle) - stop_place
            push -= stop * way * way if angle > 0.0 else -stop * way * way
        friction = STEP * level(speed, angle, load) if level is not None else 0.0
        if load_inertia:
            twist = shaft * (angle - load_angle) + damping * (speed - load_speed)
            load_speed += STEP * (twist - load) / load_inertia
            load_angle += STEP * load_speed
            speed += STEP * (push - twist) / motor_inertia
        else:
            speed += STEP * (push - load) / motor_inertia
        if friction:
            speed = prox(speed, friction / motor_inertia)
        angle += STEP * speed
        if not load_inertia:
            load_angle = angle
    return Run(command.time, *np.array(rows).T)


def make_machine_records(
    machine: Machine,
    effects: Mapping[str, float],
    seed: int,
    *,
    noise: bool = True,
    conditions: Conditions = PLAIN,
) -> dict[str, np.ndarray]:
    """Six records of a machine with hidden effects: tables of time (s), angle (rad), current (A).

    Parameters
    ----------
    machine
        As declared; the records come from one within the declared spread, drawn from the seed.
    effects
        Strength of each effect by its name; 1 is the usual size.
    seed
        Fixes machine, multisine, noise and the incidental numbers of the effects.
    noise
        False gives records without noise and without the rounding of the encoder.
    conditions
        Under which the sensors read; colour is that of a force, which these machines do not measure.

    Raises
    ------
    ValueError
        If an effect is unknown or its strength negative.
    """
    built, hidden = machine_truth(machine, effects, seed)
    sensors = conditions.sensors(machine.sensors)
    made = {}
    for number, (name, command) in enumerate(machine_commands(machine, _stream(seed, _COMMAND)).items()):
        run = simulate_machine(machine, built, hidden, command)
        every = round(1.0 / (sensors.sample_rate * STEP))
        disc = np.sin(run.angle + hidden.disc_phase) - np.sin(hidden.disc_phase)
        table = np.column_stack(
            [run.time, run.angle + hidden.eccentricity * disc, run.current + hidden.current_bias]
        )[::every]
        if noise:
            draw = _stream(seed, _NOISE, number)
            table[:, 1] = sensors.angle_quantum * np.round(table[:, 1] / sensors.angle_quantum)
            table[:, 2] += sensors.current_noise * draw.standard_normal(len(table))
            table = conditions.spiked(table, sensors, _stream(seed, _CONDITIONS, number))
        made[name] = table
    return made


def write_machine_set(
    folder: Path,
    machine: Machine,
    effects: Mapping[str, float],
    seed: int,
    *,
    conditions: Conditions = PLAIN,
) -> None:
    """Write `deck.toml` and six CSVs, as a bench leaves them."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    declared = replace(machine, sensors=conditions.sensors(machine.sensors))
    (folder / "deck.toml").write_text(deck_of(declared), encoding="utf-8")
    for name, table in make_machine_records(machine, effects, seed, conditions=conditions).items():
        np.savetxt(
            folder / f"{name}.csv",
            table,
            fmt=("%.3f", "%.7f", "%.4f"),
            delimiter=",",
            header="t_s,angle_rad,current_A",
            comments="",
        )


_HEAD = """\
[deck]
name = "{name}"
description = "{name}: a geared motor in a position loop, angle and current measured"

[motor]
component = "GearedMotor"
inertia = {{value = {motor_inertia:.9g}, unit = "kg*m^2", source = "declared by its makers", spread = 0.06}}
gear_ratio = {{value = {gear_ratio}, unit = "1", source = "declared by its makers"}}
torque_constant = {{value = {torque_constant:.9g}, unit = "N*m/A", source = "declared by its makers", \
spread = 0.06}}
current_limit = {{value = {current_limit}, unit = "A", source = "declared by its makers"}}

[bearing]
component = "Dashpot"
between = ["motor"]
damping = {{value = {viscosity}, unit = "N*m*s/rad", source = "declared by its makers", spread = 0.6}}
"""
_WEIGHT = """
[weight]
component = "TorqueRipple"
between = ["motor"]
sine = {{value = {weight}, unit = "N*m", source = "declared: a weight on an arm", spread = 0.06}}
cosine = {{value = 0.0, unit = "N*m", source = "declared: the arm hangs down at zero"}}
order = {{value = 1.0, unit = "1", source = "declared: a weight on an arm"}}
"""
_SHAFT = """
[load]
component = "Inertia"
inertia = {{value = {load_inertia:.9g}, unit = "kg*m^2", source = "declared by its makers", spread = 0.06}}

[shaft]
component = "Spring"
between = ["motor", "load"]
stiffness = {{value = {shaft_stiffness}, unit = "N*m/rad", source = "declared by its makers", spread = 0.06}}

[shaft_damping]
component = "Dashpot"
between = ["motor", "load"]
damping = {{value = {shaft_damping}, unit = "N*m*s/rad", source = "declared by its makers", spread = 0.6}}
"""
_SENSORS = """
[encoder]
component = "Encoder"
of = "motor.angle"
quantum = {{value = {quantum:.9g}, unit = "rad", source = "declared by its makers"}}

[current_sensor]
component = "CurrentSensor"
of = "motor.current"
bias = {{value = 0.0, unit = "A", source = "declared: trimmed"}}
noise = {{value = {noise}, unit = "A", source = "declared by its makers"}}
"""


def deck_of(machine: Machine) -> str:
    """What its makers declare, as a deck."""
    parts = [_HEAD, _WEIGHT if machine.weight else "", _SHAFT if machine.load_share else "", _SENSORS]
    return "".join(parts).format(
        **{name: getattr(machine, name) for name in machine.__dataclass_fields__},
        motor_inertia=machine.motor_inertia,
        load_inertia=machine.load_inertia,
        torque_constant=machine.torque_per_ampere / machine.gear_ratio,
        quantum=machine.sensors.angle_quantum,
        noise=machine.sensors.current_noise,
    )


def true_numbers_of_machine(
    machine: Machine, effects: Mapping[str, float], seed: int
) -> tuple[dict[tuple[str, str], float], dict[str, float]]:
    """True sizes by effect and last name of its number, true declared numbers by name in the deck."""
    built, hidden = machine_truth(machine, effects, seed)
    sizes = {
        ("coulomb_friction", "sliding_effort"): hidden.friction,
        ("quadratic_drag", "drag"): hidden.drag,
        ("torque_ripple", "order"): hidden.ripple_order,
        ("drive_delay", "delay"): hidden.drive_delay,
    }
    numbers = {
        "motor.inertia": built.motor_inertia,
        "motor.torque_constant": built.torque_per_ampere / built.gear_ratio,
        "bearing.damping": built.viscosity,
    }
    if "drivetrain_resonance" in effects:
        del numbers["motor.inertia"]
    if built.weight:
        numbers["weight.sine"] = built.weight
    if machine.load_share:
        numbers["load.inertia"] = built.load_inertia
        numbers["shaft.stiffness"] = built.shaft_stiffness
    return {key: size for key, size in sizes.items() if key[0] in effects}, numbers
