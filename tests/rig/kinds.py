"""Kinds of machines under a digital position controller, and what each may miss.

``geared_joint``     motor and gear, an arm with its weight; encoder and ammeter, 500 Hz
``elastic_joint``    the same behind a torsion spring; encoders on both sides, no load cell, 500 Hz
``direct_drive``     no gear, a loop at 1 kHz
``belt_axis``        motor, belt, load; encoders on both sides, 250 Hz
``screw_carriage``   motor and screw seen along the line, a scale in metres, 500 Hz
``rack_carriage``    a turning motor, a belt that stretches, a carriage; encoders in rad and in m, 500 Hz
``mujoco_*``         geared and elastic joints that MuJoCo advances (`mujoco_machines`)

All numbers are invented. The specimen in tension stands in `specimens`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .cascade import Cascade
from .digital_loop import Controller, Logger, Wanted
from .two_bodies import Missing, Plant

LEFT_OUT = ("viscous_friction", "spring_damping", "gravity_load")
"""Effects that are no addition to the plant: the deck leaves out what it has."""


@dataclass(frozen=True)
class Kind:
    """One kind of machine as its makers declare it."""

    name: str
    plant: Plant
    typical: float  # N·m or N, to which hidden effects are scaled
    sines: tuple[tuple[float, float, float], ...]  # rad or m, Hz, s
    holds: tuple[float, ...]  # rad or m
    rise: float  # s
    peak: float  # of the multisine
    multisine: tuple[float, ...]  # Hz
    bandwidth: float  # rad/s
    rate: float  # Hz, of the loop
    limit: float  # A
    logger: Logger
    coarse: float  # rad or m, of a coarse encoder
    effects: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    not_listed: tuple[str, ...]
    simulator: str = "own"
    radius: float = 0.0  # m per rad of a turning motor that moves a carriage; 0 where all is of one kind
    deck: str = ""  # kind whose deck it shares

    @property
    def sides(self) -> int:
        """How many encoders there are."""
        return 2 if self.logger.load_quantum else 1

    def controller(self, counts: float) -> Controller:
        """Return the loop, tuned on the declared numbers of both bodies together."""
        inertia = self.plant.inertia + self.plant.load_inertia
        gain = inertia * self.bandwidth / self.plant.effort_per_ampere
        return Controller(
            rate=self.rate, proportional=gain * self.bandwidth, derivative=1.6 * gain,
            integral=1.5 * gain * self.bandwidth, limit=self.limit, counts=counts,
            feed=inertia / self.plant.effort_per_ampere,
        )  # fmt: skip

    def cascade(self, counts: float, lag: float) -> Cascade:
        """Return the loop of a robot, tuned on the same numbers; slower where a spring lies within it."""
        inertia = self.plant.inertia + self.plant.load_inertia
        bandwidth = self.bandwidth * (0.6 if self.plant.load_inertia else 1.0)
        gain = inertia * bandwidth / self.plant.effort_per_ampere
        return Cascade(
            rate=self.rate, position_gain=0.4 * bandwidth, speed_gain=gain, integral=0.3 * gain * bandwidth,
            cutoff=80.0, limit=self.limit, counts=counts, lag=lag,
            feed=inertia / self.plant.effort_per_ampere,
        )  # fmt: skip


_FRICTION = ("coulomb_friction", "stribeck_friction", "viscous_friction", "quadratic_drag")
_DRIVE = ("drive_delay", "torque_constant_saturation", "current_sensor_bias", "torque_ripple")
_SINES = ((1.0, 0.25, 6.0), (0.9, 0.6, 5.0), (0.35, 1.5, 4.0), (0.12, 3.0, 3.0))
_HOLDS = (0.5, 1.2, 0.2, -0.8, 0.0)
_MULTISINE = (0.2, 0.5, 0.9, 1.7, 2.7)

GEARED_JOINT = Kind(
    name="geared_joint",
    plant=Plant(inertia=0.35, effort_per_ampere=5.2, damping=0.9, weight=6.0, gear_ratio=80.0),
    typical=8.0,
    sines=_SINES,
    holds=_HOLDS,
    rise=0.35,
    peak=0.9,
    multisine=_MULTISINE,
    bandwidth=30.0,
    rate=500.0,
    limit=10.0,
    logger=Logger(quantum=3.8e-5, current_noise=0.02),
    coarse=1.5e-3,
    effects=(
        *_FRICTION, "load_dependent_friction", "position_dependent_friction", *_DRIVE, "backlash",
        "drivetrain_resonance", "gravity_load",
    ),
    pairs=(
        ("coulomb_friction", "gravity_load"), ("coulomb_friction", "torque_ripple"),
        ("viscous_friction", "coulomb_friction"), ("load_dependent_friction", "coulomb_friction"),
        ("current_sensor_bias", "stribeck_friction"), ("drive_delay", "coulomb_friction"),
    ),
    not_listed=("payload_change", "periodic_disturbance", "amplifier_dead_zone", "external_push"),
)  # fmt: skip
ELASTIC_JOINT = replace(
    GEARED_JOINT,
    name="elastic_joint",
    plant=Plant(
        inertia=0.14, effort_per_ampere=3.1, damping=0.5, load_inertia=0.10, load_damping=0.06,
        stiffness=160.0, spring_damping=0.15, weight=4.0, gear_ratio=50.0,
    ),
    typical=5.0,
    bandwidth=22.0,
    logger=Logger(quantum=6e-6, load_quantum=6e-6, current_noise=0.02),
    coarse=3.8e-4,
    effects=(
        *_FRICTION, "joint_coulomb_friction", "load_dependent_friction", *_DRIVE, "backlash",
        "drivetrain_resonance", "gravity_load", "joint_eccentricity", "spring_damping",
        "angle_sensor_bias", "angle_sensor_delay", "soft_centre",
    ),
    pairs=(
        ("coulomb_friction", "joint_coulomb_friction"), ("coulomb_friction", "gravity_load"),
        ("load_dependent_friction", "torque_ripple"), ("backlash", "coulomb_friction"),
        ("viscous_friction", "coulomb_friction"), ("angle_sensor_bias", "stribeck_friction"),
    ),
    not_listed=("stiffness_over_angle", "payload_change", "periodic_disturbance"),
)  # fmt: skip
DIRECT_DRIVE = replace(
    GEARED_JOINT,
    name="direct_drive",
    plant=Plant(inertia=0.012, effort_per_ampere=0.9, damping=0.02),
    typical=0.9,
    sines=((2.5, 0.3, 5.0), (1.5, 1.0, 4.0), (0.5, 3.0, 3.0), (0.15, 7.0, 2.0)),
    holds=(0.7, 2.0, 0.2, -1.5, 0.0),
    rise=0.15,
    peak=1.0,
    multisine=(0.4, 1.1, 2.3, 4.1, 6.7),
    bandwidth=60.0,
    rate=1000.0,
    limit=12.0,
    logger=Logger(quantum=2.4e-5, current_noise=0.01),
    coarse=1.5e-3,
    effects=(
        *_FRICTION, *_DRIVE, "constant_torque", "drivetrain_resonance", "gravity_load",
        "angle_sensor_eccentricity", "position_dependent_friction",
    ),
    pairs=(
        ("coulomb_friction", "torque_ripple"), ("viscous_friction", "current_sensor_bias"),
        ("gravity_load", "coulomb_friction"), ("torque_ripple", "constant_torque"),
    ),
    not_listed=("amplifier_dead_zone", "periodic_disturbance", "external_push", "hardening_stop"),
)  # fmt: skip
BELT_AXIS = replace(
    ELASTIC_JOINT,
    name="belt_axis",
    plant=Plant(
        inertia=0.008, effort_per_ampere=0.42, damping=0.03, load_inertia=0.014, load_damping=0.008,
        stiffness=45.0, spring_damping=0.04,
    ),
    typical=0.8,
    sines=((2.0, 0.3, 6.0), (1.4, 0.8, 5.0), (0.5, 2.0, 4.0), (0.15, 4.0, 3.0)),
    peak=1.4,
    multisine=(0.3, 0.8, 1.5, 2.6, 4.1),
    bandwidth=28.0,
    rate=250.0,
    limit=12.0,
    logger=Logger(quantum=1.9e-5, load_quantum=1.9e-5, current_noise=0.02),
    coarse=7.7e-4,
    effects=(
        *_FRICTION, "joint_coulomb_friction", "load_dependent_friction", *_DRIVE, "backlash",
        "spring_damping", "angle_sensor_bias", "angle_sensor_delay", "joint_eccentricity",
        "soft_centre",
    ),
    pairs=(
        ("coulomb_friction", "joint_coulomb_friction"), ("backlash", "coulomb_friction"),
        ("viscous_friction", "coulomb_friction"), ("torque_ripple", "spring_damping"),
    ),
    not_listed=("stiffness_over_angle", "periodic_disturbance", "external_push"),
)  # fmt: skip
SCREW_CARRIAGE = replace(
    GEARED_JOINT,
    name="screw_carriage",
    plant=Plant(inertia=28.0, effort_per_ampere=38.0, damping=130.0),
    typical=110.0,
    sines=((0.16, 0.3, 6.0), (0.13, 0.7, 5.0), (0.05, 1.7, 4.0), (0.015, 4.0, 3.0)),
    holds=(0.06, 0.16, 0.02, -0.12, 0.0),
    peak=0.12,
    multisine=(0.2, 0.5, 1.0, 1.9, 3.1),
    limit=10.0,
    logger=Logger(quantum=1e-6, current_noise=0.01),
    coarse=2e-5,
    effects=(*_FRICTION, *_DRIVE, "constant_force", "drivetrain_resonance", "backlash"),
    pairs=(
        ("coulomb_friction", "constant_force"),
        ("viscous_friction", "coulomb_friction"),
        ("coulomb_friction", "torque_ripple"),
        ("drive_delay", "coulomb_friction"),
    ),
    not_listed=("external_push", "periodic_disturbance", "amplifier_dead_zone", "hardening_stop"),
)
RACK_CARRIAGE = replace(
    BELT_AXIS,
    name="rack_carriage",
    radius=0.02,
    plant=Plant(
        inertia=5.0, effort_per_ampere=40.0, damping=60.0, load_inertia=8.0, load_damping=20.0,
        stiffness=2.6e4, spring_damping=40.0,
    ),
    typical=90.0,
    sines=SCREW_CARRIAGE.sines,
    holds=SCREW_CARRIAGE.holds,
    peak=SCREW_CARRIAGE.peak,
    multisine=SCREW_CARRIAGE.multisine,
    rate=500.0,
    limit=10.0,
    logger=Logger(quantum=1e-6, load_quantum=1e-6, current_noise=0.01),
    coarse=2e-5,
    # A scale has no disc that could sit off its shaft.
    effects=tuple(effect for effect in BELT_AXIS.effects if effect != "joint_eccentricity"),
)  # fmt: skip
_IN_MUJOCO = (
    "coulomb_friction", "viscous_friction", "gravity_load", "torque_ripple", "drive_delay",
    "current_sensor_bias",
)  # fmt: skip
_PAIRS_IN_MUJOCO = (
    ("coulomb_friction", "gravity_load"), ("viscous_friction", "coulomb_friction"),
    ("coulomb_friction", "torque_ripple"),
)  # fmt: skip
MUJOCO_MOTOR = replace(
    GEARED_JOINT,
    name="mujoco_motor",
    simulator="mujoco",
    deck="geared_joint",
    effects=(*_IN_MUJOCO, "drivetrain_resonance"),
    pairs=_PAIRS_IN_MUJOCO,
    not_listed=("payload_change", "periodic_disturbance", "external_push", "amplifier_dead_zone"),
)
MUJOCO_TENDON = replace(
    ELASTIC_JOINT,
    name="mujoco_tendon",
    simulator="mujoco",
    deck="elastic_joint",
    effects=(*_IN_MUJOCO, "joint_coulomb_friction", "spring_damping", "angle_sensor_bias", "backlash"),
    pairs=(*_PAIRS_IN_MUJOCO, ("coulomb_friction", "joint_coulomb_friction")),
    not_listed=("payload_change", "periodic_disturbance", "external_push", "amplifier_dead_zone"),
)
MUJOCO_GEAR = replace(
    MUJOCO_MOTOR,
    name="mujoco_gear",
    plant=replace(GEARED_JOINT.plant, inertia=0.22, effort_per_ampere=4.0, damping=0.7, weight=4.5),
    typical=6.0,
    effects=(*_IN_MUJOCO, "backlash", "drivetrain_resonance"),
    pairs=(*_PAIRS_IN_MUJOCO, ("backlash", "coulomb_friction")),
)
KINDS: Mapping[str, Kind] = {
    kind.name: kind
    for kind in (
        GEARED_JOINT, ELASTIC_JOINT, DIRECT_DRIVE, BELT_AXIS, SCREW_CARRIAGE, RACK_CARRIAGE,
        MUJOCO_MOTOR, MUJOCO_TENDON, MUJOCO_GEAR,
    )
}  # fmt: skip

BUILD, COMMAND, EFFECT, NOISE, NAMES = range(20, 25)


def stream(seed: int, purpose: int, record: int = 0) -> np.random.Generator:
    """Return the random numbers of one purpose: the same machine whatever is hidden in it."""
    return np.random.default_rng([seed, purpose, record])


def sizes(kind: Kind, draw: np.random.Generator) -> dict[str, dict[str, float]]:
    """Return the fields of `Missing` that each effect sets at strength 1."""
    effort, plant = kind.typical, kind.plant
    current = effort / plant.effort_per_ampere
    about = 1.3 ** draw.uniform(-1.0, 1.0, size=4)
    phase = draw.uniform(0.0, 2.0 * np.pi, size=4)
    place = float(draw.uniform(0.35, 0.65))
    fastest = max(a * 2.0 * np.pi * f for a, f, _ in kind.sines)
    largest = max(a for a, _, _ in kind.sines)
    twist = effort / plant.stiffness if plant.stiffness else 0.02 * largest
    order = plant.gear_ratio if plant.gear_ratio > 1.0 else 14.0 / min(largest, 1.0)
    order = 12.0 / kind.radius if kind.radius else order
    period, u = 1.0 / kind.rate, float(draw.uniform(-1.0, 1.0))
    return {
        "coulomb_friction": {"friction": 0.12 * effort},
        "joint_coulomb_friction": {"joint_friction": 0.10 * effort},
        "stribeck_friction": {
            "friction": 0.08 * effort, "breakaway": 0.12 * effort,
            "stribeck_speed": 0.12 * about[0] * fastest,
        },
        "load_dependent_friction": {"load_friction": 0.12},
        "position_dependent_friction": {"place_friction": 0.10 * effort, "place_phase": phase[0]},
        "quadratic_drag": {"drag": 0.25 * effort / fastest**2},
        "torque_ripple": {
            "ripple": 0.08 * effort, "ripple_phase": phase[1],
            "ripple_order": order,
        },
        "backlash": {"gap": 0.35 * twist},
        "drive_delay": {"drive_delay": max(0.2 / kind.bandwidth, 3.0 * period)},
        "torque_constant_saturation": {"saturation": 1.0 / (1.5 * current)},
        "current_sensor_bias": {"current_bias": 0.06 * current},
        "constant_torque": {"constant_effort": 0.06 * effort},
        "constant_force": {"constant_effort": 0.06 * effort},
        "angle_sensor_eccentricity": {"eccentricity": 0.02, "disc_phase": phase[2]},
        "joint_eccentricity": {"eccentricity": 0.02, "disc_phase": phase[2]},
        "angle_sensor_bias": {"encoder_bias": 0.3 * twist},
        "angle_sensor_delay": {"encoder_delay": 3.0 * period},
        "drivetrain_resonance": {"tail_share": 0.5, "tail_frequency": 0.06 * kind.bandwidth * 1.2 ** u}
        if plant.stiffness
        else {},
        "viscous_friction": {}, "spring_damping": {}, "gravity_load": {},
        "payload_change": {"payload": 0.3 * effort},
        "periodic_disturbance": {
            "disturbance": 0.17 * effort, "disturbance_frequency": 5.0 * about[1],
            "disturbance_phase": phase[0],
        },
        "amplifier_dead_zone": {"dead_zone": 0.10 * current},
        "external_push": {"push": 0.5 * effort, "push_place": place, "push_time": 0.3 * about[3]},
        "hardening_stop": {"stop": 0.6 * effort / (0.5 * largest) ** 2, "stop_place": 0.5 * largest},
        "soft_centre": {"soft_centre": 0.5, "soft_width": 0.3 * twist},
        "stiffness_over_angle": {"stiffness_wave": 0.25, "wave_phase": phase[3]},
    }  # fmt: skip


_SHAPES = frozenset({
    "stribeck_speed", "place_phase", "ripple_order", "ripple_phase", "disc_phase", "disturbance_frequency",
    "disturbance_phase", "push_place", "tail_frequency", "push_time", "stop_place", "soft_width",
    "wave_phase",
})  # fmt: skip
"""What an effect changes in shape rather than in size: the strength leaves these alone."""


def built(kind: Kind, effects: tuple[str, ...], strength: float, seed: int) -> tuple[Plant, Missing]:
    """Return the machine as built, within the declared spread, with what is hidden in it.

    Raises
    ------
    ValueError
        If the rig has no effect of that name.
    """
    u = stream(seed, BUILD).uniform(-1.0, 1.0, size=10)
    given = kind.plant
    plant = replace(
        given,
        inertia=given.inertia * (1.0 + 0.06 * u[0]),
        effort_per_ampere=given.effort_per_ampere * (1.0 + 0.06 * u[1]),
        damping=given.damping * 1.5 ** u[2],
        load_inertia=given.load_inertia * (1.0 + 0.06 * u[3]),
        load_damping=given.load_damping * 1.5 ** u[4],
        stiffness=given.stiffness * (1.0 + 0.06 * u[5]),
        spring_damping=given.spring_damping * 1.5 ** u[6],
        weight=given.weight * (1.0 + 0.06 * u[7]),
    )
    known, missing = sizes(kind, stream(seed, EFFECT)), Missing()
    for effect in effects:
        if effect not in known:
            raise ValueError(f"the rig has no effect {effect!r}; it has {', '.join(known)}")
        for field, size in known[effect].items():
            more = size if field in _SHAPES else getattr(missing, field) + strength * size
            missing = replace(missing, **{field: more})
    return _reshaped(kind, plant, effects, strength, 1.2 ** float(u[8])), missing


def _reshaped(kind: Kind, plant: Plant, effects: tuple[str, ...], strength: float, about: float) -> Plant:
    """Return the plant with what the deck will leave out, and with the second body of a hidden coupling."""
    if "viscous_friction" in effects:
        plant = replace(plant, damping=strength * plant.damping)
    if "spring_damping" in effects:
        plant = replace(plant, spring_damping=strength * 3.0 * plant.spring_damping)
    if "gravity_load" in effects:
        plant = replace(plant, weight=strength * (plant.weight or 0.25 * kind.typical))
    resonance, gear = "drivetrain_resonance" in effects, "backlash" in effects and not kind.plant.stiffness
    if (resonance and not kind.plant.stiffness) or gear:
        share = 0.5 * strength if resonance else 0.4
        own = 2.0 * np.pi * (0.35 * kind.bandwidth * about if resonance else 90.0)
        load = share * plant.inertia
        stiffness = load * own**2 if resonance else load * (1.0 - share) * own**2
        damping = (0.08 if resonance else 0.3) * (stiffness * load) ** 0.5
        plant = replace(
            plant,
            inertia=plant.inertia - load,
            load_inertia=load,
            stiffness=stiffness,
            spring_damping=damping,
        )
    return plant


def wanted(kind: Kind, draw: np.random.Generator) -> dict[str, Wanted]:
    """Return what the loop is told to do, by the name of the record: sines, steps, two multisines."""
    period = 1.0 / kind.rate
    made = {}
    for amplitude, frequency, duration in kind.sines:
        time = np.arange(round(duration * kind.rate)) * period
        made[f"sine_{frequency:g}Hz"] = _ramped(
            time, np.array([amplitude]), np.array([frequency]), np.zeros(1)
        )
    time = np.arange(round(1.4 * len(kind.holds) * kind.rate)) * period
    place, before = np.zeros_like(time), 0.0
    for i, target in enumerate(kind.holds):
        x = np.clip((time - 0.3 - 1.4 * i) / kind.rise, 0.0, 1.0)
        place += (target - before) * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
        before = target
    made["hold"] = _differentiated(time, place)
    frequencies = np.array(kind.multisine)
    for number in range(2):
        time = np.arange(round(7.0 * kind.rate)) * period
        phases = draw.uniform(0.0, 2.0 * np.pi, size=frequencies.size)
        raw = _ramped(time, frequencies**-1.0, frequencies, phases)
        scale = kind.peak / np.max(np.abs(raw.place))
        made[f"multisine_{number + 1}"] = _differentiated(time, scale * raw.place)
    return made


def _ramped(time: np.ndarray, sizes: np.ndarray, frequencies: np.ndarray, phases: np.ndarray) -> Wanted:
    """Return a sum of sines that grows smoothly from rest, after 0.3 s of rest."""
    x = np.clip((time - 0.3) / 0.7, 0.0, 1.0)
    waves = sizes[:, None] * np.sin(2.0 * np.pi * frequencies[:, None] * time + phases[:, None])
    return _differentiated(time, x**3 * (10.0 - 15.0 * x + 6.0 * x * x) * waves.sum(axis=0))


def _differentiated(time: np.ndarray, place: np.ndarray) -> Wanted:
    speed = np.gradient(place, time)
    return Wanted(time, place, speed, np.gradient(speed, time))
